//! Smooth analytic factors of S and V.
//!
//! What a table stores is S/F_S and V/F_V, where F has most of the shape of the response outside the highlight: how it
//! dies at the horizon, Fresnel, and the projection terms. The lookup multiplies F back. F must be smooth where S and V
//! are, so no tilt is ever clamped:
//!
//! ```text
//! p̄(ψ) = mean of max(cos(ψ+δ), 0) over the tangents            z̄ = r p̄,   m̄ = z̄/√(z̄²+y²)
//! P̄, M̄ = the blends 3.22 and 3.25 of p̄ and m̄
//! δ̄    = c + h tanh((−ψ_H − c)/h)                              the highlight's tilt, within the tangents' hull c ± h
//! F_S  = M̄ P̄ cos θ_i / cos² θ_d · F_r cos(φ̄_d/2)              with θ at δ̄ and φ̄ = atan2(y, z̄)
//! F_V  = M̄ P̄ cos θ_i / cos² θ_d · (1−F_r)² / (cos θ_i + cos θ_r)
//! ```

use super::cylinder::{blend, correlation};
use super::{Optics, Response, TangentCurve, ThreadPair, fresnel};
use crate::math::{Real, norm2};

/// The factors of one thread.
#[derive(Debug, Clone, PartialEq)]
pub struct Factors<R> {
    eta: R,
    centre: R,
    half_width: R,
}

impl<R: Real> Factors<R> {
    /// Prepares the factors of a thread.
    pub fn new(optics: &Optics<R>, tangents: &TangentCurve<R>) -> Self {
        let (low, high) = tangents.hull();
        let half = R::of(0.5);
        Self { eta: optics.eta, centre: half * (low + high), half_width: (half * (high - low)).max(R::of(1e-3)) }
    }

    /// F_S and F_V.
    #[inline(always)]
    pub fn at(&self, pair: &ThreadPair<R>, tangents: &TangentCurve<R>) -> Response<R> {
        let (wi, wr) = (pair.wi(), pair.wr());
        let (p_i, p_r) = (tangents.projection(wi), tangents.projection(wr));
        let half = R::of(0.5);
        let (z_i, z_r) = (norm2(wi[0], wi[2]) * p_i, norm2(wr[0], wr[2]) * p_r);
        let (n_i, n_r) = (norm2(wi[1], z_i), norm2(wr[1], z_r));
        if !(n_i > R::zero() && n_r > R::zero()) {
            return Response::zero();
        }
        let (sin_phi_i, m_i) = (wi[1] / n_i, z_i / n_i);
        let (sin_phi_r, m_r) = (wr[1] / n_r, z_r / n_r);
        let cos_half = half * norm2(sin_phi_i + sin_phi_r, m_i + m_r);
        let sin_half = half * norm2(sin_phi_i - sin_phi_r, m_i - m_r);
        let masking = blend(correlation(pair.sigma_u(), sin_half, cos_half), m_i, m_r);
        let visibility = blend(pair.correlation_psi(), p_i, p_r);

        let highlight = -(wi[0] + wr[0]).atan2(wi[2] + wr[2]);
        let tilt = self.centre + self.half_width * ((highlight - self.centre) / self.half_width).tanh();
        let (s, c) = tilt.sin_cos();
        let (x_i, x_r) = (c * wi[0] + s * wi[2], c * wr[0] + s * wr[2]);
        let cos_i = norm2(wi[1], c * wi[2] - s * wi[0]);
        let cos_r = norm2(wr[1], c * wr[2] - s * wr[0]);
        let (x_sum, cos_sum) = (x_i + x_r, cos_i + cos_r);
        let cos2_theta_d = R::of(0.25) * (x_sum * x_sum + cos_sum * cos_sum);
        let common = masking * visibility * cos_i / cos2_theta_d;
        let reflected = fresnel(self.eta, (cos2_theta_d.sqrt() * cos_half).min(R::one()));
        let entered = (R::one() - reflected) * (R::one() - reflected);
        Response { surface: common * reflected * cos_half, volume: common * entered / cos_sum }
    }
}
