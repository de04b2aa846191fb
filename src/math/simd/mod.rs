//! Several `f32` side by side, with the widest instructions that the machine has.
//!
//! An algorithm is a [`Kernel`], written once over [`Vector`]. There is one file per instruction set, each with its vector
//! type; `portable` needs none and is what others are compared with. Which to use is decided once per batch, at run time
//! ([`Level`]).
//!
//! Square root and division are correctly rounded everywhere, `mul_add` is fused where the instruction set does so.
//! `atan2`, `exp` and `sin` are polynomials (`approx`), the same ones everywhere. AVX2 and NEON both fuse and divide; AVX-512 has some
//! quotients by an estimate and a step of Newton's method, and portable vectors do not fuse. So instruction sets differ a little:
//! `tests/table/parity.rs` has the bounds.
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
#[cfg(all(
    target_arch = "aarch64",
    target_feature = "neon",
    target_endian = "little"
))]
mod neon;
mod pairs;
mod portable;

use super::Lanes;
pub use doubles::{DoubleKernel, Doubles};
pub use pairs::{Colours, Directions};
#[doc(hidden)]
pub use portable::{Eight, Single};

/// A register full of `f32`.
#[doc(hidden)]
pub trait Vector: Lanes {
    /// How many.
    const LANES: usize;
    /// As many in memory.
    type Array: Copy + Default + AsRef<[f32]> + AsMut<[f32]>;
    /// As many `u32`: table indices, and what is packed into 32 bits.
    type Index: Copy;

    /// From memory.
    fn from_array(array: Self::Array) -> Self;
    /// Into memory.
    fn to_array(self) -> Self::Array;
    /// From the first numbers of a slice, which has as many.
    fn load(from: &[f32]) -> Self;
    /// Into the first numbers of a slice, which has as many.
    fn store(self, to: &mut [f32]);
    /// From the first numbers of a slice, which has as many.
    fn load_index(from: &[u32]) -> Self::Index;
    /// Into the first numbers of a slice, which has as many.
    fn store_index(index: Self::Index, to: &mut [u32]);
    /// The integral part of numbers from 0 to 2²⁴. Others give some index.
    fn truncate(self) -> Self::Index;
    /// The nearest integers.
    fn round(self) -> Self;
    /// The largest integers that are not above.
    fn floor(self) -> Self;
    /// The nearest integers, of numbers from 0 to 2²⁴.
    fn to_index(self) -> Self::Index;
    /// 2 to the power of `self`, an integer from −126 to 127.
    fn exp2_integer(self) -> Self;
    /// `self` with the sign of `sign`.
    fn copysign(self, sign: Self) -> Self;
    /// `table[index]`; the last one for indices past the end. The table is not empty.
    fn gather(table: &[u32], index: Self::Index) -> Self::Index;
    /// `table[index]` by the lowest four bits of the index.
    fn look_up(table: &[f32; 16], index: Self::Index) -> Self;
    /// The numbers whose bits these are.
    fn of_bits(index: Self::Index) -> Self;
    /// The same index in every lane.
    fn splat_index(index: u32) -> Self::Index;
    /// The bits that are in both.
    fn and(index: Self::Index, mask: u32) -> Self::Index;
    /// The bits that are in either.
    fn or(a: Self::Index, b: Self::Index) -> Self::Index;
    /// So many bits up, below 32.
    fn shift_up<const BITS: u32>(index: Self::Index) -> Self::Index;
    /// So many bits down, below 32.
    fn shift_down<const BITS: u32>(index: Self::Index) -> Self::Index;
    /// The sum modulo 2³².
    fn plus(a: Self::Index, b: Self::Index) -> Self::Index;
    /// The difference modulo 2³².
    fn minus(a: Self::Index, b: Self::Index) -> Self::Index;
    /// The product modulo 2³².
    fn times(a: Self::Index, b: Self::Index) -> Self::Index;
    /// `odd` where the lowest bit of the index is 1, else `even`.
    fn by_parity(index: Self::Index, even: Self::Index, odd: Self::Index) -> Self::Index;
    /// The first six numbers of each of as many rows as there are lanes.
    fn columns(rows: &[[f32; 8]]) -> [Self; 6];
}

/// Eight `f32`: what one lane sums up.
#[doc(hidden)]
pub trait Row: Vector<Array = [f32; 8]> {
    /// Whether it takes no instructions that only some machines have.
    const IS_PORTABLE: bool = false;
    /// Σ of four rows with integer weights. A tile is two rows, whose numbers lie alternately; of each pair of `weights` the lower half
    /// is that of the first. Sums stay within 2³¹ where weights sum to at most 2¹⁵.
    fn sum_tiles(tiles: [&[i16; 16]; 2], weights: [u32; 2]) -> Self;
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

/// Portable lanes of batches. Eight take seven times the code of one, and on ARM, which has NEON for them, minutes to compile.
#[cfg(any(feature = "small", target_arch = "aarch64"))]
type SideBySide = Single;
#[cfg(not(any(feature = "small", target_arch = "aarch64")))]
type SideBySide = Eight;

/// The instruction sets that there is a file for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Level {
    /// Any machine.
    Portable,
    /// 64-bit ARM with NEON: 8 lanes.
    Neon,
    /// x86-64 with AVX2 and FMA: 8 lanes.
    Avx2,
    /// x86-64 with AVX-512 F: 16 lanes.
    Avx512,
}

impl Level {
    /// All levels, the widest last.
    pub const ALL: [Self; 4] = [Self::Portable, Self::Neon, Self::Avx2, Self::Avx512];

    /// The widest level of this machine.
    #[inline]
    pub fn detect() -> Self {
        if Self::Avx512.is_available() {
            Self::Avx512
        } else if Self::Avx2.is_available() {
            Self::Avx2
        } else if Self::Neon.is_available() {
            Self::Neon
        } else {
            Self::Portable
        }
    }

    /// Whether this machine has the instructions.
    #[inline]
    pub fn is_available(self) -> bool {
        match self {
            Self::Portable => true,
            // No machine is asked: code is compiled with NEON or without.
            Self::Neon => cfg!(all(
                target_arch = "aarch64",
                target_feature = "neon",
                target_endian = "little"
            )),
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
            Self::Neon => "neon",
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
                Self::Portable | Self::Neon => {}
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
        #[cfg(all(
            target_arch = "aarch64",
            target_feature = "neon",
            target_endian = "little"
        ))]
        if self == Self::Neon {
            return neon::run(kernel);
        }
        kernel.run::<SideBySide, Eight>()
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
        #[cfg(all(
            target_arch = "aarch64",
            target_feature = "neon",
            target_endian = "little"
        ))]
        if self == Self::Neon {
            return neon::run_single(kernel);
        }
        kernel.run::<Single, Eight>()
    }
}
