//! Three coordinates of a pair for cloth that is the same in all directions.
//!
//! With the polar angles θ_i and θ_r from the normal and the azimuth Δφ between the directions,
//!
//! ```text
//! u₀ = (θ_i + θ_r) / π
//! u₁ = (1 + (θ_i − θ_r) / min(θ_i + θ_r, π − θ_i − θ_r)) / 2
//! u₂ = |Δφ| / π
//! ```
//!
//! The mirror directions, where H is the normal and light comes back from threads of every direction, are the edge u₁ = ½,
//! u₂ = 1, and the horizon is the two faces of u₁ beyond u₀ = ½.

use core::f64::consts::PI;

use super::{NARROW, within};
use crate::math::{Lanes, Real, Vec3, norm2};

/// Pair to the first three coordinates of a box; the fourth is 0.
#[inline(always)]
pub(crate) fn coordinates<R: Lanes>(wi: Vec3<R>, wr: Vec3<R>) -> [R; 4] {
    let (theta_i, theta_r) = (polar(wi), polar(wr));
    let sum = theta_i + theta_r;
    let range = sum.min(R::of(PI) - sum).max(R::of(NARROW));
    let half = R::of(0.5);
    let cross = wi[0] * wr[1] - wi[1] * wr[0];
    let azimuth = cross.abs().atan2(wi[0] * wr[0] + wi[1] * wr[1]);
    [
        within(sum * R::of(1.0 / PI)),
        within(half + half * (theta_i - theta_r) / range),
        within(azimuth * R::of(1.0 / PI)),
        R::zero(),
    ]
}

/// The angle from the normal of a direction above the surface.
#[inline(always)]
pub(super) fn polar<R: Lanes>(w: Vec3<R>) -> R {
    (norm2(w[0], w[1]) / (R::one() + w[2])).twice_atan()
}

/// A pair at these coordinates, the light at azimuth 0.
pub(crate) fn directions<R: Real>(u: [R; 4]) -> (Vec3<R>, Vec3<R>) {
    let half = R::of(0.5);
    let sum = u[0] * R::of(PI);
    let range = sum.min(R::of(PI) - sum);
    let difference = (R::of(2.0) * u[1] - R::one()) * range;
    let at = |theta: R, phi: R| {
        let (sin, cos) = theta.sin_cos();
        let (sin_phi, cos_phi) = phi.sin_cos();
        // The horizon is in the box and cos 90° must not round below it.
        [sin * cos_phi, sin * sin_phi, cos.max(R::zero())]
    };
    (
        at(half * (sum + difference), R::zero()),
        at(half * (sum - difference), u[2] * R::of(PI)),
    )
}
