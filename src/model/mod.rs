//! Direct evaluation of reflectance models: the truth that tables approximate.

mod adaptive;
mod sadeghi;

pub use adaptive::{gauss_legendre, mean_response};
pub use sadeghi::{Rule, Sadeghi};

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
