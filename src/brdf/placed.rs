//! The mean of a thread's response by N tilts per segment, placed for the pair at hand: `quadrature:N`.
//!
//! All happens in the frame turned to the highlight, β = δ + ψ_H, and in the tangent of the half angle, q = tan(β/2), which
//! needs no trigonometry:
//!
//! ```text
//! turn       (cos ψ_H, sin ψ_H) = (H_n, H_t)/|H_nt|,    x_i' = −x_r' = ±X                          H = wi + wr
//! horizon    q_up = (r+Z−X)/(r+Z+X) of the direction with x' > 0,  q_low = −(the same) of the other,   r = √(X²+Z²)
//! ends       q = sin(o+ψ_H)/(1+cos(o+ψ_H)) of both ends o of the segment, within q_low…q_up
//! map        q = w t/(1−t²),   w = ½ c γ_s/K,   K = |H_nt|/(2 cos θ_d) at β = 0,   c = 3 + N/2
//! nodes      t_k, ω_k: Gauss–Legendre between the ends' t;   dδ = 2 dq/(1+q²),   dq = w (1+t²)/(1−t²)² dt
//! lobes      ∫ g(γ, θ_h) (m_i+m_r)/2 dδ = Φ(θ_h(b)/γ) − Φ(θ_h(a)/γ) = A(γ),   since dθ_h/dδ = (m_i+m_r)/2
//!            S = A(γ_s) Σ ω S_k / Σ ω g(γ_s, θ_k)(m_i+m_r)/2;   V's lobe alike with γ_v;   its isotropic part Σ ω V_k
//! ```
//!
//! The map crowds nodes around a narrow highlight and is linear, the rule Gauss–Legendre, where the lobe is wide against the
//! segment. The quotients make a lobe's area exact. Everything is branch-free, positive, and the same number of steps for
//! every pair. Mean error over the library of what was tried, by N:
//!
//! | rule | 2 | 3 | 4 | 6 | 8 |
//! |---|---|---|---|---|---|
//! | midpoints of the thread, N per thread | 34 % | 25 % | 14 % | 8.9 % | 5.5 % |
//! | Gauss–Legendre on the visible part of each segment | 13 % | 7.1 % | 4.3 % | 1.9 % | 0.88 % |
//! | the same, cut at the highlight | 20 % | 13 % | 5.8 % | 1.9 % | 0.75 % |
//! | q = w sinh t, without exact areas | 5.0 % | 1.9 % | 0.86 % | 0.16 % | 0.05 % |
//! | q = w t/(1−t²), without exact areas | 3.5 % | 0.92 % | 0.30 % | 0.06 % | 0.015 % |
//! | q = w tan t, with them | 1.3 % | 0.30 % | 0.10 % | 0.02 % | 0.010 % |
//! | **q = w t/(1−t²), with them** | 1.15 % | 0.29 % | 0.095 % | 0.021 % | 0.009 % |
//!
//! c was tuned on the library (c ± 1 costs at most a fifth); on other pairs the errors are the same to 2 %.

use alloc::vec::Vec;
use core::f64::consts::FRAC_1_SQRT_2;

use super::{Optics, Response, TangentCurve, ThreadPair, tangent};
use crate::math::{Lanes, Real, norm2, splat};

/// Keeps quotients of nothing finite, in f32 too.
const TINY: f64 = 1e-30;
/// Keeps slopes and half-angle tangents finite.
const SMALL: f64 = 1e-6;

/// A thread's segments, prepared.
#[derive(Debug, Clone, PartialEq)]
pub struct PlacedNodes<R> {
    segments: Vec<Segment<R>>,
    /// Gauss–Legendre nodes and weights on \[−1, 1\].
    nodes: Vec<[R; 2]>,
    /// c/2.
    half_reach: R,
}

#[derive(Debug, Clone, PartialEq)]
struct Segment<R> {
    /// (cos o, sin o) of both ends.
    ends: [[R; 2]; 2],
    density: R,
}

