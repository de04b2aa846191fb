//! The ranges of parameters for which the closed forms hold in single precision. Fabric files and tables are held to them.

use core::ops::RangeInclusive;

/// η: beyond, 1 − F_r is lost to rounding.
pub const ETA: RangeInclusive<f64> = 1.0..=100.0;
/// γ_s and γ_v, radians: 0.001° (a little less, for rounding) to far beyond a full turn, where a lobe is constant.
pub const GAMMA: RangeInclusive<f64> = 1.74e-5..=20.0;
/// Width of u, radians: from 1° (a little less, for rounding); direct integration does not look for a sharper one.
pub const SIGMA_U: RangeInclusive<f64> = 0.0174..=20.0;
/// Albedo, each channel. Fits may pass 1.
pub const ALBEDO: RangeInclusive<f64> = 0.0..=1000.0;
/// Coverage of a thread that is seen: down to where an f32 sum over threads forgets it.
pub const COVERAGE: RangeInclusive<f64> = 1e-12..=1.0;
/// What ρ may be scaled by, so that no more is reflected than arrives.
pub const RHO_SCALE: RangeInclusive<f64> = 1e-4..=1.0;
/// A segment narrower than this, radians (1e-4°), is one tilt: its width is lost in f32, and in any lobe.
pub const SEGMENT_WIDTH: f64 = 1.74e-6;
