//! One coordinate of a grid: quadratic splines between knots.
//!
//! A function of the coordinate is Σ c_k B_k, where B_k are the quadratic B-splines of the knots. Three of them are not
//! zero in a cell; with t from 0 to 1 across it,
//!
//! ```text
//! B_k = f (1−t)²,    B_k+2 = r t²,    B_k+1 = 1 − B_k − B_k+2       f = h/(h₋+h), r = h/(h+h₊)
//! ```
//!
//! for a cell of width h between cells of widths h₋ and h₊, which are 0 beyond the ends. So the sum is smooth (C¹) across
//! knots, and at the ends it is the first and the last coefficient. Where functions bend, at a knot that is a kink, the
//! neighbour's width counts as 0 too: left and right share a coefficient there and nothing else.
//!
//! An axis along which nothing changes has one knot, 0, and one coefficient.
//!
//! # Words
//!
//! Cells are halves of halves: their widths are powers of ½, each begins at a multiple of its width, and is at most
//! [`MOST_UNEVEN`] times as wide as its neighbour. So all that a lookup needs to know of a place fits into one `u32`, of which there is one for each
//! 2^−depth-th of the coordinate, and which one load finds:
//!
//! ```text
//! bits 30…23   the exponent of 1/h, as it stands in an f32; 0 of a cell without width
//! bits 18…15   r and
//! bits 14…11   f, as the place k of [`SHARES`]: 1 for 0, else 1/(1 + 2^(k−8))
//! bits 10…0    the first coefficient
//! ```
//!
//! t is what follows the point of u/h.
//!
//! Why quadratic: three coefficients per axis make 27 rows of 3 in four dimensions, against 64 rows of 4 for cubics, and
//! what is interpolated has few continuous derivatives. `table/mod.rs` has the measurements.

use alloc::{vec, vec::Vec};

use crate::math::simd::Vector;

/// Knots are multiples of 2 to the power of minus this, at the finest.
pub const MAX_DEPTH: u32 = 14;
/// The most knots of an axis.
pub const MAX_KNOTS: usize = 1024;
/// The most that a cell may be wider than its neighbour.
pub const MOST_UNEVEN: u16 = 128;

/// What f and r may be.
const SHARES: [f32; 16] = {
    let mut shares = [1.0; 16];
    let (mut k, mut ratio) = (1, 1.0 / 128.0);
    while k < shares.len() {
        shares[k] = 1.0 / (1.0 + ratio);
        ratio *= 2.0;
        k += 1;
    }
    shares
};
const FALLING: u32 = 11;
const RISING: u32 = 15;
const FIRST: u32 = (1 << FALLING) - 1;
const INVERSE_WIDTH: u32 = 0x7F80_0000;
const _: () = assert!(MAX_KNOTS + 2 <= FIRST as usize);

/// The largest coordinate that is looked up: 1 − 2⁻²⁴.
const BELOW_ONE: f64 = 1.0 - f32::EPSILON as f64 / 2.0;

/// Knots of one axis, ready for lookup.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    depth: u32,
    knots: Vec<u16>,
    /// Index of the knot at which functions bend.
    kink: Option<usize>,
    /// By 2^depth-ths of the coordinate.
    words: Vec<u32>,
}

/// Where coordinates are on an axis.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place<V: Vector> {
    /// The first of the coefficients that make up the value …
    pub(crate) first: V::Index,
    /// … and the weights of these.
    pub(crate) weights: [V; TAPS],
}

/// How many coefficients make up a value along an axis.
pub(crate) const TAPS: usize = 3;
/// How many sites before and after its own a coefficient depends on: see [`Axis::solve`].
pub const REACH: usize = 3;

/// At the middle of a cell.
#[derive(Clone, Copy)]
struct Equation {
    /// The value, by the coefficients before, here and after.
    value: [f64; 3],
    /// The coefficient, nearly, by the values before, here and after.
    coefficient: [f64; 3],
}

