//! From the function to the coefficients of its splines, as stored.

use rayon::prelude::*;

use super::choose::Planned;
use super::scope::{Extent, Scope};
use crate::brdf::Response;
use crate::chart::Coordinates;
use crate::fabric::Thread;
use crate::progress::{Cancelled, Progress};
use crate::table::{self, Axis, CHANNELS, Content, Grid, Run, UNIT, own, place_of};

/// Coefficients below this are stored as zero …
const DARK: f64 = 1e-30;
/// … and above this as this: their scale would not fit an f32.
const BRIGHT: f64 = 1e30;
/// The scale is that of every second row along each axis, so that a part of a table has that of all of it; between these rows
/// coefficients may be larger by this factor: by 1.11 in drafts of the library, by less in finer tables.
const HEADROOM: f64 = 1.15;

/// Samples the planned function at its sites and solves for the coefficients: all of them, or those that the scope needs, which are the
/// same to the last bit. The result does not depend on the number of workers, either.
pub(super) fn fill_grid(
    thread: &Thread,
    planned: Planned,
    content: Content,
    scope: &Scope<'_>,
    progress: Progress<'_>,
) -> Result<Grid, Cancelled> {
    let Planned { integrand, plan } = planned;
    let coordinates = integrand.coordinates();
    let albedo = thread.albedo[0];
    let filler = Filler {
        channels: content.channels(),
        quantities: move |u: [f64; 4]| {
            let Response { surface, volume } = integrand.at_point(u);
            let values = match content {
                Content::Both => [surface, volume],
                Content::Surface => [surface, 0.0],
                Content::Volume => [volume, 0.0],
                Content::Dyed => [surface + albedo * volume, 0.0],
            };
            values.map(table::encode)
        },
    };
    let direction = thread.direction();
    let extent = Extent::new(scope, coordinates, direction, &plan.axes, filler.channels);
    let scaling = &extent.scaling;
    let (mut values, scale) = if extent.axes == plan.axes {
        let values = filler.rows(&extent.axes, &extent.sites, progress)?;
        let scale = filler.scale(&values, scaling, &extent.axes);
        (values, scale)
    } else {
        let of_all = filler.rows(&plan.axes, scaling, progress.part(0.0, 0.9))?;
        let scale = filler.scale(&of_all, scaling, &plan.axes);
        let values = filler.rows(&extent.axes, &extent.sites, progress.part(0.9, 1.0))?;
        (values, scale)
    };
    let Extent {
        axes, runs, rows, ..
    } = extent;
    let channels = filler.channels;
    let [n0, n1, n2, _] = axes.each_ref().map(Axis::len);
    // Along the other axes, all functions on the faster ones are solved for at once.
    let mut functions = channels * n0;
    for axis in &axes[1..] {
        let solver = axis.solver();
        values
            .par_chunks_exact_mut(functions * axis.len())
            .for_each(|values| solver.solve(values, functions));
        functions *= axis.len();
    }
    mirror_faces(&mut values, channels, [n0, n1, n2], coordinates);

    let stored = |row: usize, index: usize| {
        let share = values[channels * n0 * row + index] / scale[index % channels];
        (share.clamp(-1.0, 1.0) * UNIT).round() as i16
    };
    let mut tiles = Vec::new();
    for row in (0..runs.len()).filter(|row| (row % n1).is_multiple_of(2)) {
        let run = runs[row];
        // The last tile may have one row.
        let has_two = row % n1 + 1 < n1;
        for index in channels * usize::from(run.first)..channels * usize::from(run.end()) {
            tiles.push(stored(row, index));
            tiles.push(if has_two { stored(row + 1, index) } else { 0 });
        }
    }
    Ok(Grid {
        coordinates,
        content,
        scale: scale.map(|scale| scale as f32),
        tiles: own(tiles.into_iter()),
        rows,
        axes,
    })
}

/// What splines are of.
struct Filler<F> {
    channels: usize,
    quantities: F,
}

impl<F: Fn([f64; 4]) -> [f64; CHANNELS] + Sync> Filler<F> {
    /// `[u₃][u₂][u₁][u₀][channel]`: coefficients along u₀, at the sites of the other axes; 0 at sites of u₀ that are not in the
    /// runs, and wrong near them.
    fn rows(
        &self,
        axes: &[Axis; 4],
        runs: &[Run],
        progress: Progress<'_>,
    ) -> Result<Vec<f64>, Cancelled> {
        let [n0, n1, n2, n3] = axes.each_ref().map(Axis::len);
        let sites = axes.each_ref().map(Axis::sites);
        let solver = axes[0].solver();
        let mut values = vec![0.0; self.channels * n0 * runs.len()];
        let steps = progress.steps(runs.len());
        let rows = values.par_chunks_exact_mut(self.channels * n0).enumerate();
        let fill_row = |(row, values): (usize, &mut [f64])| {
            let [f1, f2, f3] = place_of(row, [n1, n2, n3]);
            let rest = [sites[1][f1], sites[2][f2], sites[3][f3]];
            let run = runs[row];
            let places = usize::from(run.first)..usize::from(run.end());
            for place in places {
                steps.check()?;
                let quantities = (self.quantities)([sites[0][place], rest[0], rest[1], rest[2]]);
                values[self.channels * place..][..self.channels]
                    .copy_from_slice(&quantities[..self.channels]);
            }
            if run.count > 0 {
                solver.solve(values, self.channels);
            }
            steps.advance()
        };
        rows.map(fill_row).collect::<Result<(), _>>()?;
        Ok(values)
    }

    /// What the largest stored number stands for, per channel.
    fn scale(&self, values: &[f64], rows: &[Run], axes: &[Axis; 4]) -> [f64; CHANNELS] {
        let row = self.channels * axes[0].len();
        let in_rows = || {
            let chunks = values.chunks_exact(row).zip(rows);
            chunks.filter(|(_, run)| run.count > 0)
        };
        [0, 1].map(|channel| {
            let of_row = |(values, _): (&[f64], _)| {
                let magnitudes = values.iter().skip(channel).step_by(self.channels);
                magnitudes.fold(0.0, |largest: f64, value| largest.max(value.abs()))
            };
            let largest = if channel < self.channels {
                in_rows().map(of_row).fold(0.0, f64::max)
            } else {
                0.0
            };
            if largest > DARK {
                HEADROOM * largest.min(BRIGHT)
            } else {
                1.0
            }
        })
    }
}

/// Makes both sides of a face exactly the same where a pair crosses it by being mirrored: u₃ = 0, where φ_d changes its sign
/// if sides are folded, and u₀ = ½, where θ_d does if ends are. There the first coefficient along the axis is the value, the knots of u₂ and u₁
/// lie evenly about ½, and the coefficients are even but for rounding, which would be a seam.
fn mirror_faces(
    values: &mut [f64],
    channels: usize,
    [n0, n1, n2]: [usize; 3],
    coordinates: Coordinates,
) {
    let [_, ends_fold, sides_fold, _] = coordinates.mirrored();
    let row = n0 * n1;
    let rows = values.len() / (channels * row);
    let mut even = |a: usize, b: usize| {
        for channel in 0..channels {
            let [a, b] = [a, b].map(|site| channels * site + channel);
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
