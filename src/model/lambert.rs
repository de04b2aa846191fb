//! Lambert's model: light that has forgotten where it came from.
//!
//! ```text
//! f = A / π                                                          [Fecho13] 3.1
//! ```
//!
//! Reciprocal, and energy conserving where A ≤ 1.

use std::f64::consts::FRAC_1_PI;

use super::{Model, are_above, finite};
use crate::fabric::Lambert;
use crate::math::{Real, Vec3, each};

impl<R: Real> Model<R> for Lambert {
    fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        if !are_above(wi, wr) {
            return [R::zero(); 3];
        }
        let cos = R::of(FRAC_1_PI) * wi[2];
        each(self.albedo, |albedo| finite(R::of(albedo) * cos))
    }
}
