//! Directional reflectance: how much of the light that arrives a cloth sends on, and how to keep that below all of it.

use std::f64::consts::TAU;
use std::fmt;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::error::lights_and_solid_angle;
use crate::fabric::{Fabric, TextError};
use crate::model::{Model, Rule, Sadeghi};

/// View angles in degrees, and azimuths at each of them.
const STEP_DEG: f64 = 11.0;
const ANGLES: usize = 9;
const AZIMUTHS: usize = 24;
/// Lights: bands of equal solid angle, and azimuths.
const LIGHTS: (usize, usize) = (32, 64);
/// Exact enough, and the same on every machine.
const RULE: Rule = Rule::Quadrature(4);
/// Between the views that are looked at a little more may be reflected.
const MARGIN: f64 = 1.005;

/// Directional reflectance ∫ ρ dwi of the brightest channel, as a share of what arrives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reflectance {
    /// By angle between viewer and normal, from 0° on.
    pub views: Vec<ViewReflectance>,
}

/// Directional reflectance at a view angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ViewReflectance {
    /// Degrees from the normal.
    pub view_deg: f64,
    /// Mean over azimuths.
    pub mean: f64,
    /// Largest over azimuths.
    pub max: f64,
}

impl Reflectance {
    /// Of any model, at 9 view angles from 0° to 88° and 24 azimuths.
    pub fn of(model: &(impl Model<f64> + ?Sized)) -> Self {
        let (lights, solid_angle) = lights_and_solid_angle(LIGHTS);
        let at = |view: usize| {
            let (sin, cos) = (STEP_DEG * (view / AZIMUTHS) as f64).to_radians().sin_cos();
            // From x on: along and across threads, where the most is reflected.
            let azimuth = TAU * (view % AZIMUTHS) as f64 / AZIMUTHS as f64;
            let wr = [sin * azimuth.cos(), sin * azimuth.sin(), cos];
            let mut sum = [0.0; 3];
            for wi in &lights {
                for (sum, rho) in sum.iter_mut().zip(model.eval_cos(*wi, wr)) {
                    *sum += solid_angle * rho;
                }
            }
            sum.into_iter().fold(0.0, f64::max)
        };
        let reflected: Vec<f64> = (0..ANGLES * AZIMUTHS).into_par_iter().map(at).collect();
        let views = reflected.chunks_exact(AZIMUTHS).enumerate();
        Self {
            views: views
                .map(|(angle, shares)| ViewReflectance {
                    view_deg: STEP_DEG * angle as f64,
                    mean: shares.iter().sum::<f64>() / AZIMUTHS as f64,
                    max: shares.iter().copied().fold(0.0, f64::max),
                })
                .collect(),
        }
    }

    /// Of a fabric's own model.
    pub fn of_fabric(fabric: &Fabric) -> Self {
        Self::of(&Sadeghi::<f64>::new(fabric, RULE))
    }

    /// Where it is largest.
    pub fn peak(&self) -> ViewReflectance {
        let first = self.views[0];
        let larger = |a: ViewReflectance, b: &ViewReflectance| if b.max > a.max { *b } else { a };
        self.views.iter().fold(first, larger)
    }

    /// Whether nowhere more is reflected than arrives.
    pub fn conserves_energy(&self) -> bool {
        self.peak().max <= 1.0
    }
}

/// In a line: the mean at some angles, and the peak.
impl fmt::Display for Reflectance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |view: &&ViewReflectance| view.view_deg % 22.0 == 0.0;
        for view in self.views.iter().filter(shown) {
            write!(f, "{}°: {:.1} %   ", view.view_deg, 100.0 * view.mean)?;
        }
        let peak = self.peak();
        write!(f, "at most {:.1} % at {}°", 100.0 * peak.max, peak.view_deg)
    }
}

/// `fabric` with ρ scaled so that it reflects no more than arrives towards any view of [`Reflectance`]; the same if it does not. The factor is
/// [`Fabric::rho_scale`], rounded down to thousandths.
///
/// # Errors
/// When the fabric reflects more than can be scaled down.
pub fn conserving(fabric: &Fabric) -> Result<Fabric, TextError> {
    let peak = Reflectance::of_fabric(fabric).peak().max;
    if peak * MARGIN <= 1.0 {
        return Ok(fabric.clone());
    }
    let scaled = Fabric {
        rho_scale: (1000.0 * fabric.rho_scale / (MARGIN * peak)).floor() / 1000.0,
        variant: None,
        ..fabric.clone()
    };
    Fabric::from_toml(&scaled.to_toml(), &fabric.name, None)
}
