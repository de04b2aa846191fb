//! The distribution of a thread's tangents, and the projections that it has in closed form.
//!
//! Tangent offsets o_0…o_n with lengths l_1…l_n are a polyline (\[Fecho13\] 3.2.2): segment k holds the share l_k/Σl of
//! the thread and its tilt δ is uniform on \[o_{k−1}, o_k\]; equal offsets are one tilt, zero length is a jump. Positive
//! δ raises the thread's tangent out of the cloth. So the distribution is a sum of single [`Tilt`]s and of [`Segment`]s.

use alloc::vec::Vec;
use core::f64::consts::FRAC_PI_2;

use super::{Optics, Response, ThreadPair, limits};
use crate::math::{Lanes, Real, Vec3, norm2, splat};

/// How Q weighs a tangent, \[Fecho13\] 3.26.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "bake",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum Reweighting {
    /// By its projection towards the viewer alone, p(ψ_r): Q stands outside the integral over light directions.
    #[default]
    View,
    /// By P(t, wi, wr), as public implementations do.
    Both,
}

/// A part of a thread with one tilt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tilt<R> {
    /// δ, radians.
    pub angle: R,
    /// Share of the thread's length, 0 to 1.
    pub weight: R,
    /// cos δ.
    pub cos: R,
    /// sin δ.
    pub sin: R,
}

impl<R: Real> Tilt<R> {
    /// A tilt of `angle` radians that holds `weight` of the thread.
    pub fn new(angle: f64, weight: f64) -> Self {
        let (sin, cos) = num_traits::Float::sin_cos(angle);
        Self {
            angle: R::of(angle),
            weight: R::of(weight),
            cos: R::of(cos),
            sin: R::of(sin),
        }
    }

    /// Sine and cosine of ψ + δ from those of ψ.
    #[inline(always)]
    fn rotate<L: Lanes>(&self, sin_psi: L, cos_psi: L) -> (L, L) {
        let (sin, cos) = (splat::<R, L>(self.sin), splat::<R, L>(self.cos));
        (sin_psi * cos + cos_psi * sin, cos_psi * cos - sin_psi * sin)
    }
}

/// A part of a thread whose tilt is uniform between two angles, `from` < `to`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment<R> {
    /// The smallest tilt, radians.
    pub from: R,
    /// The largest tilt, radians.
    pub to: R,
    /// Share of the thread's length, 0 to 1.
    pub weight: R,
}

/// The tangents of one thread.
#[derive(Debug, Clone, PartialEq)]
pub struct TangentCurve<R> {
    tilts: Vec<Tilt<R>>,
    segments: Vec<Segment<R>>,
    /// The mean projection over the segments is Σ weight · clamped sin(ψ+o) over their distinct ends o …
    ends: Vec<Tilt<R>>,
    /// … and over those too short for that, Σ weight · max(cos(ψ+δ), 0) at their middles.
    middles: Vec<Tilt<R>>,
}

impl<R: Real> TangentCurve<R> {
    /// The distribution of a polyline of `offsets` (radians, one more than lengths) and `lengths` (any unit, ≥ 0, not
    /// all 0). Parts of no length vanish, and segments that overlap or go on with the same density become disjoint ones.
    pub fn new(offsets: &[f64], lengths: &[f64]) -> Self {
        let total: f64 = lengths.iter().sum();
        let (mut tilts, mut steps) = (Vec::new(), Vec::new());
        for (ends, length) in offsets.windows(2).zip(lengths) {
            let (from, to, weight) = (ends[0].min(ends[1]), ends[0].max(ends[1]), length / total);
            if weight == 0.0 {
                continue;
            }
            if to - from < limits::SEGMENT_WIDTH {
                tilts.push((0.5 * (from + to), weight));
            } else {
                let density = weight / (to - from);
                steps.extend([(from, density, 1), (to, -density, -1)]);
            }
        }
        steps.sort_by(|a, b| a.0.total_cmp(&b.0));

        let mut pieces: Vec<(f64, f64, f64)> = Vec::new();
        let (mut density, mut overlap) = (0.0, 0);
        for pair in steps.windows(2) {
            density += pair[0].1;
            overlap += pair[0].2;
            let (from, to) = (pair[0].0, pair[1].0);
            if overlap == 0 || to == from {
                continue;
            }
            match pieces.last_mut() {
                Some(last) if last.1 == from && (last.2 - density).abs() < 1e-9 * density => {
                    last.1 = to
                }
                _ if to - from < limits::SEGMENT_WIDTH => {
                    tilts.push((0.5 * (from + to), density * (to - from)))
                }
                _ => pieces.push((from, to, density)),
            }
        }
        let segments = pieces
            .iter()
            .map(|(from, to, density)| (*from, *to, density * (to - from)));
        Self::from_parts(tilts.into_iter(), segments)
    }

