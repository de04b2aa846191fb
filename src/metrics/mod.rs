//! The error protocol: how far an approximation is from direct integration.
//!
//! Half of the pairs are *render* pairs, wi and wr independent and cosine-weighted. Half are *highlight* pairs, wi
//! cosine-weighted and wr on the reflection cone of a tilt of a random thread. The relative error of a pair is
//!
//! ```text
//! max over channels of |ρ_T − ρ_D| / (ρ_D + 0.01 ρ̄)        ρ̄ = the channel's mean ρ_D over the render pairs
//! ```
//!
//! with ρ_D by direct integration in f64 to 1e-7. *Grazing* pairs have min(wi·n, wr·n) < 0.1. Directional reflectance at
//! a view angle is ∫ ρ dwi, and its bias (R_T − R_D)/R_D is taken over the same directions for both.
//!
//! Few of those pairs are near the horizon, where lobes are steepest; a quarter as many again, at least 512, are for each *rim*, where
//! w·n is uniform: of one direction in 1e-4 … 0.1, with the other drawn as above; of both; of both in 1e-4 … 0.02. The mean ρ̄ is the
//! protocol's there, too.

mod energy;
mod error;
mod pairs;
mod pairs_file;
mod physics;
mod time;

pub use energy::{Reflectance, ViewReflectance, conserving};
pub use error::{Bias, ErrorReport, PairErrors, Quantiles, Reference, Truth, measure_table};
pub use pairs::{Pair, PairKind, Pairs, protocol_pairs};
pub use pairs_file::{MAX_CSV_BYTES, MAX_CSV_LINE_BYTES, PairsFile, PairsFileError};
pub use physics::Physics;
pub use time::{median, nanoseconds_per_pair};

use crate::model::Model;
use crate::table::Table;

/// A table as a model among others.
#[derive(Debug, Clone, Copy)]
pub struct TableModel<'a>(pub &'a Table);

impl Model<f64> for TableModel<'_> {
    fn eval_cos(&self, wi: [f64; 3], wr: [f64; 3]) -> [f64; 3] {
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        self.0.eval_cos(single(wi), single(wr)).map(f64::from)
    }
}

/// Pairs that `validate` draws unless told otherwise.
pub const DEFAULT_PAIRS: usize = 65_536;
/// The seed of the error that a bake records …
pub const RECORDED_SEED: u64 = 2013;
/// … and of `validate` unless told otherwise: other pairs than those.
pub const VALIDATION_SEED: u64 = 17;
