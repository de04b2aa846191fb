//! Eight lanes: AVX2 and FMA.
#![expect(unsafe_code, reason = "instructions that only some machines have")]

use core::arch::x86_64::*;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::{Kernel, Row, Vector, approx};
use crate::math::Lanes;

/// Where code is that names this type, the machine has AVX2 and FMA: it is private to `simd`, and kernels get it as their `V` or `R`
/// from functions alone whose callers have asked for these ([`run`]).
#[derive(Debug, Clone, Copy)]
pub(super) struct F32x8(__m256);

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
    type IndexArray = [u32; 8];

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
    fn index_to_array(index: Self::Index) -> Self::IndexArray {
        let mut array = [0; 8];
        // SAFETY: the machine has the instruction, and the array room for 8 integers; it need not be aligned.
        unsafe { _mm256_storeu_si256(array.as_mut_ptr().cast(), index) }
        array
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
}

impl Row for F32x8 {
    #[inline(always)]
    fn widen_i16(row: &[i16; 8]) -> Self {
        // SAFETY: the machine has the instruction, and the row the 16 bytes that it reads; they need not be aligned.
        let row = unsafe { _mm_loadu_si128(row.as_ptr().cast()) };
        vector!(_mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(row)))
    }
    #[inline(always)]
    fn widen_i8(row: &[i8; 8]) -> Self {
        // SAFETY: the machine has the instruction, and the row the 8 bytes that it reads; they need not be aligned.
        let row = unsafe { _mm_loadl_epi64(row.as_ptr().cast()) };
        vector!(_mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(row)))
    }
}
