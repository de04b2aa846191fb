//! What a table is baked for, if not for everything: which pairs of directions, and whether albedos change.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::enclosure::{Range, Span};
use crate::chart::Coordinates;
use crate::fabric::Thread;
use crate::math::simd::Single;
use crate::needs::{Cap, Directions, Needs};
use crate::table::{Axis, COEFFICIENT_BYTES, Content, REACH, Rows, Run, TAPS, place_of};

/// What a table will be asked for.
#[derive(Debug, Clone, Copy, Default)]
pub struct Scope<'a> {
    /// These pairs alone, if it is known.
    pub needs: Option<&'a Needs>,
    /// Whether albedos stay those of the fabric. Where they are grey one channel is enough.
    pub fixed_albedo: bool,
}

/// What a table was baked for, as its metadata tell.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ScopeNote {
    /// Whether albedos stay those of the fabric.
    pub fixed_albedo: bool,
    /// The share of all pairs of directions that was needed, if not all; those with wi = wr have none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub share: Option<f64>,
    /// CRC-32 of the file of [`Needs`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub needs: Option<u32>,
}

impl Scope<'_> {
    /// As metadata; none for everything.
    pub fn note(&self) -> Option<ScopeNote> {
        let is_less = self.fixed_albedo || self.needs.is_some();
        is_less.then(|| ScopeNote {
            fixed_albedo: self.fixed_albedo,
            share: self.needs.map(Needs::share),
            needs: self.needs.map(|needs| crc32fast::hash(&needs.to_bytes())),
        })
    }

    /// The channels that a thread's grid needs.
    pub(super) fn content(&self, thread: &Thread) -> Content {
        let [r, g, b] = thread.albedo;
        // Nothing is reflected where light enters a medium like the one it comes from.
        if thread.optics.eta == 1.0 {
            Content::Volume
        } else if !self.fixed_albedo || r != g || g != b {
            Content::Both
        } else if r == 0.0 {
            Content::Surface
        } else {
            Content::Dyed
        }
    }
}

/// What a bake makes of a grid.
pub(super) struct Extent {
    /// The planned axes, or of some one place.
    pub(super) axes: [Axis; 4],
    /// By row `[u₃][u₂][u₁]`: coefficients that are kept.
    pub(super) runs: Vec<Run>,
    /// The same for lookups, unless all are kept.
    pub(super) rows: Option<Rows>,
    /// By row: sites that are integrated.
    pub(super) sites: Vec<Run>,
    /// By row of the planned axes, complete: those whose coefficients the scale is that of. They are among the sites, unless an axis is
    /// collapsed.
    pub(super) scaling: Vec<Run>,
}

impl Extent {
    /// All of a grid of `axes`, or what `scope` needs of it for a thread with that direction; all of it, too, where a part would take no
    /// less memory.
    pub(super) fn new(
        scope: &Scope<'_>,
        coordinates: Coordinates,
        direction: f64,
        axes: &[Axis; 4],
        channels: usize,
    ) -> Self {
        let scaling = scaling_rows(axes);
        let all = Self {
            axes: axes.clone(),
            runs: vec![all_of(axes); scaling.len()],
            rows: None,
            sites: vec![all_of(axes); scaling.len()],
            scaling,
        };
        let Some(needs) = scope.needs.filter(|_| coordinates.rank() > 2) else {
            return all;
        };
        let mut axes = axes.clone();
        collapse(&mut axes, needs, coordinates);
        let mut runs = runs(needs, coordinates, direction, &axes);
        let tiles = join_rows_of_tiles(&mut runs, &axes);
        let mut sites = sites(&runs, coordinates, &axes);
        let is_collapsed = axes != all.axes;
        if !is_collapsed {
            for (sites, scaling) in sites.iter_mut().zip(&all.scaling) {
                if scaling.count > 0 {
                    *sites = *scaling;
                }
            }
        }
        let is_all = runs.iter().all(|run| *run == all_of(&axes));
        let rows = (!is_all).then(|| {
            Rows::new(&tiles, &axes, channels)
                .expect("runs are those of cells, of which some are needed")
        });
        let index = rows.as_ref().map_or(0, Rows::bytes);
        let part = Self {
            axes,
            runs,
            rows,
            sites,
            scaling: all.scaling.clone(),
        };
        let bytes = channels * COEFFICIENT_BYTES;
        if !is_collapsed && index + bytes * part.coefficients() >= bytes * all.coefficients() {
            return all;
        }
        part
    }

