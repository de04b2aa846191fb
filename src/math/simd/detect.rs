//! Which instructions the machine has, for who has no standard library to ask.

use core::arch::x86_64::{__cpuid, __cpuid_count, _xgetbv};
use core::sync::atomic::{AtomicU8, Ordering};

use super::Level;

/// The widest level. Asked once: virtual machines take microseconds to answer.
#[inline]
pub(super) fn widest() -> Level {
    const PORTABLE: u8 = 1 + Level::Portable as u8;
    const AVX2: u8 = 1 + Level::Avx2 as u8;
    static KNOWN: AtomicU8 = AtomicU8::new(0);
    match KNOWN.load(Ordering::Relaxed) {
        0 => {
            let level = ask();
            KNOWN.store(1 + level as u8, Ordering::Relaxed);
            level
        }
        PORTABLE => Level::Portable,
        AVX2 => Level::Avx2,
        _ => Level::Avx512,
    }
}

#[cold]
fn ask() -> Level {
    let has = |register: u32, bits: &[u32]| bits.iter().all(|bit| register >> bit & 1 == 1);
    if __cpuid(0).eax < 7 {
        return Level::Portable;
    }
    let (one, seven) = (__cpuid(1), __cpuid_count(7, 0));
    // FMA, XSAVE as the system has enabled it, AVX; AVX2.
    if !has(one.ecx, &[12, 27, 28]) || !has(seven.ebx, &[5]) {
        return Level::Portable;
    }
    #[target_feature(enable = "xsave")]
    fn saved() -> u32 {
        // SAFETY: the instruction is there, by this function's target feature, and wherever it is, register 0 is.
        #[expect(unsafe_code, reason = "an instruction of some machines")]
        let registers = unsafe { _xgetbv(0) };
        registers as u32
    }
    // SAFETY: the machine has XSAVE and the system has enabled it: bit 27, asked for above, says both.
    #[expect(unsafe_code, reason = "an instruction of some machines")]
    let saved = unsafe { saved() };
    // What the system keeps for every thread: registers of 128 and 256 bits; masks and registers of 512 bits.
    if !has(saved, &[1, 2]) {
        Level::Portable
    } else if has(seven.ebx, &[16]) && has(saved, &[5, 6, 7]) {
        Level::Avx512
    } else {
        Level::Avx2
    }
}
