//! Parameters of a fabric: what a TOML file says, checked.
//!
//! A fabric is a list of threads, each with a direction in the surface, optics, albedo, coverage and tangent curve
//! (\[Fecho13\] appendix A; \[SBDJ13\] table II). Angles are radians here and degrees in files.

mod library;
mod models;
mod parse;
mod sections;
pub(crate) mod source;
mod text;

pub use library::{LIBRARY, LibraryEntry, nearest_name};
pub use models::{
    Distribution, FresnelTerm, Irawan, Lambert, Models, OrenNayar, Shadowing, TorranceSparrow, Yarn,
};
pub use parse::MAX_TOML_BYTES;
pub use source::FabricError;

use crate::brdf::{Optics, Reweighting, TangentCurve, ThreadFrame};
use crate::math::Real;

/// A fabric with every parameter in its range.
#[derive(Debug, Clone, PartialEq)]
pub struct Fabric {
    /// The name to call it by, with the albedo variant: `polka-dot-lining-pink`.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// Where the parameters come from.
    pub source: String,
    /// How Q weighs tangents.
    pub reweighting: Reweighting,
    /// Width of the correlation Gaussian u, radians.
    pub sigma_u: f64,
    /// What ρ is multiplied by, 10⁻⁴ to 1: less than 1 keeps a fit from reflecting more than arrives.
    pub rho_scale: f64,
    /// The threads; those of coverage 0 may be present and cost nothing.
    pub threads: Vec<Thread>,
    /// Parameters of other models, to compare with.
    pub models: Box<Models>,
    /// The TOML text that this was read from, which tables record as what made them.
    pub toml: String,
    /// The albedo variant that was chosen, where the text offers several.
    pub variant: Option<String>,
}

/// One set of parallel threads.
#[derive(Debug, Clone, PartialEq)]
pub struct Thread {
    /// `warp`, `weft`, …
    pub name: String,
    /// Angle of the thread in the surface from the x axis towards y, radians.
    pub direction: f64,
    /// Share a of the surface that the thread covers, 0 to 1.
    pub coverage: f64,
    /// Albedo A of volume scattering, linear RGB.
    pub albedo: [f64; 3],
    /// η, k_d, γ_s, γ_v.
    pub optics: Optics<f64>,
    /// Tangent offsets o_0…o_n, radians.
    pub tangent_offsets: Vec<f64>,
    /// Lengths l_1…l_n of the segments between them.
    pub tangent_lengths: Vec<f64>,
}

impl Thread {
    /// The distribution of the thread's tilts.
    pub fn tangents<R: Real>(&self) -> TangentCurve<R> {
        TangentCurve::new(&self.tangent_offsets, &self.tangent_lengths)
    }

    /// The tilt, in radians, at a place along the thread, `share` ∈ \[0, 1\] of its length.
    pub fn tilt_at(&self, share: f64) -> f64 {
        let mut left = share * self.tangent_lengths.iter().sum::<f64>();
        for (ends, length) in self.tangent_offsets.windows(2).zip(&self.tangent_lengths) {
            if left < *length {
                return ends[0] + (ends[1] - ends[0]) * left / length;
            }
            left -= length;
        }
        self.tangent_offsets.last().copied().unwrap_or(0.0)
    }

    /// Tilts at the middles of `count` parts of equal length.
    pub fn midpoints(&self, count: u32) -> impl Iterator<Item = f64> {
        (0..count).map(move |k| self.tilt_at((f64::from(k) + 0.5) / f64::from(count)))
    }

    /// The thread's frame in the surface.
    pub fn frame<R: Real>(&self) -> ThreadFrame<R> {
        ThreadFrame::new(self.direction)
    }

    /// Whether the thread covers any of the surface.
    pub fn is_visible(&self) -> bool {
        self.coverage > 0.0
    }
}

impl Fabric {
    /// Reads a fabric from TOML text. `file` names it in errors; `variant` chooses among named albedos, the first in
    /// alphabetical order by default.
    ///
    /// # Errors
    /// What is wrong, with the key and the line.
    pub fn from_toml(text: &str, file: &str, variant: Option<&str>) -> Result<Self, FabricError> {
        parse::parse(text, file, variant)
    }

    /// TOML text of the parameters, whatever [`Fabric::toml`] says: to read a fabric whose fields were changed. Angles come back to
    /// the last bit or two.
    pub fn to_toml(&self) -> String {
        text::to_toml(self)
    }

    /// The library's fabric of that name, as [`LIBRARY`] lists them.
    pub fn from_library(name: &str) -> Option<Self> {
        LIBRARY
            .iter()
            .find(|entry| entry.name == name)
            .map(LibraryEntry::load)
    }

    /// The threads that cover some of the surface.
    pub fn visible_threads(&self) -> impl Iterator<Item = &Thread> {
        self.threads.iter().filter(|thread| thread.is_visible())
    }

    /// Whether one table serves both: all parameters but the albedos are the same.
    pub fn is_dyed_like(&self, other: &Self) -> bool {
        let undyed = |fabric: &Self| {
            let threads = fabric.threads.iter().cloned().map(|thread| Thread {
                albedo: [0.0; 3],
                ..thread
            });
            (
                fabric.reweighting,
                fabric.sigma_u,
                fabric.rho_scale,
                threads.collect::<Vec<_>>(),
            )
        };
        undyed(self) == undyed(other)
    }

    /// 1 − Σa, the share of gaps.
    pub fn gap(&self) -> f64 {
        (1.0 - self
            .threads
            .iter()
            .map(|thread| thread.coverage)
            .sum::<f64>())
        .max(0.0)
    }
}
