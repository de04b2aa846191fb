//! Single numbers: `f32` and `f64`.

use core::ops::SubAssign;

use num_traits::Float;

use super::Lanes;

/// The floating-point types sateen computes in one at a time: `f32` and `f64`.
pub trait Real: Lanes<Mask = bool> + PartialOrd + SubAssign + Send + Sync + 'static {
    /// The distance from 1 to the next larger number.
    const EPSILON: Self;
    /// The largest finite number.
    const MAX: Self;

    /// This value as `f64`, exactly.
    fn to_double(self) -> f64;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
}

macro_rules! real {
    ($float:ident) => {
        impl Lanes for $float {
            type Mask = bool;

            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $float
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                Float::sqrt(self)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Float::abs(self)
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                self * factor + term
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn both(a: bool, b: bool) -> bool {
                a & b
            }
            #[inline(always)]
            fn select(mask: bool, a: Self, b: Self) -> Self {
                if mask { a } else { b }
            }
            #[inline(always)]
            fn atan2(self, x: Self) -> Self {
                Float::atan2(self, x)
            }
            #[inline(always)]
            fn twice_atan(self) -> Self {
                2.0 * Float::atan(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                Float::exp(self)
            }
            #[inline(always)]
            fn sin(self) -> Self {
                Float::sin(self)
            }
            #[inline(always)]
            fn cos(self) -> Self {
                Float::cos(self)
            }
        }

        impl Real for $float {
            const EPSILON: Self = $float::EPSILON;
            const MAX: Self = $float::MAX;

            #[inline(always)]
            fn to_double(self) -> f64 {
                self.into()
            }
            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                Float::sin_cos(self)
            }
        }
    };
}

real!(f32);
real!(f64);

/// The same number in every lane.
#[inline(always)]
pub fn splat<R: Real, L: Lanes>(x: R) -> L {
    L::of(x.to_double())
}
