//! Where a grid's knots go, and how many each axis gets.
//!
//! Lines are drawn through the box at pairs of the error protocol, 48 along each axis, and the function is sampled densely
//! on them. An axis begins with few knots; the cell with the largest error of the spline, summed over its lines, is halved,
//! and so on: the error spreads evenly over the cells. That gives for each axis its error at every number of knots.
//! Splines in four dimensions add the errors of the axes to first order, so knots are then handed out to whichever axis
//! gains most for the growth of the table.
//!
//! Error is that of the segments' S + A V relative to itself plus a hundredth of its mean over these pairs, close to what
//! the protocol measures; A is the largest channel of the albedo.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::integrate::Integrand;
use crate::chart::Coordinates;
use crate::fabric::{Fabric, Thread};
use crate::math::simd::Single;
use crate::metrics::protocol_pairs;
use crate::progress::{Cancelled, Progress, Steps};
use crate::table::{Axis, MAX_DEPTH, MOST_UNEVEN, encode};

const LINES: usize = 48;
/// Lines are sampled at 2 to the power of this many intervals, at least.
const MIN_DEPTH: u32 = 8;
/// The sharp axis is sampled at least this often per γ_s.
const SAMPLES_PER_GAMMA: f64 = 3.0;
const MAX_LADDER: usize = 160;
/// How many knots ahead an axis' gain is looked for: halving one of several equally bad cells gains nothing yet.
const LOOK_AHEAD: usize = 4;
const SEED: u64 = 1;

/// A grid's axes.
pub(super) struct Plan {
    pub(super) axes: [Axis; 4],
    /// The mean relative error to expect; beyond a rim 0.
    pub(super) error: f64,
}

/// What a plan aims for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim {
    pub(super) max_coefficients: usize,
    /// Mean relative error at which there are knots enough.
    pub(super) target_error: f64,
}

/// The axes of a thread's function at every number of knots: what of a plan depends on neither size nor error.
pub(super) struct Ladders(Vec<Ladder>);

impl Ladders {
    /// Of an `integrand` of the thread.
    pub(super) fn climb(
        fabric: &Fabric,
        thread: &Thread,
        integrand: &Integrand,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let integrand = &integrand.at_first_sight();
        let coordinates = integrand.coordinates();
        let rank = coordinates.rank();
        let frame = thread.frame::<f64>();
        let brightest = thread.albedo.iter().copied().fold(0.0, f64::max);
        let pairs = protocol_pairs(fabric, rank * LINES, SEED);
        let steps = progress.steps(rank * LINES);
        let places: Vec<Place> = pairs
            .par_iter()
            .map(|pair| {
                steps.check()?;
                let (wi, wr) = (frame.to_thread(pair.wi), frame.to_thread(pair.wr));
                let response = integrand.at_pair(wi, wr);
                Ok(Place {
                    u: coordinates.of(wi, wr),
                    share: coordinates.share_of_box(wi, wr),
                    value: response.surface + brightest * response.volume,
                })
            })
            .collect::<Result<_, _>>()?;
        let mean_of =
            |of: fn(&Place) -> f64| places.iter().map(of).sum::<f64>() / places.len() as f64;
        let (mean, share) = (mean_of(|place| place.value), mean_of(|place| place.share));
        let size = Size {
            albedo: brightest,
            floor: 0.01 * mean,
        };

        let mut ladders = Vec::with_capacity(rank);
        for k in 0..rank {
            let scale = Scale::new(k, thread, coordinates);
            let sample = |place: &Place| {
                let sample = Line::sample(integrand, &scale, k, place, &size, &steps)?;
                steps.advance().map(|()| sample)
            };
            let places = &places[k * LINES..(k + 1) * LINES];
            let lines: Vec<Line> = places
                .par_iter()
                .filter(|place| place.share > 0.0)
                .map(sample)
                .collect::<Result<_, _>>()?;
            ladders.push(Ladder::climb(scale, &lines, share, &steps)?);
        }
        Ok(Self(ladders))
    }

    /// The axes of a grid of at most that many coefficients.
    pub(super) fn plan(&self, max_coefficients: usize, target_error: f64) -> Plan {
        let Self(ladders) = self;
        let inserted = share_out(ladders, max_coefficients, target_error);
        let axis = |k: usize| match ladders.get(k) {
            Some(ladder) => ladder.axis(inserted[k]),
            None => Axis::flat(),
        };
        let errors = ladders.iter().zip(&inserted);
        Plan {
            axes: [0, 1, 2, 3].map(axis),
            error: errors
                .map(|(ladder, inserted)| ladder.errors[*inserted])
                .sum(),
        }
    }
}