    /// Sites that are integrated.
    pub(super) fn sites(&self) -> usize {
        let is_apart = self.scaling.len() != self.sites.len();
        count(&self.sites) + if is_apart { count(&self.scaling) } else { 0 }
    }

    /// Coefficients that are kept; where a tile has one row, as if it had two.
    pub(super) fn coefficients(&self) -> usize {
        let planes = self.runs.chunks_exact(self.axes[1].len());
        let of_plane = |plane: &[Run]| {
            let tiles = plane.iter().step_by(2);
            2 * tiles.map(|run| usize::from(run.count)).sum::<usize>()
        };
        planes.map(of_plane).sum()
    }
}

/// All coefficients of a row.
fn all_of(axes: &[Axis; 4]) -> Run {
    Run {
        first: 0,
        count: axes[0].len() as u16,
    }
}

fn count(runs: &[Run]) -> usize {
    runs.iter().map(|run| usize::from(run.count)).sum()
}

/// Every second row along each axis, and the last: a part of a table has the scale of all of it.
fn scaling_rows(axes: &[Axis; 4]) -> Vec<Run> {
    let [_, n1, n2, n3] = axes.each_ref().map(Axis::len);
    let is_one = |place: usize, length: usize| place.is_multiple_of(2) || place + 1 == length;
    let row = |row: usize| {
        let [f1, f2, f3] = place_of(row, [n1, n2, n3]);
        if is_one(f1, n1) && is_one(f2, n2) && is_one(f3, n3) {
            all_of(axes)
        } else {
            Run::default()
        }
    };
    (0..n1 * n2 * n3).map(row).collect()
}

/// By row: the coefficients of all cells that a thread with that direction is asked for.
fn runs(needs: &Needs, coordinates: Coordinates, direction: f64, axes: &[Axis; 4]) -> Vec<Run> {
    let cells = cells(needs, coordinates, direction, axes);
    let lengths = axes.each_ref().map(Axis::len);
    let taps = axes
        .each_ref()
        .map(|axis| if axis.is_flat() { 1 } else { TAPS });
    let mut runs = vec![Run::default(); cells.len()];
    for (cell, [first, last]) in cells.into_iter().enumerate() {
        if first > last {
            continue;
        }
        for d in 0..taps[3] {
            for c in 0..taps[2] {
                for b in 0..taps[1] {
                    let row = cell + b + lengths[1] * (c + lengths[2] * d);
                    runs[row].join(first, last + TAPS as u16 - 1);
                }
            }
        }
    }
    runs
}

/// By tile: what its rows have, which then have the same.
fn join_rows_of_tiles(runs: &mut [Run], axes: &[Axis; 4]) -> Vec<Run> {
    let mut tiles = Vec::new();
    for plane in runs.chunks_exact_mut(axes[1].len()) {
        for rows in plane.chunks_mut(2) {
            let mut tile = Run::default();
            for row in rows.iter().filter(|row| row.count > 0) {
                tile.join(row.first, row.end() - 1);
            }
            rows.fill(tile);
            tiles.push(tile);
        }
    }
    tiles
}

/// By row: the sites that coefficients depend on.
fn sites(runs: &[Run], coordinates: Coordinates, axes: &[Axis; 4]) -> Vec<Run> {
    let lengths = axes.each_ref().map(Axis::len);
    let mut sites = runs.to_vec();
    join_mirrored(&mut sites, coordinates, lengths);
    for axis in 1..4 {
        widen(&mut sites, axis, lengths);
    }
    let end = lengths[0] as u16;
    for run in sites.iter_mut().filter(|run| run.count > 0) {
        let first = run.first.saturating_sub(REACH as u16);
        *run = Run {
            first,
            count: (run.end() + REACH as u16).min(end) - first,
        };
    }
    sites
}

/// Where all pairs that are needed have the same coordinate, an axis has one place: so have light and viewer in the same direction.
fn collapse(axes: &mut [Axis; 4], needs: &Needs, coordinates: Coordinates) {
    if !needs.has_no_pairs() || needs.is_empty() {
        return;
    }
    match coordinates {
        Coordinates::Thread { .. } => {
            axes[1] = Axis::point(1, 1);
            axes[2] = Axis::point(1, 1);
        }
        Coordinates::Isotropic => {
            axes[1] = Axis::point(1, 1);
            axes[2] = Axis::point(0, 0);
        }
        Coordinates::View { .. } => {}
    }
}

