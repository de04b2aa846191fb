//! Direct evaluation of reflectance models: the truth that tables approximate, and what it is compared with.
//!
//! [`Sadeghi`] is the truth. [`Lambert`], [`OrenNayar`], [`TorranceSparrow`] and [`IrawanMarschner`] are the other models of
//! \[Fecho13\] chapter 3, whose parameters a fabric's file may have.

mod adaptive;
mod irawan;
mod kind;
mod lambert;
mod mean;
mod oren_nayar;
mod pairs;
mod sadeghi;
mod sweep;
mod torrance_sparrow;
mod translate;

pub use adaptive::gauss_legendre;
pub use irawan::{IRAWAN_PRESETS, IrawanMarschner, IrawanPreset, SpineError};
pub use kind::ModelKind;
pub use mean::{AdaptiveMean, mean_response};
pub use sadeghi::{Rule, Sadeghi, sweep_parts};
pub use translate::irawan_of;

pub use crate::fabric::{Lambert, OrenNayar, TorranceSparrow};

use crate::brdf::without_cosine;
use crate::math::{Real, Vec3};

/// A reflectance model in the surface frame: x warp, y weft, z normal; `wi` to the light, `wr` to the viewer, unit.
pub trait Model<R: Real>: Sync {
    /// ρ = BRDF × cosine \[1/sr\], linear RGB; zero when either direction is not above the surface.
    fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R>;

    /// The BRDF \[1/sr\], linear RGB; zero when either direction is not above the surface.
    fn eval(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        without_cosine(self.eval_cos(wi, wr), wi[2])
    }
}

/// Whether both directions are above the surface.
fn are_above<R: Real>(wi: Vec3<R>, wr: Vec3<R>) -> bool {
    R::zero() < wi[2] && R::zero() < wr[2]
}

/// `x` as light: no directions at all (NaN) give none, infinite ones the most there is.
fn finite<R: Real>(x: R) -> R {
    x.max(R::zero()).min(R::MAX)
}
