//! Boxes that enclose the coordinates of all pairs of directions within two caps.
//!
//! A latitude within a cap differs from that of its axis by no more than the radius r, an azimuth by no more than
//! asin(sin r / cos θ). The normalised differences u₁ and u₂ are (b − a)/(a + b) of what two angles are away from ±π/2, so that they grow with one and
//! fall with the other, and their extremes are at the ends. A box that ends at a rim, b, has ±b instead; and pairs that have no part of it
//! need no box.

use core::f64::consts::{FRAC_PI_2, PI};

use num_traits::Float;

use crate::chart::{Chart, Coordinates, Rim};
use crate::math::Vec3;
use crate::needs::Cap;

/// What rounding may do to an angle of single precision, and more.
const SLACK: f64 = 1e-4;
/// What it may do to a coordinate.
const COORDINATE_SLACK: f64 = 1e-5;

/// From, to.
pub type Range = [f64; 2];

/// What a cap of directions spans, in thread coordinates.
#[derive(Debug, Clone, Copy)]
pub struct Span {
    /// Unit vector to the middle.
    axis: Vec3<f64>,
    /// Chord from it to the farthest.
    chord: f64,
    /// Latitude and azimuth about the thread.
    theta: Range,
    phi: Range,
    /// Polar angle and azimuth about the normal: the latter not reduced to ±π.
    polar: Range,
    around: Range,
    /// No direction is higher above the thread's horizon, as [`height`](crate::chart::height) has it.
    highest: f64,
    /// ψ of twice the direction: of the half vector where light comes from the viewer.
    psi: Range,
}

impl Span {
    /// Of a cap in thread coordinates, the part of it above the surface.
    pub fn new(Cap { axis, radius }: Cap) -> Self {
        let radius = radius + SLACK;
        let [x, y, z] = axis;
        let quarter = [-FRAC_PI_2, FRAC_PI_2];
        let span = |middle: f64, spread: f64, [low, high]: Range| {
            [
                (middle - spread).clamp(low, high),
                (middle + spread).clamp(low, high),
            ]
        };
        // How far an azimuth strays about a pole at a distance.
        let spread = |distance: f64| {
            if radius < distance {
                Float::asin((Float::sin(radius) / Float::sin(distance)).min(1.0))
            } else {
                PI
            }
        };
        let length = |a: f64, b: f64| Float::sqrt(a * a + b * b);
        let theta = Float::atan2(x, length(y, z));
        let beside = Float::atan2(length(x, z), y.abs());
        let polar = Float::atan2(length(x, y), z);
        let phi = span(Float::atan2(y, z), spread(FRAC_PI_2 - theta.abs()), quarter);
        let least = |[low, high]: Range| f64::max(low.max(-high), 0.0);
        let from_normal = span(polar, radius, [0.0, FRAC_PI_2]);
        Self {
            highest: Float::cos(least(phi)).min(1.5 * Float::cos(from_normal[0])),
            axis,
            chord: 2.0 * Float::sin(0.5 * radius),
            theta: span(theta, radius, quarter),
            phi,
            polar: from_normal,
            around: span(
                Float::atan2(y, x),
                spread(polar.min(PI - polar)),
                [-TAU, TAU],
            ),
            psi: span(Float::atan2(x, z), spread(beside), quarter),
        }
    }
}

const TAU: f64 = 2.0 * PI;

impl Coordinates {
    /// Boxes that together enclose the points of all pairs, wi in one span and wr in the other, as `of` computes them in any
    /// precision. Coordinates that there are not are 0.
    pub fn enclose(self, wi: &Span, wr: &Span, mut with: impl FnMut([Range; 4])) {
        match self {
            Self::Thread { chart, rim, .. } => {
                if is_beyond(rim, wi.highest.min(wr.highest)) {
                    return;
                }
                let u0 = match chart {
                    Chart::Thesis => half_sum(wi.theta, wr.theta, FRAC_PI_2),
                    Chart::Highlight => psi_of_half(wi, wr),
                };
                let u1 = ratio(wi.theta, wr.theta, FRAC_PI_2);
                let u2 = ratio(wi.phi, wr.phi, rim.azimuth());
                let u3 = half_sum(wi.phi, wr.phi, rim.azimuth());
                self.fold(u0, u1, u2, u3, with);
            }
            Self::Isotropic => {
                let [[a, b], [c, d]] = [wi.polar, wr.polar];
                let u0 = [(a + c) / PI, (b + d) / PI];
                let difference = |i: f64, r: f64| {
                    let range = (i + r).min(PI - i - r);
                    if range > 0.0 { (i - r) / range } else { 0.0 }
                };
                // At the pole and the horizon the ratio is anything.
                let u1 = if a + c <= 0.0 || b + d >= PI {
                    [-1.0, 1.0]
                } else {
                    [difference(a, d), difference(b, c)]
                };
                with([u0, unit(u1), azimuths(wi.around, wr.around), [0.0; 2]].map(slacken));
            }
            Self::View { .. } => with([[0.0, 1.0]; 4]),
        }
    }

