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

/// Of a slice that vectors are loaded from.
const AS_MANY: &str = "as many numbers as lanes";

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

            #[inline(always)]
            fn from_array(array: Self::Array) -> Self {
                Self::from(array)
            }
            #[inline(always)]
            fn to_array(self) -> Self::Array {
                self.array()
            }
            #[inline(always)]
            fn load(from: &[f32]) -> Self {
                Self::from(*from.first_chunk().expect(AS_MANY))
            }
            #[inline(always)]
            fn store(self, to: &mut [f32]) {
                to[..$lanes].copy_from_slice(&self.array());
            }
            #[inline(always)]
            fn load_index(from: &[u32]) -> Self::Index {
                *from.first_chunk().expect(AS_MANY)
            }
            #[inline(always)]
            fn store_index(index: Self::Index, to: &mut [u32]) {
                to[..$lanes].copy_from_slice(&index);
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
            fn floor(self) -> Self {
                // Rounded, and one less where that went up.
                self.map(|x| {
                    let rounded = (x + ROUNDER) - ROUNDER;
                    if x < rounded { rounded - 1.0 } else { rounded }
                })
            }
            #[inline(always)]
            fn to_index(self) -> Self::Index {
                self.round().truncate()
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
            #[inline(always)]
            fn look_up(table: &[f32; 16], index: Self::Index) -> Self {
                Self::from(index.map(|index| table[index as usize & 15]))
            }
            #[inline(always)]
            fn of_bits(index: Self::Index) -> Self {
                Self::from(index.map(f32::from_bits))
            }
            #[inline(always)]
            fn splat_index(index: u32) -> Self::Index {
                [index; $lanes]
            }
            #[inline(always)]
            fn and(index: Self::Index, mask: u32) -> Self::Index {
                index.map(|index| index & mask)
            }
            #[inline(always)]
            fn or(a: Self::Index, b: Self::Index) -> Self::Index {
                core::array::from_fn(|k| a[k] | b[k])
            }
            #[inline(always)]
            fn shift_up<const BITS: u32>(index: Self::Index) -> Self::Index {
                index.map(|index| index << BITS)
            }
            #[inline(always)]
            fn shift_down<const BITS: u32>(index: Self::Index) -> Self::Index {
                index.map(|index| index >> BITS)
            }
            #[inline(always)]
            fn plus(a: Self::Index, b: Self::Index) -> Self::Index {
                core::array::from_fn(|k| a[k].wrapping_add(b[k]))
            }
            #[inline(always)]
            fn minus(a: Self::Index, b: Self::Index) -> Self::Index {
                core::array::from_fn(|k| a[k].wrapping_sub(b[k]))
            }
            #[inline(always)]
            fn times(a: Self::Index, b: Self::Index) -> Self::Index {
                core::array::from_fn(|k| a[k].wrapping_mul(b[k]))
            }
            #[inline(always)]
            fn by_parity(index: Self::Index, even: Self::Index, odd: Self::Index) -> Self::Index {
                core::array::from_fn(|k| if index[k] & 1 == 1 { odd[k] } else { even[k] })
            }
            #[inline(always)]
            fn columns(rows: &[[f32; 8]]) -> [Self; 6] {
                let rows: &[[f32; 8]; $lanes] = rows.first_chunk().expect(AS_MANY);
                core::array::from_fn(|k| Self::from(rows.map(|row| row[k])))
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
    fn sum_tiles(tiles: [&[i16; 16]; 2], weights: [u32; 2]) -> Self {
        Self(core::array::from_fn(|k| {
            let part = |tile: &[i16; 16], weights: u32| {
                let [first, second] = [weights as i16, (weights >> 16) as i16].map(i32::from);
                first * i32::from(tile[2 * k]) + second * i32::from(tile[2 * k + 1])
            };
            (part(tiles[0], weights[0]) + part(tiles[1], weights[1])) as f32
        }))
    }
}
