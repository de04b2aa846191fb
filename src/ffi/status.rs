//! What functions return.

use core::ffi::CStr;

use crate::table::Error;

/// Whether a function has done what it was asked: `sateen_status` in C.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
#[non_exhaustive]
pub enum Status {
    /// It has.
    Ok = 0,
    /// A pointer is null that must not be.
    NullArgument = 1,
    /// A buffer overlaps another, is not aligned, or is longer than memory.
    InvalidBuffer = 2,
    /// There is no thread of this index.
    OutOfRange = 3,
    /// The file cannot be read.
    File = 4,
    /// The bytes are no table.
    NotATable = 5,
    /// They are one of a version that this library does not read.
    Version = 6,
    /// They end too soon, or too late.
    Length = 7,
    /// They have changed since they were written.
    Damaged = 8,
    /// They contradict the format.
    Invalid = 9,
    /// They would take too much memory.
    TooLarge = 10,
    /// They are compressed, and the library was built without zstd.
    NoZstd = 11,
    /// The table does not have what is asked.
    NoAlbedo = 12,
    /// There is a mistake in the library.
    Internal = 13,
}

impl Status {
    const ALL: [Self; 14] = [
        Self::Ok,
        Self::NullArgument,
        Self::InvalidBuffer,
        Self::OutOfRange,
        Self::File,
        Self::NotATable,
        Self::Version,
        Self::Length,
        Self::Damaged,
        Self::Invalid,
        Self::TooLarge,
        Self::NoZstd,
        Self::NoAlbedo,
        Self::Internal,
    ];

    pub(super) fn of(error: &Error) -> Self {
        match error {
            Error::NotATable => Self::NotATable,
            Error::Version { .. } => Self::Version,
            Error::Truncated { .. } | Error::TrailingBytes { .. } => Self::Length,
            Error::Checksum { .. } | Error::Decompression => Self::Damaged,
            Error::Invalid { .. } => Self::Invalid,
            Error::TooLarge { .. } => Self::TooLarge,
            Error::NoZstd => Self::NoZstd,
        }
    }

    /// Of what [`guarded`] returns.
    pub(super) fn of_result(result: Option<Result<(), Self>>) -> Self {
        match result {
            Some(Ok(())) => Self::Ok,
            Some(Err(status)) => status,
            None => Self::Internal,
        }
    }

    pub(super) fn c_text(number: i32) -> &'static CStr {
        let status = Self::ALL
            .into_iter()
            .find(|status| *status as i32 == number);
        match status {
            Some(Self::Ok) => c"ok",
            Some(Self::NullArgument) => c"a pointer is null that must not be",
            Some(Self::InvalidBuffer) => {
                c"a buffer overlaps another, is not aligned for float, or is longer than memory"
            }
            Some(Self::OutOfRange) => c"there is no thread of this index",
            Some(Self::File) => c"the file cannot be read",
            Some(Self::NotATable) => c"not a sateen table",
            Some(Self::Version) => c"a table of a format version that this library does not read",
            Some(Self::Length) => c"the table ends too soon, or bytes follow it",
            Some(Self::Damaged) => c"damaged: a checksum does not match",
            Some(Self::Invalid) => c"a value contradicts the format",
            Some(Self::TooLarge) => c"the table would take more memory than allowed",
            Some(Self::NoZstd) => c"compressed, but this library was built without zstd",
            Some(Self::NoAlbedo) => {
                c"the table has no albedos by view: bake it without --no-sampling"
            }
            Some(Self::Internal) => c"internal error: please report it",
            None => c"no status of sateen's",
        }
    }

    pub(super) fn text(self) -> &'static str {
        Self::c_text(self as i32).to_str().unwrap_or_default()
    }
}

/// The result, or `None` if there was a panic, where panics unwind.
pub(super) fn guarded<T>(f: impl FnOnce() -> T) -> Option<T> {
    #[cfg(all(feature = "std", panic = "unwind"))]
    return std::panic::catch_unwind(std::panic::AssertUnwindSafe(f)).ok();
    // Elsewhere a panic ends the program.
    #[cfg(not(all(feature = "std", panic = "unwind")))]
    Some(f())
}
