//! Eight lanes in two registers: NEON, which every 64-bit ARM processor has.
#![expect(unsafe_code, reason = "instructions that only some machines have")]

use core::arch::aarch64::*;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::{Kernel, Row, Vector, approx};
use crate::math::Lanes;

/// The first four lanes and the last. This file is compiled only for machines that have NEON.
#[derive(Debug, Clone, Copy)]
pub(super) struct F32x8([float32x4_t; 2]);

/// Runs `kernel` with these vectors.
#[inline]
pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<F32x8, F32x8>()
}

/// Runs `kernel` on a single lane.
#[inline]
pub(super) fn run_single<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<super::Single, F32x8>()
}

/// A value of instructions that take and give registers alone.
macro_rules! registers {
    ($value:expr) => {
        // SAFETY: the machine has the instructions: see [`F32x8`].
        unsafe { $value }
    };
}

/// An instruction on both registers of all arguments.
macro_rules! both {
    ($instruction:path, $($argument:expr),+) => {
        registers!([$instruction($($argument[0]),+), $instruction($($argument[1]),+)])
    };
}

macro_rules! vector {
    ($instruction:path, $($argument:expr),+) => {
        Self(both!($instruction, $($argument),+))
    };
}

impl Add for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        vector!(vaddq_f32, self.0, other.0)
    }
}

impl Sub for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        vector!(vsubq_f32, self.0, other.0)
    }
}

impl Mul for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        vector!(vmulq_f32, self.0, other.0)
    }
}

impl Div for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        vector!(vdivq_f32, self.0, other.0)
    }
}

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        vector!(vnegq_f32, self.0)
    }
}

impl AddAssign for F32x8 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Lanes for F32x8 {
    type Mask = [uint32x4_t; 2];

    #[inline(always)]
    fn of(x: f64) -> Self {
        Self(registers!([vdupq_n_f32(x as f32); 2]))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        vector!(vsqrtq_f32, self.0)
    }
    #[inline(always)]
    fn abs(self) -> Self {
        vector!(vabsq_f32, self.0)
    }
    // Not by the instructions for the smaller and the larger, which give NaN where either is, or, if told not to, where one signals.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(self.lt(other), self, other)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(other.lt(self), self, other)
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        vector!(vfmaq_f32, term.0, self.0, factor.0)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        both!(vcltq_f32, self.0, other.0)
    }
    #[inline(always)]
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        both!(vandq_u32, a, b)
    }
    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        vector!(vbslq_f32, mask, a.0, b.0)
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

impl Vector for F32x8 {
    const LANES: usize = 8;
    type Array = [f32; 8];
    type Index = [uint32x4_t; 2];

