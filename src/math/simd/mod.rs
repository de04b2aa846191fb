//! Several `f32` side by side, with the widest instructions that the machine has.
//!
//! An algorithm is a [`Kernel`], written once over [`Vector`]. There is one file per instruction set, each with its vector
//! type; `portable` needs none and is what others are compared with. Which to use is decided once per batch, at run time
//! ([`Level`]).
//!
//! Square root and division are correctly rounded everywhere, `mul_add` is fused where the instruction set does so.
//! `atan2`, `exp` and `sin` are polynomials (`approx`), the same ones everywhere. So instruction sets do not agree to the last
//! bit, but closely: `tests/table/parity.rs` has the bounds.
//!
//! Where exactness counts there are [`Doubles`], the same to the last bit everywhere.

mod approx;
#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(all(target_arch = "x86_64", not(feature = "small")))]
mod avx512;
#[cfg(all(target_arch = "x86_64", not(feature = "std")))]
mod detect;
mod doubles;
mod pairs;
mod portable;

use super::Lanes;
pub use doubles::{DoubleKernel, Doubles};
pub use pairs::{Colours, Directions};
pub(crate) use pairs::{PairFunction, at_pair, map_pairs};
#[doc(hidden)]
pub use portable::{Eight, Single};

/// A register full of `f32`.
#[doc(hidden)]
pub trait Vector: Lanes {
    /// How many.
    const LANES: usize;
    /// As many in memory.
    type Array: Copy + Default + AsRef<[f32]> + AsMut<[f32]>;
    /// As many table indices.
    type Index: Copy;
    /// As many table indices in memory.
    type IndexArray: Copy + AsRef<[u32]> + AsMut<[u32]>;

    /// From memory.
    fn from_array(array: Self::Array) -> Self;
    /// Into memory.
    fn to_array(self) -> Self::Array;
    /// Into memory.
    fn index_to_array(index: Self::Index) -> Self::IndexArray;
    /// The integral part of numbers from 0 to 2²⁴. Others give some index.
    fn truncate(self) -> Self::Index;
    /// The nearest integers.
    fn round(self) -> Self;
    /// 2 to the power of `self`, an integer from −126 to 127.
    fn exp2_integer(self) -> Self;
    /// `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// `table[index]`; the last one for indices past the end. The table is not empty.
    fn gather(table: &[u32], index: Self::Index) -> Self::Index;
}

/// Eight `f32`, which narrower numbers can be widened to.
#[doc(hidden)]
pub trait Row: Vector<Array = [f32; 8]> {
    /// Whether it takes no instructions that only some machines have.
    const IS_PORTABLE: bool = false;
    /// As f32.
    fn widen_i16(row: &[i16; 8]) -> Self;
    /// As f32.
    fn widen_i8(row: &[i8; 8]) -> Self;
}

/// An algorithm for any instruction set.
#[doc(hidden)]
pub trait Kernel {
    /// What it returns.
    type Output;
    /// Runs it, with lanes `V` side by side and rows `R` of one lane's numbers. Everything it calls has to be inlined to profit from the instruction set, itself with
    /// `#[inline(always)]`.
    fn run<V: Vector, R: Row>(self) -> Self::Output;
}

/// The instruction sets that there is a file for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Level {
    /// Any machine.
    Portable,
    /// x86-64 with AVX2 and FMA: 8 lanes.
    Avx2,
    /// x86-64 with AVX-512 F: 16 lanes.
    Avx512,
}

impl Level {
    /// All levels, the widest last.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The widest level of this machine.
    #[inline]
    pub fn detect() -> Self {
        if Self::Avx512.is_available() {
            Self::Avx512
        } else if Self::Avx2.is_available() {
            Self::Avx2
        } else {
            Self::Portable
        }
    }

    /// Whether this machine has the instructions.
    #[inline]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            Self::Avx512 if cfg!(feature = "small") => false,
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Self::Avx2 => {
                std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma")
            }
            #[cfg(all(target_arch = "x86_64", feature = "std"))]
            Self::Avx512 => std::is_x86_feature_detected!("avx512f") && Self::Avx2.is_available(),
            #[cfg(all(target_arch = "x86_64", not(feature = "std")))]
            _ => self <= detect::widest(),
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// `portable`, `avx2`, …
    pub fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }

    /// Runs `kernel` with this level's vectors; with portable ones if the machine does not have it.
    #[inline]
    pub fn run<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        if self.is_available() {
            match self {
                Self::Portable => {}
                // SAFETY: `is_available` has asked the machine for AVX2 and FMA, just above.
                #[expect(unsafe_code, reason = "functions of an instruction set")]
                Self::Avx2 => return unsafe { avx2::run(kernel) },
                #[cfg(feature = "small")]
                Self::Avx512 => {}
                // SAFETY: `is_available` has asked the machine for AVX-512 F, AVX2 and FMA, just above.
                #[cfg(not(feature = "small"))]
                #[expect(unsafe_code, reason = "functions of an instruction set")]
                Self::Avx512 => return unsafe { avx512::run(kernel) },
            }
        }
        // Eight lanes side by side take seven times the code of one.
        #[cfg(feature = "small")]
        return kernel.run::<Single, Eight>();
        #[cfg(not(feature = "small"))]
        kernel.run::<Eight, Eight>()
    }

    /// Runs `kernel` on a single lane, compiled for this level's instructions.
    #[inline]
    pub fn run_single<K: Kernel>(self, kernel: K) -> K::Output {
        #[cfg(target_arch = "x86_64")]
        if self != Self::Portable && Self::Avx2.is_available() {
            // SAFETY: `is_available` has asked the machine for AVX2 and FMA, just above.
            #[expect(unsafe_code, reason = "functions of an instruction set")]
            return unsafe { avx2::run_single(kernel) };
        }
        kernel.run::<Single, Eight>()
    }
}
