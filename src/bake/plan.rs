//! Where a grid's nodes go, and how many each axis gets.
//!
//! Lines are drawn through the box at pairs of the error protocol, 64 along each axis, and the function is sampled densely
//! on them. An axis begins with the fewest nodes that its interpolation needs; the cell with the largest error of
//! interpolation, summed over its lines, is halved, and so on: the error spreads evenly over the cells. That gives for
//! each axis its error at every number of nodes. Interpolation in four dimensions adds the errors of the axes to first
//! order, so nodes are then handed out to whichever axis gains most for the growth of the table.
//!
//! Error is that of the segments' S + A V relative to itself plus a hundredth of its mean over these pairs, close to what
//! the protocol measures; A is the largest channel of the albedo.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::Settings;
use super::integrate::Integrand;
use crate::chart::Chart;
use crate::fabric::{Fabric, Thread};
use crate::metrics::protocol_pairs;
use crate::progress::{Cancelled, Progress};
use crate::table::{Axis, Encoding, Interpolation};

const LINES: usize = 64;
/// Samples on a line, at least; a multiple of 12 puts thirds of halves on samples.
const MIN_INTERVALS: usize = 192;
const MAX_INTERVALS: usize = 4096;
/// The sharp axis is sampled at least this often per γ_s.
const SAMPLES_PER_GAMMA: f64 = 3.0;
const MAX_LADDER: usize = 160;
/// How many nodes ahead an axis' gain is looked for: halving one of several equally bad cells gains nothing yet.
const LOOK_AHEAD: usize = 4;
const SEED: u64 = 1;

/// The four axes of a thread's grid, at most `max_nodes` nodes in all.
pub(super) fn plan_axes(
    fabric: &Fabric,
    thread: &Thread,
    integrand: &Integrand,
    settings: &Settings,
    max_nodes: usize,
    progress: Progress<'_>,
) -> Result<[Axis; 4], Cancelled> {
    let frame = thread.frame::<f64>();
    let brightest = thread.albedo.iter().copied().fold(0.0, f64::max);
    let pairs = protocol_pairs(fabric, 4 * LINES, SEED);
    let places: Vec<([f64; 4], f64)> = pairs
        .par_iter()
        .map(|pair| {
            let (wi, wr) = (frame.to_thread(pair.wi), frame.to_thread(pair.wr));
            let response = integrand.at_pair(wi, wr).response;
            (
                integrand.coordinates(wi, wr),
                response.surface + brightest * response.volume,
            )
        })
        .collect();
    let mean = places.iter().map(|(_, value)| value).sum::<f64>() / places.len() as f64;

    let steps = progress.steps(4 * LINES);
    let mut ladders = Vec::with_capacity(4);
    for k in 0..4 {
        let scale = Scale::new(k, thread, integrand.is_folded());
        let sample = |u: &[f64; 4]| {
            let sample = Line::sample(
                integrand,
                &scale,
                k,
                *u,
                settings.encoding,
                brightest,
                0.01 * mean,
            );
            steps.advance().map(|()| sample)
        };
        let places = &places[k * LINES..(k + 1) * LINES];
        let lines: Vec<Line> = places
            .par_iter()
            .map(|(u, _)| sample(u))
            .collect::<Result<_, _>>()?;
        ladders.push(Ladder::climb(scale, &lines, settings.interpolation[k]));
    }
    let inserted = share_out(&ladders, max_nodes, settings.target_error);
    Ok([0, 1, 2, 3].map(|k| ladders[k].axis(inserted[k])))
}

/// How many nodes beyond the first each axis gets.
fn share_out(ladders: &[Ladder], max_nodes: usize, target_error: f64) -> [usize; 4] {
    let mut inserted = [0; 4];
    loop {
        let error: f64 = (0..4).map(|k| ladders[k].errors[inserted[k]]).sum();
        if error < target_error {
            return inserted;
        }
        let size: f64 = (0..4)
            .map(|k| ladders[k].node_count(inserted[k]) as f64)
            .product();
        let mut best: Option<(f64, usize, usize)> = None;
        for (k, ladder) in ladders.iter().enumerate() {
            let now = inserted[k];
            for next in now + 1..(now + 1 + LOOK_AHEAD).min(ladder.errors.len()) {
                let growth = ladder.node_count(next) as f64 / ladder.node_count(now) as f64;
                let gain = (ladder.errors[now] - ladder.errors[next]) / growth.ln();
                if size * growth <= max_nodes as f64 && gain > best.map_or(0.0, |best| best.0) {
                    best = Some((gain, k, next));
                }
            }
        }
        match best {
            Some((_, k, next)) => inserted[k] = next,
            None => return inserted,
        }
    }
}

/// The places on an axis at which nodes may be: evenly spaced from `low` to 1.
struct Scale {
    low: f64,
    intervals: usize,
    kink: Option<f32>,
}

