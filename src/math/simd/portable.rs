//! One lane, and eight in an array.

use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::{Row, Vector, approx};
use crate::math::Lanes;

/// One `f32` with the approximations of the other vectors: what looks up one pair of directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Single(pub f32);

/// Eight `f32` in an array.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Eight([f32; 8]);

/// 1.5 · 2²³: adding and subtracting it rounds to integers.
const ROUNDER: f32 = 12_582_912.0;

macro_rules! operator {
    ($type:ident, $trait:ident, $method:ident) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| $trait::$method(a, b))
            }
        }
    };
}

macro_rules! portable {
    ($type:ident, $lanes:literal) => {
        operator!($type, Add, add);
        operator!($type, Sub, sub);
        operator!($type, Mul, mul);
        operator!($type, Div, div);

        impl Neg for $type {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                self.map(|x| -x)
            }
        }

        impl AddAssign for $type {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl Lanes for $type {
            type Mask = [bool; $lanes];

            #[inline(always)]
            fn of(x: f64) -> Self {
                Self::from([x as f32; $lanes])
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                self.map(Lanes::sqrt)
            }
            #[inline(always)]
            fn abs(self) -> Self {
                self.map(Lanes::abs)
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.zip(other, Lanes::min)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.zip(other, Lanes::max)
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                self * factor + term
            }
            #[inline(always)]
            fn lt(self, other: Self) -> Self::Mask {
                let (a, b) = (self.array(), other.array());
                core::array::from_fn(|k| a[k] < b[k])
            }
            #[inline(always)]
            fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
                core::array::from_fn(|k| a[k] & b[k])
            }
            #[inline(always)]
            fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
                let (a, b) = (a.array(), b.array());
                Self::from(core::array::from_fn(|k| if mask[k] { a[k] } else { b[k] }))
            }
            #[inline(always)]
            fn atan2(self, x: Self) -> Self {
                approx::atan2(self, x)
            }
            #[inline(always)]
            fn twice_atan(self) -> Self {
                approx::twice_atan(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                approx::exp(self)
            }
            #[inline(always)]
            fn sin(self) -> Self {
                approx::sin(self)
            }
            #[inline(always)]
            fn cos(self) -> Self {
                approx::sin(self + Self::of(core::f64::consts::FRAC_PI_2))
            }
        }

        impl Vector for $type {
            const LANES: usize = $lanes;
            type Array = [f32; $lanes];
            type Index = [u32; $lanes];
            type IndexArray = [u32; $lanes];

            #[inline(always)]
            fn from_array(array: Self::Array) -> Self {
                Self::from(array)
            }
            #[inline(always)]
            fn to_array(self) -> Self::Array {
                self.array()
            }
            #[inline(always)]
            fn index_to_array(index: Self::Index) -> Self::IndexArray {
                index
            }
            #[inline(always)]
            fn truncate(self) -> Self::Index {
                self.array().map(|x| x as u32)
            }
            #[inline(always)]
            fn round(self) -> Self {
                self.map(|x| (x + ROUNDER) - ROUNDER)
            }
            #[inline(always)]
            fn exp2_integer(self) -> Self {
                self.map(|x| f32::from_bits(((x as i32 + 127) as u32) << 23))
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                const SIGN: u32 = 1 << 31;
                self.zip(sign, |x, sign| {
                    f32::from_bits((x.to_bits() & !SIGN) | (sign.to_bits() & SIGN))
                })
            }
            #[inline(always)]
            fn gather(table: &[u32], index: Self::Index) -> Self::Index {
                let last = table.len() - 1;
                index.map(|index| table[(index as usize).min(last)])
            }
        }
    };
}

portable!(Single, 1);
portable!(Eight, 8);

impl Single {
    #[inline(always)]
    fn from([x]: [f32; 1]) -> Self {
        Self(x)
    }
    #[inline(always)]
    fn array(self) -> [f32; 1] {
        [self.0]
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(f(self.0))
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(f(self.0, other.0))
    }
}

impl Eight {
    #[inline(always)]
    fn from(lanes: [f32; 8]) -> Self {
        Self(lanes)
    }
    #[inline(always)]
    fn array(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(self.0.map(f))
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(core::array::from_fn(|k| f(self.0[k], other.0[k])))
    }
}

impl Row for Eight {
    const IS_PORTABLE: bool = true;

    #[inline(always)]
    fn widen_i16(row: &[i16; 8]) -> Self {
        Self(row.map(f32::from))
    }
    #[inline(always)]
    fn widen_i8(row: &[i8; 8]) -> Self {
        Self(row.map(f32::from))
    }
}
