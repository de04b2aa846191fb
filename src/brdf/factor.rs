//! Smooth analytic factors of S and V.
//!
//! What a table stores is S/F_S and V/F_V, where F has most of the shape of the response outside the highlight: how it
//! dies at the horizon and where one part of the thread hides another, Fresnel, and the cosines. The lookup multiplies F
//! back. F has to vanish where and as fast as the response does, and to be smooth elsewhere:
//!
//! ```text
//! P̄    = mean of P over the segments, in closed form
//! p̃    = mean p² / mean p over the tilts visible from both directions,    z̃ = r p̃,   m̃ = z̃/√(z̃²+y²)
//! M̃    = the blend 3.22 of m̃_i and m̃_r
//! δ̄    = c + h tanh((−ψ_H − c)/h)              the highlight's tilt, softly kept within the segments' hull c ± h
//! F_S  = M̃ P̄ cos θ_i / cos² θ_d · F_r cos(φ̃_d/2)              with θ at δ̄ and φ̃ = atan2(y, z̃)
//! F_V  = M̃ P̄ cos θ_i / cos² θ_d · (1−F_r)² / (cos θ_i + cos θ_r)
//! ```
//!
//! Where the visible tilts shrink to a sliver of width ε, p runs linearly from 0 to ε across it and M P is a mean of p²:
//! p̄ p̃ = (ε²/2)(2ε/3) = ε³/3 is that mean exactly, and S/F stays bounded. With separate means of p_i and p_r, S/F
//! would tend to 0 where light and viewer see different parts of the thread, and to infinity at the sliver.
//!
//! What the factors buy, mean error of ρ with F = 1 and with F, grids of cubic interpolation and √ encoding:
//!
//! | | at most 4 MiB | at most 512 KiB |
//! |---|---|---|
//! | denim | 0.118 % → 0.073 % | 0.53 % → 0.26 % |
//! | polka-dot lining, pink | 0.245 % → 0.277 % | 2.1 % → 1.3 % |
//! | corduroy | 0.194 % → 0.169 % | – |
//! | velvet | 1.65 % → 0.63 % | 5.8 % → 1.9 % |

use super::cylinder::masking;
use super::{Optics, Response, TangentCurve, ThreadPair, fresnel};
use crate::math::{Real, norm2};

/// F_S and F_V of one thread's segments.
#[derive(Debug, Clone, PartialEq)]
pub struct Factors<R> {
    eta: R,
    centre: R,
    half_width: R,
}

/// Keeps δ̄ defined for a hull of one point.
const LEAST_HALF_WIDTH: f64 = 1e-3;

impl<R: Real> Factors<R> {
    /// Prepares the factors of a thread.
    pub fn new(optics: &Optics<R>, tangents: &TangentCurve<R>) -> Self {
        let (low, high) = tangents.hull();
        let half = R::of(0.5);
        Self {
            eta: optics.eta,
            centre: half * (low + high),
            half_width: (half * (high - low)).max(R::of(LEAST_HALF_WIDTH)),
        }
    }

    /// F_S and F_V for a pair; zero where no tilt is visible from both directions.
    #[inline(always)]
    pub fn at(&self, pair: &ThreadPair<R>, tangents: &TangentCurve<R>) -> Response<R> {
        let (wi, wr) = (pair.wi(), pair.wr());
        let joint = tangents.joint_visibility(wi, wr, pair.correlation_psi());
        let (z_i, z_r) = (
            norm2(wi[0], wi[2]) * joint.facing_i,
            norm2(wr[0], wr[2]) * joint.facing_r,
        );
        if !(z_i > R::zero() && z_r > R::zero()) {
            return Response::zero();
        }
        let (n_i, n_r) = (norm2(wi[1], z_i), norm2(wr[1], z_r));
        let (phi_i, phi_r) = ((wi[1] / n_i, z_i / n_i), (wr[1] / n_r, z_r / n_r));
        let (masking, cos_half) = masking(pair.sigma_u(), phi_i, phi_r);

        let highlight = -(wi[0] + wr[0]).atan2(wi[2] + wr[2]);
        let tilt =
            self.centre + self.half_width * ((highlight - self.centre) / self.half_width).tanh();
        let (sin, cos) = tilt.sin_cos();
        let (x_i, x_r) = (cos * wi[0] + sin * wi[2], cos * wr[0] + sin * wr[2]);
        let cos_i = norm2(wi[1], cos * wi[2] - sin * wi[0]);
        let cos_r = norm2(wr[1], cos * wr[2] - sin * wr[0]);
        let (x_sum, cos_sum) = (x_i + x_r, cos_i + cos_r);
        let cos2_theta_d = R::of(0.25) * (x_sum * x_sum + cos_sum * cos_sum);
        let common = masking * joint.projection * cos_i / cos2_theta_d;
        let reflected = fresnel(self.eta, (cos2_theta_d.sqrt() * cos_half).min(R::one()));
        let entered = (R::one() - reflected) * (R::one() - reflected);
        Response {
            surface: common * reflected * cos_half,
            volume: common * entered / cos_sum,
        }
    }
}
