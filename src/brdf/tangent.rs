//! The distribution of a thread's tangents, and the projections that it has in closed form.
//!
//! Tangent offsets o_0…o_n with lengths l_1…l_n are a polyline ([Fecho13] 3.2.2): segment k holds the share l_k/Σl of
//! the thread and its tilt δ is uniform on [o_{k−1}, o_k]; equal offsets are one tilt, zero length is a jump. Positive δ
//! raises the thread's tangent out of the cloth.
//!
//! The mean over the distribution of max(cos(ψ+δ), 0) needs no quadrature: the antiderivative sin is clamped where the
//! thread turns away, and sin(ψ+o), cos(ψ+o) follow from (x, z)/r by rotation, so that no angle is formed either.

use alloc::vec::Vec;

use crate::math::{Real, Vec3, norm2};

/// How Q weighs a tangent, [Fecho13] 3.26.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "lowercase"))]
pub enum Reweighting {
    /// By its projection towards the viewer alone, p(ψ_r): Q stands outside the integral over light directions.
    #[default]
    View,
    /// By P(t, wi, wr), as public implementations do.
    Both,
}

/// A part of a thread whose tilt is uniform between two angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment<R> {
    /// Tilt at the start, radians.
    pub from: R,
    /// Tilt at the end, radians; may be below `from`.
    pub to: R,
    /// Share of the thread's length, 0 to 1.
    pub weight: R,
}

impl<R: Real> Segment<R> {
    /// Whether mean values over the segment are better taken at its middle: the difference of antiderivatives loses
    /// ε/Δ to rounding, the midpoint Δ²/24 to curvature, and the two meet where Δ³ = 24 ε.
    fn is_narrow(&self) -> bool {
        (self.to - self.from).abs() < (R::of(24.0) * R::epsilon()).cbrt()
    }

    fn middle(&self) -> R {
        R::of(0.5) * (self.from + self.to)
    }
}

/// The tangents of one thread.
#[derive(Debug, Clone, PartialEq)]
pub struct TangentCurve<R> {
    segments: Vec<Segment<R>>,
    /// What [`TangentCurve::projection`] sums: Σ weight · clamped sin(ψ+o), by distinct segment end.
    ends: Vec<Term<R>>,
    /// … and Σ weight · max(cos(ψ+δ), 0), by single tilt.
    tilts: Vec<Term<R>>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Term<R> {
    angle: f64,
    cos: R,
    sin: R,
    weight: R,
}

impl<R: Real> TangentCurve<R> {
    /// The distribution of a polyline of `offsets` (radians, one more than lengths) and `lengths` (any unit, ≥ 0, not
    /// all 0). Segments of no length vanish.
    pub fn new(offsets: &[f64], lengths: &[f64]) -> Self {
        let total: f64 = lengths.iter().sum();
        let segments = offsets.windows(2).zip(lengths).filter(|(_, length)| **length > 0.0).map(|(ends, length)| {
            Segment { from: R::of(ends[0]), to: R::of(ends[1]), weight: R::of(length / total) }
        });
        Self::from_segments(segments.collect())
    }

    /// The distribution made of `segments`, whose weights sum to 1.
    pub fn from_segments(segments: Vec<Segment<R>>) -> Self {
        let (mut ends, mut tilts) = (Vec::new(), Vec::new());
        for segment in &segments {
            let weight = segment.weight.to_double();
            if segment.is_narrow() {
                add_term(&mut tilts, segment.middle().to_double(), weight);
            } else {
                let density = weight / (segment.to - segment.from).to_double();
                add_term(&mut ends, segment.to.to_double(), density);
                add_term(&mut ends, segment.from.to_double(), -density);
            }
        }
        ends.retain(|end| end.weight != R::zero());
        Self { segments, ends, tilts }
    }

    /// The segments, all of positive weight.
    pub fn segments(&self) -> &[Segment<R>] {
        &self.segments
    }

    /// The tilt, in radians, of a thread that has only one.
    pub fn single_tilt(&self) -> Option<R> {
        let first = self.segments.first()?.from;
        self.segments.iter().all(|s| s.from == first && s.to == first).then_some(first)
    }

    /// The smallest and the largest tilt, radians.
    pub fn hull(&self) -> (R, R) {
        let ends = || self.segments.iter().flat_map(|s| [s.from, s.to]);
        (ends().fold(R::infinity(), R::min), ends().fold(R::neg_infinity(), R::max))
    }

