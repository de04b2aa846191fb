//! Baked fabrics: what is stored, and how it becomes bytes and back.
//!
//! A [`Table`] has the parameters of a fabric's visible threads and, for each, what is needed to evaluate it: single tilts by
//! their closed form, which is exact and needs no bytes; the smoothly spread segments from a [`Grid`], or by a few placed
//! tilts (`PlacedNodes`) where a grid would err more or cost more. `FORMAT.md` describes the file.
//!
//! A single tilt in a grid is the hardest thing to interpolate: sharp, with the kinks of M and P undamped. Mean error of ρ
//! with the tilts in a grid of 2 MB and with their closed form: silk crepe de chine 0.51 % → 0.06 %, charmeuse front
//! 0.53 % → 0.11 %, shot silk 0.44 % → 0.08 %, black T-shirt 0.22 % → 0.04 %, faux suede 1.6 % → 0.
//!
//! # What was tried
//!
//! Mean error (and 99th percentile) over protocol pairs, at most 4 MiB in memory; bold is what is kept.
//!
//! | representation | denim | lining | white T-shirt | pink lining | corduroy | velvet |
//! |---|---|---|---|---|---|---|
//! | cubic Lagrange, 64 rows of 4, √f16 | 0.118 % | 0.120 % | 0.078 % | 0.245 % | 0.194 % | 1.65 % |
//! | the same of ratios to smooth analytic factors | 0.073 (0.76) | 0.117 (1.1) | 0.043 (0.26) | 0.277 (1.8) | 0.169 (1.4) | 0.63 (5.2) |
//! | quadratic splines, 27 rows of 3, √i16, highlight chart | 0.103 (1.3) | 0.080 (0.74) | 0.055 (0.67) | 0.307 (1.6) | 0.156 (1.4) | 0.98 (6.0) |
//! | thesis chart | 0.091 (1.0) | 0.105 (1.4) | 0.078 (1.1) | 0.208 (2.1) | 0.112 (1.1) | 0.75 (3.6) |
//! | each thread in the chart that promises less error | 0.091 (1.0) | 0.084 (0.70) | 0.085 (1.1) | 0.247 (2.2) | 0.113 (1.1) | 0.74 (3.5) |
//! | **and directly where that is worth it** | 0.091 (1.0) | 0.084 (0.70) | 0.034 (0.62) | 0.139 (1.5) | 0.059 (0.62) | 0.029 (0.25) |
//!
//! The factors halved some errors but took a third of a lookup of 2 to 3 µs; rows of cubics most of the rest. A lookup of
//! the last line takes a tenth of that. The T-shirt and velvet have no samples at all in it, corduroy and the pink lining
//! one grid instead of two.
//!
//! Encodings at the same bytes (mean error of grids of 3840 KiB): denim f32 0.187 %, i16 0.111 %, √f32 0.145 %, **√i16
//! 0.094 %**, √i8 0.222 %; lining 0.240, 0.121, 0.258, **0.094**, 0.238 %. Eight bits are too coarse for what they save;
//! 32 bits would rather be more knots. Without the root, dark places err: velvet 4.5 % against 1.0 %.
//!
//! Splines of other degrees, on knots spread evenly along a smooth warp of each axis (4 MiB, highlight chart): denim
//! quadratic 0.18 %, cubic across the highlight and quadratic elsewhere 0.27 %, cubic 0.48 %; lining 0.15, 0.16, 0.19 %.
//! What is interpolated has few continuous derivatives: higher degrees ring. Knots halved where the error is
//! (`bake/plan.rs`) err half as much as such warps. Dividing by z_i z_r/cos² θ_d, which needs no angle, doubled the error.

mod axis;
mod encoding;
mod error;
mod format;
mod grid;
mod misses;
mod numbers;
mod parts;
mod rows;
mod sampling;

pub use axis::{Axis, MAX_DEPTH, MAX_KNOTS, MOST_UNEVEN, REACH};
pub(crate) use axis::{Place, TAPS};
#[cfg(feature = "bake")]
pub(crate) use encoding::{COEFFICIENT_BYTES, encode};
pub(crate) use encoding::{UNIT, decode};
pub use error::Error;
pub use format::{MAX_DECODED_BYTES, VERSION};
#[cfg(feature = "bake")]
pub(crate) use grid::coefficients_of;
pub(crate) use grid::{CHANNELS, TILE, WHOLE, tiles_of};
pub use grid::{Content, Grid};
pub(crate) use misses::Misses;
#[cfg(feature = "bake")]
pub(crate) use numbers::own;
pub(crate) use parts::{GridGroup, Group, PARTS, Parts, SegmentGroup, dye, load};
pub(crate) use rows::Rows;
#[cfg(feature = "bake")]
pub(crate) use rows::{Run, place_of};
#[cfg(feature = "bake")]
pub(crate) use sampling::{
    ALBEDO_NODES, Albedo, BINS, EDGE_UNIT, HISTOGRAM_NODES, albedo_place, histogram_place,
};
pub(crate) use sampling::{Histogram, Mix, SAMPLED, Sampling, ViewPlace};

