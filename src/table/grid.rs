//! A function of pairs of directions, tabulated.

use super::{Axis, Encoding, Samples};
use crate::chart::Coordinates;

/// Spline coefficients of S and V (or of their roots) of one thread's segments, over the box of its coordinates.
///
/// Samples are ordered `[u₃][u₂][u₁][u₀][channel]`, the last index fastest, channel 0 of S and 1 of V: the coefficients
/// that make up a value along the sharp axis are contiguous, both channels together.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub(crate) coordinates: Coordinates,
    /// Those beyond the coordinates' rank are flat, the others not.
    pub(crate) axes: [Axis; 4],
    pub(crate) encoding: Encoding,
    /// What the largest stored number stands for, per channel.
    pub(crate) scale: [f32; CHANNELS],
    /// Followed by [`PADDING`] zeros, so that a row can be read as [`ROW`] numbers wherever it begins.
    pub(crate) samples: Samples,
}

/// S and V.
pub(crate) const CHANNELS: usize = 2;
/// Numbers that are read at once along the sharp axis: three coefficients of two channels, and as many more as fill a
/// register.
pub(crate) const ROW: usize = 8;
/// See [`Grid::samples`].
pub(crate) const PADDING: usize = ROW - super::axis::TAPS * CHANNELS;

impl Grid {
    /// What it is a function of.
    pub fn coordinates(&self) -> Coordinates {
        self.coordinates
    }

    /// From one coefficient of u₁, u₂ and u₃ to the next, in samples; 0 along an axis that has one.
    pub(crate) fn strides(&self) -> [usize; 3] {
        let lengths = self.axes.each_ref().map(Axis::len);
        let mut stride = CHANNELS;
        [1, 2, 3].map(|axis| {
            stride *= lengths[axis - 1];
            if self.axes[axis].is_flat() { 0 } else { stride }
        })
    }

    /// The axes of u₀ to u₃.
    pub fn axes(&self) -> &[Axis; 4] {
        &self.axes
    }

    /// How coefficients are stored.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Bytes of samples in memory.
    pub fn bytes(&self) -> usize {
        (self.samples.len() - PADDING) * self.encoding.bytes()
    }
}