    /// Whether tilts δ and −δ are equally frequent, so that the thread looks the same from both of its ends.
    pub fn is_symmetric(&self) -> bool {
        let mirrored = |terms: &[Term<R>], sign: f64| {
            terms.iter().all(|a| {
                terms.iter().any(|b| {
                    (a.angle + b.angle).abs() < 1e-9
                        && (a.weight.to_double() - sign * b.weight.to_double()).abs() < 1e-6 * a.weight.to_double().abs()
                })
            })
        };
        // The density is even exactly if its antiderivative's jumps (the ends) are odd.
        mirrored(&self.ends, -1.0) && mirrored(&self.tilts, 1.0)
    }

    /// Mean of max(cos(ψ+δ), 0) over the distribution for a direction `w` in thread coordinates: the projection p that
    /// Q sums for the viewer, 3.26. Between 0 and 1.
    #[inline]
    pub fn projection(&self, w: Vec3<R>) -> R {
        let r = norm2(w[0], w[2]);
        // Along s every tilt is seen alike but ψ is undefined; the normal's ψ = 0 is as good as any.
        let (sin_psi, cos_psi) = if r > R::zero() { (w[0] / r, w[2] / r) } else { (R::zero(), R::one()) };
        let mut sum = R::zero();
        for end in &self.ends {
            let sin = sin_psi * end.cos + cos_psi * end.sin;
            let cos = cos_psi * end.cos - sin_psi * end.sin;
            sum += end.weight * if cos > R::zero() { sin } else { sin.signum() };
        }
        for tilt in &self.tilts {
            sum += tilt.weight * (cos_psi * tilt.cos - sin_psi * tilt.sin).max(R::zero());
        }
        sum.max(R::zero())
    }

    /// Mean of P(t, wi, wr), 3.25, over the distribution, for directions in thread coordinates and `u_psi` = u(ψ_d).
    pub fn joint_projection(&self, wi: Vec3<R>, wr: Vec3<R>, u_psi: R) -> R {
        let angle = |w: Vec3<R>| if norm2(w[0], w[2]) > R::zero() { w[0].atan2(w[2]) } else { R::zero() };
        let (psi_i, psi_r) = (angle(wi), angle(wr));
        let (psi_min, psi_max) = (psi_i.min(psi_r), psi_i.max(psi_r));
        let quarter = R::FRAC_PI_2();
        // ∫ cos over [from, to] as a product, exact for short intervals.
        let cos_integral = |psi: R, from: R, to: R| {
            let half = R::of(0.5);
            R::of(2.0) * (psi + half * (from + to)).cos() * (half * (to - from)).sin()
        };
        let mut sum = R::zero();
        for segment in &self.segments {
            if segment.is_narrow() {
                let tilt = segment.middle();
                let p_i = (psi_i + tilt).cos().max(R::zero());
                let p_r = (psi_r + tilt).cos().max(R::zero());
                sum += segment.weight * ((R::one() - u_psi) * p_i * p_r + u_psi * p_i.min(p_r));
                continue;
            }
            let from = segment.from.min(segment.to).max(-quarter - psi_min);
            let to = segment.from.max(segment.to).min(quarter - psi_max);
            if to <= from {
                continue;
            }
            // cos a cos b = (cos(a−b) + cos(a+b))/2, and the smaller cosine is that of the angle further from 0.
            let product = R::of(0.5)
                * ((psi_i - psi_r).cos() * (to - from)
                    + R::of(0.5) * cos_integral(psi_i + psi_r, R::of(2.0) * from, R::of(2.0) * to));
            let turn = (R::of(-0.5) * (psi_i + psi_r)).max(from).min(to);
            let smaller = cos_integral(psi_min, from, turn) + cos_integral(psi_max, turn, to);
            let mean = (R::one() - u_psi) * product + u_psi * smaller;
            sum += segment.weight * mean / (segment.to - segment.from).abs();
        }
        sum.max(R::zero())
    }
}

fn add_term<R: Real>(terms: &mut Vec<Term<R>>, angle: f64, weight: f64) {
    match terms.iter_mut().find(|term| term.angle == angle) {
        Some(term) => term.weight += R::of(weight),
        None => {
            let (sin, cos) = num_traits::Float::sin_cos(angle);
            terms.push(Term { angle, cos: R::of(cos), sin: R::of(sin), weight: R::of(weight) });
        }
    }
}
