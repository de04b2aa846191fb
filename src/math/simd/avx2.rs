//! Eight lanes: AVX2 and FMA.
#![expect(unsafe_code, reason = "instructions that only some machines have")]

use core::arch::x86_64::*;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::{Kernel, Row, Vector, approx};
use crate::math::Lanes;

/// Where code is that names this type, the machine has AVX2 and FMA: it is private to `simd`, and kernels get it as their `V` or `R`
/// from functions alone whose callers have asked for these ([`run`]).
#[derive(Debug, Clone, Copy)]
pub(super) struct F32x8(pub(super) __m256);

/// Runs `kernel` with these vectors.
///
/// # Safety
/// The machine has AVX2 and FMA.
#[target_feature(enable = "avx2,fma")]
pub(super) unsafe fn run<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<F32x8, F32x8>()
}

/// Runs `kernel` on a single lane.
///
/// # Safety
/// The machine has AVX2 and FMA.
#[target_feature(enable = "avx2,fma")]
pub(super) unsafe fn run_single<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<super::Single, F32x8>()
}

/// A value of instructions that take and give registers alone.
macro_rules! registers {
    ($value:expr) => {
        // SAFETY: the machine has the instructions: see [`F32x8`].
        unsafe { $value }
    };
}

macro_rules! vector {
    ($value:expr) => {
        Self(registers!($value))
    };
}

impl Add for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        vector!(_mm256_add_ps(self.0, other.0))
    }
}

impl Sub for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        vector!(_mm256_sub_ps(self.0, other.0))
    }
}

impl Mul for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        vector!(_mm256_mul_ps(self.0, other.0))
    }
}

impl Div for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        vector!(_mm256_div_ps(self.0, other.0))
    }
}

impl Neg for F32x8 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        vector!(_mm256_xor_ps(_mm256_set1_ps(-0.0), self.0))
    }
}

impl AddAssign for F32x8 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Lanes for F32x8 {
    type Mask = __m256;

