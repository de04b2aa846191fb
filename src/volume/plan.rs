//! How many nodes a volume has along each axis of each grid, and where.
//!
//! Lines are drawn through the box of each grid at pairs of directions, and the table's function is sampled densely on them. An axis
//! begins with its ends and its middle; a step halves the cell whose halving gains most for the bytes that it costs, measured as
//! the error of ρ at the pairs, relative to ρ plus a hundredth of its mean. All grids share the volume's width and height, so that
//! a step along x or y gives nodes to each of them. Linear interpolation in four dimensions adds the errors of the axes to first order.
//!
//! Pairs are those of the error protocol, drawn here from a sequence of low discrepancy: no fabric is needed, and every run draws the same.

use rayon::prelude::*;

use super::{Error, MAX_SIDE, Nodes, Settings, TEXEL_BYTES, slabs};
use crate::lookup::roots;
use crate::math::simd::{Single, Vector};
use crate::math::{Vec3, dot};
use crate::table::{Grid, Segments, Table, ThreadTable};

/// Pairs that lines go through.
const PAIRS: u32 = 512;
/// Nodes are multiples of 2 to the power of minus these, at the finest. What it takes to find them grows with that.
const DEPTHS: [u32; 4] = [9, 7, 7, 7];
/// How many halvings ahead a gain is looked for: half of a lobe within a cell gains nothing yet.
const LOOK_AHEAD: u32 = 3;
/// Relative error is relative to ρ and this share of its mean.
const FLOOR: f64 = 0.01;
/// Threads are dyed at run time: one of less albedo counts as of this.
const LEAST_ALBEDO: f64 = 0.05;

/// The nodes of every grid, in order.
pub(super) fn plan(table: &Table, settings: &Settings) -> Result<Vec<[Nodes; 4]>, Error> {
    // Lookups count what is missing: not in the caller's table.
    let table = &table.clone();
    let pairs = weighted_pairs(table);
    let mut grids = Vec::new();
    for (index, thread) in table.threads().iter().enumerate() {
        for (role, grid) in thread.grids().enumerate() {
            let samples: Vec<Sample> = pairs
                .par_iter()
                .map(|pair| Sample::new(thread, index, role, grid, pair))
                .collect();
            grids.push([0, 1, 2, 3].map(|axis| Ladder::new(grid, axis, &samples)));
        }
    }
    let limits = Limits {
        bytes: settings.max_bytes,
        side: settings.max_side.min(MAX_SIDE),
    };
    let least = cost(&grids);
    if least[0] > settings.max_bytes {
        return Err(Error::TooLittle {
            allowed: settings.max_bytes,
            least: least[0],
        });
    }
    if least[1] > limits.side {
        return Err(Error::TooDeep {
            slabs: least[1],
            side: limits.side,
        });
    }
    while error(&grids) > settings.target_error && step(&mut grids, limits) {}
    Ok(grids
        .iter()
        .map(|axes| axes.each_ref().map(Ladder::nodes))
        .collect())
}

/// What a volume may take.
#[derive(Clone, Copy)]
struct Limits {
    bytes: usize,
    side: usize,
}

/// Texels along x, y and z of grids with such nodes.
pub(super) fn size(nodes: &[[Nodes; 4]]) -> [usize; 3] {
    let most = |axis: usize| nodes.iter().map(|n| n[axis].count()).max().unwrap_or(1);
    [most(0), most(1), nodes.iter().map(slabs).sum()]
}

/// Bytes and slabs.
fn cost(grids: &[[Ladder; 4]]) -> [usize; 2] {
    let count = |axis: usize| {
        grids
            .iter()
            .map(|g| g[axis].places.len())
            .max()
            .unwrap_or(1)
    };
    let depth = grids.iter().map(slabs_of).sum();
    [TEXEL_BYTES * count(0) * count(1) * depth, depth]
}

fn slabs_of(axes: &[Ladder; 4]) -> usize {
    axes[2].places.len() * (axes[3].places.len() - 1).max(1)
}

fn error(grids: &[[Ladder; 4]]) -> f64 {
    let axes = grids.iter().flatten();
    axes.map(|axis| axis.cells.iter().map(|cell| cell.error).sum::<f64>())
        .sum()
}

