//! Fabrics that are more extreme than any cloth.

use serde::{Deserialize, Serialize};

use crate::brdf::limits;
use crate::fabric::{Fabric, TextError, Thread};

/// What of a fabric is driven to its extremes, all threads alike unless said otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Sweep {
    /// γ_s in degrees; γ_v keeps its ratio to it.
    GammaS,
    /// k_d.
    Kd,
    /// η.
    Eta,
    /// Offsets from minus to plus so many degrees.
    Range,
    /// Offsets from so many degrees to 90°.
    Upright,
    /// A single tilt, degrees.
    Tilt,
    /// So many segments, to and fro.
    Segments,
    /// A second segment that begins so many degrees beside the first one's end, with another density.
    Gap,
    /// The length of a second segment over that of the first; 0 is a jump.
    Lengths,
    /// Coverage of the first thread; the others share the rest.
    Coverage,
    /// Coverage of all threads together.
    Sum,
    /// Albedo of all channels.
    Albedo,
    /// Width of u in degrees.
    SigmaU,
}

impl Sweep {
    /// All of them, with the values they take.
    pub const ALL: [(Self, &'static [f64]); 13] = [
        (
            Self::GammaS,
            &[45.0, 15.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01],
        ),
        (Self::Kd, &[0.0, 0.5, 1.0]),
        (Self::Eta, &[1.0, 1.000_001, 1.01, 1.5, 4.0]),
        (Self::Range, &[0.0, 0.001, 1.0, 10.0, 45.0, 80.0, 90.0]),
        (Self::Upright, &[0.0, 60.0, 89.0]),
        (Self::Tilt, &[-90.0, -89.99, 0.0, 89.99, 90.0]),
        (Self::Segments, &[10.0, 300.0]),
        (Self::Gap, &[1e-9, 1e-4, 0.1]),
        (Self::Lengths, &[0.0, 1e-9, 1e9]),
        (Self::Coverage, &[1e-9, 1.0]),
        (Self::Sum, &[1e-9, 1e-3, 1.0]),
        (Self::Albedo, &[0.0, 1e-6, 1000.0]),
        (Self::SigmaU, &[1.0, 90.0]),
    ];

    /// The values that a short run takes: the ends and one between.
    pub fn few(values: &[f64]) -> Vec<f64> {
        let mut few = vec![
            values[0],
            values[values.len() / 2],
            values[values.len() - 1],
        ];
        few.dedup();
        few
    }

    /// `fabric` with `value`.
    ///
    /// # Errors
    /// When that is no fabric: the reason is a verdict, too.
    pub fn apply(self, fabric: &Fabric, value: f64) -> Result<Fabric, TextError> {
        let mut changed = fabric.clone();
        changed.variant = None;
        let degrees = value.to_radians();
        match self {
            Self::SigmaU => changed.sigma_u = degrees,
            Self::Coverage => cover(&mut changed, value),
            Self::Sum => {
                let sum: f64 = fabric.threads.iter().map(|thread| thread.coverage).sum();
                for thread in &mut changed.threads {
                    thread.coverage *= value / sum;
                }
            }
            _ => {
                for thread in &mut changed.threads {
                    self.apply_to_thread(thread, value, degrees);
                }
            }
        }
        Fabric::from_toml(&changed.to_toml(), &fabric.name, None)
    }

    fn apply_to_thread(self, thread: &mut Thread, value: f64, degrees: f64) {
        let curve = |thread: &mut Thread, offsets: &[f64], lengths: &[f64]| {
            thread.tangent_offsets = offsets.to_vec();
            thread.tangent_lengths = lengths.to_vec();
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        match self {
            Self::GammaS => {
                let ratio = thread.optics.gamma_v / thread.optics.gamma_s;
                thread.optics.gamma_s = degrees;
                thread.optics.gamma_v = (ratio * degrees).min(*limits::GAMMA.end());
            }
            Self::Kd => thread.optics.k_d = value,
            Self::Eta => thread.optics.eta = value,
            Self::Range => curve(thread, &[-degrees, degrees], &[1.0]),
            Self::Upright => curve(thread, &[degrees, quarter], &[1.0]),
            Self::Tilt => curve(thread, &[degrees, degrees], &[1.0]),
            Self::Segments => {
                let count = value as usize;
                let offset = |k: usize| {
                    let amplitude = 0.2 + 0.8 * k as f64 / count as f64;
                    if k.is_multiple_of(2) {
                        amplitude
                    } else {
                        -amplitude
                    }
                };
                let offsets: Vec<f64> = (0..=count).map(offset).collect();
                curve(thread, &offsets, &vec![1.0; count]);
            }
            Self::Gap => curve(thread, &[-0.4, 0.2, 0.2 + degrees, 0.5], &[1.0, 0.0, 2.0]),
            Self::Lengths => curve(thread, &[-0.4, 0.1, 0.6], &[1.0, value]),
            Self::Albedo => thread.albedo = [value; 3],
            Self::Coverage | Self::Sum | Self::SigmaU => {}
        }
    }
}

/// Gives the first thread a coverage and what is left to the others.
fn cover(fabric: &mut Fabric, first: f64) {
    let others = fabric.threads.len().saturating_sub(1).max(1) as f64;
    for (index, thread) in fabric.threads.iter_mut().enumerate() {
        thread.coverage = if index == 0 {
            first
        } else {
            (1.0 - first) / others
        };
    }
}
