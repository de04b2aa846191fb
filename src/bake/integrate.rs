//! The function that a grid samples: S and V of one thread's segments.

use crate::brdf::{Optics, Response, TangentCurve, ThreadPair};
use crate::chart::{Chart, fold_ends};
use crate::fabric::{Fabric, Thread};
use crate::math::Vec3;
use crate::model::mean_response;

/// Sites on the faces of the box are evaluated this far inside it: on some faces themselves the direction is ambiguous.
const INSET: f64 = 1e-4;

/// Segments of one thread, on the box of a chart.
pub(super) struct Integrand {
    optics: Optics<f64>,
    segments: TangentCurve<f64>,
    sigma_u: f64,
    chart: Chart,
    tolerance: f64,
    folded: bool,
}

impl Integrand {
    pub(super) fn new(fabric: &Fabric, thread: &Thread, chart: Chart, tolerance: f64) -> Self {
        let curve = thread.tangents::<f64>();
        let segments = curve
            .segments()
            .iter()
            .map(|segment| (segment.from, segment.to, segment.weight));
        let segments = TangentCurve::from_parts(std::iter::empty(), segments);
        Self {
            optics: thread.optics,
            folded: segments.segments_are_symmetric(),
            segments,
            sigma_u: fabric.sigma_u,
            chart,
            tolerance,
        }
    }

    /// Whether the function is the same for u₀ and 1 − u₀.
    pub(super) fn is_folded(&self) -> bool {
        self.folded
    }

    pub(super) fn chart(&self) -> Chart {
        self.chart
    }

    /// The function for a pair in thread coordinates.
    pub(super) fn at_pair(&self, wi: Vec3<f64>, wr: Vec3<f64>) -> Response<f64> {
        let pair = ThreadPair::new(wi, wr, self.sigma_u);
        mean_response(&pair, &self.optics, &self.segments, self.tolerance)
    }

    /// The function at a point of the box, or beside it where the point is on a face.
    pub(super) fn at_point(&self, u: [f64; 4]) -> Response<f64> {
        // u₃ = 0 is the mirror's plane and not a face.
        let low = [INSET, INSET, INSET, 0.0];
        let inside = [0, 1, 2, 3].map(|k| u[k].clamp(low[k], 1.0 - INSET));
        let (wi, wr) = self.chart.directions(inside);
        self.at_pair(wi, wr)
    }

    /// Where a pair in thread coordinates is looked up.
    pub(super) fn coordinates(&self, wi: Vec3<f64>, wr: Vec3<f64>) -> [f64; 4] {
        let (wi, wr) = if self.folded {
            fold_ends(wi, wr)
        } else {
            (wi, wr)
        };
        self.chart.coordinates(wi, wr)
    }
}
