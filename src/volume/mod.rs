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
//! Error of ρ against direct integration on 4096 pairs of the protocol, mean and, in brackets, 99th percentile, in percent: of standard
//! tables and of their volumes by the most bytes that these may take; size and parameters ([`crate::shader`]) of the larger. `–`: the fabric
//! has no grid, and its closed forms are as exact as the table.
//!
//! | fabric | table | 1 MiB | 8 MiB | texels | float4 |
//! |---|---|---|---|---|---|
//! | corduroy | 0.056 (0.63) | 0.314 (3.37) | 0.134 (1.48) | 37 × 35 × 777 | 211 |
//! | denim | 0.089 (0.92) | 0.773 (6.93) | 0.276 (2.31) | 20 × 33 × 1584 | 324 |
//! | faux-suede | 0.000 (0.00) | – | – | – | 12 |
//! | felt | 0.042 (0.40) | 0.078 (0.55) | the same | 61 × 57 × 27 | 441 |
//! | linen-plain | 0.078 (0.71) | 0.695 (8.18) | 0.220 (2.52) | 20 × 33 × 1584 | 320 |
//! | polka-dot-lining-pink | 0.132 (1.56) | 0.676 (7.00) | 0.320 (2.82) | 40 × 33 × 770 | 243 |
//! | polka-dot-lining-white | 0.059 (0.50) | 0.362 (3.03) | 0.170 (1.36) | 40 × 33 × 770 | 243 |
//! | polyester-lining | 0.088 (0.75) | 0.668 (6.62) | 0.257 (2.07) | 40 × 37 × 700 | 234 |
//! | polyester-satin-charmeuse-back | 0.026 (0.25) | 0.218 (2.26) | 0.076 (0.94) | 40 × 35 × 735 | 385 |
//! | polyester-satin-charmeuse-front | 0.061 (0.53) | 0.804 (7.93) | 0.223 (1.95) | 42 × 29 × 858 | 224 |
//! | silk-crepe-de-chine | 0.031 (0.35) | 0.251 (2.88) | 0.093 (0.93) | 30 × 31 × 1127 | 203 |
//! | silk-shot | 0.038 (0.35) | 0.535 (6.09) | 0.138 (1.29) | 32 × 35 × 936 | 171 |
//! | swimwear-back | 0.106 (1.37) | 0.823 (8.23) | 0.287 (4.43) | 20 × 37 × 1416 | 272 |
//! | swimwear-front | 0.096 (1.01) | 0.829 (9.74) | 0.262 (3.15) | 22 × 33 × 1440 | 304 |
//! | tshirt-black-back | 0.030 (0.48) | – | – | – | 17 |
//! | tshirt-black-front | 0.036 (0.39) | – | – | – | 17 |
//! | tshirt-white | 0.033 (0.51) | – | – | – | 15 |
//! | velvet-spread | 0.257 (1.94) | 3.280 (26.59) | 1.085 (8.23) | 31 × 37 × 902 | 492 |
//! | velvet | 0.029 (0.25) | – | – | – | 36 |
//! | warp-knit | 0.077 (1.15) | 0.795 (7.92) | 0.343 (4.63) | 29 × 57 × 628 | 247 |
//! | weft-knit-curve | 0.056 (0.65) | 0.742 (7.66) | 0.206 (1.84) | 27 × 53 × 727 | 311 |
//! | weft-knit | 0.090 (0.94) | 0.665 (5.36) | 0.271 (2.37) | 18 × 29 × 2000 | 335 |
//!
//! Weights of 8 bits, with which hardware filters, add at most 0.003 % to these means. Near the horizon, where S and V are small and rise
//! steeply, a volume is not asked: grids end before it (denim's 99th percentile of grazing pairs is 0.9 % in 8 MiB), but those of threads whose
//! direction changes along their curve.
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
use crate::table::{Energy, Grid, Table};

/// Texels along each side at most: what WebGPU promises, and what implementations of WebGL 2 have, though its promise is 256.
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
    /// The most texels along a side, up to [`MAX_SIDE`]. Depth is what there is most of.
    pub max_side: usize,
}

impl Default for Settings {
    /// At most 8 MiB; fewer where interpolation errs no more than 0.1 %, twice what half floats do.
    fn default() -> Self {
        Self {
            max_bytes: 8 << 20,
            target_error: 1e-3,
            max_side: MAX_SIDE,
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
    /// The volume of a table. It does not depend on the number of workers.
    ///
    /// Where a table was baked for some pairs alone, nodes elsewhere have the nearest value, as its lookups do; the volume does not tell one
    /// from the other.
    ///
    /// # Errors
    /// When `settings` leave too little room, or more than [`MAX_BYTES`]; or the table's energy is kept per view.
    pub fn new(table: &Table, settings: &Settings) -> Result<Self, Error> {
        if table.energy() == Energy::PerView {
            return Err(Error::PerView);
        }
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