/// Coefficients by values: see [`Axis::solve`].
#[derive(Debug, Clone)]
pub(crate) struct Solver {
    /// By coefficient, none where it is the value: see [`weights_of_sites`].
    rows: Vec<Option<(usize, [f64; 2 * REACH + 1])>>,
}

impl Solver {
    /// As [`Axis::solve`].
    ///
    /// # Panics
    /// When there are not [`Axis::len`] · `channels` values.
    pub(crate) fn solve(&self, values: &mut [f64], channels: usize) {
        assert_eq!(values.len(), self.rows.len() * channels);
        let given = values.to_vec();
        for (row, values) in self.rows.iter().zip(values.chunks_exact_mut(channels)) {
            let Some((from, weights)) = row else {
                continue;
            };
            values.fill(0.0);
            for (given, weight) in given[from * channels..].chunks_exact(channels).zip(weights) {
                for (value, given) in values.iter_mut().zip(given) {
                    *value += weight * given;
                }
            }
        }
    }
}

/// A coefficient by values: the first site that it depends on, and weights from there on.
fn weights_of_sites(equations: &[Option<Equation>], row: usize) -> (usize, [f64; 2 * REACH + 1]) {
    // The coefficients of a spline from here to there …
    let (first, last) = (
        row.saturating_sub(REACH - 1),
        (row + REACH - 1).min(equations.len() - 1),
    );
    // … whose ends are known.
    let entry = |k: usize, side: usize| match equations[k] {
        Some(Equation { value, .. }) if k != first && k != last => value[side],
        _ => [0.0, 1.0, 0.0][side],
    };
    // The row of the inverse matrix is a column of the transposed one's; elimination, and back.
    let mut column = [0.0; 2 * REACH - 1];
    let mut above = [0.0; 2 * REACH - 1];
    let (mut before, mut above_before) = (0.0, 0.0);
    for k in first..=last {
        let below = if k > first { entry(k - 1, 2) } else { 0.0 };
        let pivot = 1.0 / (entry(k, 1) - below * above_before);
        let right = if k == row { 1.0 } else { 0.0 };
        before = (right - below * before) * pivot;
        above_before = if k < last {
            entry(k + 1, 0) * pivot
        } else {
            0.0
        };
        (column[k - first], above[k - first]) = (before, above_before);
    }
    for k in (0..last - first).rev() {
        column[k] -= above[k] * column[k + 1];
    }
    let from = first.saturating_sub(1);
    let mut weights = [0.0; 2 * REACH + 1];
    for k in first..=last {
        let share = column[k - first];
        match equations[k] {
            Some(Equation { coefficient, .. }) if k == first || k == last => {
                for (side, weight) in coefficient.into_iter().enumerate() {
                    weights[k + side - 1 - from] += share * weight;
                }
            }
            _ => weights[k - from] += share,
        }
    }
    (from, weights)
}

/// Index of the knot ½, if that is an inner one.
fn middle(depth: u32, knots: &[u16]) -> Option<usize> {
    let unit = 1u32 << depth;
    let inner = 1..knots.len().max(1) - 1;
    inner.into_iter().find(|k| 2 * u32::from(knots[*k]) == unit)
}

impl Axis {
    /// An axis along which nothing changes: one knot, 0, one coefficient.
    pub fn flat() -> Self {
        Self::point(0, 0)
    }

    /// An axis along which all that is needed is at one place, in units of 2^−`depth`: one coefficient, which counts for all. A place
    /// beyond 1 counts as 1.
    pub fn point(depth: u32, knot: u16) -> Self {
        let depth = depth.min(MAX_DEPTH);
        let unit = 1u16 << depth;
        Self {
            depth,
            knots: vec![knot.min(unit)],
            kink: None,
            // With t = 0 all weight is on the first coefficient.
            words: vec![0; usize::from(unit)],
        }
    }