    /// The distribution made of tilts (angle, weight) and segments (from < to, weight), whose weights sum to 1.
    pub fn from_parts(
        tilts: impl Iterator<Item = (f64, f64)>,
        segments: impl Iterator<Item = (f64, f64, f64)>,
    ) -> Self {
        let mut curve = Self {
            tilts: Vec::new(),
            segments: Vec::new(),
            ends: Vec::new(),
            middles: Vec::new(),
        };
        for (angle, weight) in tilts {
            add(&mut curve.tilts, angle, weight);
        }
        // The difference of antiderivatives loses ε/Δ to rounding, the midpoint Δ²/24 to curvature: they meet at Δ³ = 24 ε.
        let narrow = num_traits::Float::cbrt(24.0 * R::EPSILON.to_double());
        for (from, to, weight) in segments {
            curve.segments.push(Segment {
                from: R::of(from),
                to: R::of(to),
                weight: R::of(weight),
            });
            if to - from < narrow {
                add(&mut curve.middles, 0.5 * (from + to), weight);
            } else {
                add(&mut curve.ends, to, weight / (to - from));
                add(&mut curve.ends, from, -weight / (to - from));
            }
        }
        // Where one segment goes on as the next of equal density, there is no end.
        curve.ends.retain(|end| end.weight != R::zero());
        curve
    }

    /// The single tilts, distinct.
    pub fn tilts(&self) -> &[Tilt<R>] {
        &self.tilts
    }

    /// S and V of the single tilts, over the whole thread's length.
    #[inline(always)]
    pub fn response_of_tilts<L: Lanes>(
        &self,
        pair: &ThreadPair<L>,
        optics: &Optics<L>,
    ) -> Response<L> {
        let mut response = Response::zero();
        for tilt in &self.tilts {
            let (cos, sin) = (splat::<R, L>(tilt.cos), splat::<R, L>(tilt.sin));
            response = response.plus(splat::<R, L>(tilt.weight), pair.response(optics, cos, sin));
        }
        response
    }

    /// The spread-out parts.
    pub fn segments(&self) -> &[Segment<R>] {
        &self.segments
    }

    /// Whether the segments hold tilts δ and −δ equally, so that they look the same from both ends of the thread.
    pub fn segments_are_symmetric(&self) -> bool {
        let tolerance = R::of(1e-6);
        let density = |s: &Segment<R>| s.weight / (s.to - s.from);
        // The density at a tilt is the sum over the segments around it; it can only change at their ends.
        let at = |delta: R| {
            let around = self
                .segments
                .iter()
                .filter(|s| s.from <= delta && delta <= s.to);
            around.map(density).fold(R::zero(), |sum, x| sum + x)
        };
        let mut cuts: Vec<R> = self
            .segments
            .iter()
            .flat_map(|s| [s.from, s.to, -s.from, -s.to])
            .collect();
        cuts.sort_by(|a, b| a.partial_cmp(b).unwrap_or(core::cmp::Ordering::Equal));
        cuts.windows(2)
            .filter(|pair| pair[1] - pair[0] > tolerance)
            .all(|pair| {
                let middle = R::of(0.5) * (pair[0] + pair[1]);
                (at(middle) - at(-middle)).abs() <= tolerance * at(middle).max(at(-middle))
            })
    }

