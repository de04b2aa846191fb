//! sateen (placeholder)
#![cfg_attr(not(feature = "std"), no_std)]
extern crate alloc;
pub mod brdf;
pub mod chart;
pub mod math;
#[cfg(feature = "bake")]
pub mod fabric;
#[cfg(feature = "bake")]
pub mod model;
pub mod table;
pub mod lookup;
#[cfg(feature = "bake")]
pub mod bake;
#[cfg(feature = "bake")]
pub mod metrics;
