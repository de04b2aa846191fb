//! Numbers that a table owns, or finds in the bytes of its file.

#[cfg(target_has_atomic = "ptr")]
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::fmt;
use core::ops::Deref;
use core::panic::{RefUnwindSafe, UnwindSafe};

use super::grid::PADDING;

/// Numbers in a row, in memory of their own or in that of a file which is kept as long as they are.
#[derive(Debug, Clone)]
pub struct Numbers<T: 'static>(Memory<T>);

#[derive(Debug, Clone)]
enum Memory<T: 'static> {
    Own(Vec<T>),
    Lent {
        /// In truth as long as there is the lender.
        numbers: &'static [T],
        /// Never asked, but kept.
        _lender: Lender,
    },
}

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

impl fmt::Debug for Lender {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Static => "Static",
            #[cfg(target_has_atomic = "ptr")]
            Self::Shared(_) => "Shared",
        })
    }
}

/// A number whose bytes, in the order of the machine, may be anything.
pub(super) trait Plain: Copy {}

impl Plain for f32 {}
impl Plain for i16 {}
impl Plain for i8 {}

/// The numbers that `bytes` begin with, so many and [`PADDING`] more, where they are: `None` if there are not as many, if
/// they are not aligned, or if the machine would read their bytes in another order.
///
/// # Safety
/// As long as there is the lender, or a clone of it, the bytes are where they are, and do not change.
#[expect(unsafe_code, reason = "bytes as numbers, for as long as they are kept")]
pub(super) unsafe fn lend<T: Plain>(
    bytes: &[u8],
    count: usize,
    lender: &Lender,
) -> Option<Numbers<T>> {
    if cfg!(target_endian = "big") {
        return None;
    }
    let length = count.checked_add(PADDING)?.checked_mul(size_of::<T>())?;
    // SAFETY: numbers that are `Plain` have no bytes that they cannot be made of.
    let (before, numbers, after) = unsafe { bytes.get(..length)?.align_to::<T>() };
    if !before.is_empty() || !after.is_empty() {
        return None;
    }
    // SAFETY: the lender is kept beside them, and the caller promises the rest.
    let numbers = unsafe { core::slice::from_raw_parts(numbers.as_ptr(), numbers.len()) };
    Some(Numbers(Memory::Lent {
        numbers,
        _lender: lender.clone(),
    }))
}

impl<T> Numbers<T> {
    /// Whether they are in memory that is not their own.
    pub fn is_lent(&self) -> bool {
        matches!(self.0, Memory::Lent { .. })
    }

    /// Without what follows them so that rows can be read whole.
    pub(super) fn stored(&self) -> &[T] {
        &self[..self.len() - PADDING]
    }
}

impl<T> From<Vec<T>> for Numbers<T> {
    fn from(numbers: Vec<T>) -> Self {
        Self(Memory::Own(numbers))
    }
}

impl<T> FromIterator<T> for Numbers<T> {
    fn from_iter<I: IntoIterator<Item = T>>(numbers: I) -> Self {
        Vec::from_iter(numbers).into()
    }
}

impl<T> Deref for Numbers<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        match &self.0 {
            Memory::Own(numbers) => numbers,
            Memory::Lent { numbers, .. } => numbers,
        }
    }
}

/// What follows them does not count: it may be anything.
impl<T: PartialEq> PartialEq for Numbers<T> {
    fn eq(&self, other: &Self) -> bool {
        self.stored() == other.stored()
    }
}