    /// Whether nothing changes along it.
    pub fn is_flat(&self) -> bool {
        self.knots.len() == 1
    }

    /// An axis with ascending `knots` in units of 2^−`depth` from 0, or ½, to 1, between which cells are halves of halves (widths are powers of ½); functions may bend at the inner knot ½ if `has_kink`.
    ///
    /// Returns `None` when the knots are not so.
    pub fn new(depth: u32, knots: Vec<u16>, has_kink: bool) -> Option<Self> {
        let ascending = knots.windows(2).all(|pair| pair[0] < pair[1]);
        if depth > MAX_DEPTH || !(2..=MAX_KNOTS).contains(&knots.len()) || !ascending {
            return None;
        }
        let unit = 1u16 << depth;
        let is_dyadic = |ends: &[u16]| {
            let width = ends[1] - ends[0];
            width.is_power_of_two() && ends[0].is_multiple_of(width)
        };
        let begins = knots[0] == 0 || u32::from(knots[0]) * 2 == u32::from(unit);
        if !begins || knots.last() != Some(&unit) || !knots.windows(2).all(is_dyadic) {
            return None;
        }
        let kink = middle(depth, &knots).filter(|_| has_kink);
        let mut axis = Self {
            depth,
            kink,
            // Below the first knot is nothing but what rounding makes of it.
            words: vec![0; usize::from(unit)],
            knots,
        };
        for cell in 0..axis.knots.len() - 1 {
            let (start, end) = (axis.knots[cell], axis.knots[cell + 1]);
            let inverse_width = f32::from(unit) / f32::from(end - start);
            let [falling, rising] = axis.shares(cell)?;
            let word = inverse_width.to_bits()
                | rising << RISING
                | falling << FALLING
                | axis.first_of(cell) as u32;
            axis.words[usize::from(start)..usize::from(end)].fill(word);
        }
        Some(axis)
    }

    /// f and r of a cell as places of [`SHARES`]; `None` if its neighbours are too wide or too narrow.
    fn shares(&self, cell: usize) -> Option<[u32; 2]> {
        let width = self.width(cell);
        let most = MOST_UNEVEN.ilog2();
        let share = |neighbour: u16| match neighbour {
            0 => Some(0),
            _ => {
                // The ratio is a power of two.
                let place = (most + 1 + neighbour.ilog2()).checked_sub(width.ilog2())?;
                (1..=2 * most + 1).contains(&place).then_some(place)
            }
        };
        let [before, after] = self.beside(cell);
        Some([share(before)?, share(after)?])
    }

    /// The knots, ascending within \[0, 1\].
    pub fn knots(&self) -> impl ExactSizeIterator<Item = f64> {
        let unit = f64::from(1u32 << self.depth);
        self.knots.iter().map(move |knot| f64::from(*knot) / unit)
    }

    /// The knots in units of 2 to the power of minus [`Axis::depth`].
    pub fn integer_knots(&self) -> &[u16] {
        &self.knots
    }

    /// Knots are multiples of 2 to the power of minus this.
    pub fn depth(&self) -> u32 {
        self.depth
    }

    /// Whether functions may bend at the knot ½.
    pub fn has_kink(&self) -> bool {
        self.kink.is_some()
    }

    /// Whether ½ is a knot at which functions could bend: an inner one.
    pub fn has_middle(&self) -> bool {
        middle(self.depth, &self.knots).is_some()
    }

    /// How many coefficients there are.
    #[expect(clippy::len_without_is_empty, reason = "an axis is never empty")]
    pub fn len(&self) -> usize {
        if self.is_flat() {
            return 1;
        }
        self.knots.len() + 1 + usize::from(self.kink.is_some())
    }

