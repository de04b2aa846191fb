//! Why a table has no volume.

use super::MAX_BYTES;

/// Why a table cannot be made a volume.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Error {
    /// Even the coarsest volume is larger than allowed.
    TooLittle {
        /// Bytes that are allowed.
        allowed: usize,
        /// Bytes that the coarsest takes.
        least: usize,
    },
    /// More is allowed than [`MAX_BYTES`].
    TooMuch {
        /// Bytes that are allowed.
        bytes: usize,
    },
    /// Even the coarsest volume has more slabs than textures can have: too many threads have grids.
    TooDeep {
        /// Slabs.
        slabs: usize,
        /// The most that there may be.
        side: usize,
    },
    /// The table divides ρ by the albedo of the view, which shaders do not know.
    PerView,
}

impl core::fmt::Display for Error {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self {
            Self::TooLittle { allowed, least } => write!(
                f,
                "a volume of this table takes at least {least} bytes, but {allowed} are allowed; allow more"
            ),
            Self::TooMuch { bytes } => write!(
                f,
                "a volume of up to {bytes} bytes is more than the {MAX_BYTES} that there may be; allow less"
            ),
            Self::TooDeep { slabs, side } => write!(
                f,
                "a volume of this table is at least {slabs} texels deep, but {side} are allowed; fewer threads with grids would fit"
            ),
            Self::PerView => f.write_str(
                "this table keeps energy per view, which shaders do not; bake it with --energy clamp or as-is",
            ),
        }
    }
}

impl core::error::Error for Error {}
