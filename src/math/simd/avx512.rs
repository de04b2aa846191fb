//! Sixteen lanes: AVX-512 F.
#![expect(unsafe_code, reason = "instructions that only some machines have")]

use core::arch::x86_64::*;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::{Kernel, Vector, approx};
use crate::math::Lanes;

/// Where code is that names this type, the machine has AVX-512 F, AVX2 and FMA: it is private to `simd`, and kernels get it as their `V` or `R`
/// from functions alone whose callers have asked for these ([`run`]).
#[derive(Debug, Clone, Copy)]
pub(super) struct F32x16(__m512);

/// Runs `kernel` with these vectors.
///
/// # Safety
/// The machine has AVX512F and AVX2 and FMA.
#[target_feature(enable = "avx512f,avx2,fma")]
pub(super) unsafe fn run<K: Kernel>(kernel: K) -> K::Output {
    kernel.run::<F32x16, super::avx2::F32x8>()
}

/// A value of instructions that take and give registers alone.
macro_rules! registers {
    ($value:expr) => {
        // SAFETY: the machine has the instructions: see [`F32x16`].
        unsafe { $value }
    };
}

macro_rules! vector {
    ($value:expr) => {
        Self(registers!($value))
    };
}

impl Add for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        vector!(_mm512_add_ps(self.0, other.0))
    }
}

impl Sub for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        vector!(_mm512_sub_ps(self.0, other.0))
    }
}

impl Mul for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        vector!(_mm512_mul_ps(self.0, other.0))
    }
}

impl Div for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        vector!(_mm512_div_ps(self.0, other.0))
    }
}

impl Neg for F32x16 {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        vector!(_mm512_sub_ps(_mm512_set1_ps(-0.0), self.0))
    }
}

impl AddAssign for F32x16 {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Lanes for F32x16 {
    type Mask = __mmask16;

    #[inline(always)]
    fn of(x: f64) -> Self {
        vector!(_mm512_set1_ps(x as f32))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        vector!(_mm512_sqrt_ps(self.0))
    }
    #[inline(always)]
    fn reciprocal(self) -> Self {
        // 14 bits, and one step of Newton's method: division takes three times as long.
        let near: Self = vector!(_mm512_rcp14_ps(self.0));
        let rest = vector!(_mm512_fnmadd_ps(self.0, near.0, Self::one().0));
        near.mul_add(rest, near)
    }
    #[inline(always)]
    fn sqrt_and_reciprocal(self) -> (Self, Self) {
        let near = vector!(_mm512_rsqrt14_ps(self.0));
        let root = self * near;
        let rest = vector!(_mm512_fnmadd_ps(root.0, near.0, Self::one().0));
        let half = Self::of(0.5) * rest;
        (root.mul_add(half, root), near.mul_add(half, near))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        vector!(_mm512_abs_ps(self.0))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        vector!(_mm512_min_ps(self.0, other.0))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        vector!(_mm512_max_ps(self.0, other.0))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        vector!(_mm512_fmadd_ps(self.0, factor.0, term.0))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        registers!(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0))
    }
    #[inline(always)]
    fn both(a: Self::Mask, b: Self::Mask) -> Self::Mask {
        a & b
    }
    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        vector!(_mm512_mask_blend_ps(mask, b.0, a.0))
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

impl Vector for F32x16 {
    const LANES: usize = 16;
    type Array = [f32; 16];
    type Index = __m512i;
    type IndexArray = [u32; 16];

    #[inline(always)]
    fn from_array(array: Self::Array) -> Self {
        // SAFETY: the machine has the instruction, and the array its 16 floats; they need not be aligned.
        Self(unsafe { _mm512_loadu_ps(array.as_ptr()) })
    }
    #[inline(always)]
    fn to_array(self) -> Self::Array {
        let mut array = [0.0; 16];
        // SAFETY: the machine has the instruction, and the array room for 16 floats; it need not be aligned.
        unsafe { _mm512_storeu_ps(array.as_mut_ptr(), self.0) }
        array
    }
    #[inline(always)]
    fn index_to_array(index: Self::Index) -> Self::IndexArray {
        let mut array = [0; 16];
        // SAFETY: the machine has the instruction, and the array room for 16 integers; it need not be aligned.
        unsafe { _mm512_storeu_si512(array.as_mut_ptr().cast(), index) }
        array
    }
    #[inline(always)]
    fn truncate(self) -> Self::Index {
        registers!(_mm512_cvttps_epi32(self.0))
    }
    #[inline(always)]
    fn round(self) -> Self {
        vector!(_mm512_roundscale_ps::<
            { _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC },
        >(self.0))
    }
    #[inline(always)]
    fn exp2_integer(self) -> Self {
        vector!({
            let exponent = _mm512_add_epi32(_mm512_cvtps_epi32(self.0), _mm512_set1_epi32(127));
            _mm512_castsi512_ps(_mm512_slli_epi32::<23>(exponent))
        })
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        vector!({
            let minus = _mm512_set1_epi32(i32::MIN);
            _mm512_castsi512_ps(_mm512_ternarylogic_epi32::<0xCA>(
                minus,
                _mm512_castps_si512(sign.0),
                _mm512_castps_si512(self.0),
            ))
        })
    }
    #[inline(always)]
    fn gather(table: &[u32], index: Self::Index) -> Self::Index {
        // As signed integers, which the instruction takes them for, no index is negative then.
        assert!((1..=1 << 31).contains(&table.len()));
        let last = (table.len() - 1) as i32;
        let index = registers!(_mm512_min_epu32(index, _mm512_set1_epi32(last)));
        // SAFETY: the machine has the instruction, and every index is from 0 to the last of the table, by the line before.
        unsafe { _mm512_i32gather_epi32::<4>(index, table.as_ptr().cast()) }
    }
}