    /// The places at which values determine the coefficients, one per coefficient and in their order: the ends, the kink
    /// and the middles of cells.
    pub fn sites(&self) -> Vec<f64> {
        let knots: Vec<f64> = self.knots().collect();
        if self.is_flat() {
            return knots;
        }
        let mut sites = vec![knots[0]];
        for (cell, ends) in knots.windows(2).enumerate() {
            sites.push(0.5 * (ends[0] + ends[1]));
            if self.kink == Some(cell + 1) {
                sites.push(ends[1]);
            }
        }
        sites.push(knots[knots.len() - 1]);
        sites
    }

    /// Turns values at [`Axis::sites`] into coefficients, `channels` interleaved functions at once.
    ///
    /// At the ends and the kink the value is the coefficient. At the middle of a cell B = f/4, 1 − (f+r)/4, r/4, so that
    /// coefficients of a spline that meets all values depend on all of them, if by a factor of about 6 less from one site to the next.
    /// Here each is that of a spline which meets the values nearby and ends two coefficients to either side in
    ///
    /// ```text
    /// c = v − h²/4 · v[x₋, x, x₊]          h the cell's width, v[…] the second divided difference over the sites around it
    /// ```
    ///
    /// which is right for quadratics. No table's error shows the difference; but no coefficient depends on values farther away than
    /// [`REACH`] sites, and a part of a table can be baked without the rest, to the last bit.
    ///
    /// # Panics
    /// When there are not [`Axis::len`] · `channels` values.
    pub fn solve(&self, values: &mut [f64], channels: usize) {
        self.solver().solve(values, channels);
    }

    /// [`Axis::solve`] for many functions.
    pub(crate) fn solver(&self) -> Solver {
        let equations = self.equations();
        let rows = (0..equations.len()).map(|row| {
            let is_value = equations[row].is_none();
            (!is_value).then(|| weights_of_sites(&equations, row))
        });
        Solver {
            rows: rows.collect(),
        }
    }

    /// What ties coefficients and values together, by coefficient; none where they are the same.
    fn equations(&self) -> Vec<Option<Equation>> {
        let mut equations = vec![None; self.len()];
        let sites = self.sites();
        for cell in 0..self.knots.len() - 1 {
            let row = self.first_of(cell) + 1;
            let [falling, rising] = self.slopes(cell).map(|slope| 0.25 * slope);
            let width = f64::from(self.width(cell)) / f64::from(1u32 << self.depth);
            let (left, right) = (sites[row] - sites[row - 1], sites[row + 1] - sites[row]);
            let share = 0.25 * width * width / (left + right);
            let (before, after) = (-share / left, -share / right);
            equations[row] = Some(Equation {
                value: [falling, 1.0 - falling - rising, rising],
                coefficient: [before, 1.0 - before - after, after],
            });
        }
        equations
    }

    /// Where coordinates within \[0, 1\] are.
    #[inline(always)]
    pub(crate) fn place<V: Vector>(&self, u: V) -> Place<V> {
        let u = u.min(V::of(BELOW_ONE));
        // Scaling by powers of two is exact, so that u lies in the cell that is found.
        let unit = (u * V::of(f64::from(1u32 << self.depth))).truncate();
        Place::of_words(V::gather(&self.words, unit), u)
    }

    /// What lookups know of places: see [Words](self#words).
    pub(crate) fn words(&self) -> &[u32] {
        &self.words
    }

