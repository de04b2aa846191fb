//! How far the model itself is from reciprocity and from conserving energy, so that no one takes that for an error.

use std::fmt;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::energy::Reflectance;
use super::error::{Quantiles, quantiles};
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
    /// How much of what arrives is sent on.
    pub reflectance: Reflectance,
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
        Self {
            reciprocity: quantiles(reciprocity),
            reflectance: Reflectance::of_fabric(fabric),
        }
    }
}

/// In a sentence or two.
impl fmt::Display for Physics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |x: f64| format!("{:.0} %", 100.0 * x);
        let peak = self.reflectance.peak();
        let energy = if self.reflectance.conserves_energy() {
            "no more than arrives"
        } else {
            "more than arrives, which is the model's doing and no error of a table"
        };
        write!(
            f,
            "The model itself is not reciprocal: exchanging light and viewer changes the BRDF by {} on average (99th \
             percentile {}). It reflects {energy}: up to {} at {}°.",
            percent(self.reciprocity.mean),
            percent(self.reciprocity.p99),
            percent(peak.max),
            peak.view_deg,
        )
    }
}
