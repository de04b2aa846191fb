//! From the function to the coefficients of its splines, as stored.

use rayon::prelude::*;

use super::integrate::Integrand;
use crate::chart::Coordinates;
use crate::progress::{Cancelled, Progress};
use crate::table::{Axis, CHANNELS, Encoding, Grid, Samples};

/// Coefficients below this are stored as zero …
const DARK: f64 = 1e-30;
/// … and above this as this: their scale would not fit an f32.
const BRIGHT: f64 = 1e30;

/// Samples `integrand` at the sites of `axes` and solves for the coefficients. The result does not depend on the number
/// of threads.
pub(super) fn fill_grid(
    integrand: &Integrand,
    axes: [Axis; 4],
    encoding: Encoding,
    progress: Progress<'_>,
) -> Result<Grid, Cancelled> {
    let [n0, n1, n2, n3] = axes.each_ref().map(Axis::len);
    let sites = axes.each_ref().map(Axis::sites);
    let mut values = vec![0.0; CHANNELS * n0 * n1 * n2 * n3];
    let steps = progress.steps(n1 * n2 * n3);
    let fill_row = |(row, values): (usize, &mut [f64])| {
        let rest = [
            sites[1][row % n1],
            sites[2][row / n1 % n2],
            sites[3][row / n1 / n2],
        ];
        for (u0, value) in sites[0].iter().zip(values.chunks_exact_mut(CHANNELS)) {
            steps.check()?;
            let response = integrand.at_point([*u0, rest[0], rest[1], rest[2]]);
            value.copy_from_slice(
                &[response.surface, response.volume].map(|value| encoding.encode(value)),
            );
        }
        axes[0].solve(values, CHANNELS);
        steps.advance()
    };
    let rows = values.par_chunks_exact_mut(CHANNELS * n0).enumerate();
    rows.map(fill_row).collect::<Result<(), _>>()?;
    // Along the other axes, all functions on the faster ones are solved for at once.
    let mut channels = CHANNELS * n0;
    for axis in &axes[1..] {
        values
            .par_chunks_exact_mut(channels * axis.len())
            .for_each(|values| axis.solve(values, channels));
        channels *= axis.len();
    }

    mirror_faces(&mut values, [n0, n1, n2], integrand.coordinates());

    let scale = [0, 1].map(|channel| {
        let magnitudes = values.iter().skip(channel).step_by(CHANNELS);
        let largest = magnitudes.fold(0.0, |largest: f64, value| largest.max(value.abs()));
        if largest > DARK {
            largest.min(BRIGHT)
        } else {
            1.0
        }
    });
    let stored = values.iter().enumerate().map(|(index, value)| {
        let share = value / scale[index % CHANNELS];
        share.clamp(-1.0, 1.0) * encoding.unit()
    });
    Ok(Grid {
        coordinates: integrand.coordinates(),
        encoding,
        scale: scale.map(|scale| scale as f32),
        samples: Samples::store(encoding, stored),
        axes,
    })
}

/// Makes both sides of a face exactly the same where a pair crosses it by being mirrored: u₃ = 0, where φ_d changes its sign
/// if sides are folded, and u₀ = ½, where θ_d does if ends are. There the first coefficient along the axis is the value, the knots of u₂ and u₁
/// lie evenly about ½, and the coefficients are even but for rounding, which would be a seam.
fn mirror_faces(values: &mut [f64], [n0, n1, n2]: [usize; 3], coordinates: Coordinates) {
    let [_, ends_fold, sides_fold, _] = coordinates.mirrored();
    let row = n0 * n1;
    let rows = values.len() / (CHANNELS * row);
    let mut even = |a: usize, b: usize| {
        for channel in 0..CHANNELS {
            let [a, b] = [a, b].map(|site| CHANNELS * site + channel);
            let mean = 0.5 * (values[a] + values[b]);
            (values[a], values[b]) = (mean, mean);
        }
    };
    if sides_fold {
        for k in 0..n2 / 2 {
            for site in 0..row {
                even(k * row + site, (n2 - 1 - k) * row + site);
            }
        }
    }
    if ends_fold {
        for plane in 0..rows {
            for k in 0..n1 / 2 {
                let [a, b] = [k, n1 - 1 - k].map(|k| n0 * (n1 * plane + k));
                even(a, b);
            }
        }
    }
}
