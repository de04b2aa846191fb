//! Several `f64` side by side, each to the last bit what it is alone.
//!
//! Sums, products, quotients and square roots are correctly rounded in vectors as they are alone, nothing is fused, and angles,
//! exponentials, sines and cosines are those of `f64`, called lane by lane. So what is computed here does not depend on the
//! instruction set; only the time does, since quotients and roots are most of it.

use super::Level;
use crate::math::Lanes;

/// As many lanes as a register, or two of them, holds.
pub trait Doubles: Lanes {
    /// How many.
    const LANES: usize;
    /// The first of `lanes`, of which there are at least as many.
    fn load(lanes: &[f64]) -> Self;
    /// Into the first of `lanes`, of which there are at least as many.
    fn store(self, lanes: &mut [f64]);
}

impl Doubles for f64 {
    const LANES: usize = 1;

    #[inline(always)]
    fn load(lanes: &[f64]) -> Self {
        lanes[0]
    }
    #[inline(always)]
    fn store(self, lanes: &mut [f64]) {
        lanes[0] = self;
    }
}

/// An algorithm for any number of lanes.
pub trait DoubleKernel {
    /// What it returns.
    type Output;
    /// Runs it. As of [`Kernel`](super::Kernel), everything it calls has to be inlined, itself with `#[inline(always)]`.
    fn run<L: Doubles>(self) -> Self::Output;
}

impl Level {
    /// Runs `kernel` on seven lanes where this level and the machine have AVX2, else on one. The result is the same.
    #[inline]
    pub fn run_doubles<K: DoubleKernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        if self != Self::Portable && Self::Avx2.is_available() {
            // SAFETY: the machine has been asked for the instructions just above.
            #[expect(unsafe_code, reason = "functions of an instruction set")]
            return unsafe { x86::run(kernel) };
        }
        kernel.run::<f64>()
    }
}

#[cfg(target_arch = "x86_64")]
#[expect(unsafe_code, reason = "instructions that only some machines have")]
mod x86 {
    use core::arch::x86_64::*;
    use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

    use super::{DoubleKernel, Doubles};
    use crate::math::Lanes;

    /// Seven lanes, as many as the panels of [`crate::model`] have nodes, in two registers. Functions are not called for the eighth. Only
    /// [`run`] makes these, so wherever one exists the machine has the instructions.
    #[derive(Debug, Clone, Copy)]
    pub(super) struct Seven([__m256d; 2]);

    const LANES: usize = 7;

    /// Runs `kernel` with these vectors.
    ///
    /// # Safety
    /// The machine has AVX2.
    #[target_feature(enable = "avx2")]
    pub(super) unsafe fn run<K: DoubleKernel>(kernel: K) -> K::Output {
        kernel.run::<Seven>()
    }

    macro_rules! both {
        ($a:expr, $b:expr, $op:expr) => {{
            let ([a0, a1], [b0, b1]) = ($a.0, $b.0);
            // SAFETY: the instructions are there wherever the type is.
            Seven(unsafe { [$op(a0, b0), $op(a1, b1)] })
        }};
    }

    impl Seven {
        #[inline(always)]
        fn lanes(self) -> [f64; 8] {
            let mut lanes = [0.0; 8];
            // SAFETY: the instructions are there wherever the type is, and there is room for four numbers, twice.
            unsafe {
                _mm256_storeu_pd(lanes.as_mut_ptr(), self.0[0]);
                _mm256_storeu_pd(lanes[4..].as_mut_ptr(), self.0[1]);
            }
            lanes
        }
        #[inline(always)]
        fn of_lanes(lanes: &[f64; 8]) -> Self {
            // SAFETY: the instructions are there wherever the type is, and there are four numbers, twice.
            Self(unsafe {
                [
                    _mm256_loadu_pd(lanes.as_ptr()),
                    _mm256_loadu_pd(lanes[4..].as_ptr()),
                ]
            })
        }
        /// `of` every lane, one at a time.
        #[inline(always)]
        fn one_by_one(self, of: impl Fn(f64) -> f64) -> Self {
            let mut lanes = self.lanes();
            for lane in &mut lanes[..LANES] {
                *lane = of(*lane);
            }
            Self::of_lanes(&lanes)
        }
        #[inline(always)]
        fn all(x: f64) -> Self {
            // SAFETY: the instructions are there wherever the type is.
            Self(unsafe { [_mm256_set1_pd(x); 2] })
        }
    }