impl Scale {
    fn new(k: usize, thread: &Thread, folded: bool) -> Self {
        let low = if k == 0 && folded { 0.5 } else { 0.0 };
        let sharp = if k == 0 {
            (1.0 - low) * PI / thread.optics.gamma_s * SAMPLES_PER_GAMMA
        } else {
            0.0
        };
        let intervals = (sharp as usize)
            .clamp(MIN_INTERVALS, MAX_INTERVALS)
            .next_multiple_of(12);
        Self {
            low,
            intervals,
            kink: Chart::KINKS[k].filter(|kink| f64::from(*kink) > low),
        }
    }

    fn at(&self, index: usize) -> f64 {
        self.low + (1.0 - self.low) * index as f64 / self.intervals as f64
    }

    /// The fewest nodes: the ends, the kink, and what cubics need between them.
    fn first_nodes(&self, interpolation: Interpolation) -> Vec<usize> {
        let sides = if self.kink.is_some() { 2 } else { 1 };
        let cells = sides * (interpolation.taps() - 1);
        (0..=cells).map(|i| i * self.intervals / cells).collect()
    }

    fn axis(&self, nodes: &[usize], interpolation: Interpolation) -> Axis {
        let nodes = nodes.iter().map(|index| self.at(*index) as f32).collect();
        Axis::new(nodes, interpolation, self.kink).expect("indices ascend within the scale")
    }
}

/// The function along one axis.
struct Line {
    /// What would be stored, per place and channel.
    stored: Vec<[f64; 2]>,
    /// By how much relative error grows with it.
    weights: Vec<[f64; 2]>,
}

impl Line {
    fn sample(
        integrand: &Integrand,
        scale: &Scale,
        k: usize,
        mut u: [f64; 4],
        encoding: Encoding,
        albedo: f64,
        floor: f64,
    ) -> Self {
        let at = |index: usize| {
            u[k] = scale.at(index);
            let value = integrand.at_point(u);
            let Some(ratios) = value.ratios() else {
                return ([0.0; 2], [0.0; 2]);
            };
            let stored = ratios.map(|ratio| encoding.encode(ratio));
            let total = value.response.surface + albedo * value.response.volume + floor;
            let slopes = stored.map(|stored| encoding.slope(stored) / total);
            (
                stored,
                [
                    slopes[0] * value.factor.surface,
                    slopes[1] * albedo * value.factor.volume,
                ],
            )
        };
        let (stored, weights) = (0..=scale.intervals).map(at).unzip();
        Self { stored, weights }
    }
}

/// An axis at every number of nodes.
struct Ladder {
    scale: Scale,
    interpolation: Interpolation,
    first: Vec<usize>,
    /// Nodes in the order in which they were added.
    inserted: Vec<usize>,
    /// Mean relative error along this axis, by the number of nodes added.
    errors: Vec<f64>,
}

impl Ladder {
    fn climb(scale: Scale, lines: &[Line], interpolation: Interpolation) -> Self {
        let first = scale.first_nodes(interpolation);
        let mut nodes = first.clone();
        let (mut inserted, mut errors) = (Vec::new(), Vec::new());
        let samples = (lines.len() * scale.intervals) as f64;
        loop {
            let axis = scale.axis(&nodes, interpolation);
            let cell_error = |cell: usize| cell_error(&axis, &scale, &nodes, cell, lines);
            let cells: Vec<f64> = (0..nodes.len() - 1)
                .into_par_iter()
                .map(cell_error)
                .collect();
            errors.push(cells.iter().sum::<f64>() / samples);
            let divisible = (0..cells.len()).filter(|cell| nodes[cell + 1] - nodes[*cell] > 1);
            let worst = divisible.max_by(|a, b| cells[*a].total_cmp(&cells[*b]));
            match worst {
                Some(cell) if nodes.len() < MAX_LADDER => {
                    let middle = (nodes[cell] + nodes[cell + 1]) / 2;
                    nodes.insert(cell + 1, middle);
                    inserted.push(middle);
                }
                _ => {
                    return Self {
                        scale,
                        interpolation,
                        first,
                        inserted,
                        errors,
                    };
                }
            }
        }
    }

    fn node_count(&self, inserted: usize) -> usize {
        self.first.len() + inserted
    }

    fn axis(&self, inserted: usize) -> Axis {
        let mut nodes = [&self.first[..], &self.inserted[..inserted]].concat();
        nodes.sort_unstable();
        self.scale.axis(&nodes, self.interpolation)
    }
}

/// The error within a cell, summed over places, lines and channels.
fn cell_error(axis: &Axis, scale: &Scale, nodes: &[usize], cell: usize, lines: &[Line]) -> f64 {
    let mut sum = 0.0;
    for place in nodes[cell] + 1..nodes[cell + 1] {
        let stencil = axis.stencil(scale.at(place) as f32);
        let taps = &nodes[stencil.first..stencil.first + axis.taps()];
        for line in lines {
            for channel in 0..2 {
                let at_nodes = taps.iter().zip(stencil.weights);
                let value: f64 = at_nodes
                    .map(|(node, w)| f64::from(w) * line.stored[*node][channel])
                    .sum();
                sum += line.weights[place][channel] * (value - line.stored[place][channel]).abs();
            }
        }
    }
    sum
}