    /// Boxes that together enclose the points of all pairs wi = wr in a span.
    pub fn enclose_collocated(self, w: &Span, mut with: impl FnMut([Range; 4])) {
        match self {
            Self::Thread { chart, rim, .. } => {
                if is_beyond(rim, w.highest) {
                    return;
                }
                let u0 = match chart {
                    Chart::Thesis => w.theta,
                    Chart::Highlight => w.psi,
                };
                let middle = [0.0; 2];
                self.fold(
                    normal(u0, FRAC_PI_2),
                    middle,
                    middle,
                    normal(w.phi, rim.azimuth()),
                    |[u0, _, _, u3]| {
                        with([u0, [0.5; 2], [0.5; 2], u3]);
                    },
                );
            }
            Self::Isotropic => {
                let u0 = w.polar.map(|theta| theta / FRAC_PI_2);
                with([slacken(u0), [0.5; 2], [0.0; 2], [0.0; 2]]);
            }
            Self::View { .. } => with([[0.0, 1.0]; 4]),
        }
    }

    /// Boxes of coordinates that are within ±1 before any mirror.
    fn fold(self, u0: Range, u1: Range, u2: Range, u3: Range, mut with: impl FnMut([Range; 4])) {
        let Self::Thread {
            ends_fold,
            sides_fold,
            ..
        } = self
        else {
            return;
        };
        let negative = |[low, high]: Range| [-high, -low];
        // The part on one side of the mirror, and the mirrored other part.
        let halves = |range: Range, folds: bool| {
            let upper =
                |[low, high]: Range| (high >= -SLACK).then(|| [low.max(0.0), high.max(0.0)]);
            if folds {
                [upper(range), upper(negative(range))]
            } else {
                [Some(range), None]
            }
        };
        for (end, u0) in halves(u0, ends_fold).into_iter().enumerate() {
            for (side, u3) in halves(u3, sides_fold).into_iter().enumerate() {
                let (Some(u0), Some(u3)) = (u0, u3) else {
                    continue;
                };
                let u1 = if end == 1 { negative(u1) } else { u1 };
                let u2 = if side == 1 { negative(u2) } else { u2 };
                let u3 = if sides_fold { u3 } else { unit(u3) };
                with([unit(u0), unit(u1), unit(u2), u3].map(slacken));
            }
        }
    }
}

/// (1 + x)/2.
fn unit(range: Range) -> Range {
    range.map(|x| 0.5 + 0.5 * x)
}

fn slacken([low, high]: Range) -> Range {
    [
        (low - COORDINATE_SLACK).max(0.0),
        (high + COORDINATE_SLACK).min(1.0),
    ]
}

/// Whether pairs of such a height have no part of a box.
fn is_beyond(rim: Rim, height: f64) -> bool {
    rim.share_of_box(height + SLACK) <= 0.0
}

/// An angle over the most that there is in a box, within ±1.
fn normal(range: Range, most: f64) -> Range {
    range.map(|angle| (angle / most).clamp(-1.0, 1.0))
}

/// Half the sum of two angles over the most.
fn half_sum([a, b]: Range, [c, d]: Range, most: f64) -> Range {
    normal([0.5 * (a + c), 0.5 * (b + d)], most)
}

/// (i − r)/(2 `most` − |i + r|), within ±1.
fn ratio([a, b]: Range, [c, d]: Range, most: f64) -> Range {
    let at = |i: f64, r: f64| {
        let range = 2.0 * most - (i + r).abs();
        (range > 0.0).then(|| ((i - r) / range).clamp(-1.0, 1.0))
    };
    // Where the range is empty the ratio is anything.
    let is_at_pole = b + d >= 2.0 * most || a + c <= -2.0 * most;
    match (at(a, d), at(b, c)) {
        (Some(low), Some(high)) if !is_at_pole => [low, high],
        _ => [-1.0, 1.0],
    }
}

/// ψ of wi + wr over π/2.
fn psi_of_half(wi: &Span, wr: &Span) -> Range {
    let (h_t, h_n) = (wi.axis[0] + wr.axis[0], wi.axis[2] + wr.axis[2]);
    let (length, stray) = (Float::sqrt(h_t * h_t + h_n * h_n), wi.chord + wr.chord);
    if stray >= length {
        return [-1.0, 1.0];
    }
    let (psi, spread) = (Float::atan2(h_t, h_n), Float::asin(stray / length));
    normal([psi - spread, psi + spread], FRAC_PI_2)
}

/// |Δφ| over π.
fn azimuths([a, b]: Range, [c, d]: Range) -> Range {
    let (low, high) = (a - d, b - c);
    if high - low >= TAU {
        return [0.0, 1.0];
    }
    // From −2π to 2π, |Δφ| reduced to [0, π] rises and falls with bends at multiples of π.
    let reduced = |x: f64| {
        let turns = x / TAU;
        (TAU * (turns - Float::round(turns))).abs() / PI
    };
    let (at_low, at_high) = (reduced(low), reduced(high));
    let passes = |bend: f64| {
        let first = bend + TAU * Float::ceil((low - bend) / TAU);
        first <= high
    };
    [
        if passes(0.0) {
            0.0
        } else {
            at_low.min(at_high)
        },
        if passes(PI) { 1.0 } else { at_low.max(at_high) },
    ]
}