use alloc::{boxed::Box, string::String, vec::Vec};

use crate::brdf::{Optics, PlacedNodes, Reweighting, TangentCurve, ThreadFrame};
use crate::chart::Rim;

/// A baked fabric. Evaluation is in [`crate::lookup`].
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub(crate) threads: Vec<ThreadTable>,
    /// 1 − Σa.
    pub(crate) gap: f32,
    /// Width of u, radians.
    pub(crate) sigma_u: f32,
    /// What ρ is multiplied by.
    pub(crate) rho_scale: f32,
    pub(crate) reweighting: Reweighting,
    pub(crate) metadata: String,
    /// Whether pairs can be asked for that it was not baked for.
    pub(crate) is_partial: bool,
    pub(crate) misses: Misses,
    /// What one pair is evaluated with, if that is all.
    pub(crate) parts: Option<Parts>,
    pub(crate) energy: Energy,
}

/// What becomes of views that the published parameters reflect more to than arrives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(rename_all = "kebab-case"))]
pub enum Energy {
    /// They stay as bright as they are.
    #[default]
    AsIs,
    /// ρ is divided by the largest channel of the directional albedo of the view, where that is above 1.
    PerView,
}

impl Table {
    /// The threads, in the fabric's order, without those of coverage 0.
    pub fn threads(&self) -> &[ThreadTable] {
        &self.threads
    }

    /// What ρ is multiplied by, so that no more is reflected than arrives: 1 unless the fabric says less.
    pub fn rho_scale(&self) -> f32 {
        self.rho_scale
    }

    /// How Q weighs tangents.
    pub fn reweighting(&self) -> Reweighting {
        self.reweighting
    }

    /// Bytes of coefficients in memory, all threads.
    pub fn decoded_bytes(&self) -> usize {
        let grids = self.threads.iter().flat_map(ThreadTable::grids);
        grids.map(Grid::bytes).sum()
    }

    /// Bytes in memory of what directions are drawn by, and albedos told.
    pub fn sampling_bytes(&self) -> usize {
        let known = self
            .threads
            .iter()
            .filter_map(|thread| thread.sampling.as_ref());
        known
            .map(|sampling| Sampling::bytes(sampling.histogram.is_some()))
            .sum()
    }

    /// Of the coefficients, bytes that were not copied from the file: see [`Table::from_static`].
    pub fn lent_bytes(&self) -> usize {
        let grids = self.threads.iter().flat_map(ThreadTable::grids);
        let lent = grids.filter(|grid| grid.tiles.is_lent());
        lent.map(Grid::tile_bytes).sum()
    }

    /// A table with these threads; its metadata are empty.
    pub(crate) fn new(
        threads: Vec<ThreadTable>,
        gap: f32,
        sigma_u: f32,
        rho_scale: f32,
        reweighting: Reweighting,
    ) -> Self {
        let is_partial =
            |thread: &ThreadTable| !thread.takes_albedo() || thread.grids().any(Grid::is_partial);
        Self {
            is_partial: threads.iter().any(is_partial),
            parts: Parts::new(&threads, reweighting),
            threads,
            gap,
            sigma_u,
            rho_scale,
            reweighting,
            metadata: String::new(),
            misses: Misses::default(),
            energy: Energy::AsIs,
        }
    }

    /// What becomes of views that would reflect more than arrives.
    pub fn energy(&self) -> Energy {
        self.energy
    }

    /// Whether it knows what it reflects of light from everywhere: [`Table::albedo`].
    pub fn has_albedo(&self) -> bool {
        !self.threads.is_empty() && self.threads.iter().all(|thread| thread.sampling.is_some())
    }

    /// Whether it knows where that light comes from, and so can draw directions well: [`Table::sample_cos`].
    pub fn has_sampling(&self) -> bool {
        let sampling =
            |thread: &ThreadTable| thread.sampling.as_ref()?.histogram.as_ref().map(drop);
        self.threads.first().and_then(sampling).is_some()
    }

    /// Whether pairs, or albedos, can be asked for that it was not baked for: see [`Table::misses`].
    pub fn is_partial(&self) -> bool {
        self.is_partial
    }

    /// Whether it has every pair of directions.
    pub fn has_all_pairs(&self) -> bool {
        let mut grids = self.threads.iter().flat_map(ThreadTable::grids);
        !grids.any(Grid::is_partial)
    }

    /// How many pairs were looked up, in threads and batches of any kind, that the table was not baked for, or with another albedo than it was
    /// baked with. They get the nearest value that there is. It is 0 for a table of everything.
    pub fn misses(&self) -> usize {
        self.misses.count()
    }

