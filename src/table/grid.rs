//! The 4D table of one thread.

use super::{Axis, Encoding, Samples};
use crate::chart::Chart;

/// Spline coefficients of S and V (or of their roots) of one thread's segments, over the box of a chart.
///
/// Samples are ordered `[u₃][u₂][u₁][u₀][channel]`, the last index fastest, channel 0 of S and 1 of V: the coefficients
/// that make up a value along the sharp axis are contiguous, both channels together.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub(crate) chart: Chart,
    /// Whether only u₀ ≥ ½ is stored, the segments looking the same from both ends of the thread.
    pub(crate) folded: bool,
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
    /// The chart that the axes are of.
    pub fn chart(&self) -> Chart {
        self.chart
    }

    /// Whether the table holds the half u₀ ≥ ½ only, for a thread that looks the same from both ends.
    pub fn is_folded(&self) -> bool {
        self.folded
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
