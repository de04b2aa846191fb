//! A function of pairs of directions, tabulated.

use super::rows::Rows;
use super::{Axis, Encoding, Samples};
use crate::chart::Coordinates;

/// Spline coefficients of S and V (or of their roots) of one thread's segments, over the box of its coordinates.
///
/// Samples are ordered `[u₃][u₂][u₁][u₀][channel]`, the last index fastest, by default channel 0 of S and 1 of V: the coefficients
/// that make up a value along the sharp axis are contiguous, all channels together. A grid that is baked for some pairs has
/// a part of each row along u₀ alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub(crate) coordinates: Coordinates,
    /// Those beyond the coordinates' rank are flat, the others not, but where all pairs that are needed have the same coordinate.
    pub(crate) axes: [Axis; 4],
    pub(crate) encoding: Encoding,
    pub(crate) content: Content,
    /// What the largest stored number stands for, per channel.
    pub(crate) scale: [f32; CHANNELS],
    /// Which coefficients there are, if not all.
    pub(crate) rows: Option<Rows>,
    /// Followed by [`PADDING`] numbers that do not matter, so that a row can be read as [`ROW`] numbers wherever it begins.
    pub(crate) samples: Samples,
}

/// What the channels of a grid are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "bake",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Content {
    /// S and V.
    Both,
    /// S alone: V does not matter, since the albedo is 0 and stays so.
    Surface,
    /// V alone: S is 0.
    Volume,
    /// S + A V, since the albedo A is grey and stays as it is.
    Dyed,
}

impl Content {
    /// How many channels there are.
    pub const fn channels(self) -> usize {
        match self {
            Self::Both => CHANNELS,
            Self::Surface | Self::Volume | Self::Dyed => 1,
        }
    }

    /// Whether it serves any albedo.
    pub const fn takes_albedo(self) -> bool {
        matches!(self, Self::Both | Self::Volume)
    }
}

/// The most channels: S and V.
pub(crate) const CHANNELS: usize = 2;
/// Numbers that are read at once along the sharp axis: three coefficients of two channels, and as many more as fill a
/// register.
pub(crate) const ROW: usize = 8;
/// See [`Grid::samples`]: of one channel.
pub(crate) const PADDING: usize = ROW - super::axis::TAPS;

impl Grid {
    /// What it is a function of.
    pub fn coordinates(&self) -> Coordinates {
        self.coordinates
    }

    /// What its channels are.
    pub fn content(&self) -> Content {
        self.content
    }

    /// From one coefficient of u₁, u₂ and u₃ to the next, in samples, if all are there; 0 along an axis that has one.
    pub(crate) fn strides(&self) -> [usize; 3] {
        let lengths = self.axes.each_ref().map(Axis::len);
        let mut stride = self.content.channels();
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

    /// Whether pairs can be asked for that it does not have.
    pub fn is_partial(&self) -> bool {
        self.rows.is_some() || self.collapsed().next().is_some()
    }

    /// Axes of the coordinates along which all pairs that are needed are at one place.
    pub(crate) fn collapsed(&self) -> impl Iterator<Item = usize> {
        let rank = self.coordinates.rank();
        (0..rank).filter(|axis| self.axes[*axis].is_flat())
    }

    /// How many cells of the box have coefficients, and how many cells there are; along a collapsed axis there is one.
    pub fn baked_cells(&self) -> [usize; 2] {
        match &self.rows {
            Some(rows) => rows.baked_cells(&self.axes),
            None => [self.axes.iter().map(|axis| axis.firsts().count()).product(); 2],
        }
    }

    /// Bytes of samples in memory, and of what finds them.
    pub fn bytes(&self) -> usize {
        self.sample_bytes() + self.rows.as_ref().map_or(0, Rows::bytes)
    }

    /// Bytes of samples.
    pub(super) fn sample_bytes(&self) -> usize {
        (self.samples.len() - PADDING) * self.encoding.bytes()
    }
}
