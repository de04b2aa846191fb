//! A function of pairs of directions, tabulated.

use super::numbers::Numbers;
use super::rows::Rows;
use super::{Axis, UNIT};
use crate::chart::Coordinates;

/// Spline coefficients of √S and √V of one thread's segments, over the box of its coordinates.
///
/// They lie in tiles, as they are looked up: `[u₃][u₂][u₁/2][u₀][channel][2]`, the last index fastest. A tile is two rows along the
/// sharp axis, of even and odd place along u₁, whose coefficients lie alternately, by default channel 0 of S and 1 of V: so
/// what makes up a value in two rows is one load, and one instruction multiplies and adds both. A grid that is baked for some
/// pairs has a part of each tile alone.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub(crate) coordinates: Coordinates,
    /// Those beyond the coordinates' rank are flat, the others not, but where all pairs that are needed have the same coordinate.
    pub(crate) axes: [Axis; 4],
    pub(crate) content: Content,
    /// What the largest stored number stands for, per channel.
    pub(crate) scale: [f32; CHANNELS],
    /// Which coefficients there are, if not all.
    pub(crate) rows: Option<Rows>,
    /// Followed by [`PADDING`] numbers that do not matter, so that a tile can be read as [`TILE`] numbers wherever it begins.
    pub(crate) tiles: Numbers,
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
/// Numbers that are read at once: three coefficients of two channels in two rows, and as many more as fill a register.
pub(crate) const TILE: usize = 16;
/// The sum of the integer weights of rows.
pub(crate) const WHOLE: u32 = 32_767;
/// See [`Grid::tiles`]: of one channel.
pub(crate) const PADDING: usize = TILE - 2 * super::axis::TAPS;

/// How many tiles as many rows along u₁ make.
pub(crate) const fn tiles_of(rows: usize) -> usize {
    rows.div_ceil(2)
}

/// How many coefficients grids of these axes have in their tiles, which are of two rows along u₁ even where there is one.
#[cfg(feature = "bake")]
pub(crate) fn coefficients_of(axes: &[Axis; 4]) -> usize {
    let [n0, n1, n2, n3] = axes.each_ref().map(Axis::len);
    2 * n0 * tiles_of(n1) * n2 * n3
}

impl Grid {
    /// What it is a function of.
    pub fn coordinates(&self) -> Coordinates {
        self.coordinates
    }

    /// What its channels are.
    pub fn content(&self) -> Content {
        self.content
    }

    /// From one tile to the next, and from one coefficient of u₂ and u₃ to the next, in numbers, if all are there; 0 along an axis that has
    /// one.
    pub(crate) fn strides(&self) -> [usize; 3] {
        let [n0, n1, n2, _] = self.axes.each_ref().map(Axis::len);
        let tile = 2 * self.content.channels() * n0;
        let plane = tile * tiles_of(n1);
        let strides = [tile, plane, plane * n2];
        [0, 1, 2].map(|k| {
            if self.axes[k + 1].is_flat() {
                0
            } else {
                strides[k]
            }
        })
    }

    /// From one coefficient of u₀ to the next, and the others.
    pub(crate) fn all_strides(&self) -> [u32; 4] {
        let [s1, s2, s3] = self.strides();
        [2 * self.content.channels(), s1, s2, s3].map(|stride| stride as u32)
    }

    /// What the integers of each channel stand for, times those of weights that sum to [`WHOLE`].
    pub(crate) fn integer_scale(&self) -> [f32; CHANNELS] {
        let of = |scale: f32| (f64::from(scale) / (UNIT * f64::from(WHOLE))) as f32;
        self.scale.map(of)
    }

    /// How many numbers there are, of so many tiles' coefficients.
    pub(super) fn numbers_of(content: Content, coefficients: u64) -> u64 {
        2 * content.channels() as u64 * coefficients
    }

    /// The axes of u₀ to u₃.
    pub fn axes(&self) -> &[Axis; 4] {
        &self.axes
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

    /// Bytes of coefficients in memory, and of what finds them.
    pub fn bytes(&self) -> usize {
        self.tile_bytes() + self.rows.as_ref().map_or(0, Rows::bytes)
    }

    /// Bytes of coefficients.
    pub(super) fn tile_bytes(&self) -> usize {
        size_of_val(self.tiles.stored())
    }
}