    #[inline(always)]
    fn of(x: f64) -> Self {
        vector!(_mm256_set1_ps(x as f32))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        vector!(_mm256_sqrt_ps(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        vector!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        vector!(_mm256_min_ps(self.0, other.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        vector!(_mm256_max_ps(self.0, other.0))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        vector!(_mm256_fmadd_ps(self.0, factor.0, term.0))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        registers!(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0))
    }
    #[inline(always)]
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        registers!(_mm256_and_ps(a, b))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        vector!(_mm256_blendv_ps(b.0, a.0, mask))
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
    type Index = __m256i;

    #[inline(always)]
    fn from_array(array: Self::Array) -> Self {
        // SAFETY: the machine has the instruction, and the array its 8 floats; they need not be aligned.
        Self(unsafe { _mm256_loadu_ps(array.as_ptr()) })
    }
    #[inline(always)]
    fn to_array(self) -> Self::Array {
        let mut array = [0.0; 8];
        // SAFETY: the machine has the instruction, and the array room for 8 floats; it need not be aligned.
        unsafe { _mm256_storeu_ps(array.as_mut_ptr(), self.0) }
        array
    }
    #[inline(always)]
    fn load(from: &[f32]) -> Self {
        let from = &from[..Self::LANES];
        // SAFETY: the machine has the instruction, and the slice its 8 floats; they need not be aligned.
        Self(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }
    #[inline(always)]
    fn store(self, to: &mut [f32]) {
        let to = &mut to[..Self::LANES];
        // SAFETY: the machine has the instruction, and the slice room for 8 floats; it need not be aligned.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }
    #[inline(always)]
    fn load_index(from: &[u32]) -> Self::Index {
        let from = &from[..Self::LANES];
        // SAFETY: the machine has the instruction, and the slice its 8 integers; they need not be aligned.
        unsafe { _mm256_loadu_si256(from.as_ptr().cast()) }
    }
    #[inline(always)]
    fn store_index(index: Self::Index, to: &mut [u32]) {
        let to = &mut to[..Self::LANES];
        // SAFETY: the machine has the instruction, and the slice room for 8 integers; it need not be aligned.
        unsafe { _mm256_storeu_si256(to.as_mut_ptr().cast(), index) }
    }
    #[inline(always)]
    fn truncate(self) -> Self::Index {
        registers!(_mm256_cvttps_epi32(self.0))
    }
    #[inline(always)]
    fn round(self) -> Self {
        vector!(_mm256_round_ps::<
            { _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC },
        >(self.0))
    }
    #[inline(always)]
    fn floor(self) -> Self {
        vector!(_mm256_floor_ps(self.0))
    }
    #[inline(always)]
    fn to_index(self) -> Self::Index {
        registers!(_mm256_cvtps_epi32(self.0))
    }
    #[inline(always)]
    fn exp2_integer(self) -> Self {
        vector!({
            let exponent = _mm256_add_epi32(_mm256_cvtps_epi32(self.0), _mm256_set1_epi32(127));
            _mm256_castsi256_ps(_mm256_slli_epi32::<23>(exponent))
        })
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        vector!({
            let minus = _mm256_set1_ps(-0.0);
            _mm256_or_ps(
                _mm256_andnot_ps(minus, self.0),
                _mm256_and_ps(minus, sign.0),
            )
        })
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self::Index) -> Self::Index {
        // As signed integers, which the instruction takes them for, no index is negative then.
        assert!((1..=1 << 31).contains(&table.len()));
        let last = (table.len() - 1) as i32;
        let index = registers!(_mm256_min_epu32(index, _mm256_set1_epi32(last)));
        // SAFETY: the machine has the instruction, and every index is from 0 to the last of the table, by the line before.
        unsafe { _mm256_i32gather_epi32::<4>(table.as_ptr().cast(), index) }
    }
    #[inline(always)]
    fn look_up(table: &[f32; 16], index: Self::Index) -> Self {
        let (low, high) = (Self::load(&table[..8]), Self::load(&table[8..]));
        vector!({
            // Of an index three bits count here, and the fourth, as a sign, chooses.
            let (low, high) = (
                _mm256_permutevar8x32_ps(low.0, index),
                _mm256_permutevar8x32_ps(high.0, index),
            );
            let which = _mm256_castsi256_ps(_mm256_slli_epi32::<28>(index));
            _mm256_blendv_ps(low, high, which)
        })
    }
    #[inline(always)]
    fn of_bits(index: Self::Index) -> Self {
        vector!(_mm256_castsi256_ps(index))
    }
    #[inline(always)]
    fn splat_index(index: u32) -> Self::Index {
        registers!(_mm256_set1_epi32(index as i32))
    }
    #[inline(always)]
    fn and(index: Self::Index, mask: u32) -> Self::Index {
        registers!(_mm256_and_si256(index, Self::splat_index(mask)))
    }
    #[inline(always)]
    fn or(a: Self::Index, b: Self::Index) -> Self::Index {
        registers!(_mm256_or_si256(a, b))
    }
    #[inline(always)]
    fn shift_up<const BITS: u32>(index: Self::Index) -> Self::Index {
        registers!(_mm256_sll_epi32(index, _mm_cvtsi32_si128(BITS as i32)))
    }
    #[inline(always)]
    fn shift_down<const BITS: u32>(index: Self::Index) -> Self::Index {
        registers!(_mm256_srl_epi32(index, _mm_cvtsi32_si128(BITS as i32)))
    }
    #[inline(always)]
    fn plus(a: Self::Index, b: Self::Index) -> Self::Index {
        registers!(_mm256_add_epi32(a, b))
    }
    #[inline(always)]
    fn minus(a: Self::Index, b: Self::Index) -> Self::Index {
        registers!(_mm256_sub_epi32(a, b))
    }
    #[inline(always)]
    fn times(a: Self::Index, b: Self::Index) -> Self::Index {
        registers!(_mm256_mullo_epi32(a, b))
    }
    #[inline(always)]
    fn by_parity(index: Self::Index, even: Self::Index, odd: Self::Index) -> Self::Index {
        registers!({
            let is_odd = _mm256_castsi256_ps(_mm256_slli_epi32::<31>(index));
            let [even, odd] = [_mm256_castsi256_ps(even), _mm256_castsi256_ps(odd)];
            _mm256_castps_si256(_mm256_blendv_ps(even, odd, is_odd))
        })
    }
    #[inline(always)]
    fn columns(rows: &[[f32; 8]]) -> [Self; 6] {
        let rows = &rows[..Self::LANES];
        let [low, high] = [four_columns(&rows[..4]), four_columns(&rows[4..])];
        [
            vector!(_mm256_permute2f128_ps::<0x20>(low[0], high[0])),
            vector!(_mm256_permute2f128_ps::<0x20>(low[1], high[1])),
            vector!(_mm256_permute2f128_ps::<0x20>(low[2], high[2])),
            vector!(_mm256_permute2f128_ps::<0x20>(low[3], high[3])),
            vector!(_mm256_permute2f128_ps::<0x31>(low[0], high[0])),
            vector!(_mm256_permute2f128_ps::<0x31>(low[1], high[1])),
        ]
    }
}

/// Of four rows the columns k and k + 4, one behind the other, for k from 0 to 3.
#[inline(always)]
fn four_columns(rows: &[[f32; 8]]) -> [__m256; 4] {
    let [a, b, c, d] = [
        F32x8::load(&rows[0]).0,
        F32x8::load(&rows[1]).0,
        F32x8::load(&rows[2]).0,
        F32x8::load(&rows[3]).0,
    ];
    registers!({
        let (low_ab, low_cd) = (_mm256_unpacklo_ps(a, b), _mm256_unpacklo_ps(c, d));
        let (high_ab, high_cd) = (_mm256_unpackhi_ps(a, b), _mm256_unpackhi_ps(c, d));
        [
            _mm256_shuffle_ps::<0x44>(low_ab, low_cd),
            _mm256_shuffle_ps::<0xEE>(low_ab, low_cd),
            _mm256_shuffle_ps::<0x44>(high_ab, high_cd),
            _mm256_shuffle_ps::<0xEE>(high_ab, high_cd),
        ]
    })
}

impl Row for F32x8 {
    #[inline(always)]
    fn sum_tiles(tiles: [&[i16; 16]; 2], weights: [u32; 2]) -> Self {
        // SAFETY: the machine has the instruction, and each tile the 32 bytes that it reads; they need not be aligned.
        let [a, b] = unsafe {
            [
                _mm256_loadu_si256(tiles[0].as_ptr().cast()),
                _mm256_loadu_si256(tiles[1].as_ptr().cast()),
            ]
        };
        vector!(_mm256_cvtepi32_ps(_mm256_add_epi32(
            _mm256_madd_epi16(a, Self::splat_index(weights[0])),
            _mm256_madd_epi16(b, Self::splat_index(weights[1])),
        )))
    }
}
