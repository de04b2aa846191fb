//! The Torrance–Sparrow model: mirror facets over a diffuse base.
//!
//! ```text
//! f = k_d A/π + k_s F(wi·h) D(h) G(wi, wr) / (4 cos θ_i cos θ_r)     [Fecho13] 3.3
//!
//! Beckmann    D = exp(−(h_x²/α_x² + h_y²/α_y²)/h_z²) / (π α_x α_y h_z⁴)
//! GGX         D = 1 / (π α_x α_y (h_x²/α_x² + h_y²/α_y² + h_z²)²)
//! V-cavity    G = min(1, 2 h_z cos θ_r/(wr·h), 2 h_z cos θ_i/(wr·h))
//! Smith       G = 1 / (1 + Λ(wi) + Λ(wr))
//! Schlick     F = F_0 + (1 − F_0)(1 − wi·h)⁵,   F_0 = ((η−1)/(η+1))²
//! ```
//!
//! Λ is exact for GGX; for Beckmann it is the rational approximation of Walter, Marschner, Li and Torrance, *Microfacet Models
//! for Refraction through Rough Surfaces* (EGSR 2007), good to 0.4 %.
//!
//! Reciprocal, and energy conserving where k_d A + k_s ≤ 1.

use std::f64::consts::{FRAC_1_PI, PI};

use super::{Model, are_above, finite};
use crate::brdf::fresnel;
use crate::fabric::{Distribution, FresnelTerm, Shadowing, TorranceSparrow};
use crate::math::{Real, Vec3, dot, normalized};

impl<R: Real> Model<R> for TorranceSparrow {
    fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        if !are_above(wi, wr) {
            return [R::zero(); 3];
        }
        let diffuse = R::of(FRAC_1_PI) * wi[2];
        let specular = finite(self.specular_cos(wi, wr));
        [0, 1, 2].map(|channel| {
            let [k_d, k_s] = [self.diffuse, self.specular].map(|k| R::of(k[channel]));
            finite(k_d * diffuse + k_s * specular)
        })
    }
}

impl TorranceSparrow {
    /// F D G / (4 cos θ_r).
    fn specular_cos<R: Real>(&self, wi: Vec3<R>, wr: Vec3<R>) -> R {
        let Some(h) = normalized([wi[0] + wr[0], wi[1] + wr[1], wi[2] + wr[2]]) else {
            return R::zero();
        };
        let cos_d = dot(wr, h).max(R::zero()).min(R::one());
        let quarter = R::of(0.25);
        quarter
            * self.reflectance(cos_d)
            * self.density(h)
            * self.visible_over_cos(wi, wr, h, cos_d)
    }

    /// F.
    fn reflectance<R: Real>(&self, cos: R) -> R {
        match self.fresnel {
            FresnelTerm::Dielectric => fresnel(R::of(self.eta * self.eta - 1.0), cos).0,
            FresnelTerm::Schlick => {
                let f0 = ((self.eta - 1.0) / (self.eta + 1.0)).powi(2);
                let x = R::one() - cos;
                R::of(f0) + R::of(1.0 - f0) * (x * x) * (x * x) * x
            }
        }
    }

    /// D.
    fn density<R: Real>(&self, h: Vec3<R>) -> R {
        let (x, y) = (h[0] / R::of(self.alpha_x), h[1] / R::of(self.alpha_y));
        let slope2 = x * x + y * y;
        let cos2 = h[2] * h[2];
        let scale = R::of(1.0 / (PI * self.alpha_x * self.alpha_y));
        match self.distribution {
            Distribution::Beckmann => scale * ((-slope2 / cos2).exp() / cos2) / cos2,
            Distribution::Ggx => scale / ((slope2 + cos2) * (slope2 + cos2)),
        }
    }

    /// G / cos θ_r, by quotients that stay bounded where cosines vanish.
    fn visible_over_cos<R: Real>(&self, wi: Vec3<R>, wr: Vec3<R>, h: Vec3<R>, cos_d: R) -> R {
        match self.shadowing {
            Shadowing::VCavity => {
                let groove = R::of(2.0) * h[2] / cos_d;
                (R::one() / wr[2]).min(groove * R::one().min(wi[2] / wr[2]))
            }
            Shadowing::Smith => {
                let hidden = self.hidden(wi) * (wr[2] / wi[2]) + self.hidden(wr);
                R::one() / (wr[2] + hidden)
            }
        }
    }

    /// cos θ · Λ.
    fn hidden<R: Real>(&self, w: Vec3<R>) -> R {
        let (x, y) = (w[0] * R::of(self.alpha_x), w[1] * R::of(self.alpha_y));
        let across2 = x * x + y * y;
        match self.distribution {
            Distribution::Ggx => R::of(0.5) * ((w[2] * w[2] + across2).sqrt() - w[2]),
            Distribution::Beckmann => {
                let across = across2.sqrt();
                // 1 / (α tan θ)
                let a = w[2] / across;
                if !(a < R::of(1.6)) {
                    return R::zero();
                }
                let over = R::one() - R::of(1.259) * a + R::of(0.396) * a * a;
                across * over / (R::of(3.535) + R::of(2.181) * a)
            }
        }
    }
}