impl<R: Real> PlacedNodes<R> {
    /// For the segments of `curve`, with the Gauss–Legendre `nodes` and weights on \[−1, 1\].
    pub fn new(curve: &TangentCurve<f64>, nodes: &[[f64; 2]]) -> Self {
        let end = |o: f64| {
            let (sin, cos) = num_traits::Float::sin_cos(o);
            [R::of(cos), R::of(sin)]
        };
        let segment = |segment: &tangent::Segment<f64>| Segment {
            ends: [end(segment.from), end(segment.to)],
            density: R::of(segment.weight / (segment.to - segment.from)),
        };
        Self {
            segments: curve.segments().iter().map(segment).collect(),
            nodes: nodes.iter().map(|node| node.map(R::of)).collect(),
            half_reach: R::of(0.5 * (3.0 + 0.5 * nodes.len() as f64)),
        }
    }

    /// N, the nodes per segment.
    pub fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Mean S and V of the segments over the whole thread's length.
    #[inline(always)]
    pub fn mean_response<L: Lanes>(&self, pair: &ThreadPair<L>, optics: &Optics<L>) -> Response<L> {
        let mut response = Response::zero();
        let highlight = Highlight::new(pair, optics, splat(self.half_reach));
        for segment in &self.segments {
            response = response.plus(
                splat(segment.density),
                highlight.segment(optics, segment, &self.nodes),
            );
        }
        response
    }
}

/// A pair in its highlight's frame.
struct Highlight<L> {
    pair: ThreadPair<L>,
    /// |H_nt|, cos ψ_H, sin ψ_H.
    h: L,
    cos: L,
    sin: L,
    /// Ends of the jointly visible tilts, and the width w of the map, in q.
    low: L,
    up: L,
    width: L,
}

/// An end of a segment: q, x = q/w, t and 1 − t².
struct End<L> {
    q: L,
    x: L,
    t: L,
    d: L,
}

impl<L: Lanes> Highlight<L> {
    #[inline(always)]
    fn new(pair: &ThreadPair<L>, optics: &Optics<L>, half_reach: L) -> Self {
        let (wi, wr) = (pair.wi(), pair.wr());
        let (h_t, h_n) = (wi[0] + wr[0], wi[2] + wr[2]);
        let h = norm2(h_t, h_n).max(L::of(TINY));
        let (cos, sin) = (h_n / h, h_t / h);
        let pair = pair.turned(cos, sin);
        let (wi, wr) = (pair.wi(), pair.wr());
        let x = wi[0].abs();
        let leans = L::zero().lt(wi[0]);
        let slope = h / (L::of(2.0) * norm2(wi[1], wi[2]).max(L::of(SMALL)));
        Self {
            h,
            cos,
            sin,
            low: -horizon(x, L::select(leans, wr[2], wi[2])),
            up: horizon(x, L::select(leans, wi[2], wr[2])),
            width: half_reach * optics.gamma_s / slope.max(L::of(1e-3)),
            pair,
        }
    }

    #[inline(always)]
    fn end<R: Real>(&self, [cos_o, sin_o]: &[R; 2]) -> End<L> {
        let (cos_o, sin_o) = (splat::<R, L>(*cos_o), splat::<R, L>(*sin_o));
        let cos = cos_o * self.cos - sin_o * self.sin;
        let sin = sin_o * self.cos + cos_o * self.sin;
        let q = (sin / (L::one() + cos).max(L::of(SMALL)))
            .min(self.up)
            .max(self.low);
        let x = q / self.width;
        let d = L::of(2.0) / (L::one() + (L::one() + L::of(4.0) * x * x).sqrt());
        End { q, x, t: x * d, d }
    }

    /// θ_h at an end. x_i' + x_r' = |H_nt| sin β: nothing cancels.
    #[inline(always)]
    fn theta_h(&self, q: L) -> L {
        let (cos, sin, _) = turn(q);
        let (wi, wr) = (self.pair.wi(), self.pair.wr());
        let cos_i = norm2(wi[1], cos * wi[2] - sin * wi[0]);
        let cos_r = norm2(wr[1], cos * wr[2] - sin * wr[0]);
        let cos_sum = cos_i + cos_r;
        (self.h * sin).atan2(cos_sum.max(L::of(TINY)))
    }

