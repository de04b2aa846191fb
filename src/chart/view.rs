//! Two coordinates of the direction to the viewer, for what does not depend on the light: the projection that Q sums.
//!
//! ```text
//! u₀ = θ_r / (π/2)            θ_r the polar angle from the normal
//! u₁ = (1 + φ_r / π) / 2      φ_r the azimuth from t towards s
//! ```

use core::f64::consts::{FRAC_PI_2, PI};

use super::{isotropic::polar, within};
use crate::math::{Lanes, Real, Vec3};

/// Direction to the first two coordinates of a box; the others are 0.
#[inline(always)]
pub(crate) fn coordinates<R: Lanes>(wr: Vec3<R>) -> [R; 4] {
    let phi = wr[1].atan2(wr[0]);
    [
        within(polar(wr) * R::of(1.0 / FRAC_PI_2)),
        within(phi.mul_add(R::of(0.5 / PI), R::of(0.5))),
        R::zero(),
        R::zero(),
    ]
}

/// The direction at these coordinates.
pub(crate) fn direction<R: Real>(u: [R; 4]) -> Vec3<R> {
    let (sin, cos) = (u[0] * R::of(FRAC_PI_2)).sin_cos();
    let (sin_phi, cos_phi) = ((R::of(2.0) * u[1] - R::one()) * R::of(PI)).sin_cos();
    [sin * cos_phi, sin * sin_phi, cos.max(R::zero())]
}
