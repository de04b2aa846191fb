//! sateen bakes anisotropic fabric BRDFs into small 4D tables, evaluates them fast, and tells what the approximation costs.
#![cfg_attr(not(feature = "std"), no_std)]

extern crate alloc;

pub mod brdf;
pub mod chart;
pub mod lookup;
pub mod math;
pub mod table;

#[cfg(feature = "bake")]
pub mod bake;
#[cfg(feature = "bake")]
pub mod fabric;
#[cfg(feature = "bake")]
pub mod metrics;
#[cfg(feature = "bake")]
pub mod model;
#[cfg(feature = "bake")]
pub mod progress;
