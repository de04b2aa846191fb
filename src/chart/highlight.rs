//! The highlight chart: (ψ, θ_d, φ_d, φ_h) with ψ = atan2(H·t, H·n) of the half vector H = wi + wr.
//!
//! ```text
//! u₀ = (1 + ψ / (π/2)) / 2
//! ```
//!
//! A segment tilted by δ has its highlight at exactly ψ = −δ, since in its frame 2 sin θ_h cos θ_d = |H_nt| sin(ψ + δ).
//! So only this axis is sharp, and the ends of a thread's segments are planes of the box.
//!
//! The inverse knows ψ but not θ_h, on which the range of θ_d depends. It is the one root in [0, π/2] (for ψ ≥ 0; the
//! other half by symmetry) of
//!
//! ```text
//! cos ψ · 2 sin θ_h cos θ_d − sin ψ · (cos θ_i cos φ_i + cos θ_r cos φ_r),   θ_d = (2u₁ − 1)(π/2 − θ_h)
//! ```
//!
//! which is not positive at 0 and not negative at π/2; it is found by safeguarded secant steps to the last bit or two.

use super::{
    Angles, Rim, TINY, directions_at, of_quarters, phi_d_and_h, shared_coordinates, theta_d,
};
use core::f64::consts::FRAC_PI_2;

use crate::math::{Lanes, Real, Vec3, norm2, root};

/// Pair to box, and its angles; see [`super::Chart::coordinates`].
#[inline(always)]
pub(super) fn coordinates<R: Lanes>(rim: Rim, wi: Vec3<R>, wr: Vec3<R>) -> ([R; 4], Angles<R>) {
    let angles = Angles::of(wi, wr);
    let [u1, u2, u3] = shared_coordinates(rim.end(), &angles);
    ([first(wi, wr), u1, u2, u3], angles)
}

/// u₀.
#[inline(always)]
pub(super) fn first<R: Lanes>(wi: Vec3<R>, wr: Vec3<R>) -> R {
    let (h_t, h_n) = (wi[0] + wr[0], wi[2] + wr[2]);
    let psi = (h_t / (norm2(h_t, h_n) + h_n).max(R::of(TINY))).twice_atan();
    of_quarters(psi)
}

/// Box to pair; see [`super::Chart::directions`].
pub(crate) fn directions<R: Real>(rim: Rim, u: [R; 4]) -> (Vec3<R>, Vec3<R>) {
    let psi = (R::of(2.0) * u[0] - R::one()) * R::of(FRAC_PI_2);
    let (phi_d, phi_h) = phi_d_and_h(rim, u);
    let half = R::of(0.5);
    let (cos_i, cos_r) = ((phi_h + half * phi_d).cos(), (phi_h - half * phi_d).cos());
    let (sin_psi, cos_psi) = psi.abs().sin_cos();
    // For ψ < 0 the pair mirrored along t has θ_d of the other sign.
    let mirrored = [
        u[0],
        if psi < R::zero() {
            R::one() - u[1]
        } else {
            u[1]
        },
        u[2],
        u[3],
    ];
    let theta_h = root(R::zero(), R::of(FRAC_PI_2), R::zero(), |theta_h| {
        let theta_d = theta_d(mirrored, theta_h);
        cos_psi * R::of(2.0) * theta_h.sin() * theta_d.cos()
            - sin_psi * ((theta_h + theta_d).cos() * cos_i + (theta_h - theta_d).cos() * cos_r)
    });
    let theta_h = if psi < R::zero() { -theta_h } else { theta_h };
    directions_at(rim, u, theta_h)
}
