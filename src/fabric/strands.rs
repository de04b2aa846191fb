//! A thread's curve in parts that integrate alike.
//!
//! Along the curve the tilt δ and the direction α change together, linearly between one tangent offset and the next
//! (\[Fecho13\] 6.1.2). Where α stays the same, however often the curve comes back to it, the parts are one straight *strand*,
//! whose mean has only tilts to go through; where it changes they are *sweeps* over both. A straight thread is one strand.
//!
//! A cylinder has no ends: tilt δ in direction α is tilt −δ in direction α + 180°. So its distribution over (δ, α) may look the
//! same from both sides (α → −α), from both ends (δ, α → −δ, −α), or from everywhere.

use std::f64::consts::{PI, TAU};

use super::Thread;
use crate::brdf::TangentCurve;
use crate::math::Real;

/// Angles and shares closer than this are the same.
const SAME: f64 = 1e-9;

/// The parts of a thread's curve; their shares sum to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct Strands {
    /// Those of one direction each, all different.
    pub straight: Vec<Strand>,
    /// Those that turn.
    pub sweeps: Vec<Sweep>,
}

/// All parts of a thread that have one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Strand {
    /// α, radians.
    pub direction: f64,
    /// Share of the thread's length, above 0 to 1.
    pub share: f64,
    /// Its parts as a polyline, with jumps of length 0 between them.
    offsets: Vec<f64>,
    lengths: Vec<f64>,
}

/// A part along which the direction changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sweep {
    /// δ and α where it begins, radians.
    pub from: [f64; 2],
    /// δ and α where it ends.
    pub to: [f64; 2],
    /// Share of the thread's length, above 0 to 1.
    pub share: f64,
}

impl Strand {
    /// The distribution of its tilts.
    pub fn tangents<R: Real>(&self) -> TangentCurve<R> {
        TangentCurve::new(&self.offsets, &self.lengths)
    }
}

impl Sweep {
    /// δ and α at `s` ∈ \[0, 1\] of the way.
    pub fn at(&self, s: f64) -> [f64; 2] {
        [0, 1].map(|k| self.from[k] + (self.to[k] - self.from[k]) * s)
    }

    /// By how much δ and α change at most, radians.
    pub fn width(&self) -> f64 {
        let [tilt, direction] = [0, 1].map(|k| (self.to[k] - self.from[k]).abs());
        tilt.max(direction)
    }

    /// `count` parts of equal length.
    pub fn parts(&self, count: usize) -> impl Iterator<Item = Self> {
        let whole = *self;
        (0..count).map(move |k| {
            let end = |k: usize| whole.at(k as f64 / count as f64);
            Self {
                from: end(k),
                to: end(k + 1),
                share: whole.share / count as f64,
            }
        })
    }
}

impl Strands {
    pub(super) fn new(thread: &Thread, origin: f64) -> Self {
        let (offsets, lengths) = (&thread.tangent_offsets, &thread.tangent_lengths);
        let total: f64 = lengths.iter().sum();
        let (mut straight, mut sweeps) = (Vec::<Strand>::new(), Vec::new());
        for (k, length) in lengths
            .iter()
            .enumerate()
            .filter(|(_, length)| **length > 0.0)
        {
            let [from, to] = [k, k + 1].map(|end| [offsets[end], thread.directions[end] - origin]);
            if from[1] != to[1] {
                let share = length / total;
                sweeps.push(Sweep { from, to, share });
                continue;
            }
            let same = straight
                .iter()
                .position(|strand| strand.direction == from[1]);
            let index = same.unwrap_or_else(|| {
                straight.push(Strand {
                    direction: from[1],
                    share: 0.0,
                    offsets: Vec::new(),
                    lengths: Vec::new(),
                });
                straight.len() - 1
            });
            let strand = &mut straight[index];
            if !strand.lengths.is_empty() {
                strand.lengths.push(0.0);
            }
            strand.lengths.push(*length);
            strand.offsets.extend([from[0], to[0]]);
        }
        for strand in &mut straight {
            strand.share = strand.lengths.iter().sum::<f64>() / total;
        }
        Self { straight, sweeps }
    }

    /// Whether the mirror s → −s of the direction α = 0 changes nothing.
    pub fn look_the_same_from_both_sides(&self) -> bool {
        self.is_mapped_to_itself(|[tilt, direction]| [tilt, -direction])
    }

