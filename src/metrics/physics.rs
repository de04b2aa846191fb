//! How far the model itself is from reciprocity and from conserving energy, so that no one takes that for an error.

use std::fmt;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::error::{Quantiles, VIEW_ANGLES_DEG, lights_and_solid_angle, quantiles, viewer};
use super::pairs::protocol_pairs;
use crate::fabric::Fabric;
use crate::model::{Model, Rule, Sadeghi};

/// Pairs on which reciprocity is measured.
const PAIRS: usize = 2048;

/// What is not physical about a fabric's model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Physics {
    /// |f(wi, wr) − f(wr, wi)| over their mean, of the channel where it is largest.
    pub reciprocity: Quantiles,
    /// ∫ ρ dwi of the brightest channel at 0°, 30°, 60° and 80° of view, in degrees and as a share of what arrives.
    pub reflectance: Vec<(f64, f64)>,
}

impl Physics {
    /// Measures `fabric` by direct integration.
    pub fn of(fabric: &Fabric) -> Self {
        let model = Sadeghi::<f64>::new(fabric, Rule::REFERENCE);
        let asymmetry = |wi, wr| {
            let (there, back) = (model.eval(wi, wr), model.eval(wr, wi));
            (0..3)
                .map(|c| (there[c] - back[c], 0.5 * (there[c] + back[c])))
                .filter(|(_, mean)| *mean > 0.0)
                .map(|(difference, mean)| difference.abs() / mean)
                .fold(0.0, f64::max)
        };
        let pairs = protocol_pairs(fabric, PAIRS, super::RECORDED_SEED);
        let reciprocity = pairs
            .par_iter()
            .map(|pair| asymmetry(pair.wi, pair.wr))
            .collect();
        let (lights, solid_angle) = lights_and_solid_angle();
        let reflectance = VIEW_ANGLES_DEG.iter().map(|angle| {
            let values: Vec<[f64; 3]> = lights
                .par_iter()
                .map(|wi| model.eval_cos(*wi, viewer(*angle)))
                .collect();
            let of_channel =
                |c: usize| solid_angle * values.iter().map(|value| value[c]).sum::<f64>();
            (*angle, (0..3).map(of_channel).fold(0.0, f64::max))
        });
        Self {
            reciprocity: quantiles(reciprocity),
            reflectance: reflectance.collect(),
        }
    }

    /// The most that is reflected of what arrives; above 1 energy is not conserved.
    pub fn largest_reflectance(&self) -> f64 {
        self.reflectance.iter().map(|(_, r)| *r).fold(0.0, f64::max)
    }
}

/// In a sentence or two.
impl fmt::Display for Physics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |x: f64| format!("{:.0} %", 100.0 * x);
        let angles: Vec<String> = self
            .reflectance
            .iter()
            .map(|(angle, share)| format!("{} at {angle}°", percent(*share)))
            .collect();
        let energy = if self.largest_reflectance() > 1.0 {
            "more than arrives, which is the model's doing and no error of a table"
        } else {
            "no more than arrives"
        };
        write!(
            f,
            "The model itself is not reciprocal: exchanging light and viewer changes the BRDF by {} on average (99th \
             percentile {}). It reflects {energy}: {}.",
            percent(self.reciprocity.mean),
            percent(self.reciprocity.p99),
            angles.join(", ")
        )
    }
}
