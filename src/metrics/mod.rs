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

mod error;
mod pairs;

pub use error::{Bias, ErrorReport, Quantiles, measure};
pub use pairs::{Pair, PairKind, protocol_pairs};

/// Pairs that `validate` draws unless told otherwise.
pub const DEFAULT_PAIRS: usize = 65_536;
/// The seed of every measurement unless told otherwise.
pub const DEFAULT_SEED: u64 = 2013;