    /// Whether the mirror t → −t of the direction α = 0 changes nothing.
    pub fn look_the_same_from_both_ends(&self) -> bool {
        self.is_mapped_to_itself(|[tilt, direction]| [-tilt, -direction])
    }

    /// Whether no direction differs from another: at every tilt the curve goes around evenly.
    pub fn are_isotropic(&self) -> bool {
        let upright = |tilt: f64| (tilt.abs() - 0.5 * PI).abs() < SAME;
        let mut arcs: Vec<(f64, f64, f64, f64)> = Vec::new();
        for sweep in &self.sweeps {
            let [tilt, from] = sweep.from;
            if (sweep.to[0] - tilt).abs() > SAME {
                return false;
            }
            // δ ≥ 0; of δ = 0 each direction is its opposite, too.
            let turn = if tilt < 0.0 { PI } else { 0.0 };
            let (low, high) = (from.min(sweep.to[1]) + turn, from.max(sweep.to[1]) + turn);
            if tilt.abs() < SAME {
                arcs.push((0.0, low, high, 0.5 * sweep.share));
                arcs.push((0.0, low + PI, high + PI, 0.5 * sweep.share));
            } else {
                arcs.push((tilt.abs(), low, high, sweep.share));
            }
        }
        let straight_are = self.straight.iter().all(|strand| {
            let curve = strand.tangents::<f64>();
            curve.segments().is_empty() && curve.tilts().iter().all(|tilt| upright(tilt.angle))
        });
        arcs.sort_by(|a, b| a.0.total_cmp(&b.0));
        straight_are
            && arcs
                .chunk_by(|a, b| b.0 - a.0 < SAME)
                .all(|ring| is_even(ring.iter().map(|(_, from, to, share)| (*from, *to, *share))))
    }

    /// Whether `map` of (δ, α) takes the curve's parts to each other. Parts that are divided differently count as different,
    /// which costs bytes and no error.
    fn is_mapped_to_itself(&self, map: impl Fn([f64; 2]) -> [f64; 2]) -> bool {
        let parts = self.ends();
        let mut left = parts.clone();
        parts.into_iter().all(|(from, to, share)| {
            let image = [map(from), map(to)];
            let is_image = |(from, to, other): &([f64; 2], [f64; 2], f64)| {
                (share - other).abs() < SAME
                    && (are_same(image, [*from, *to]) || are_same(image, [*to, *from]))
            };
            let found = left.iter().position(is_image);
            found.map(|index| left.swap_remove(index)).is_some()
        })
    }

    /// The ends of all parts, and their shares.
    fn ends(&self) -> Vec<([f64; 2], [f64; 2], f64)> {
        let mut ends = Vec::new();
        for strand in &self.straight {
            let curve = strand.tangents::<f64>();
            let at = |tilt: f64| [tilt, strand.direction];
            let tilts = curve.tilts().iter();
            ends.extend(tilts.map(|tilt| {
                let end = at(tilt.angle);
                (end, end, strand.share * tilt.weight)
            }));
            let segments = curve.segments().iter();
            ends.extend(segments.map(|s| (at(s.from), at(s.to), strand.share * s.weight)));
        }
        let sweeps = self.sweeps.iter();
        ends.extend(sweeps.map(|sweep| (sweep.from, sweep.to, sweep.share)));
        ends
    }
}

fn are_same(a: [[f64; 2]; 2], b: [[f64; 2]; 2]) -> bool {
    a.as_flattened()
        .iter()
        .zip(b.as_flattened())
        .all(|(a, b)| (a - b).abs() < SAME)
}

/// Whether arcs (from, to, share) of directions cover the full turn evenly.
fn is_even(arcs: impl Iterator<Item = (f64, f64, f64)>) -> bool {
    // Whole turns cover evenly; what is left of each begins and ends somewhere, where another must end or begin.
    let mut ends: Vec<(f64, f64)> = Vec::new();
    for (from, to, share) in arcs {
        let density = share / (to - from);
        ends.push((from.rem_euclid(TAU), density));
        ends.push((to.rem_euclid(TAU), -density));
    }
    let largest = ends.iter().map(|end| end.1).fold(0.0, f64::max);
    let apart = |a: f64, b: f64| {
        let difference = (a - b).abs();
        difference.min(TAU - difference)
    };
    ends.iter().all(|(at, _)| {
        let here = ends.iter().filter(|(other, _)| apart(*at, *other) < SAME);
        here.map(|(_, change)| change).sum::<f64>().abs() <= SAME * largest
    })
}
