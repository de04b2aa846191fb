//! The functions that grids sample: S and V of one thread's segments, or of all of a thread whose direction changes along its
//! curve, and the projection of such a thread.

use crate::brdf::{Optics, Response, Reweighting, TangentCurve, ThreadPair};
use crate::chart::{Chart, Coordinates, Rim};
use crate::fabric::{Fabric, Strands, Thread};
use crate::math::Vec3;
use crate::model::{AdaptiveMean, mean_response};

/// Sites on the faces of the box are evaluated this far inside it: on some faces themselves the direction is ambiguous.
const INSET: f64 = 1e-4;

/// A function of pairs of directions in thread coordinates, on the box of its coordinates.
#[derive(Clone)]
pub(super) struct Integrand {
    function: Function,
    coordinates: Coordinates,
}

#[derive(Clone)]
enum Function {
    Segments {
        optics: Optics<f64>,
        segments: TangentCurve<f64>,
        sigma_u: f64,
        tolerance: f64,
    },
    Curve(AdaptiveMean),
    Projection(AdaptiveMean),
}

impl Integrand {
    /// S and V of the segments of a straight thread, in a box that ends at a `rim`.
    pub(super) fn of_segments(
        fabric: &Fabric,
        thread: &Thread,
        chart: Chart,
        rim: Rim,
        tolerance: f64,
    ) -> Self {
        let curve = thread.tangents::<f64>();
        let segments = curve
            .segments()
            .iter()
            .map(|segment| (segment.from, segment.to, segment.weight));
        let segments = TangentCurve::from_parts(std::iter::empty(), segments);
        let coordinates = Coordinates::Thread {
            chart,
            ends_fold: segments.segments_are_symmetric(),
            sides_fold: true,
            rim,
        };
        let function = Function::Segments {
            optics: thread.optics,
            segments,
            sigma_u: fabric.sigma_u,
            tolerance,
        };
        Self {
            function,
            coordinates,
        }
    }

    /// S and V of a thread with these `strands`, whose directions are counted from the thread's own.
    pub(super) fn of_curve(
        fabric: &Fabric,
        thread: &Thread,
        strands: &Strands,
        chart: Chart,
        tolerance: f64,
    ) -> Self {
        let mean = AdaptiveMean::new(fabric, thread, strands, tolerance);
        Self {
            function: Function::Curve(mean),
            coordinates: coordinates_of(strands, chart),
        }
    }

    /// The projection of such a thread that Q sums, as S, and 0 as V.
    pub(super) fn of_projection(
        fabric: &Fabric,
        thread: &Thread,
        strands: &Strands,
        chart: Chart,
        tolerance: f64,
    ) -> Self {
        let mean = AdaptiveMean::new(fabric, thread, strands, tolerance);
        let coordinates = match fabric.reweighting {
            Reweighting::View => Coordinates::View {
                isotropic: strands.are_isotropic(),
            },
            Reweighting::Both => coordinates_of(strands, chart),
        };
        Self {
            function: Function::Projection(mean),
            coordinates,
        }
    }

    /// The same by a first look, a third of the work: what differs nearby differs by less.
    pub(super) fn at_first_sight(&self) -> Self {
        let mut rough = self.clone();
        match &mut rough.function {
            Function::Segments { tolerance, .. } => *tolerance = f64::INFINITY,
            Function::Curve(mean) | Function::Projection(mean) => mean.tolerance = f64::INFINITY,
        }
        rough
    }

    /// Whether, of a thread, both are the same function but for their tolerances.
    pub(super) fn is_of(&self, other: &Self) -> bool {
        let kind = |integrand: &Self| std::mem::discriminant(&integrand.function);
        kind(self) == kind(other) && self.coordinates == other.coordinates
    }

    pub(super) fn coordinates(&self) -> Coordinates {
        self.coordinates
    }

    /// The function for a pair in thread coordinates.
    pub(super) fn at_pair(&self, wi: Vec3<f64>, wr: Vec3<f64>) -> Response<f64> {
        match &self.function {
            Function::Segments {
                optics,
                segments,
                sigma_u,
                tolerance,
            } => {
                let pair = ThreadPair::new(wi, wr, *sigma_u);
                mean_response(&pair, optics, segments, *tolerance)
            }
            Function::Curve(mean) => mean.response(wi, wr),
            Function::Projection(mean) => Response {
                surface: mean.projection(wi, wr),
                volume: 0.0,
            },
        }
    }

    /// The function at a point of the box, or beside it where the point is on a face.
    pub(super) fn at_point(&self, u: [f64; 4]) -> Response<f64> {
        let (wi, wr) = self.pair_at(u);
        self.at_pair(wi, wr)
    }

    /// The box's share in the value of the pair at a point: see [`Rim::share_of_box`].
    pub(super) fn share_at(&self, u: [f64; 4]) -> f64 {
        let (wi, wr) = self.pair_at(u);
        self.coordinates.share_of_box(wi, wr)
    }

    fn pair_at(&self, u: [f64; 4]) -> (Vec3<f64>, Vec3<f64>) {
        let faces = self.coordinates.is_face();
        let inside = [0, 1, 2, 3].map(|k| {
            let [low, high] = faces[k].map(|is_face| if is_face { INSET } else { 0.0 });
            u[k].clamp(low, 1.0 - high)
        });
        self.coordinates.directions(inside)
    }
}

fn coordinates_of(strands: &Strands, chart: Chart) -> Coordinates {
    if strands.are_isotropic() {
        Coordinates::Isotropic
    } else {
        Coordinates::Thread {
            chart,
            ends_fold: strands.look_the_same_from_both_ends(),
            sides_fold: strands.look_the_same_from_both_sides(),
            rim: Rim::NONE,
        }
    }
}
