//! Small vectors and the one switch between `std` and `libm`.
//!
//! Everything above is written once over [`Real`] and used as `f32` where speed counts (lookup) and as `f64` where
//! exactness does (baking, reference).

use core::fmt::Debug;
use num_traits::{Float, FloatConst, NumAssign};

/// The floating-point types sateen computes in: `f32` and `f64`.
pub trait Real: Float + FloatConst + NumAssign + Debug + Send + Sync + 'static {
    /// The nearest value of this type to a literal.
    fn of(x: f64) -> Self;
    /// This value as `f64`, exactly.
    fn to_double(self) -> f64;
}

impl Real for f32 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        x as f32
    }
    #[inline(always)]
    fn to_double(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    #[inline(always)]
    fn of(x: f64) -> Self {
        x
    }
    #[inline(always)]
    fn to_double(self) -> f64 {
        self
    }
}

/// A direction or vector `[x, y, z]`.
pub type Vec3<R> = [R; 3];

/// Scalar product.
#[inline(always)]
pub fn dot<R: Real>(a: Vec3<R>, b: Vec3<R>) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// √(x² + y²) without the scaling of `hypot`: directions are unit vectors, so nothing overflows, and squares that
/// underflow belong to components that no longer matter.
#[inline(always)]
pub fn norm2<R: Real>(x: R, y: R) -> R {
    (x * x + y * y).sqrt()
}

/// `v` scaled to unit length, or `None` when it is zero, infinite or NaN.
pub fn normalized<R: Real>(v: Vec3<R>) -> Option<Vec3<R>> {
    // Scaling by the largest component first keeps denormal and huge input exact.
    let largest = v[0].abs().max(v[1].abs()).max(v[2].abs());
    if !(largest > R::zero()) || !v.iter().all(|x| x.is_finite()) {
        return None;
    }
    let v = v.map(|x| x / largest);
    let length = dot(v, v).sqrt();
    Some(v.map(|x| x / length))
}
