//! Baked fabrics: what is stored, and how it becomes bytes and back.
//!
//! A [`Table`] has the parameters of a fabric's visible threads and, for each, what is needed to evaluate it: single tilts by
//! their closed form, which is exact and needs no bytes; the smoothly spread segments from a [`Grid`], or by a few placed
//! tilts ([`PlacedNodes`]) where a grid would err more or cost more. `FORMAT.md` describes the file.
//!
//! A single tilt in a grid is the hardest thing to interpolate: sharp, with the kinks of M and P undamped. Mean error of ρ
//! with the tilts in a grid of 2 MB and with their closed form: silk crepe de chine 0.51 % → 0.06 %, charmeuse front
//! 0.53 % → 0.11 %, shot silk 0.44 % → 0.08 %, black T-shirt 0.22 % → 0.04 %, faux suede 1.6 % → 0.

mod axis;
mod encoding;
mod error;
mod format;
mod grid;

pub(crate) use axis::TAPS;
pub use axis::{Axis, MAX_DEPTH, MAX_KNOTS};
pub use encoding::{Encoding, Samples};
pub use error::Error;
pub use format::{MAJOR, MAX_DECODED_BYTES, MINOR};
pub use grid::Grid;
pub(crate) use grid::{CHANNELS, ROW};

use alloc::{string::String, vec::Vec};

use crate::brdf::{Optics, PlacedNodes, Reweighting, TangentCurve, ThreadFrame};

/// A baked fabric. Evaluation is in [`crate::lookup`].
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub(crate) threads: Vec<ThreadTable>,
    /// 1 − Σa.
    pub(crate) gap: f32,
    /// Width of u, radians.
    pub(crate) sigma_u: f32,
    pub(crate) reweighting: Reweighting,
    pub(crate) metadata: String,
}

impl Table {
    /// The threads, in the fabric's order, without those of coverage 0.
    pub fn threads(&self) -> &[ThreadTable] {
        &self.threads
    }

    /// How Q weighs tangents.
    pub fn reweighting(&self) -> Reweighting {
        self.reweighting
    }

    /// Bytes of samples in memory, all threads.
    pub fn decoded_bytes(&self) -> usize {
        self.threads
            .iter()
            .filter_map(ThreadTable::grid)
            .map(Grid::bytes)
            .sum()
    }

    /// TOML text that says what made the table: fabric, settings, tool, measured error.
    pub fn metadata(&self) -> &str {
        &self.metadata
    }
}

/// Parameters of one thread, as the file has them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ThreadParameters {
    pub(crate) name: String,
    /// Radians from x towards y.
    pub(crate) direction: f64,
    pub(crate) coverage: f64,
    pub(crate) albedo: [f64; 3],
    pub(crate) optics: Optics<f64>,
    /// (δ, weight).
    pub(crate) tilts: Vec<(f64, f64)>,
    /// (from, to, weight).
    pub(crate) segments: Vec<(f64, f64, f64)>,
    /// Nodes and weights of the rule that the segments are evaluated by, none if there is a grid.
    pub(crate) nodes: Vec<[f64; 2]>,
}

/// One thread of a [`Table`].
#[derive(Debug, Clone, PartialEq)]
pub struct ThreadTable {
    pub(crate) parameters: ThreadParameters,
    pub(crate) frame: ThreadFrame<f32>,
    pub(crate) coverage: f32,
    pub(crate) albedo: [f32; 3],
    pub(crate) optics: Optics<f32>,
    pub(crate) tangents: TangentCurve<f32>,
    pub(crate) segments: Segments,
}

/// How a thread's segments are evaluated.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Segments {
    /// There are none.
    None,
    /// By interpolation.
    Grid(Grid),
    /// Directly, where that costs less or errs less.
    Direct(PlacedNodes<f32>),
}

impl ThreadTable {
    pub(crate) fn new(parameters: ThreadParameters, grid: Option<Grid>) -> Self {
        let optics = parameters.optics.cast();
        let tangents = TangentCurve::from_parts(
            parameters.tilts.iter().copied(),
            parameters.segments.iter().copied(),
        );
        Self {
            frame: ThreadFrame::new(parameters.direction),
            coverage: parameters.coverage as f32,
            albedo: parameters.albedo.map(|channel| channel as f32),
            segments: match grid {
                Some(grid) => Segments::Grid(grid),
                None if parameters.nodes.is_empty() => Segments::None,
                None => Segments::Direct(PlacedNodes::new(
                    &TangentCurve::from_parts(
                        core::iter::empty(),
                        parameters.segments.iter().copied(),
                    ),
                    &parameters.nodes,
                )),
            },
            optics,
            tangents,
            parameters,
        }
    }

    /// `warp`, `weft`, …
    pub fn name(&self) -> &str {
        &self.parameters.name
    }

    /// Share of the surface that the thread covers.
    pub fn coverage(&self) -> f32 {
        self.coverage
    }

    /// The fabric's own albedo, linear RGB.
    pub fn albedo(&self) -> [f32; 3] {
        self.albedo
    }

    /// The thread's tangents: single tilts are evaluated, segments are in the grid or evaluated.
    pub fn tangents(&self) -> &TangentCurve<f32> {
        &self.tangents
    }

    /// The grid of the thread's segments, if they have one.
    pub fn grid(&self) -> Option<&Grid> {
        match &self.segments {
            Segments::Grid(grid) => Some(grid),
            Segments::None | Segments::Direct(_) => None,
        }
    }

    /// How many tilts per segment are evaluated for a pair, if the segments have no grid.
    pub fn direct_nodes(&self) -> Option<usize> {
        match &self.segments {
            Segments::Direct(nodes) => Some(nodes.count()),
            Segments::None | Segments::Grid(_) => None,
        }
    }
}
