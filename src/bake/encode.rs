//! The function at every node, as stored.

use rayon::prelude::*;

use super::integrate::Integrand;
use crate::progress::{Cancelled, Progress};
use crate::table::{Axis, Encoding, Grid, Samples};

/// Ratios below this are stored as zero …
const DARK: f64 = 1e-30;
/// … and above this as this: their scale would not fit an f32.
const BRIGHT: f64 = 1e30;

/// Samples `integrand` on the nodes of `axes`. The result does not depend on the number of threads.
pub(super) fn fill_grid(
    integrand: &Integrand,
    axes: [Axis; 4],
    encoding: Encoding,
    progress: Progress<'_>,
) -> Result<Grid, Cancelled> {
    let [_, n1, n2, n3] = axes.each_ref().map(Axis::len);
    let steps = progress.steps(n1 * n2 * n3);
    let row = |row: usize| {
        let at = |k: usize, index: usize| f64::from(axes[k].nodes()[index]);
        let rest = [at(1, row % n1), at(2, row / n1 % n2), at(3, row / n1 / n2)];
        let values = axes[0].nodes().iter().map(|u0| {
            integrand
                .at_point([f64::from(*u0), rest[0], rest[1], rest[2]])
                .ratios()
        });
        let values = fill_invisible(values.collect());
        steps.advance().map(|()| values)
    };
    let rows: Vec<Vec<[f64; 2]>> = (0..n1 * n2 * n3)
        .into_par_iter()
        .map(row)
        .collect::<Result<_, _>>()?;
    let values = || rows.iter().flatten();
    let scale = [0, 1].map(|channel| {
        let largest = values().map(|value| value[channel]).fold(0.0, f64::max);
        if largest > DARK {
            largest.min(BRIGHT)
        } else {
            1.0
        }
    });
    let stored = values().flat_map(|value| {
        [0, 1].map(|channel| encoding.encode((value[channel] / scale[channel]).min(1.0)))
    });
    Ok(Grid {
        chart: integrand.chart(),
        folded: integrand.is_folded(),
        encoding,
        scale: scale.map(|scale| scale as f32),
        samples: Samples::store(encoding, stored),
        axes,
    })
}

/// Where no tilt is visible F is 0 and the ratio does not matter, but cells reach across the edge: the nearest defined
/// value along the row goes on.
fn fill_invisible(values: Vec<Option<[f64; 2]>>) -> Vec<[f64; 2]> {
    let nearest = |index: usize| {
        let defined = |i: &usize| values[*i].is_some();
        let before = (0..=index).rev().find(defined);
        let after = (index..values.len()).find(defined);
        let nearest = match (before, after) {
            (Some(before), Some(after)) => Some(if index - before <= after - index {
                before
            } else {
                after
            }),
            (before, after) => before.or(after),
        };
        nearest.and_then(|i| values[i]).unwrap_or_default()
    };
    (0..values.len()).map(nearest).collect()
}
