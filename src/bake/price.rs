//! What evaluation of a thread costs, in nanoseconds per pair.
//!
//! Measured on one core with AVX-512 (Intel Xeon, Sapphire Rapids). Machines differ by a factor that all prices share, more or less, and
//! only ratios count here.

use serde::{Deserialize, Serialize};

/// What a table is made for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum For {
    /// Many pairs at once: what is computed directly fills the machine's vectors.
    #[default]
    Batch,
    /// One pair at a time: grids are cheap beside what is computed directly.
    Single,
}

/// What parts of an evaluation cost.
pub(super) struct Prices {
    /// A grid of a few megabytes.
    grid: f64,
    /// What [`PlacedNodes`](crate::brdf::PlacedNodes) does once per segment …
    segment: f64,
    /// … and per tilt.
    tilt: f64,
    /// How many times as long that takes for the pairs near a horizon, whose vectors are not all full.
    scattered: f64,
}

impl For {
    pub(super) fn prices(self) -> Prices {
        match self {
            Self::Batch => Prices {
                grid: 20.0,
                segment: 7.6,
                tilt: 6.1,
                scattered: 1.5,
            },
            Self::Single => Prices {
                grid: 70.0,
                segment: 120.0,
                tilt: 12.0,
                scattered: 1.0,
            },
        }
    }
}

impl Prices {
    /// Of direct evaluation at so many tilts in each of so many segments.
    pub(super) fn direct(&self, segments: usize, tilts: usize) -> f64 {
        segments as f64 * (self.segment + tilts as f64 * self.tilt)
    }

    /// Of a grid with a rim that `share` of all pairs are in, where direct evaluation costs `direct`.
    pub(super) fn grid(&self, share: f64, direct: f64) -> f64 {
        self.grid + self.scattered * share * direct
    }
}
