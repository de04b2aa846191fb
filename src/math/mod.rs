//! Small vectors, and numbers: one or several side by side.
//!
//! The closed forms above are written once, without branches, over [`Lanes`]: a number of one precision (`f64` where
//! exactness counts, `f32`), or as many `f32` as a vector register holds ([`simd`]). What needs branches or angles is
//! written over [`Real`], a single number. The one switch between `std` and `libm` is here, in `num_traits`.

mod real;
mod root;
pub mod simd;

pub use real::{Real, splat};
pub(crate) use root::root;

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

/// Numbers that are computed with side by side; masks choose between them where scalar code would branch.
pub trait Lanes:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
{
    /// The result of a comparison, lane by lane.
    type Mask: Copy;

    /// The nearest value to a literal, in every lane.
    fn of(x: f64) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// 1/`self`, of normal numbers whose reciprocal is normal; where it is fast to within a unit in the last place or two.
    #[inline(always)]
    fn reciprocal(self) -> Self {
        Self::one() / self
    }
    /// The square root and its reciprocal, likewise.
    #[inline(always)]
    fn sqrt_and_reciprocal(self) -> (Self, Self) {
        let root = self.sqrt();
        (root, Self::one() / root)
    }
    /// The absolute value.
    fn abs(self) -> Self;
    /// The smaller; `other` where `self` is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger; `other` where `self` is NaN.
    fn max(self, other: Self) -> Self;
    /// `self · factor + term`, fused where that is free.
    fn mul_add(self, factor: Self, term: Self) -> Self;
    /// Whether `self` < `other`; not where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// Where both are.
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// `a` where `mask` is, else `b`.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// The angle of the point (`x`, `self`), in ±π.
    fn atan2(self, x: Self) -> Self;
    /// 2 atan(`self`), of numbers within ±1: an angle by the tangent of its half, which takes neither quadrants nor a division.
    fn twice_atan(self) -> Self;
    /// e to the power of `self`.
    fn exp(self) -> Self;
    /// The sine, of angles within ±1000.
    fn sin(self) -> Self;
    /// The cosine, of angles within ±1000.
    fn cos(self) -> Self;

    /// 0.
    #[inline(always)]
    fn zero() -> Self {
        Self::of(0.0)
    }

    /// 1.
    #[inline(always)]
    fn one() -> Self {
        Self::of(1.0)
    }
}

/// A direction or vector `[x, y, z]`.
pub type Vec3<R> = [R; 3];

/// Scalar product.
#[inline(always)]
pub fn dot<R: Lanes>(a: Vec3<R>, b: Vec3<R>) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// `f` of every component. (Inlined for certain, which `map` of arrays is not: see [`simd::Kernel`].)
#[inline(always)]
pub fn each<A, B>([x, y, z]: [A; 3], f: impl Fn(A) -> B) -> [B; 3] {
    [f(x), f(y), f(z)]
}

/// √(x² + y²) without the scaling of `hypot`: directions are unit vectors, so nothing overflows, and squares that
/// underflow belong to components that no longer matter.
#[inline(always)]
pub fn norm2<R: Lanes>(x: R, y: R) -> R {
    (x * x + y * y).sqrt()
}

/// x² + y², fused where that is free.
#[inline(always)]
pub fn square2<R: Lanes>(x: R, y: R) -> R {
    x.mul_add(x, y * y)
}

/// `v` scaled to unit length, or `None` when it is zero, infinite or NaN.
pub fn normalized<R: Real>(v: Vec3<R>) -> Option<Vec3<R>> {
    // Scaling by the largest component first keeps denormal and huge input exact.
    let largest = v[0].abs().max(v[1].abs()).max(v[2].abs());
    if !(largest > R::zero()) || !v.iter().all(|x| x.to_double().is_finite()) {
        return None;
    }
    let v = v.map(|x| x / largest);
    let length = dot(v, v).sqrt();
    Some(v.map(|x| x / length))
}