    /// ∫ S dδ and ∫ V dδ over a segment.
    #[inline(always)]
    fn segment<R: Real>(
        &self,
        optics: &Optics<L>,
        segment: &Segment<R>,
        nodes: &[[R; 2]],
    ) -> Response<L> {
        let (a, b) = (self.end(&segment.ends[0]), self.end(&segment.ends[1]));
        // t_b − t_a, and on one side of the highlight the same without cancellation.
        let product = a.t * b.t;
        let beside = (b.x - a.x) * a.d * b.d / (L::one() + product.max(L::zero()));
        let length = L::select(L::zero().lt(product), beside, b.t - a.t);
        let half = L::of(0.5) * length.max(L::zero());
        let middle = L::of(0.5) * (a.t + b.t);

        let mut sum = Response::zero();
        let mut isotropic = L::zero();
        let (mut surface_area, mut volume_area) = (L::zero(), L::zero());
        for [node, weight] in nodes {
            let t = middle + half * splat::<R, L>(*node);
            let d = L::one() / (L::one() - t * t);
            let (cos, sin, jacobian) = turn(self.width * t * d);
            let weight = splat::<R, L>(*weight) * (L::one() + t * t) * d * d * jacobian;
            let parts = self.pair.scatter(optics, cos, sin);
            sum.surface += weight * parts.surface;
            sum.volume += weight * parts.lobe;
            isotropic += weight * parts.isotropic;
            let slope = weight * parts.slope;
            surface_area += slope * parts.surface_lobe;
            volume_area += slope * parts.volume_lobe;
        }
        let scale = L::of(2.0) * half * self.width;
        let (theta_a, theta_b) = (self.theta_h(a.q), self.theta_h(b.q));
        let surface_area =
            lobe_area(optics.gamma_s, theta_a, theta_b) / summed(scale * surface_area);
        let volume_area = lobe_area(optics.gamma_v, theta_a, theta_b) / summed(scale * volume_area);
        Response {
            surface: scale * sum.surface * surface_area,
            volume: scale * (sum.volume * volume_area + isotropic),
        }
    }
}

/// A(γ).
#[inline(always)]
fn lobe_area<L: Lanes>(gamma: L, theta_a: L, theta_b: L) -> L {
    let k = L::of(FRAC_1_SQRT_2) / gamma;
    (L::of(0.5) * (erf(k * theta_b) - erf(k * theta_a))).max(L::zero())
}

/// What the nodes make of A(γ), to divide by.
#[inline(always)]
fn summed<L: Lanes>(area: L) -> L {
    area.max(L::zero()) + L::of(TINY)
}

/// q at which a direction with |x'| = `x` and z' = `z` passes behind the thread.
#[inline(always)]
fn horizon<L: Lanes>(x: L, z: L) -> L {
    let d = norm2(x, z) + z;
    ((d - x) / (d + x + L::of(TINY))).min(L::one())
}

/// (cos β, sin β) of q = tan(β/2), and 1/(1+q²).
#[inline(always)]
fn turn<L: Lanes>(q: L) -> (L, L, L) {
    let d = L::one() / (L::one() + q * q);
    ((L::one() - q * q) * d, L::of(2.0) * q * d, d)
}

/// The error function to 3e-7: M. Abramowitz, I. Stegun, *Handbook of Mathematical Functions*, 1964, 7.1.28.
#[inline(always)]
fn erf<L: Lanes>(x: L) -> L {
    const TERMS: [f64; 6] = [
        0.070_523_078_4,
        0.042_282_012_3,
        0.009_270_527_2,
        0.000_152_014_3,
        0.000_276_567_2,
        0.000_043_063_8,
    ];
    let a = x.abs().min(L::of(10.0));
    let mut sum = L::zero();
    for term in TERMS.into_iter().rev() {
        sum = (sum + L::of(term)) * a;
    }
    let r = L::one() / (L::one() + sum);
    let r2 = r * r;
    let r4 = r2 * r2;
    let r8 = r4 * r4;
    let value = L::one() - r8 * r8;
    L::select(x.lt(L::zero()), -value, value)
}
