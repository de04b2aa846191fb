//! Why bytes are not a table.

use core::fmt;

/// Why bytes could not be read as a table.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// The magic number is missing: this is some other kind of file.
    NotATable,
    /// The file's format is another than this reader's.
    Version {
        /// Version of the file; before 3 its upper half is a minor version.
        version: u32,
    },
    /// The file ends too soon.
    Truncated {
        /// Bytes that it should have.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// There are bytes behind the end.
    TrailingBytes {
        /// Bytes that it should have.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// Bytes have changed since the table was written.
    Checksum {
        /// Which part.
        part: &'static str,
    },
    /// A value contradicts the format.
    Invalid {
        /// Which value.
        what: &'static str,
        /// Where the reader was, bytes from the start of the file.
        offset: usize,
    },
    /// The table would take more memory than [`super::MAX_DECODED_BYTES`].
    TooLarge {
        /// Bytes that it would take.
        bytes: u64,
    },
    /// A chunk does not decompress to what the header says.
    Decompression,
    /// A chunk is compressed, but the library was built without the `zstd` feature.
    NoZstd,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotATable => write!(f, "not a sateen table"),
            Self::Version { version } => write!(
                f,
                "format version {}, but this sateen reads {}; {}",
                version & 0xFFFF,
                super::VERSION,
                if *version > super::VERSION && version >> 16 == 0 {
                    "upgrade sateen"
                } else {
                    "bake it again"
                }
            ),
            Self::Truncated { expected, found } => {
                write!(
                    f,
                    "cut off after {found} bytes, where at least {expected} belong; copy or bake it again"
                )
            }
            Self::TrailingBytes { expected, found } => {
                write!(
                    f,
                    "{} bytes follow the end of the table at {expected}; copy or bake it again",
                    found - expected
                )
            }
            Self::Checksum { part } => write!(
                f,
                "damaged: the checksum of the {part} does not match; copy or bake it again"
            ),
            Self::Invalid { what, offset } => write!(f, "invalid: {what} (near byte {offset})"),
            Self::TooLarge { bytes } => {
                write!(
                    f,
                    "would take {bytes} bytes of memory, more than the {} allowed",
                    super::MAX_DECODED_BYTES
                )
            }
            Self::Decompression => write!(
                f,
                "damaged: a chunk does not decompress; copy or bake it again"
            ),
            Self::NoZstd => write!(f, "compressed, but this build lacks the `zstd` feature"),
        }
    }
}

impl core::error::Error for Error {}
