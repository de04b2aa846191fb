//! What a thread reflects of light from everywhere, by view: all of it, its [`Albedo`], and how it is spread over the angle of
//! the highlight, a [`Histogram`] that directions are drawn from (`lookup/sampling.rs`). Both are free of the thread's colour.
//!
//! A view is wr in the thread's frame, by q = tan(ψ_r/2) and λ = tan(asin(y)/2). Nodes are evenly spaced in
//!
//! ```text
//! t = x (7 − x²)/6                              of a histogram: more closely where x is small, for what stands upright
//! t = x (7 − x²)/12 + sgn x (1 − √(1−|x|))/2    of an albedo: at the horizon, too, where it rises most
//! ```
//!
//! of each, and what lies between is interpolated linearly.

use alloc::boxed::Box;
use alloc::vec::Vec;

use crate::math::{Lanes, Real, Vec3, norm2};

/// How many bins of the highlight's angle.
pub(crate) const BINS: usize = 32;
/// Nodes of a histogram along q, from −1 to 1, and along λ, from 0 to 1.
pub(crate) const HISTOGRAM_NODES: [usize; 2] = [9, 5];
const VIEWS: usize = HISTOGRAM_NODES[0] * HISTOGRAM_NODES[1];
/// Nodes of an albedo along q and λ, both from −1 to 1: of another thread's share in Q both sides may differ.
pub(crate) const ALBEDO_NODES: [usize; 2] = [33, 33];
const ALBEDOS: usize = ALBEDO_NODES[0] * ALBEDO_NODES[1];
/// So many threads have histograms, the first ones; of others light is found by the cosine.
pub(crate) const SAMPLED: usize = 8;
/// What a sum counts to.
const WHOLE: f32 = 65535.0;
/// Places of edges are multiples of 1 over this.
pub(crate) const EDGE_UNIT: f32 = 32767.0;

/// What a table knows of a thread for sampling.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Sampling {
    pub(crate) albedo: Albedo,
    pub(crate) histogram: Option<Box<Histogram>>,
}

/// The share of light from everywhere that a thread sends to a view: a ∫ S/Q dwi and a ∫ V/Q dwi.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Albedo {
    /// By node, q fastest: of S and of V.
    pub(crate) shares: Vec<[f32; 2]>,
}

/// How a thread's share of the light is spread over q = tan(ψ_h/2), where ψ_h is the angle of wi + wr in the plane of thread and
/// normal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Histogram {
    /// Where bins end, in units of 1/[`EDGE_UNIT`]: from −1 to 1, all different.
    pub(crate) edges: [i16; BINS + 1],
    /// By node, q fastest: all that S and V have in the bins.
    pub(crate) totals: [[f32; 2]; VIEWS],
    /// By node: up to each edge, the parts of S and V, in units of 1/65535; zeros where the total is 0.
    pub(crate) sums: [[[u16; 2]; BINS + 1]; VIEWS],
}

/// A view in a thread's frame: q and λ.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ViewPlace<L> {
    pub(crate) q: L,
    pub(crate) l: L,
}

impl<L: Lanes> ViewPlace<L> {
    /// That of a view in thread coordinates.
    #[inline(always)]
    pub(crate) fn of([x, y, z]: Vec3<L>) -> Self {
        let r = norm2(x, z);
        let within = |x: L| x.max(L::of(-1.0)).min(L::one());
        Self {
            q: within(x / (r + z).max(L::of(1e-30))),
            l: within(y / (L::one() + r)),
        }
    }
}

/// t of a histogram's q or λ.
#[inline(always)]
pub(crate) fn histogram_place<R: Real>(x: R) -> R {
    x * (R::of(7.0) - x * x) * R::of(1.0 / 6.0)
}

/// t of an albedo's q or λ.
#[inline(always)]
pub(crate) fn albedo_place<R: Real>(x: R) -> R {
    let steep = R::one() - (R::one() - x.abs()).max(R::zero()).sqrt();
    let steep = if x < R::zero() { -steep } else { steep };
    R::of(0.5) * (histogram_place(x) + steep)
}

/// Four nodes around a place, and their weights.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Nodes {
    pub(crate) index: [usize; 4],
    pub(crate) weight: [f32; 4],
}

impl Nodes {
    /// Of `counts` nodes along both axes, at places from 0 to 1.
    #[inline(always)]
    fn around([q, l]: [f32; 2], counts: [usize; 2]) -> Self {
        let ((k, a), (m, b)) = (cell(q, counts[0]), cell(l, counts[1]));
        let first = m * counts[0] + k;
        Self {
            index: [first, first + 1, first + counts[0], first + counts[0] + 1],
            weight: [(1.0 - a) * (1.0 - b), a * (1.0 - b), (1.0 - a) * b, a * b],
        }
    }
}