    /// Mean of max(cos(ψ+δ), 0) over the distribution for a direction `w` in thread coordinates: the projection p that
    /// Q sums for the viewer, 3.26. Between 0 and 1.
    ///
    /// The antiderivative sin is clamped where the thread turns away, and sin(ψ+o), cos(ψ+o) follow from (x, z) by
    /// rotation, so that no angle is formed.
    #[inline(always)]
    pub fn projection<L: Lanes>(&self, w: Vec3<L>) -> L {
        let r = norm2(w[0], w[2]);
        // Along s the angle ψ is undefined; the normal's 0 is as good as any.
        let defined = L::zero().lt(r);
        let sin_psi = L::select(defined, w[0] / r, L::zero());
        let cos_psi = L::select(defined, w[2] / r, L::one());
        let mut sum = L::zero();
        for end in &self.ends {
            let (sin, cos) = end.rotate(sin_psi, cos_psi);
            let turned = L::select(sin.lt(L::zero()), L::of(-1.0), L::one());
            let sin = L::select(L::zero().lt(cos), sin, turned);
            sum += splat::<R, L>(end.weight) * sin;
        }
        for tilt in self.middles.iter().chain(&self.tilts) {
            let (_, cos) = tilt.rotate(sin_psi, cos_psi);
            sum += splat::<R, L>(tilt.weight) * cos.max(L::zero());
        }
        sum.max(L::zero())
    }

    /// Mean of P(t, wi, wr), 3.25, over the distribution, for directions in thread coordinates and `u_psi` = u(ψ_d).
    #[inline(always)]
    pub fn joint_projection<L: Lanes>(&self, wi: Vec3<L>, wr: Vec3<L>, u_psi: L) -> L {
        let (psi_i, psi_r) = (psi(wi), psi(wr));
        let (psi_min, psi_max) = (psi_i.min(psi_r), psi_i.max(psi_r));
        let (half, quarter) = (L::of(0.5), L::of(FRAC_PI_2));
        let mut sum = L::zero();
        for segment in &self.segments {
            // The part that faces both directions.
            let from = splat::<R, L>(segment.from).max(-quarter - psi_min);
            let to = splat::<R, L>(segment.to).min(quarter - psi_max).max(from);
            // cos a cos b = (cos(a−b) + cos(a+b))/2, and the smaller cosine is that of the angle further from 0.
            let product = half
                * ((psi_i - psi_r).cos() * (to - from) + integral_cos_2(psi_i + psi_r, from, to));
            let turn = (-half * (psi_i + psi_r)).max(from).min(to);
            let smaller = integral_cos(psi_min, from, turn) + integral_cos(psi_max, turn, to);
            let density = splat::<R, L>(segment.weight / (segment.to - segment.from));
            sum += density * ((L::one() - u_psi) * product + u_psi * smaller);
        }
        for tilt in &self.tilts {
            let angle = splat::<R, L>(tilt.angle);
            let p_i = (psi_i + angle).cos().max(L::zero());
            let p_r = (psi_r + angle).cos().max(L::zero());
            sum += splat::<R, L>(tilt.weight) * super::cylinder::blend(u_psi, p_i, p_r);
        }
        sum.max(L::zero())
    }
}

/// ψ, 0 along s.
#[inline(always)]
fn psi<L: Lanes>(w: Vec3<L>) -> L {
    w[0].atan2(w[2])
}

/// ∫ cos(ψ + δ) dδ, as a product so that short intervals keep their precision.
#[inline(always)]
fn integral_cos<L: Lanes>(psi: L, from: L, to: L) -> L {
    let half = L::of(0.5);
    L::of(2.0) * (psi + half * (from + to)).cos() * (half * (to - from)).sin()
}

/// ∫ cos(ψ + 2δ) dδ.
#[inline(always)]
fn integral_cos_2<L: Lanes>(psi: L, from: L, to: L) -> L {
    (psi + from + to).cos() * (to - from).sin()
}

fn add<R: Real>(terms: &mut Vec<Tilt<R>>, angle: f64, weight: f64) {
    let term = Tilt::new(angle, weight);
    match terms.iter_mut().find(|other| other.angle == term.angle) {
        Some(other) => other.weight += term.weight,
        None => terms.push(term),
    }
}
