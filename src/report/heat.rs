//! Where in a chart an evaluator errs.

use std::f64::consts::FRAC_PI_2;

use serde::{Deserialize, Serialize};

use crate::chart::{Chart, Rim};
use crate::fabric::Fabric;
use crate::metrics::Pair;

const COLUMNS: usize = 36;
const ROWS: usize = 24;

/// Mean relative error over two coordinates of the highlight chart in the frame of the fabric's first thread.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct HeatMap {
    /// The evaluator.
    pub evaluator: String,
    /// The thread.
    pub thread: String,
    /// The coordinate that grows along a row …
    pub x: Axis,
    /// … and the one that grows from row to row.
    pub y: Axis,
    /// Bins of `x`.
    pub columns: usize,
    /// Bins of `y`.
    pub rows: usize,
    /// Mean relative error of the pairs in each bin, `[y][x]`; none without pairs.
    pub mean: Vec<Option<f64>>,
}

/// A coordinate of the highlight chart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// ψ of the half vector, −90° to 90°.
    Psi,
    /// θ_d as a share of its range at θ_h, −1 to 1.
    ThetaD,
    /// φ_d as a share of its range at φ_h, −1 to 1.
    PhiD,
    /// φ_h, 0° to 90°.
    PhiH,
}

impl Axis {
    /// What to write beside it.
    pub(super) fn label(self) -> &'static str {
        match self {
            Self::Psi => "ψ of the half vector [°]",
            Self::ThetaD => "θ_d / its range",
            Self::PhiD => "φ_d / its range",
            Self::PhiH => "φ_h [°]",
        }
    }

    /// Its values at 0 and 1 of the chart.
    pub(super) fn ends(self) -> (f64, f64) {
        let right_angle = FRAC_PI_2.to_degrees();
        match self {
            Self::Psi => (-right_angle, right_angle),
            Self::ThetaD | Self::PhiD => (-1.0, 1.0),
            Self::PhiH => (0.0, right_angle),
        }
    }
}

/// Heat maps of (ψ, θ_d) and (φ_d, φ_h) from the relative error at every pair; none for a fabric without threads.
pub(super) fn maps(
    evaluator: &str,
    fabric: &Fabric,
    pairs: &[Pair],
    errors: &[f64],
) -> Vec<HeatMap> {
    let Some(thread) = fabric.visible_threads().next() else {
        return Vec::new();
    };
    let frame = thread.frame::<f64>();
    let place = |pair: &Pair| {
        Chart::Highlight.coordinates(
            Rim::NONE,
            frame.to_thread(pair.wi),
            frame.to_thread(pair.wr),
        )
    };
    let places: Vec<[f64; 4]> = pairs.iter().map(place).collect();
    let bin = |u: f64, count: usize| ((u * count as f64) as usize).min(count - 1);
    let axes = [Axis::Psi, Axis::ThetaD, Axis::PhiD, Axis::PhiH];
    [(0, 1), (2, 3)]
        .map(|(x, y)| {
            let mut bins = vec![(0.0, 0.0); COLUMNS * ROWS];
            for (u, error) in places.iter().zip(errors) {
                let bin = &mut bins[bin(u[y], ROWS) * COLUMNS + bin(u[x], COLUMNS)];
                *bin = (bin.0 + error, bin.1 + 1.0);
            }
            HeatMap {
                evaluator: evaluator.to_owned(),
                thread: thread.name.clone(),
                x: axes[x],
                y: axes[y],
                columns: COLUMNS,
                rows: ROWS,
                mean: bins
                    .into_iter()
                    .map(|(sum, count)| (count > 0.0).then_some(sum / count))
                    .collect(),
            }
        })
        .into()
}