    /// First coefficients of its cells, ascending.
    pub(crate) fn firsts(&self) -> impl Iterator<Item = usize> + '_ {
        let cells = self.knots.len().max(2) - 1;
        (0..cells).map(|cell| self.first_of(cell))
    }

    /// Whether a coefficient is the first of a cell.
    pub(crate) fn has_cell(&self, first: usize) -> bool {
        // At a kink one index is skipped.
        first + TAPS.min(self.len()) <= self.len() && self.kink.is_none_or(|kink| first != kink)
    }

    /// The nearest coordinate of the cell that begins with a coefficient.
    pub(crate) fn clamp(&self, first: u32, u: f32) -> f32 {
        let first = first as usize;
        let cell = first - usize::from(self.kink.is_some_and(|kink| first > kink));
        let at = |knot: usize| f32::from(self.knots[knot]) / (1u32 << self.depth) as f32;
        if self.is_flat() {
            return at(0);
        }
        // max before min: it replaces NaN.
        u.max(at(cell)).min(at(cell + 1).next_down())
    }

    fn width(&self, cell: usize) -> u16 {
        self.knots[cell + 1] - self.knots[cell]
    }

    /// First coefficient of a cell.
    fn first_of(&self, cell: usize) -> usize {
        cell + usize::from(self.kink.is_some_and(|kink| cell >= kink))
    }

    /// f and r of a cell.
    fn slopes(&self, cell: usize) -> [f64; 2] {
        let width = f64::from(self.width(cell));
        self.beside(cell)
            .map(|beside| width / (width + f64::from(beside)))
    }

    /// Widths of the cells before and after one; 0 where there are none, or others.
    fn beside(&self, cell: usize) -> [u16; 2] {
        let ends_at =
            |knot: usize| knot == 0 || knot == self.knots.len() - 1 || self.kink == Some(knot);
        let beyond = |knot: usize, cell: usize| {
            if ends_at(knot) { 0 } else { self.width(cell) }
        };
        [
            beyond(cell, cell.wrapping_sub(1)),
            beyond(cell + 1, cell + 1),
        ]
    }
}

impl<V: Vector> Place<V> {
    /// At coordinates within \[0, 1\], by words of several axes, those of each from its start on, with 2^depth of each.
    #[inline(always)]
    pub(crate) fn of_words_from(words: &[u32], start: V::Index, u: V, unit: V) -> Self {
        let u = u.min(V::of(BELOW_ONE));
        let word = V::plus(start, (u * unit).truncate());
        Self::of_words(V::gather(words, word), u)
    }

