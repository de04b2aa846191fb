//! What a bake aims for.

use serde::{Deserialize, Serialize};

use super::{Direct, For};
use crate::chart::Chart;
use crate::table::Energy;

/// Size against accuracy, ready-made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// At most 300 kB in memory and 200 kB in the file: for previews.
    Draft,
    /// At most 1.2 MB in memory and 0.7 MB in the file: for use.
    Standard,
    /// At most 32 MiB in memory: for reference; takes minutes.
    Fine,
}

/// How to bake.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Settings {
    /// The preset that these settings began as.
    pub preset: Preset,
    /// The four coordinates of the tables; if none, for each thread those in which less error is expected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chart: Option<Chart>,
    /// The most bytes of samples in memory, shared equally by the threads that need a grid.
    pub max_bytes: usize,
    /// Knots are added to a thread's grid until its expected mean relative error is below this, or `max_bytes` reached.
    pub target_error: f64,
    /// When segments are evaluated directly instead of from a grid.
    pub direct: Direct,
    /// What evaluation is priced for.
    #[serde(default)]
    pub made_for: For,
    /// Whether the table gets what draws directions for path tracers, if all of it is baked.
    #[serde(default)]
    pub sampling: bool,
    /// What becomes of views that would reflect more than arrives.
    #[serde(default)]
    pub energy: Energy,
    /// The mean relative error to expect of a thread, above which its grid has failed, and which direct evaluation keeps.
    pub max_error: f64,
    /// Relative tolerance of the integral at a site.
    pub tolerance: f64,
    /// Pairs on which the error that is written into the table is measured.
    pub error_pairs: usize,
    /// The seed that draws them.
    pub error_seed: u64,
}

impl Preset {
    /// All of them, from the smallest on.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Standard, Self::Fine];

    /// What files, flags and reports call it: `standard`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Standard => "standard",
            Self::Fine => "fine",
        }
    }

    /// The settings of the preset.
    pub fn settings(self) -> Settings {
        let (max_bytes, max_error, target_error, tolerance) = match self {
            Self::Draft => (290 << 10, 1e-2, 2e-3, 1e-4),
            Self::Standard => (1170 << 10, 2e-3, 5e-4, 1e-4),
            Self::Fine => (32 << 20, 3e-4, 1e-4, 1e-5),
        };
        Settings {
            preset: self,
            chart: None,
            max_bytes,
            target_error,
            direct: Direct::Worthwhile,
            made_for: For::Batch,
            sampling: true,
            energy: Energy::AsIs,
            max_error,
            tolerance,
            error_pairs: 16_384,
            error_seed: crate::metrics::RECORDED_SEED,
        }
    }
}
