//! Tables
mod axis;
mod encoding;
mod grid;

pub use axis::{Axis, Interpolation, Stencil};
pub use encoding::{Encoding, Samples};
pub use grid::Grid;

use alloc::{string::String, vec::Vec};
use crate::brdf::{Factors, Optics, Reweighting, TangentCurve, ThreadFrame};

/// A baked fabric.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub(crate) threads: Vec<ThreadTable>,
    pub(crate) gap: f32,
    pub(crate) sigma_u: f32,
    pub(crate) reweighting: Reweighting,
    pub(crate) metadata: String,
}

/// thread
#[derive(Debug, Clone, PartialEq)]
pub struct ThreadTable {
    pub(crate) name: String,
    pub(crate) frame: ThreadFrame<f32>,
    pub(crate) coverage: f32,
    pub(crate) albedo: [f32; 3],
    pub(crate) optics: Optics<f32>,
    pub(crate) tangents: TangentCurve<f32>,
    pub(crate) factors: Factors<f32>,
    pub(crate) form: Form,
}

/// form
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
    /// single tilt
    Tilt { /// c
        cos: f32, /// s
        sin: f32 },
    /// grid
    Grid(Grid),
}
impl Table {
    /// bytes
    pub fn sample_bytes(&self) -> usize { self.threads.iter().map(|t| match &t.form { Form::Grid(g) => g.bytes(), _ => 0 }).sum() }
}
