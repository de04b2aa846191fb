//! Parameters of a fabric: what a TOML file says, checked.
//!
//! A fabric is a list of threads, each with a direction in the surface, optics, albedo, coverage and tangent curve
//! (\[Fecho13\] appendix A; \[SBDJ13\] table II). In knits and piles the direction changes along the curve, too (\[Fecho13\]
//! 6.1.2). Angles are radians here and degrees in files.

mod library;
mod models;
mod parse;
mod sections;
mod strands;
mod text;

pub use library::{LIBRARY, LibraryEntry, nearest_name};
pub use models::{
    Distribution, FresnelTerm, Irawan, Lambert, Models, OrenNayar, Shadowing, TorranceSparrow, Yarn,
};
pub use strands::{Strand, Strands, Sweep};

use crate::brdf::{Optics, Reweighting, TangentCurve, ThreadFrame};
use crate::math::Real;
pub use crate::text::{MAX_TOML_BYTES, TextError};

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

/// One set of threads that run alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Thread {
    /// `warp`, `weft`, …
    pub name: String,
    /// Share a of the surface that the thread covers, 0 to 1.
    pub coverage: f64,
    /// Albedo A of volume scattering, linear RGB.
    pub albedo: [f64; 3],
    /// η, k_d, γ_s, γ_v.
    pub optics: Optics<f64>,
    /// Directions in the surface α_0…α_n, from the x axis towards y, radians: one for every tangent offset, all the same for
    /// a straight thread.
    pub directions: Vec<f64>,
    /// Tangent offsets o_0…o_n, radians.
    pub tangent_offsets: Vec<f64>,
    /// Lengths l_1…l_n of the segments between them.
    pub tangent_lengths: Vec<f64>,
}

impl Thread {
    /// The distribution of the thread's tilts, in whatever directions.
    pub fn tangents<R: Real>(&self) -> TangentCurve<R> {
        TangentCurve::new(&self.tangent_offsets, &self.tangent_lengths)
    }

    /// Whether its direction is one and the same.
    pub fn is_straight(&self) -> bool {
        let mut directions = self.sections().flat_map(|(ends, _)| ends);
        let first = directions.next();
        directions.all(|next| Some(next) == first)
    }

    /// Whether it is straight and of single tilts alone, whose closed form is exact.
    pub fn has_closed_form(&self) -> bool {
        self.is_straight() && self.tangents::<f64>().segments().is_empty()
    }

    /// Its direction, or the mean along the curve, radians.
    pub fn direction(&self) -> f64 {
        if self.is_straight() {
            return self.sections().next().map_or(0.0, |(ends, _)| ends[0]);
        }
        let (sum, total) = self
            .sections()
            .fold((0.0, 0.0), |(sum, total), (ends, length)| {
                (sum + 0.5 * (ends[0] + ends[1]) * length, total + length)
            });
        sum / total
    }

    /// Directions at both ends, and lengths, of what is more than a jump.
    fn sections(&self) -> impl Iterator<Item = ([f64; 2], f64)> {
        let ends = self.directions.windows(2).zip(&self.tangent_lengths);
        ends.filter(|(_, length)| **length > 0.0)
            .map(|(ends, length)| ([ends[0], ends[1]], *length))
    }

    /// Tilt and direction, in radians, at a place along the thread, `share` ∈ \[0, 1\] of its length.
    pub fn tangent_at(&self, share: f64) -> [f64; 2] {
        let mut left = share * self.tangent_lengths.iter().sum::<f64>();
        for (k, length) in self.tangent_lengths.iter().enumerate() {
            if left < *length {
                return [&self.tangent_offsets, &self.directions]
                    .map(|angles| angles[k] + (angles[k + 1] - angles[k]) * left / length);
            }
            left -= length;
        }
        [&self.tangent_offsets, &self.directions].map(|angles| angles[angles.len() - 1])
    }

    /// Tilt and direction at the middles of `count` parts of equal length.
    pub fn midpoints(&self, count: u32) -> impl Iterator<Item = [f64; 2]> {
        (0..count).map(move |k| self.tangent_at((f64::from(k) + 0.5) / f64::from(count)))
    }

    /// The thread's frame in the surface: that of its mean direction.
    pub fn frame<R: Real>(&self) -> ThreadFrame<R> {
        ThreadFrame::new(self.direction())
    }

    /// The thread's curve in parts, with directions counted from `origin` (radians).
    pub fn strands(&self, origin: f64) -> Strands {
        Strands::new(self, origin)
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
    pub fn from_toml(text: &str, file: &str, variant: Option<&str>) -> Result<Self, TextError> {
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