    /// At coordinates below 1, by the words that are there.
    #[inline(always)]
    pub(crate) fn of_words(word: V::Index, u: V) -> Self {
        let x = u * V::of_bits(V::and(word, INVERSE_WIDTH));
        let t = x - x.floor();
        let s = V::one() - t;
        let falling = V::look_up(&SHARES, V::shift_down::<FALLING>(word)) * (s * s);
        let rising = V::look_up(&SHARES, V::shift_down::<RISING>(word)) * (t * t);
        Self {
            first: V::and(word, FIRST),
            weights: [falling, V::one() - falling - rising, rising],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::Single;

    fn value(axis: &Axis, coefficients: &[f64], u: f32) -> f32 {
        let Place {
            first: [first],
            weights,
        } = axis.place(Single(u));
        (0..TAPS)
            .map(|k| weights[k].0 * coefficients[first as usize + k] as f32)
            .sum()
    }

    fn fit(axis: &Axis, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut values: Vec<f64> = axis.sites().into_iter().map(f).collect();
        axis.solve(&mut values, 1);
        values
    }

    fn uneven() -> Vec<u16> {
        vec![0, 8, 12, 14, 15, 16, 32, 33, 34, 36, 40, 48, 64]
    }

    #[test]
    fn quadratics_and_their_kinks_are_reproduced() {
        let axis = Axis::new(6, uneven(), true).unwrap();
        let f = |x: f64| {
            if x < 0.5 {
                1.0 + x * x
            } else {
                1.25 + (x - 0.5) * (3.0 - x)
            }
        };
        let coefficients = fit(&axis, f);
        assert_eq!(coefficients.len(), axis.len());
        for k in 0..=1000 {
            let x = f64::from(k) / 1000.0;
            assert!(
                (f64::from(value(&axis, &coefficients, x as f32)) - f(x)).abs() < 1e-6,
                "{x}"
            );
        }
    }

    #[test]
    fn values_at_sites_are_nearly_met_by_any_function() {
        for kink in [false, true] {
            let axis = Axis::new(6, uneven(), kink).unwrap();
            let f = |x: f64| (17.0 * x).sin();
            let coefficients = fit(&axis, f);
            for site in axis.sites() {
                let error = f64::from(value(&axis, &coefficients, site as f32)) - f(site);
                // A cell is up to 4 radians wide here.
                assert!(error.abs() < 6e-3, "{site}: {error}");
            }
        }
    }

    #[test]
    fn coefficients_depend_on_no_value_beyond_their_reach() {
        let axis = Axis::new(6, uneven(), true).unwrap();
        let mut values: Vec<f64> = axis.sites().into_iter().map(|x| (9.0 * x).cos()).collect();
        let given = values.clone();
        axis.solve(&mut values, 1);
        for changed in 0..axis.len() {
            let mut others = given.clone();
            others[changed] = 1e3;
            axis.solve(&mut others, 1);
            for (index, (other, value)) in others.iter().zip(&values).enumerate() {
                if index.abs_diff(changed) > REACH {
                    assert_eq!(other.to_bits(), value.to_bits(), "{index} of {changed}");
                }
            }
        }
    }

    #[test]
    fn splines_are_smooth_across_knots() {
        let axis = Axis::new(6, uneven(), false).unwrap();
        let coefficients = fit(&axis, |x| (9.0 * x).sin());
        for knot in axis.knots().skip(1).take(11) {
            let h = 1e-3;
            let [before, at, after] =
                [-h, 0.0, h].map(|h| value(&axis, &coefficients, knot as f32 + h));
            assert!((after - 2.0 * at + before).abs() < 500.0 * h * h, "{knot}");
        }
    }

    #[test]
    fn two_knots_suffice_and_coordinates_that_are_no_numbers_are_looked_up() {
        let axis = Axis::new(0, vec![0, 1], true).unwrap();
        let coefficients = fit(&axis, |x| x * x - x);
        assert!((value(&axis, &coefficients, 0.25) + 0.1875).abs() < 1e-6);
        assert_eq!(axis.place(Single(1.0)).first, [0]);
    }

    #[test]
    fn a_flat_axis_has_one_coefficient_for_any_coordinate() {
        let axis = Axis::flat();
        assert_eq!((axis.len(), axis.sites()), (1, vec![0.0]));
        let mut values = vec![7.0];
        axis.solve(&mut values, 1);
        assert_eq!(values, [7.0]);
        for u in [0.0, 0.3, 1.0] {
            let place = axis.place(Single(u));
            assert_eq!((place.first, place.weights[0]), ([0], Single(1.0)), "{u}");
        }
    }

    #[test]
    fn disordered_knots_are_refused() {
        for knots in [vec![], vec![5], vec![0, 0], vec![5, 2], vec![0, 65]] {
            assert!(Axis::new(6, knots, false).is_none());
        }
        let uneven = "cells that are no halves of halves";
        assert!(Axis::new(6, vec![0, 24, 64], false).is_none(), "{uneven}");
        assert!(
            Axis::new(6, vec![0, 16, 48, 64], false).is_none(),
            "{uneven}"
        );
        assert!(Axis::new(6, vec![16, 32, 64], false).is_none(), "{uneven}");
        // 2⁷ times as wide as the one before is not too wide, 2⁸ times is.
        let up = [260, 264, 272, 288, 320, 384, 512];
        let from = |start: &[u16]| [start, &up].concat();
        assert!(Axis::new(9, from(&[0, 256, 258]), false).is_some());
        assert!(Axis::new(9, from(&[0, 256, 257, 258]), false).is_none());
        let kink = Axis::new(9, from(&[0, 256, 257, 258]), true);
        assert!(kink.is_some(), "across a kink nothing is shared");
        assert!(Axis::new(MAX_DEPTH + 1, vec![0, 1], false).is_none());
    }
}
