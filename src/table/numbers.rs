//! Integers that a table owns, or finds in the bytes of its file.

#[cfg(target_has_atomic = "ptr")]
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;
use core::ops::Deref;
use core::panic::{RefUnwindSafe, UnwindSafe};
use core::ptr::NonNull;

use super::grid::PADDING;

/// Integers in a row, in memory of their own or in that of a file which is kept as long as they are. [`PADDING`] more follow them, so
/// that tiles can be read whole.
#[derive(Clone)]
pub(crate) struct Numbers(Memory);

#[derive(Clone)]
enum Memory {
    Own(Vec<i16>),
    Lent {
        /// Readable and unchanged as long as there is the lender: [`lend`]'s caller sees to it.
        numbers: NonNull<[i16]>,
        /// Never asked, but kept.
        _lender: Lender,
    },
}

#[expect(unsafe_code, reason = "a pointer to what nobody writes to")]
// SAFETY: lent numbers are only read, so that the pointer is what `&[i16]` would be; lenders are Send and Sync.
unsafe impl Send for Memory {}
#[expect(unsafe_code, reason = "a pointer to what nobody writes to")]
// SAFETY: as above.
unsafe impl Sync for Memory {}

/// What keeps the bytes of a file where they are.
#[derive(Clone)]
pub(super) enum Lender {
    /// They stay for good.
    Static,
    /// They are its.
    #[cfg(target_has_atomic = "ptr")]
    Shared(
        #[expect(dead_code, reason = "it is kept, not used")] Arc<dyn AsRef<[u8]> + Send + Sync>,
    ),
}

// What is never asked cannot be seen half changed.
impl UnwindSafe for Lender {}
impl RefUnwindSafe for Lender {}

/// The numbers that `bytes` begin with, so many and [`PADDING`] more, where they are: `None` if there are not as many, if
/// they are not aligned, or if the machine would read their bytes in another order.
///
/// # Safety
/// As long as there is the lender, or a clone of it, the bytes are where they are, and do not change.
#[expect(unsafe_code, reason = "bytes as numbers, for as long as they are kept")]
pub(super) unsafe fn lend(bytes: &[u8], count: usize, lender: &Lender) -> Option<Numbers> {
    if cfg!(target_endian = "big") {
        return None;
    }
    let length = count.checked_add(PADDING)?.checked_mul(size_of::<i16>())?;
    // SAFETY: any two bytes are an integer.
    let (before, numbers, after) = unsafe { bytes.get(..length)?.align_to::<i16>() };
    if !before.is_empty() || !after.is_empty() {
        return None;
    }
    Some(Numbers(Memory::Lent {
        numbers: NonNull::from(numbers),
        _lender: lender.clone(),
    }))
}

/// In memory of their own, followed by zeros.
pub(crate) fn own(numbers: impl Iterator<Item = i16>) -> Numbers {
    let padding = core::iter::repeat_n(0, PADDING);
    Numbers(Memory::Own(numbers.chain(padding).collect()))
}

impl Numbers {
    /// Whether they are in memory that is not their own.
    pub(crate) fn is_lent(&self) -> bool {
        matches!(self.0, Memory::Lent { .. })
    }

    /// Without what follows them.
    pub(super) fn stored(&self) -> &[i16] {
        // Neither [`own`] nor [`lend`] makes fewer.
        &self[..self.len() - PADDING]
    }
}

impl Deref for Numbers {
    type Target = [i16];

    #[inline(always)]
    fn deref(&self) -> &[i16] {
        match &self.0 {
            Memory::Own(numbers) => numbers,
            #[expect(unsafe_code, reason = "what a lender keeps")]
            // SAFETY: it is made of a slice of as many, and `self` holds the lender, for as long as which the caller of [`lend`] promises that
            // they are there and do not change; the slice lives no longer than `self` is borrowed.
            Memory::Lent { numbers, .. } => unsafe { numbers.as_ref() },
        }
    }
}

impl fmt::Debug for Numbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.stored().fmt(f)
    }
}

/// What follows them does not count: it may be anything.
impl PartialEq for Numbers {
    fn eq(&self, other: &Self) -> bool {
        self.stored() == other.stored()
    }
}