/// How many knots beyond the first each axis gets.
fn share_out(ladders: &[Ladder], max_coefficients: usize, target_error: f64) -> Vec<usize> {
    let mut inserted = vec![0; ladders.len()];
    loop {
        let error: f64 = (0..ladders.len())
            .map(|k| ladders[k].errors[inserted[k]])
            .sum();
        if error < target_error {
            return inserted;
        }
        let size: f64 = (0..ladders.len())
            .map(|k| ladders[k].length(inserted[k]) as f64)
            .product();
        let mut best: Option<(f64, usize, usize)> = None;
        for (k, ladder) in ladders.iter().enumerate() {
            let now = inserted[k];
            for next in now + 1..(now + 1 + LOOK_AHEAD).min(ladder.errors.len()) {
                let growth = ladder.length(next) as f64 / ladder.length(now) as f64;
                let gain = (ladder.errors[now] - ladder.errors[next]) / growth.ln();
                if size * growth <= max_coefficients as f64
                    && gain > best.map_or(0.0, |best| best.0)
                {
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

/// The places on an axis at which knots may be, and the line's samples: multiples of 2^−`depth`, from `low` to 1.
struct Scale {
    depth: u32,
    low: usize,
    has_kink: bool,
    /// Whether knots lie evenly about the middle.
    mirrored: bool,
    /// Coefficients come in tiles of as many.
    rows: usize,
}

impl Scale {
    fn new(k: usize, thread: &Thread, coordinates: Coordinates) -> Self {
        let (ends_fold, is_sharp) = match coordinates {
            Coordinates::Thread { ends_fold, .. } => (ends_fold, k == 0),
            // The highlight is at the middle of θ_i − θ_r.
            Coordinates::Isotropic => (false, k == 1),
            Coordinates::View { .. } => (false, false),
        };
        let sharp = if is_sharp {
            (PI / thread.optics.gamma_s * SAMPLES_PER_GAMMA)
                .log2()
                .ceil() as u32
        } else {
            0
        };
        let depth = sharp.clamp(MIN_DEPTH, MAX_DEPTH);
        let halved = k == 0 && ends_fold;
        Self {
            depth,
            low: if halved { 1 << (depth - 1) } else { 0 },
            has_kink: coordinates.kinks()[k] && !halved,
            // A face on which pairs are mirrored into each other looks the same from both sides only if splines on it do.
            mirrored: coordinates.mirrored()[k],
            rows: if k == 1 { 2 } else { 1 },
        }
    }

    /// Places of samples, in units of 2^−`depth`.
    fn places(&self) -> impl ExactSizeIterator<Item = usize> {
        self.low..(1 << self.depth) + 1
    }

    fn at(&self, place: usize) -> f64 {
        place as f64 / f64::from(1u32 << self.depth)
    }

    /// The fewest knots: halves and quarters.
    fn first_knots(&self) -> Vec<usize> {
        let quarter = 1 << (self.depth - 2);
        (0..=4)
            .map(|i| i * quarter)
            .filter(|knot| *knot >= self.low)
            .collect()
    }

    fn axis(&self, knots: &[usize]) -> Axis {
        // As coarse as the knots allow: lookup keeps an entry per unit.
        let shift = knots
            .iter()
            .map(|knot| knot.trailing_zeros())
            .fold(self.depth, u32::min);
        let knots = knots.iter().map(|knot| (knot >> shift) as u16).collect();
        Axis::new(self.depth - shift, knots, self.has_kink).expect("knots ascend within the scale")
    }
}

/// A pair of the protocol.
struct Place {
    u: [f64; 4],
    /// That of the box in the pair's value.
    share: f64,
    value: f64,
}

/// What errors are relative to: S + `albedo` V + `floor`.
struct Size {
    albedo: f64,
    floor: f64,
}

/// The function along one axis, by place.
struct Line {
    /// The quantity that splines are of, both channels.
    quantity: Vec<[f64; 2]>,
    /// By how much relative error grows with it, times the share of the box.
    weights: Vec<[f64; 2]>,
    /// The sum of these shares.
    shares: f64,
}

impl Line {
    fn sample(
        integrand: &Integrand,
        scale: &Scale,
        k: usize,
        place: &Place,
        &Size { albedo, floor }: &Size,
        steps: &Steps<'_>,
    ) -> Result<Self, Cancelled> {
        let mut u = place.u;
        let mut shares = 0.0;
        let at = |at: usize| {
            steps.check()?;
            u[k] = scale.at(at);
            let share = place.share * integrand.share_at(u);
            shares += share;
            let response = integrand.at_point(u);
            let values = [response.surface, response.volume];
            let quantity = values.map(encode);
            let total = response.surface + albedo * response.volume + floor;
            // What splines are of is the root of a value.
            let weights = [
                share * 2.0 * quantity[0] / total,
                share * albedo * 2.0 * quantity[1] / total,
            ];
            Ok((quantity, weights))
        };
        let samples: Vec<_> = scale.places().map(at).collect::<Result<_, Cancelled>>()?;
        let (quantity, weights) = samples.into_iter().unzip();
        Ok(Self {
            quantity,
            weights,
            shares,
        })
    }
}

/// An axis at every number of knots.
struct Ladder {
    scale: Scale,
    first: Vec<usize>,
    /// Knots in the order in which they were added: one at a time, or one and its mirror image.
    inserted: Vec<Vec<usize>>,
    /// Mean relative error along this axis, by the number of additions; of what is beyond a rim 0.
    errors: Vec<f64>,
}

impl Ladder {
    /// Of a box that has that `share` of all pairs.
    fn climb(
        scale: Scale,
        lines: &[Line],
        share: f64,
        steps: &Steps<'_>,
    ) -> Result<Self, Cancelled> {
        let first = scale.first_knots();
        let mut knots = first.clone();
        let (mut inserted, mut errors) = (Vec::new(), Vec::new());
        let samples = lines.iter().map(|line| line.shares).sum::<f64>().max(1.0) / share;
        loop {
            steps.check()?;
            let mut cells = cell_errors(&scale, &knots, lines);
            errors.push(cells.iter().sum::<f64>() / samples);
            if scale.mirrored {
                // The image of a cell is halved with it.
                let middle = cells.len() / 2;
                let (lower, upper) = cells.split_at_mut(middle);
                for (cell, image) in lower.iter_mut().zip(upper.iter_mut().rev()) {
                    *cell += std::mem::take(image);
                }
            }
            // The middles of halves have to be samples, too.
            let divisible = (0..cells.len()).filter(|cell| is_divisible(&knots, *cell));
            let worst = divisible.max_by(|a, b| cells[*a].total_cmp(&cells[*b]));
            match worst {
                Some(cell) if knots.len() < MAX_LADDER => {
                    let middle = (knots[cell] + knots[cell + 1]) / 2;
                    let image = (1 << scale.depth) - middle;
                    let added = if scale.mirrored {
                        vec![middle, image]
                    } else {
                        vec![middle]
                    };
                    knots.extend(&added);
                    knots.sort_unstable();
                    inserted.push(added);
                }
                _ => {
                    return Ok(Self {
                        scale,
                        first,
                        inserted,
                        errors,
                    });
                }
            }
        }
    }

    /// Coefficients of the axis that take memory.
    fn length(&self, inserted: usize) -> usize {
        self.axis(inserted).len().next_multiple_of(self.scale.rows)
    }

    fn axis(&self, inserted: usize) -> Axis {
        let mut knots = [&self.first[..], &self.inserted[..inserted].concat()].concat();
        knots.sort_unstable();
        self.scale.axis(&knots)
    }
}

/// Whether a cell's halves have samples in their middles, too, and are not too narrow beside its neighbours.
fn is_divisible(knots: &[usize], cell: usize) -> bool {
    let width = |ends: Option<&[usize]>| ends.map_or(0, |ends| ends[1] - ends[0]);
    let at = |cell: usize| width(knots.get(cell..cell + 2));
    let before = cell.checked_sub(1).map_or(0, at);
    let least = before.max(at(cell + 1)) / usize::from(MOST_UNEVEN);
    at(cell) >= (2 * least).max(4)
}

/// The error of the spline within each cell, summed over places, lines and channels.
fn cell_errors(scale: &Scale, knots: &[usize], lines: &[Line]) -> Vec<f64> {
    let axis = scale.axis(knots);
    let unit = f64::from(1u32 << scale.depth);
    let sites: Vec<usize> = axis
        .sites()
        .iter()
        .map(|site| (site * unit) as usize - scale.low)
        .collect();
    let stencils: Vec<(usize, [f64; 3])> = scale
        .places()
        .map(|place| {
            let place = axis.place(Single(scale.at(place) as f32));
            let [first] = place.first;
            (
                first as usize,
                place.weights.map(|weight| f64::from(weight.0)),
            )
        })
        .collect();
    let solver = axis.solver();
    let errors_of = |line: &Line| -> Vec<f64> {
        let mut coefficients: Vec<f64> =
            sites.iter().flat_map(|site| line.quantity[*site]).collect();
        solver.solve(&mut coefficients, 2);
        let error_at = |place: usize| {
            let (first, weights) = stencils[place];
            let error = |channel: usize| {
                let value: f64 = (0..3)
                    .map(|k| weights[k] * coefficients[2 * (first + k) + channel])
                    .sum();
                line.weights[place][channel] * (value - line.quantity[place][channel]).abs()
            };
            error(0) + error(1)
        };
        let cells = knots.windows(2);
        cells
            .map(|ends| {
                (ends[0] + 1..ends[1])
                    .map(|place| error_at(place - scale.low))
                    .sum()
            })
            .collect()
    };
    let by_line: Vec<Vec<f64>> = lines.par_iter().map(errors_of).collect();
    (0..knots.len() - 1)
        .map(|cell| by_line.iter().map(|errors| errors[cell]).sum())
        .collect()
}