/// A number from 0 to 1: the nearest; 0 for what is no number.
#[inline(always)]
fn within(x: f32) -> f32 {
    Lanes::min(Lanes::max(x, 0.0), 1.0)
}

/// The cell of a place from 0 to 1 between `count` nodes, and where in the cell.
#[inline(always)]
fn cell(t: f32, count: usize) -> (usize, f32) {
    let place = within(t) * (count - 1) as f32;
    let cell = (place as usize).min(count - 2);
    (cell, place - cell as f32)
}

impl Albedo {
    /// The shares of S and V at a view.
    #[inline(always)]
    pub(crate) fn at(&self, place: ViewPlace<f32>) -> [f32; 2] {
        let place = [place.q, place.l].map(|x| 0.5 + 0.5 * albedo_place(x));
        let nodes = Nodes::around(place, ALBEDO_NODES);
        let mut sum = [0.0; 2];
        for (index, weight) in nodes.index.into_iter().zip(nodes.weight) {
            let [s, v] = self.shares[index];
            sum = [sum[0] + weight * s, sum[1] + weight * v];
        }
        sum
    }
}

/// A histogram at a view, for a colour.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mix {
    nodes: [usize; 4],
    /// What a unit of the sums of S and V is worth.
    units: [[f32; 2]; 4],
}

impl Histogram {
    /// Where bin `bin` begins.
    #[inline(always)]
    pub(crate) fn edge(&self, bin: usize) -> f32 {
        f32::from(self.edges[bin]) * (1.0 / EDGE_UNIT)
    }

    /// The bin of q; the first or the last for what is outside.
    #[inline(always)]
    pub(crate) fn bin(&self, q: f32) -> usize {
        let q = q * EDGE_UNIT;
        let mut bin = 0;
        let mut step = BINS / 2;
        while step > 0 {
            if f32::from(self.edges[bin + step]) <= q {
                bin += step;
            }
            step /= 2;
        }
        bin
    }

    /// At a view, where V counts `volume` times.
    #[inline(always)]
    pub(crate) fn at(&self, place: ViewPlace<f32>, volume: f32) -> Mix {
        let [q, l] = [place.q, place.l].map(histogram_place);
        let place = [0.5 + 0.5 * q, l.abs()];
        let Nodes { index, weight } = Nodes::around(place, HISTOGRAM_NODES);
        let mut units = [[0.0; 2]; 4];
        for k in 0..4 {
            let [s, v] = self.totals[index[k]];
            let unit = weight[k] / WHOLE;
            units[k] = [unit * s, unit * v * volume];
        }
        Mix {
            nodes: index,
            units,
        }
    }

    /// The light up to where bin `bin` begins, and to where it ends.
    #[inline(always)]
    fn around(&self, mix: &Mix, bin: usize) -> [f32; 2] {
        let mut sums = [0.0; 2];
        for (node, [s, v]) in mix.nodes.into_iter().zip(mix.units) {
            let row = &self.sums[node];
            for (sum, [of_s, of_v]) in sums.iter_mut().zip([row[bin], row[bin + 1]]) {
                *sum += s * f32::from(of_s) + v * f32::from(of_v);
            }
        }
        sums
    }

    /// The light up to where a range of q begins, and in it.
    #[inline(always)]
    pub(crate) fn light(&self, mix: &Mix, range: [f32; 2]) -> (f32, f32) {
        let [from, to] = [self.sum_to(mix, range[0]), self.sum_to(mix, range[1])];
        (from, (to - from).max(0.0))
    }

    /// The light up to q.
    #[inline(always)]
    fn sum_to(&self, mix: &Mix, q: f32) -> f32 {
        let bin = self.bin(q);
        let [from, to] = self.around(mix, bin);
        let [a, b] = [self.edge(bin), self.edge(bin + 1)];
        from + (to - from) * within((q - a) / (b - a))
    }

    /// The light per q.
    #[inline(always)]
    pub(crate) fn density(&self, mix: &Mix, q: f32) -> f32 {
        let bin = self.bin(q);
        let [from, to] = self.around(mix, bin);
        (to - from) / (self.edge(bin + 1) - self.edge(bin))
    }

