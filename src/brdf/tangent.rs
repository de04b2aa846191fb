//! The distribution of a thread's tangents, and the projections that it has in closed form.
//!
//! Tangent offsets o_0…o_n with lengths l_1…l_n are a polyline (\[Fecho13\] 3.2.2): segment k holds the share l_k/Σl of
//! the thread and its tilt δ is uniform on \[o_{k−1}, o_k\]; equal offsets are one tilt, zero length is a jump. Positive
//! δ raises the thread's tangent out of the cloth. So the distribution is a sum of single [`Tilt`]s and of [`Segment`]s.
//!
//! Projections are integrals over the tilts that are visible ([`psi`](super::psi)), from an end a to an end b. With
//! T = tan((b−a)/2)
//!
//! ```text
//! ∫ cos β dβ               = T (cos a + cos b)
//! ∫ cos β cos(β+ψ_d) dβ    = T/2 (cos a + cos b)(cos(a+ψ_d) + cos(b+ψ_d)) + cos ψ_d (atan T − T/(1+T²))
//! ```

use alloc::{collections::BTreeMap, vec::Vec};
use core::f64::consts::FRAC_PI_2;

use super::psi::{Arc, Ordered, Psi, Seen, half_tangent};
use super::{Optics, Response, ThreadPair, limits};
use crate::math::{Lanes, Real, Vec3, splat};

/// How Q weighs a tangent, \[Fecho13\] 3.26.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "bake",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
#[non_exhaustive]
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
    /// The segments again, in parts of at most 90°, for projections.
    arcs: Vec<Arc<R>>,
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
            // Of a dense segment that has ended, its rounding stays behind: where little else is, that may be below 0.
            if overlap == 0 || to == from || density <= 0.0 {
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
        let (mut kept, mut arcs) = (Vec::new(), Vec::new());
        for (from, to, weight) in segments {
            kept.push(Segment {
                from: R::of(from),
                to: R::of(to),
                weight: R::of(weight),
            });
            let width = to - from;
            let parts = num_traits::Float::ceil(width / FRAC_PI_2).max(1.0);
            let end = |k: f64| from + width * (k / parts);
            for k in 0..parts as u32 {
                let k = f64::from(k);
                arcs.push(Arc::new(end(k), end(k + 1.0), weight / width));
            }
        }
        Self {
            tilts: distinct(tilts),
            segments: kept,
            arcs,
        }
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

    /// The segments in parts of at most 90°, as numbers: cos and sin of both ends, the tangent of half the width, and the density.
    pub(crate) fn arcs(&self) -> impl ExactSizeIterator<Item = [R; 6]> {
        self.arcs.iter().map(Arc::numbers)
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
    #[inline(always)]
    pub fn projection<L: Lanes>(&self, w: Vec3<L>) -> L {
        let (psi, _) = Psi::of(w);
        let mut sum = L::zero();
        for arc in &self.arcs {
            let arc = arc.splat::<L>();
            sum += arc.density * arc.projection(psi);
        }
        for tilt in &self.tilts {
            let facing = psi.facing(splat(tilt.cos), splat(tilt.sin));
            sum += splat::<R, L>(tilt.weight) * facing.max(L::zero());
        }
        sum
    }

    /// Mean of P(t, wi, wr), 3.25, over the distribution, for a pair in thread coordinates.
    #[inline(always)]
    pub fn joint_projection<L: Lanes>(&self, pair: &ThreadPair<L>) -> L {
        let order = pair.order();
        let mut sum = L::zero();
        for arc in &self.arcs {
            let arc = arc.splat::<L>();
            sum += arc.density * joint_integral(&order, &order.seen(&arc), pair.correlation_psi());
        }
        for tilt in &self.tilts {
            sum += splat::<R, L>(tilt.weight) * pair.visibility(splat(tilt.cos), splat(tilt.sin));
        }
        sum
    }
}

/// Means of max(cos(ψ+δ), 0) over arcs of these [`TangentCurve::arcs`] for a direction `w` in their threads' coordinates, times their shares of the
/// threads.
#[inline(always)]
pub(crate) fn projection_of_arcs<L: Lanes>(arcs: [L; 6], w: Vec3<L>) -> L {
    let (psi, _) = Psi::of(w);
    let arcs = Arc::of_numbers(arcs);
    arcs.density * arcs.projection(psi)
}

/// The projections of single tilts with these cosines and sines.
#[inline(always)]
pub(crate) fn projection_of_tilts<L: Lanes>([cos, sin]: [L; 2], w: Vec3<L>) -> L {
    let (psi, _) = Psi::of(w);
    psi.facing(cos, sin).max(L::zero())
}

/// ∫ P dδ over the tilts that both directions see.
#[inline(always)]
fn joint_integral<L: Lanes>(order: &Ordered<L>, seen: &Seen<L>, u: L) -> L {
    let (half, one) = (L::of(0.5), L::one());
    let ([first_a, first_b], [last_a, last_b]) = (seen.first, seen.last);
    let product =
        half * seen.half_tangent * (first_a.cos + first_b.cos) * (last_a.cos + last_b.cos)
            + order.cos_between * angle_beyond_sine(seen.half_tangent);
    // The smaller cosine is that of the angle further from 0: of `first` up to where the two are opposite, then of `last`.
    let turn = order.half_back();
    let falling = half_tangent(first_a, turn)
        .max(L::zero())
        .min(seen.half_tangent);
    let rising = (seen.half_tangent - falling) / (one + seen.half_tangent * falling);
    let first_turn = L::select(falling.lt(seen.half_tangent), turn.cos, first_b.cos);
    let last_turn = L::select(L::zero().lt(falling), turn.cos, last_a.cos);
    let smaller = falling * (first_a.cos + first_turn) + rising * (last_turn + last_b.cos);
    let mean = (one - u) * product + u * smaller;
    L::select(
        L::zero().lt(seen.half_tangent),
        mean.max(L::zero()),
        L::zero(),
    )
}

/// atan T − T/(1+T²) for T from 0 to 1: half of what an angle of half tangent T has over its sine.
#[inline(always)]
fn angle_beyond_sine<L: Lanes>(t: L) -> L {
    let t2 = t * t;
    let series = t * t2 * (L::of(2.0 / 3.0) - t2 * (L::of(4.0 / 5.0) - t2 * L::of(6.0 / 7.0)));
    let closed = t.atan2(L::one()) - t / (L::one() + t2);
    L::select(t.lt(L::of(0.1)), series, closed)
}

/// Tilts (angle, weight) of which those of equal angle are one. A file may have thousands, so they are looked up rather than
/// searched for.
fn distinct<R: Real>(tilts: impl Iterator<Item = (f64, f64)>) -> Vec<Tilt<R>> {
    let mut distinct: Vec<Tilt<R>> = Vec::new();
    let mut places = BTreeMap::new();
    for (angle, weight) in tilts {
        let tilt = Tilt::<R>::new(angle, weight);
        // Adding 0 makes −0 the 0 that it equals.
        let bits = (tilt.angle.to_double() + 0.0).to_bits();
        let place = *places.entry(bits).or_insert(distinct.len());
        match distinct.get_mut(place) {
            Some(same) => same.weight += tilt.weight,
            None => distinct.push(tilt),
        }
    }
    distinct
}