/// Gives nodes to the axis that gains most for its cost. Not if nothing fits, or nothing gains.
fn step(grids: &mut [[Ladder; 4]], limits: Limits) -> bool {
    let [bytes, depth] = cost(grids);
    let mut best: Option<(f64, usize, usize)> = None;
    let mut consider = |gain: f64, relative_cost: f64, slabs: usize, grid: usize, axis: usize| {
        let fits = bytes as f64 * (1.0 + relative_cost) <= limits.bytes as f64 + 0.5
            && slabs <= limits.side;
        let value = gain / relative_cost;
        if fits && gain > 0.0 && best.is_none_or(|(most, ..)| value > most) {
            best = Some((value, grid, axis));
        }
    };
    for axis in [0, 1] {
        let count = grids
            .iter()
            .map(|g| g[axis].places.len())
            .max()
            .unwrap_or(1);
        let gain = |ladder: &Ladder| {
            let (rating, _) = ladder.best().unwrap_or_default();
            rating * (count + SHARED_STEP - ladder.places.len()) as f64
        };
        let gain = grids.iter().map(|g| gain(&g[axis])).sum();
        if count + SHARED_STEP <= limits.side {
            consider(gain, SHARED_STEP as f64 / count as f64, depth, 0, axis);
        }
    }
    for (index, axes) in grids.iter().enumerate() {
        for axis in [2, 3] {
            let Some((rating, _)) = axes[axis].best() else {
                continue;
            };
            let nodes = axes[axis].nodes_per_step();
            let others = slabs_of(axes) / axes[axis].places.len().saturating_sub(axis - 2).max(1);
            let slabs = depth + nodes * others;
            let relative = (nodes * others) as f64 / depth as f64;
            consider(rating * nodes as f64, relative, slabs, index, axis);
        }
    }
    let Some((_, grid, axis)) = best else {
        return false;
    };
    if axis >= 2 {
        grids[grid][axis].halve();
        return true;
    }
    let count = grids
        .iter()
        .map(|g| g[axis].places.len())
        .max()
        .unwrap_or(1);
    for axes in grids {
        let ladder = &mut axes[axis];
        while ladder.places.len() + ladder.nodes_per_step() <= count + SHARED_STEP && ladder.halve()
        {
        }
    }
    true
}

/// Nodes of a step along x or y: what a mirrored axis takes.
const SHARED_STEP: usize = 2;

/// An axis of a grid, and the lines along it.
struct Ladder {
    depth: u32,
    places: Vec<u16>,
    /// Whether points u and 1 − u are one at a face of the box, where different nodes would be seen as a seam.
    is_mirrored: bool,
    lines: Vec<Line>,
    /// One less than places.
    cells: Vec<Cell>,
}

#[derive(Clone, Copy, Default)]
struct Cell {
    error: f64,
    /// What halving gains, per node.
    rating: f64,
}

/// A line through a sample along an axis.
struct Line {
    /// Where the sample is, in units of the lattice.
    at: f64,
    /// What errors of S and V cost.
    weights: [f64; 2],
    /// S and V at the sample.
    truth: [f64; 2],
    /// √S and √V at every place of the lattice.
    roots: Vec<[f32; 2]>,
}

impl Line {
    /// The error of interpolation between two places.
    fn error(&self, from: u16, to: u16) -> f64 {
        let t = (self.at - f64::from(from)) / f64::from(to - from);
        let mut error = 0.0;
        for channel in 0..2 {
            let root = |place: u16| f64::from(self.roots[usize::from(place)][channel]);
            let value = (1.0 - t) * root(from) + t * root(to);
            error += self.weights[channel] * (value * value - self.truth[channel]);
        }
        error.abs()
    }
}

impl Ladder {
    fn new(grid: &Grid, axis: usize, samples: &[Sample]) -> Self {
        let knots: Vec<f64> = grid.axes()[axis].knots().collect();
        let depth = DEPTHS[axis];
        let unit = f64::from(1u32 << depth);
        let first = (knots[0] * unit).floor() as u16;
        let last = (knots[knots.len() - 1] * unit).ceil() as u16;
        if axis >= grid.coordinates().rank() || knots.len() == 1 || first == last {
            return Self {
                depth,
                places: vec![first],
                is_mirrored: false,
                lines: Vec::new(),
                cells: Vec::new(),
            };
        }
        let middle = 1u16 << (depth - 1);
        let mut places = vec![first, middle, last];
        places.retain(|place| (first..=last).contains(place));
        places.dedup();
        let is_mirrored = grid.coordinates().mirrored()[axis] && first + last == 2 * middle;
        let lines = samples
            .par_iter()
            .map(|sample| sample.line(grid, axis, depth))
            .collect();
        let mut ladder = Self {
            depth,
            places,
            is_mirrored,
            lines,
            cells: Vec::new(),
        };
        ladder.cells = (1..ladder.places.len())
            .map(|k| ladder.cell(k - 1))
            .collect();
        ladder
    }

    fn nodes(&self) -> Nodes {
        Nodes::new(self.depth, self.places.clone())
    }

    fn nodes_per_step(&self) -> usize {
        1 + usize::from(self.is_mirrored)
    }

