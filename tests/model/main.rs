//! The models without tables: fabrics, charts, the direct integrals, and what physics and single precision ask of them.
#![cfg(feature = "bake")]

#[path = "../common/mod.rs"]
mod common;

mod chart;
mod curves;
#[cfg(feature = "cli")]
mod energy;
mod errors;
mod fabric;
#[cfg(feature = "cli")]
mod fit;
mod models;
mod physics;
mod reference;
#[cfg(feature = "report")]
mod stability;
