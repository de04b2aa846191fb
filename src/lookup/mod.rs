//! Evaluation of a baked fabric.
//!
//! `kernel` is the one algorithm, from a pair of directions to a number, for as many pairs at once as the machine's vectors
//! have lanes: into the thread's frame; single tilts by their closed form; for the segments the pair's place in the chart
//! and the spline's value there (`interpolate`); then the sum over threads. `scalar` runs it for one pair and is what the
//! others are compared with; `batch` over slices, with the instructions of [`crate::math::simd`]. These round differently,
//! so that results differ by at most 3e-5 of the value and a thousandth of the mean, 5e-7 on average (`tests/table/parity.rs`).

mod batch;
mod interpolate;
mod kernel;
#[cfg(feature = "shader")]
mod points;
mod scalar;

pub use batch::Quantity;
#[cfg(feature = "shader")]
pub(crate) use points::roots;