    /// Counts from 0 again.
    pub fn reset_misses(&self) {
        self.misses.reset();
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
    /// Nodes and weights of the rule that the segments are evaluated by; where there is a grid, within its rim, and none if it has no
    /// rim.
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
    /// What it reflects by view, if the table knows.
    pub(crate) sampling: Option<Sampling>,
}

/// How a thread's segments are evaluated.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Segments {
    /// There are none.
    None,
    /// By interpolation.
    Grid(Box<SegmentGrid>),
    /// Directly, where that costs less or errs less.
    Direct(PlacedNodes<f32>),
    /// By interpolation, as all of the thread: its direction changes along it.
    Curve(Box<CurveGrids>),
}

/// The grid of a thread's segments.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SegmentGrid {
    pub(crate) grid: Grid,
    /// What pairs are evaluated by within the grid's rim, if it has one.
    pub(crate) rim: Option<PlacedNodes<f32>>,
}

/// What a thread is whose direction changes along its curve.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CurveGrids {
    /// S and V.
    pub(crate) response: Grid,
    /// The projection that Q sums, in the first channel; the second is 0.
    pub(crate) projection: Grid,
}

/// The grids of a thread, as the file has them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Grids<G> {
    None,
    Segments(G),
    Curve { response: G, projection: G },
}

impl ThreadTable {
    pub(crate) fn new(parameters: ThreadParameters, grids: Grids<Grid>) -> Self {
        let optics = parameters.optics.cast();
        let segments = || parameters.segments.iter().copied();
        let tangents = TangentCurve::from_parts(parameters.tilts.iter().copied(), segments());
        let placed = (!parameters.nodes.is_empty()).then(|| {
            let segments = TangentCurve::from_parts(core::iter::empty(), segments());
            PlacedNodes::new(&segments, &parameters.optics, &parameters.nodes)
        });
        Self {
            frame: ThreadFrame::new(parameters.direction),
            coverage: parameters.coverage as f32,
            albedo: parameters.albedo.map(|channel| channel as f32),
            segments: match grids {
                Grids::Segments(grid) => {
                    Segments::Grid(Box::new(SegmentGrid { grid, rim: placed }))
                }
                Grids::Curve {
                    response,
                    projection,
                } => Segments::Curve(Box::new(CurveGrids {
                    response,
                    projection,
                })),
                Grids::None => placed.map_or(Segments::None, Segments::Direct),
            },
            optics,
            tangents,
            parameters,
            sampling: None,
        }
    }

    /// `warp`, `weft`, …
    pub fn name(&self) -> &str {
        &self.parameters.name
    }

    /// The thread's frame in the surface.
    pub fn frame(&self) -> ThreadFrame<f64> {
        ThreadFrame::new(self.parameters.direction)
    }

    /// Share of the surface that the thread covers.
    pub fn coverage(&self) -> f32 {
        self.coverage
    }

    /// The fabric's own albedo, linear RGB.
    pub fn albedo(&self) -> [f32; 3] {
        self.albedo
    }

    /// The thread's tangents: single tilts are evaluated, segments are in the grid or evaluated. None of a thread whose direction
    /// changes along its curve.
    pub fn tangents(&self) -> &TangentCurve<f32> {
        &self.tangents
    }

    /// The grid of S and V, if the thread has one.
    pub fn grid(&self) -> Option<&Grid> {
        match &self.segments {
            Segments::Grid(segments) => Some(&segments.grid),
            Segments::Curve(grids) => Some(&grids.response),
            Segments::None | Segments::Direct(_) => None,
        }
    }

    /// The grid of the projection, if the thread's direction changes along its curve. Others have it in closed form.
    pub fn projection_grid(&self) -> Option<&Grid> {
        match &self.segments {
            Segments::Curve(grids) => Some(&grids.projection),
            Segments::None | Segments::Grid(_) | Segments::Direct(_) => None,
        }
    }

    /// Whether it serves any albedo, or its own alone.
    pub fn takes_albedo(&self) -> bool {
        self.grid().is_none_or(|grid| grid.content.takes_albedo())
    }

    /// All grids, in the order of the file.
    pub(crate) fn grids(&self) -> impl Iterator<Item = &Grid> + Clone {
        self.grid().into_iter().chain(self.projection_grid())
    }

    /// How many tilts per segment are evaluated for a pair, if the segments have no grid.
    pub fn direct_nodes(&self) -> Option<usize> {
        match &self.segments {
            Segments::Direct(nodes) => Some(nodes.count()),
            Segments::None | Segments::Grid(_) | Segments::Curve(_) => None,
        }
    }

    /// How far before the thread's horizon its grid ends, and how many tilts per segment are evaluated for pairs beyond, if it ends before
    /// the horizon.
    pub fn rim(&self) -> Option<(Rim, usize)> {
        match &self.segments {
            Segments::Grid(segments) => {
                let nodes = segments.rim.as_ref()?;
                Some((segments.grid.coordinates.rim(), nodes.count()))
            }
            Segments::None | Segments::Direct(_) | Segments::Curve(_) => None,
        }
    }
}
