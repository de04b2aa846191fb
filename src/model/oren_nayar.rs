//! The Oren–Nayar model: V-cavities of Lambertian facets.
//!
//! ```text
//! f = A/π (a + b max(0, cos(φ_i − φ_r)) sin α tan β)                 [Fecho13] 3.2
//! a = 1 − σ²/2 / (σ² + 0.33),   b = 0.45 σ² / (σ² + 0.09),   α = max(θ_i, θ_r),   β = min(θ_i, θ_r)
//! ```
//!
//! This is the qualitative model of Oren and Nayar, *Generalization of Lambert's Reflectance Model* (SIGGRAPH 1994), without
//! light that facets scatter to each other. With s = sin θ_i sin θ_r cos(φ_i − φ_r), the scalar product of the directions'
//! parts in the surface, sin α tan β cos(φ_i − φ_r) is s over the larger cosine: there are no angles to take.
//!
//! Reciprocal. For A = 1 and σ about 12° it reflects up to 1.5 % more than arrives at grazing angles, where a + b/2 exceeds 1.

use std::f64::consts::FRAC_1_PI;

use super::{Model, are_above, finite};
use crate::fabric::OrenNayar;
use crate::math::{Real, Vec3, each};

impl<R: Real> Model<R> for OrenNayar {
    fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        if !are_above(wi, wr) {
            return [R::zero(); 3];
        }
        let sigma2 = self.sigma * self.sigma;
        let a = 1.0 - 0.5 * sigma2 / (sigma2 + 0.33);
        let b = 0.45 * sigma2 / (sigma2 + 0.09);
        let s = (wi[0] * wr[0] + wi[1] * wr[1]).max(R::zero());
        // The cosine goes into the quotient, which is then at most s.
        let facing = R::of(a) * wi[2] + R::of(b) * s * (wi[2] / wi[2].max(wr[2]));
        let share = R::of(FRAC_1_PI) * facing;
        each(self.albedo, |albedo| finite(R::of(albedo) * share))
    }
}