/// By first row of a cell of u₁, u₂ and u₃: from which to which first coefficient of u₀ it is asked for; from 1 to 0 if it is not.
fn cells(
    needs: &Needs,
    coordinates: Coordinates,
    direction: f64,
    axes: &[Axis; 4],
) -> Vec<[u16; 2]> {
    const NONE: [u16; 2] = [u16::MAX, 0];
    let [_, n1, n2, n3] = axes.each_ref().map(Axis::len);
    let frame = crate::brdf::ThreadFrame::<f64>::new(direction);
    let spans: Vec<Span> = Directions::caps()
        .into_iter()
        .map(|Cap { axis, radius }| {
            Span::new(Cap {
                axis: frame.to_thread(axis),
                radius,
            })
        })
        .collect();
    let first = |axis: usize, u: f64| {
        let [first] = axes[axis].place(Single(u as f32)).first;
        first as usize
    };
    let mark = |cells: &mut [[u16; 2]], ranges: [Range; 4]| {
        let ends = |axis: usize| ranges[axis].map(|u| first(axis, u));
        let [from, to] = ends(0).map(|first| first as u16);
        let [range_1, range_2, range_3] = [ends(1), ends(2), ends(3)];
        for f3 in range_3[0]..=range_3[1] {
            for f2 in range_2[0]..=range_2[1] {
                for f1 in range_1[0]..=range_1[1] {
                    let cell = &mut cells[f1 + n1 * (f2 + n2 * f3)];
                    *cell = [cell[0].min(from), cell[1].max(to)];
                }
            }
        }
    };
    let nothing = || vec![NONE; n1 * n2 * n3];
    let of_pairs = (0..spans.len())
        .into_par_iter()
        .fold(nothing, |mut cells, light| {
            for viewer in needs.viewers(light).bins() {
                coordinates.enclose(&spans[light], &spans[viewer], |ranges| {
                    mark(&mut cells, ranges);
                });
            }
            cells
        });
    let mut cells = of_pairs.reduce(nothing, |mut a, b| {
        for (a, b) in a.iter_mut().zip(b) {
            *a = [a[0].min(b[0]), a[1].max(b[1])];
        }
        a
    });
    for both in needs.collocated().bins() {
        coordinates.enclose_collocated(&spans[both], |ranges| mark(&mut cells, ranges));
    }
    // What is needed may all be beyond a rim, but there is no grid without cells.
    if cells.iter().all(|cell| *cell == NONE) {
        cells[0] = [0, 0];
    }
    cells
}

/// Where a face is mirrored into itself, both sides make the coefficients of either.
fn join_mirrored(sites: &mut [Run], coordinates: Coordinates, [_, n1, n2, n3]: [usize; 4]) {
    let [_, ends_fold, sides_fold, _] = coordinates.mirrored();
    let mut join = |a: usize, b: usize, of: fn(Run) -> Run| {
        let (run_a, run_b) = (of(sites[a]), of(sites[b]));
        for (to, run) in [(b, run_a), (a, run_b)] {
            if run.count > 0 {
                sites[to].join(run.first, run.end() - 1);
            }
        }
    };
    if sides_fold {
        for f2 in 0..n2 / 2 {
            for f1 in 0..n1 {
                join(f2 * n1 + f1, (n2 - 1 - f2) * n1 + f1, |run| run);
            }
        }
    }
    if ends_fold {
        for plane in 0..n2 * n3 {
            for f1 in 0..n1 / 2 {
                // Of u₀ the first.
                join(plane * n1 + f1, plane * n1 + n1 - 1 - f1, |run| Run {
                    first: 0,
                    count: u16::from(run.first == 0 && run.count > 0),
                });
            }
        }
    }
}

/// Every row has what rows within [`REACH`] of it along an axis have.
fn widen(rows: &mut [Run], axis: usize, lengths: [usize; 4]) {
    let stride: usize = lengths[1..axis].iter().product();
    let given = rows.to_vec();
    for (row, wide) in rows.iter_mut().enumerate() {
        let place = row / stride % lengths[axis];
        let from = place.saturating_sub(REACH);
        let to = (place + REACH).min(lengths[axis] - 1);
        for other in from..=to {
            let run = given[row + other * stride - place * stride];
            if run.count > 0 {
                wide.join(run.first, run.end() - 1);
            }
        }
    }
}