    /// The rating of the cell that is halved next, and which.
    fn best(&self) -> Option<(f64, usize)> {
        let cells = if self.is_mirrored {
            self.cells.len() / 2
        } else {
            self.cells.len()
        };
        let rating = |k: usize| {
            if self.is_mirrored {
                0.5 * (self.cells[k].rating + self.cells[self.cells.len() - 1 - k].rating)
            } else {
                self.cells[k].rating
            }
        };
        let all = (0..cells).map(|k| (rating(k), k));
        all.filter(|(rating, _)| *rating > 0.0)
            .reduce(|a, b| if b.0 > a.0 { b } else { a })
    }

    /// Whether there was a cell to halve.
    fn halve(&mut self) -> bool {
        let Some((_, cell)) = self.best() else {
            return false;
        };
        if self.is_mirrored {
            self.halve_cell(self.cells.len() - 1 - cell);
        }
        self.halve_cell(cell);
        true
    }

    fn halve_cell(&mut self, cell: usize) {
        let middle = self.places[cell].midpoint(self.places[cell + 1]);
        self.places.insert(cell + 1, middle);
        self.cells[cell] = self.cell(cell);
        self.cells.insert(cell + 1, self.cell(cell + 1));
    }

    fn cell(&self, k: usize) -> Cell {
        let (from, to) = (self.places[k], self.places[k + 1]);
        let is_last = k + 2 == self.places.len();
        let lines: Vec<&Line> = self
            .lines
            .iter()
            .filter(|line| {
                let is_before_end = line.at < f64::from(to) || is_last;
                (line.at >= f64::from(from) || k == 0) && is_before_end
            })
            .collect();
        let error_in = |parts: u16| {
            let width = (to - from) / parts;
            let error = |line: &&Line| {
                let part = ((line.at - f64::from(from)) / f64::from(width)).max(0.0) as u16;
                let start = from + width * part.min(parts - 1);
                line.error(start, start + width)
            };
            lines.iter().map(error).sum::<f64>()
        };
        let error = error_in(1);
        let mut rating = 0.0;
        for halvings in 1..=LOOK_AHEAD {
            let parts = 1u16 << halvings;
            if (to - from) % parts == 0 {
                let gain = error - error_in(parts);
                rating = f64::max(rating, gain / f64::from(parts - 1));
            }
        }
        let count = self.lines.len().max(1) as f64;
        Cell {
            error: error / count,
            rating: rating / count,
        }
    }
}

/// A pair in a grid.
struct Sample {
    u: [f32; 4],
    weights: [f64; 2],
}

impl Sample {
    fn new(
        thread: &ThreadTable,
        index: usize,
        role: usize,
        grid: &Grid,
        pair: &WeightedPair,
    ) -> Self {
        let frame = thread.frame.cast::<Single>();
        let lanes = |w: [f32; 3]| frame.to_thread(w.map(Single));
        let (wi, wr) = (lanes(pair.wi), lanes(pair.wr));
        let u = grid.coordinates().of(wi, wr);
        let weights = if role == 0 {
            let [share] = grid.coordinates().share_of_box(wi, wr).to_array();
            pair.threads[index].map(|weight| weight * f64::from(share))
        } else {
            [f64::from(thread.coverage()) * pair.per_q, 0.0]
        };
        Self {
            u: u.map(|u| u.to_array()[0]),
            weights,
        }
    }

    fn line(&self, grid: &Grid, axis: usize, depth: u32) -> Line {
        let unit = (1u32 << depth) as f32;
        let point = |place: f32| {
            let mut u = self.u;
            u[axis] = place;
            u
        };
        let places = (0..(1usize << depth) + 1).map(|k| k as f32 / unit);
        let [own] = roots(grid, std::iter::once(self.u))[..] else {
            unreachable!("one point has one value")
        };
        Line {
            at: f64::from(self.u[axis] * unit),
            weights: self.weights,
            truth: own.map(|root| f64::from(root * root)),
            roots: roots(grid, places.map(point)),
        }
    }
}

/// A pair of directions.
struct WeightedPair {
    wi: [f32; 3],
    wr: [f32; 3],
    /// By thread, what errors of its S and V do to ρ relative to it …
    threads: Vec<[f64; 2]>,
    /// … and what one of Q does.
    per_q: f64,
}