    #[inline(always)]
    fn from_array(array: Self::Array) -> Self {
        Self::load(&array)
    }
    #[inline(always)]
    fn to_array(self) -> Self::Array {
        let mut array = [0.0; 8];
        self.store(&mut array);
        array
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let from = &from[..Self::LANES];
        // SAFETY: the machine has the instruction, and the slice 4 floats from 0 on and from 4 on.
        Self(unsafe { [vld1q_f32(from.as_ptr()), vld1q_f32(from[4..].as_ptr())] })
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to = &mut to[..Self::LANES];
        // SAFETY: the machine has the instruction, and the slice room for 4 floats from 0 on and from 4 on.
        unsafe {
            vst1q_f32(to.as_mut_ptr(), self.0[0]);
            vst1q_f32(to[4..].as_mut_ptr(), self.0[1]);
        }
    }
    #[inline(always)]
    fn load_index(from: &[u32]) -> Self::Index {
        let from = &from[..Self::LANES];
        // SAFETY: the machine has the instruction, and the slice 4 integers from 0 on and from 4 on.
        unsafe { [vld1q_u32(from.as_ptr()), vld1q_u32(from[4..].as_ptr())] }
    }
    #[inline(always)]
    fn store_index(index: Self::Index, to: &mut [u32]) {
        let to = &mut to[..Self::LANES];
        // SAFETY: the machine has the instruction, and the slice room for 4 integers from 0 on and from 4 on.
        unsafe {
            vst1q_u32(to.as_mut_ptr(), index[0]);
            vst1q_u32(to[4..].as_mut_ptr(), index[1]);
        }
    }
    #[inline(always)]
    fn truncate(self) -> Self::Index {
        both!(vcvtq_u32_f32, self.0)
    }
    #[inline(always)]
    fn round(self) -> Self {
        vector!(vrndnq_f32, self.0)
    }
    #[inline(always)]
    fn floor(self) -> Self {
        vector!(vrndmq_f32, self.0)
    }
    #[inline(always)]
    fn to_index(self) -> Self::Index {
        both!(vcvtnq_u32_f32, self.0)
    }
    #[inline(always)]
    fn exp2_integer(self) -> Self {
        let exponent = both!(vcvtnq_s32_f32, self.0);
        let biased = both!(vaddq_s32, exponent, splat_signed(127));
        let shifted = both!(vshlq_n_s32::<23>, biased);
        vector!(vreinterpretq_f32_s32, shifted)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self::select(Self::splat_index(1 << 31), sign, self)
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self::Index) -> Self::Index {
        let last = table.len() - 1;
        let mut lanes = [0; 8];
        Self::store_index(index, &mut lanes);
        for lane in &mut lanes {
            *lane = table[(*lane as usize).min(last)];
        }
        Self::load_index(&lanes)
    }
    #[inline(always)]
    fn look_up(table: &[f32; 16], index: Self::Index) -> Self {
        // SAFETY: the machine has the instruction, and the table the 64 bytes that it reads.
        let table = unsafe { vld1q_u8_x4(table.as_ptr().cast()) };
        // Of each index the places of its number's four bytes.
        let four = Self::splat_index(0x0404_0404);
        let first = both!(vmulq_u32, Self::and(index, 15), four);
        let bytes = Self::plus(first, Self::splat_index(0x0302_0100));
        let bytes = both!(vreinterpretq_u8_u32, bytes);
        let numbers = both!(vqtbl4q_u8, [table, table], bytes);
        vector!(vreinterpretq_f32_u8, numbers)
    }
    #[inline(always)]
    fn of_bits(index: Self::Index) -> Self {
        vector!(vreinterpretq_f32_u32, index)
    }
    #[inline(always)]
    fn splat_index(index: u32) -> Self::Index {
        registers!([vdupq_n_u32(index); 2])
    }
    #[inline(always)]
    fn and(index: Self::Index, mask: u32) -> Self::Index {
        both!(vandq_u32, index, Self::splat_index(mask))
    }
    #[inline(always)]
    fn or(a: Self::Index, b: Self::Index) -> Self::Index {
        both!(vorrq_u32, a, b)
    }
    #[inline(always)]
    fn shift_up<const BITS: u32>(index: Self::Index) -> Self::Index {
        both!(vshlq_u32, index, splat_signed(BITS as i32))
    }
    #[inline(always)]
    fn shift_down<const BITS: u32>(index: Self::Index) -> Self::Index {
        // The instruction shifts up, by a negative number.
        both!(vshlq_u32, index, splat_signed(-(BITS as i32)))
    }
    #[inline(always)]
    fn plus(a: Self::Index, b: Self::Index) -> Self::Index {
        both!(vaddq_u32, a, b)
    }
    #[inline(always)]
    fn minus(a: Self::Index, b: Self::Index) -> Self::Index {
        both!(vsubq_u32, a, b)
    }
    #[inline(always)]
    fn times(a: Self::Index, b: Self::Index) -> Self::Index {
        both!(vmulq_u32, a, b)
    }
    #[inline(always)]
    fn by_parity(index: Self::Index, even: Self::Index, odd: Self::Index) -> Self::Index {
        let is_odd = both!(vtstq_u32, index, Self::splat_index(1));
        both!(vbslq_u32, is_odd, odd, even)
    }
    #[inline(always)]
    fn columns(rows: &[[f32; 8]]) -> [Self; 6] {
        let rows = &rows[..Self::LANES];
        let [low, high] = [four_columns(&rows[..4]), four_columns(&rows[4..])];
        [
            Self([low[0], high[0]]),
            Self([low[1], high[1]]),
            Self([low[2], high[2]]),
            Self([low[3], high[3]]),
            Self([low[4], high[4]]),
            Self([low[5], high[5]]),
        ]
    }
}