    /// Where the light up to there is `sum`, between bins `first` and `last`.
    #[inline(always)]
    pub(crate) fn place_of(&self, mix: &Mix, sum: f32, [first, last]: [usize; 2]) -> f32 {
        let (mut low, mut high) = (first, last + 1);
        while high - low > 1 {
            let middle = (low + high) / 2;
            if self.around(mix, middle)[0] <= sum {
                low = middle;
            } else {
                high = middle;
            }
        }
        let [from, to] = self.around(mix, low);
        let share = if to > from {
            (sum - from) / (to - from)
        } else {
            0.5
        };
        let [a, b] = [self.edge(low), self.edge(low + 1)];
        a + (b - a) * within(share)
    }
}

impl Sampling {
    /// How many bytes a thread takes in a file.
    pub(crate) fn bytes(has_histogram: bool) -> usize {
        let histogram = 2 * (BINS + 1) + VIEWS * (8 + 4 * (BINS + 1));
        8 * ALBEDOS + if has_histogram { histogram } else { 0 }
    }

    /// Appends its bytes.
    pub(crate) fn put(&self, out: &mut Vec<u8>) {
        let put = |out: &mut Vec<u8>, x: &f32| out.extend(x.to_le_bytes());
        for x in self.albedo.shares.as_flattened() {
            put(out, x);
        }
        if let Some(histogram) = &self.histogram {
            for x in histogram.totals.as_flattened() {
                put(out, x);
            }
            out.extend(histogram.edges.iter().flat_map(|x| x.to_le_bytes()));
            let sums = histogram.sums.as_flattened().as_flattened();
            out.extend(sums.iter().flat_map(|x| x.to_le_bytes()));
        }
    }

    /// From as many bytes as [`Sampling::bytes`] says; `None` where they are no such.
    pub(crate) fn get(bytes: &[u8], has_histogram: bool) -> Option<Self> {
        let (floats, rest) = bytes.split_at_checked(8 * ALBEDOS)?;
        let albedo = Albedo {
            shares: pairs(floats).collect(),
        };
        let is_share = |x: &f32| (0.0..=MOST).contains(x);
        let is_right = |shares: &[[f32; 2]]| shares.as_flattened().iter().all(is_share);
        if !is_right(&albedo.shares) {
            return None;
        }
        if !has_histogram {
            return rest.is_empty().then_some(Self {
                albedo,
                histogram: None,
            });
        }
        let (totals, rest) = rest.split_at_checked(8 * VIEWS)?;
        let (edges, rest) = rest.split_at_checked(2 * (BINS + 1))?;
        let mut histogram = Box::new(Histogram {
            edges: [0; BINS + 1],
            totals: [[0.0; 2]; VIEWS],
            sums: [[[0; 2]; BINS + 1]; VIEWS],
        });
        for (to, x) in histogram.totals.iter_mut().zip(pairs(totals)) {
            *to = x;
        }
        for (to, x) in histogram.edges.iter_mut().zip(edges.as_chunks().0) {
            *to = i16::from_le_bytes(*x);
        }
        let sums = histogram.sums.as_flattened_mut().as_flattened_mut();
        if rest.len() != 2 * sums.len() {
            return None;
        }
        for (to, x) in sums.iter_mut().zip(rest.as_chunks().0) {
            *to = u16::from_le_bytes(*x);
        }
        (is_right(&histogram.totals) && histogram.is_right()).then_some(Self {
            albedo,
            histogram: Some(histogram),
        })
    }
}

/// More than any fabric reflects.
const MOST: f32 = 1e6;

fn pairs(bytes: &[u8]) -> impl Iterator<Item = [f32; 2]> {
    let pair = |[a, b, c, d, e, f, g, h]: &[u8; 8]| {
        [[*a, *b, *c, *d], [*e, *f, *g, *h]].map(f32::from_le_bytes)
    };
    bytes.as_chunks().0.iter().map(pair)
}

impl Histogram {
    /// Whether edges ascend from −1 to 1, and sums from nothing to all.
    fn is_right(&self) -> bool {
        let ends = [self.edges[0], self.edges[BINS]].map(f32::from);
        let edges = ends == [-EDGE_UNIT, EDGE_UNIT] && self.edges.is_sorted_by(|a, b| a < b);
        let sums = self.sums.iter().zip(&self.totals).all(|(sums, totals)| {
            [0, 1].into_iter().all(|part| {
                let last = if totals[part] > 0.0 { u16::MAX } else { 0 };
                sums[0][part] == 0
                    && sums[BINS][part] == last
                    && sums.is_sorted_by_key(|sum| sum[part])
            })
        });
        edges && sums
    }
}