/// Pairs that the table has.
fn weighted_pairs(table: &Table) -> Vec<WeightedPair> {
    let draw = |index: u32| {
        let (wi, wr, is_render) = pair(table, index);
        let all = table.components(wi, wr);
        let lit = table.threads().iter().zip(&all.threads);
        let weights = lit.clone().map(|(thread, _)| {
            let albedo = thread.albedo().iter().copied().fold(0.0, f32::max);
            let coverage = f64::from(thread.coverage());
            [coverage, coverage * f64::from(albedo).max(LEAST_ALBEDO)]
        });
        let weights: Vec<[f64; 2]> = weights.collect();
        let sum: f64 = lit
            .zip(&weights)
            .map(|((_, of), w)| {
                w[0] * f64::from(of.response.surface) + w[1] * f64::from(of.response.volume)
            })
            .sum();
        let q = f64::from(all.q);
        (table.is_baked(wi, wr) && q > 0.0).then_some((wi, wr, is_render, weights, sum, q))
    };
    let drawn: Vec<_> = (0..PAIRS).into_par_iter().filter_map(draw).collect();
    let renders = || drawn.iter().filter(|pair| pair.2);
    let mean = renders().map(|(.., sum, q)| sum / q).sum::<f64>() / renders().count().max(1) as f64;
    let weigh = |(wi, wr, _, weights, sum, q): (_, _, _, Vec<[f64; 2]>, f64, f64)| {
        let over = 1.0 / (sum + FLOOR * mean * q).max(1e-30);
        WeightedPair {
            wi,
            wr,
            threads: weights.iter().map(|w| w.map(|w| w * over)).collect(),
            per_q: 1.0 / q,
        }
    };
    drawn.into_iter().map(weigh).collect()
}

/// The pair of an index, and whether it is a render pair.
fn pair(table: &Table, index: u32) -> ([f32; 3], [f32; 3], bool) {
    let number = |base: u32| radical_inverse(base, index + 1);
    let wi = cosine_weighted(number(2), number(3));
    let single = |w: Vec3<f64>| w.map(|x| x as f32);
    let render = (
        single(wi),
        single(cosine_weighted(number(5), number(7))),
        true,
    );
    if number(11) < 0.5 || table.threads().is_empty() {
        return render;
    }
    let threads = table.threads();
    let thread = &threads[(number(13) * threads.len() as f64) as usize];
    let jitter = f64::from(thread.optics.gamma_s) * 4.0 * (number(17) - 0.5);
    let tilt = jitter + tilt(thread, number(19));
    let wr = on_reflection_cone(thread, tilt, wi, number(23));
    if wr[2] > 0.0 {
        (single(wi), single(wr), false)
    } else {
        render
    }
}

/// The tilt at a share of a thread's length. Of what changes its direction tables do not tell; it may be any that yarns have.
fn tilt(thread: &ThreadTable, share: f64) -> f64 {
    if matches!(thread.segments, Segments::Curve(_)) {
        return share - 0.5;
    }
    let mut rest = share;
    for tilt in thread.tangents().tilts() {
        rest -= f64::from(tilt.weight);
        if rest < 0.0 {
            return f64::from(tilt.angle);
        }
    }
    for segment in thread.tangents().segments() {
        let weight = f64::from(segment.weight);
        if rest < weight {
            let (from, to) = (f64::from(segment.from), f64::from(segment.to));
            return from + (to - from) * rest / weight;
        }
        rest -= weight;
    }
    0.0
}

/// The digits of `index`, mirrored at the point: J. H. Halton, *On the efficiency of certain quasi-random sequences of points in evaluating
/// multi-dimensional integrals*, Numerische Mathematik 2, 1960.
fn radical_inverse(base: u32, mut index: u32) -> f64 {
    let (mut sum, mut scale) = (0.0, 1.0);
    while index > 0 {
        scale /= f64::from(base);
        sum += scale * f64::from(index % base);
        index /= base;
    }
    sum
}

fn cosine_weighted(a: f64, b: f64) -> Vec3<f64> {
    let z = (1.0 - a).sqrt();
    let (sin, cos) = (std::f64::consts::TAU * b).sin_cos();
    let r = a.sqrt();
    [r * cos, r * sin, z]
}

/// A direction at which a cylinder of that tilt reflects light from `wi`, at a share of its azimuths.
fn on_reflection_cone(thread: &ThreadTable, tilt: f64, wi: Vec3<f64>, share: f64) -> Vec3<f64> {
    let frame = thread.frame();
    let (sin, cos) = tilt.sin_cos();
    let wi = frame.to_thread(wi);
    let (tangent, normal) = ([cos, 0.0, sin], [-sin, 0.0, cos]);
    let x = -dot(wi, tangent);
    let r = (1.0 - x * x).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (std::f64::consts::PI * (share - 0.5)).sin_cos();
    let wr = [0, 1, 2].map(|k| x * tangent[k] + r * cos_phi * normal[k]);
    frame.to_surface([wr[0], r * sin_phi, wr[2]])
}