/// The same integer in every lane.
#[inline(always)]
fn splat_signed(x: i32) -> [int32x4_t; 2] {
    registers!([vdupq_n_s32(x); 2])
}

/// The first six columns of four rows.
#[inline(always)]
fn four_columns(rows: &[[f32; 8]]) -> [float32x4_t; 6] {
    let [a, b, c, d] = [
        F32x8::load(&rows[0]).0,
        F32x8::load(&rows[1]).0,
        F32x8::load(&rows[2]).0,
        F32x8::load(&rows[3]).0,
    ];
    // Of two rows columns 0 and 2, 1 and 3; 4 and 6, 5 and 7.
    let (even_ab, odd_ab) = (both!(vtrn1q_f32, a, b), both!(vtrn2q_f32, a, b));
    let (even_cd, odd_cd) = (both!(vtrn1q_f32, c, d), both!(vtrn2q_f32, c, d));
    [
        lower_halves(even_ab[0], even_cd[0]),
        lower_halves(odd_ab[0], odd_cd[0]),
        upper_halves(even_ab[0], even_cd[0]),
        upper_halves(odd_ab[0], odd_cd[0]),
        lower_halves(even_ab[1], even_cd[1]),
        lower_halves(odd_ab[1], odd_cd[1]),
    ]
}

#[inline(always)]
fn lower_halves(a: float32x4_t, b: float32x4_t) -> float32x4_t {
    registers!({
        let (a, b) = (vreinterpretq_f64_f32(a), vreinterpretq_f64_f32(b));
        vreinterpretq_f32_f64(vtrn1q_f64(a, b))
    })
}

#[inline(always)]
fn upper_halves(a: float32x4_t, b: float32x4_t) -> float32x4_t {
    registers!({
        let (a, b) = (vreinterpretq_f64_f32(a), vreinterpretq_f64_f32(b));
        vreinterpretq_f32_f64(vtrn2q_f64(a, b))
    })
}

impl Row for F32x8 {
    #[inline(always)]
    fn sum_tiles(tiles: [&[i16; 16]; 2], weights: [u32; 2]) -> Self {
        // SAFETY: the machine has the instruction, and each tile the 32 bytes that it reads.
        let [a, b] = unsafe {
            [
                vld1q_s16_x2(tiles[0].as_ptr()),
                vld1q_s16_x2(tiles[1].as_ptr()),
            ]
        };
        Self(registers!({
            // The weights of both rows, alternately, as the tiles' numbers lie.
            let v = vreinterpretq_s16_u32(vdupq_n_u32(weights[0]));
            let w = vreinterpretq_s16_u32(vdupq_n_u32(weights[1]));
            [four_sums(a.0, v, b.0, w), four_sums(a.1, v, b.1, w)]
        }))
    }
}

/// av + bw, neighbours added.
#[inline(always)]
fn four_sums(a: int16x8_t, v: int16x8_t, b: int16x8_t, w: int16x8_t) -> float32x4_t {
    registers!({
        let low = vmull_s16(vget_low_s16(a), vget_low_s16(v));
        let low = vmlal_s16(low, vget_low_s16(b), vget_low_s16(w));
        let high = vmlal_high_s16(vmull_high_s16(a, v), b, w);
        vcvtq_f32_s32(vpaddq_s32(low, high))
    })
}