    impl Add for Seven {
        type Output = Self;
        #[inline(always)]
        fn add(self, other: Self) -> Self {
            both!(self, other, _mm256_add_pd)
        }
    }

    impl Sub for Seven {
        type Output = Self;
        #[inline(always)]
        fn sub(self, other: Self) -> Self {
            both!(self, other, _mm256_sub_pd)
        }
    }

    impl Mul for Seven {
        type Output = Self;
        #[inline(always)]
        fn mul(self, other: Self) -> Self {
            both!(self, other, _mm256_mul_pd)
        }
    }

    impl Div for Seven {
        type Output = Self;
        #[inline(always)]
        fn div(self, other: Self) -> Self {
            both!(self, other, _mm256_div_pd)
        }
    }

    impl Neg for Seven {
        type Output = Self;
        #[inline(always)]
        fn neg(self) -> Self {
            both!(Self::all(-0.0), self, _mm256_xor_pd)
        }
    }

    impl AddAssign for Seven {
        #[inline(always)]
        fn add_assign(&mut self, other: Self) {
            *self = *self + other;
        }
    }

    impl Lanes for Seven {
        type Mask = Self;

        #[inline(always)]
        fn of(x: f64) -> Self {
            Self::all(x)
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            let [a, b] = self.0;
            // SAFETY: the instructions are there wherever the type is.
            Self(unsafe { [_mm256_sqrt_pd(a), _mm256_sqrt_pd(b)] })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            both!(Self::all(-0.0), self, _mm256_andnot_pd)
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            both!(self, other, _mm256_min_pd)
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            both!(self, other, _mm256_max_pd)
        }
        #[inline(always)]
        fn mul_add(self, factor: Self, term: Self) -> Self {
            self * factor + term
        }
        #[inline(always)]
        fn lt(self, other: Self) -> Self {
            both!(self, other, _mm256_cmp_pd::<_CMP_LT_OQ>)
        }
        #[inline(always)]
        fn both(a: Self, b: Self) -> Self {
            both!(a, b, _mm256_and_pd)
        }
        #[inline(always)]
        fn select(mask: Self, a: Self, b: Self) -> Self {
            let ([m0, m1], [a0, a1], [b0, b1]) = (mask.0, a.0, b.0);
            // SAFETY: the instructions are there wherever the type is.
            Self(unsafe { [_mm256_blendv_pd(b0, a0, m0), _mm256_blendv_pd(b1, a1, m1)] })
        }
        #[inline(always)]
        fn atan2(self, x: Self) -> Self {
            let (mut lanes, x) = (self.lanes(), x.lanes());
            for k in 0..LANES {
                lanes[k] = Lanes::atan2(lanes[k], x[k]);
            }
            Self::of_lanes(&lanes)
        }
        #[inline(always)]
        fn twice_atan(self) -> Self {
            self.one_by_one(<f64 as Lanes>::twice_atan)
        }
        #[inline(always)]
        fn exp(self) -> Self {
            self.one_by_one(<f64 as Lanes>::exp)
        }
        #[inline(always)]
        fn sin(self) -> Self {
            self.one_by_one(<f64 as Lanes>::sin)
        }
        #[inline(always)]
        fn cos(self) -> Self {
            self.one_by_one(<f64 as Lanes>::cos)
        }
    }

    impl Doubles for Seven {
        const LANES: usize = LANES;

        #[inline(always)]
        fn load(from: &[f64]) -> Self {
            let mut lanes = [from[LANES - 1]; 8];
            lanes[..LANES].copy_from_slice(&from[..LANES]);
            Self::of_lanes(&lanes)
        }
        #[inline(always)]
        fn store(self, to: &mut [f64]) {
            to[..LANES].copy_from_slice(&self.lanes()[..LANES]);
        }
    }
}
