//! The chart of the thesis: (θ_h, θ_d, φ_d, roll).
//!
//! ```text
//! u₀ = (1 + θ_h / (π/2)) / 2
//! ```
//!
//! Departure: the thesis' ψ cannot be the fourth coordinate, since it is 0 for every roll at θ = 0 and the map has no
//! inverse there. The roll of the pair about the thread, φ_h = (φ_i + φ_r)/2, takes its place.

use super::{Angles, Rim, directions_at, of_quarters, shared_coordinates};
use core::f64::consts::FRAC_PI_2;

use crate::math::{Lanes, Real, Vec3};

/// Pair to box, and its angles; see [`super::Chart::coordinates`].
#[inline(always)]
pub(super) fn coordinates<R: Lanes>(rim: Rim, wi: Vec3<R>, wr: Vec3<R>) -> ([R; 4], Angles<R>) {
    let angles = Angles::of(wi, wr);
    let [u1, u2, u3] = shared_coordinates(rim.end(), &angles);
    ([first(&angles), u1, u2, u3], angles)
}

/// u₀.
#[inline(always)]
pub(super) fn first<R: Lanes>(angles: &Angles<R>) -> R {
    of_quarters(angles.theta_h)
}

/// Box to pair; see [`super::Chart::directions`].
pub(crate) fn directions<R: Real>(rim: Rim, u: [R; 4]) -> (Vec3<R>, Vec3<R>) {
    let theta_h = (R::of(2.0) * u[0] - R::one()) * R::of(FRAC_PI_2);
    directions_at(rim, u, theta_h)
}
