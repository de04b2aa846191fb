//! Volumes: the grids of a table made dense and linear, for the filters of graphics hardware.
//!
//! A table's splines take 27 rows of coefficients, too dear for a pixel. A [`Volume`] is one 3D texture of four half floats per
//! texel that holds all grids of a table, in which a lookup in a grid is **one filtered fetch and one mix**:
//!
//! ```text
//! x = t₀, y = t₁, z = first slab + n₂ k + t₂      k = ⌊t₃⌋, at most n₃ − 2
//! (R, G) = (√S, √V) at node k of u₃, (B, A) at node k + 1:    √S = mix(R, B, t₃ − k),  √V = mix(G, A, t₃ − k)
//! S = scale_S (√S)²,  V = scale_V (√V)²
//! ```
//!
//! t₀ … t₃ are the chart's coordinates u₀ … u₃ in nodes. Texel centres are nodes, so that x is sampled at (t₀ + ½)/n, and t₂ is within
//! 0 … n₂ − 1: what is filtered along z are nodes of one slab. A thread thus takes one fetch, one whose direction changes along
//! its curve two (the second is its projection), and a thread without a grid none. With (√S, √V) alone in a texel it would be two fetches
//! at half the bytes.
//!
//! Nodes are where linear interpolation needs them, multiples of a small power of two, so that a table of 2^depth straight pieces turns
//! u into t exactly ([`Nodes`]). The root is what is interpolated, since a root bends less than a lobe does. `plan` chooses the
//! nodes, `fill` the values.
//!
//! It stands above the lookup, whose tables it samples, and needs neither fabrics nor models: an engine can make volumes of the files it
//! ships. Evaluation is in [`crate::shader`].

mod error;
mod fill;
mod nodes;
mod plan;

pub use error::Error;
pub use nodes::Nodes;

use half::f16;

use crate::chart::Coordinates;
use crate::table::{Grid, Table};

/// Texels along each side at most, which every API has.
pub const MAX_SIDE: usize = 2048;
/// R, G, B and A, half floats.
pub const TEXEL_BYTES: usize = 8;
/// The largest volume that can be asked for.
pub const MAX_BYTES: usize = 64 << 20;

/// How to make a volume.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The most bytes of texels, up to [`MAX_BYTES`].
    pub max_bytes: usize,
    /// Nodes are added until the mean relative error that linear interpolation is expected to add is below this, or `max_bytes` are
    /// reached.
    pub target_error: f64,
}

impl Default for Settings {
    /// At most 8 MiB; fewer where interpolation errs no more than 0.1 %, twice what half floats do.
    fn default() -> Self {
        Self {
            max_bytes: 8 << 20,
            target_error: 1e-3,
        }
    }
}

/// A table's grids as one 3D texture. Of a table without grids it is a single texel, which nothing reads.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    size: [usize; 3],
    /// `[z][y][x]`
    texels: Vec<[f16; 4]>,
    grids: Vec<GridVolume>,
}

/// Where in a [`Volume`] a grid is.
#[derive(Debug, Clone, PartialEq)]
pub struct GridVolume {
    pub(crate) coordinates: Coordinates,
    pub(crate) nodes: [Nodes; 4],
    pub(crate) first_slab: usize,
    /// What 1 stands for, per channel, after squaring.
    pub(crate) scale: [f32; 2],
}

impl GridVolume {
    /// What it is a function of.
    pub fn coordinates(&self) -> Coordinates {
        self.coordinates
    }

    /// The nodes of u₀ to u₃.
    pub fn nodes(&self) -> &[Nodes; 4] {
        &self.nodes
    }

    /// How many texels it takes along z.
    pub fn slabs(&self) -> usize {
        slabs(&self.nodes)
    }
}

/// Texels along z of a grid with such nodes.
fn slabs(nodes: &[Nodes; 4]) -> usize {
    nodes[2].count() * nodes[3].count().saturating_sub(1).max(1)
}

impl Volume {
    /// The volume of a table. It does not depend on the number of threads.
    ///
    /// Where a table was baked for some pairs alone, nodes elsewhere have the nearest value, as its lookups do; the volume does not tell one
    /// from the other.
    ///
    /// # Errors
    /// When `settings` leave too little room, or more than [`MAX_BYTES`].
    pub fn new(table: &Table, settings: &Settings) -> Result<Self, Error> {
        if settings.max_bytes > MAX_BYTES {
            return Err(Error::TooMuch {
                bytes: settings.max_bytes,
            });
        }
        let grids: Vec<&Grid> = table.threads().iter().flat_map(|t| t.grids()).collect();
        if grids.is_empty() {
            return Ok(Self {
                size: [1; 3],
                texels: vec![[f16::ZERO; 4]],
                grids: Vec::new(),
            });
        }
        let plan = plan::plan(table, settings)?;
        let size = plan::size(&plan);
        let mut volume = Self {
            size,
            texels: Vec::with_capacity(size.iter().product()),
            grids: Vec::with_capacity(grids.len()),
        };
        for (grid, nodes) in grids.iter().zip(plan) {
            let scale = fill::fill(grid, &nodes, [size[0], size[1]], &mut volume.texels);
            let first_slab = volume.grids.iter().map(GridVolume::slabs).sum();
            volume.grids.push(GridVolume {
                coordinates: grid.coordinates(),
                nodes,
                first_slab,
                scale,
            });
        }
        Ok(volume)
    }

    /// Texels along x, y and z.
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// R, G, B and A of every texel as bits of half floats, x fastest, then y.
    pub fn texels(&self) -> impl ExactSizeIterator<Item = [u16; 4]> + '_ {
        self.texels.iter().map(|texel| texel.map(f16::to_bits))
    }

    /// The texels as a texture of RGBA16F takes them: little-endian, rows and slices without gaps.
    pub fn to_bytes(&self) -> Vec<u8> {
        let halves = self.texels.iter().flatten();
        halves.flat_map(|half| half.to_le_bytes()).collect()
    }

    /// The same with other texels, x fastest, then y: those that were read from a file, or that a smaller format keeps. None unless there are
    /// as many.
    pub fn with_texels(&self, texels: impl IntoIterator<Item = [u16; 4]>) -> Option<Self> {
        let halves = |texel: [u16; 4]| texel.map(f16::from_bits);
        let texels: Vec<[f16; 4]> = texels.into_iter().map(halves).collect();
        (texels.len() == self.texels.len()).then(|| Self {
            size: self.size,
            texels,
            grids: self.grids.clone(),
        })
    }

    /// Bytes of texels.
    pub fn bytes(&self) -> usize {
        TEXEL_BYTES * self.texels.len()
    }

    /// The grids, in the order of the threads; of a thread whose direction changes along its curve S and V, then the projection.
    pub fn grids(&self) -> &[GridVolume] {
        &self.grids
    }

    pub(crate) fn texel(&self, x: usize, y: usize, z: usize) -> [f32; 4] {
        let [width, height, _] = self.size;
        self.texels[(z * height + y) * width + x].map(f16::to_f32)
    }
}
