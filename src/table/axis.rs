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
//! Why quadratic: three coefficients per axis make 27 rows of 3 in four dimensions, against 64 rows of 4 for cubics, and
//! what is interpolated has few continuous derivatives. `table/mod.rs` has the measurements.

use alloc::{vec, vec::Vec};

use crate::math::simd::Vector;

/// Knots are multiples of 2 to the power of minus this, at the finest.
pub const MAX_DEPTH: u32 = 14;
/// The most knots of an axis.
pub const MAX_KNOTS: usize = 1024;

/// Knots of one axis, ready for lookup.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    depth: u32,
    knots: Vec<u16>,
    /// Index of the knot at which functions bend.
    kink: Option<usize>,
    /// First coefficient of the cell by 2^depth-ths of the coordinate, and once more for 1.
    firsts: Vec<u32>,
    /// By first coefficient. (At a kink one index is skipped.)
    cells: Vec<Cell>,
}

/// A cell between knots.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Cell {
    start: f32,
    inverse_width: f32,
    /// f and r.
    falling: f32,
    rising: f32,
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
            firsts: vec![0; usize::from(unit) + 1],
            // With t = 0 all weight is on the first coefficient.
            cells: vec![Cell {
                falling: 1.0,
                ..Cell::default()
            }],
        }
    }

    /// Whether nothing changes along it.
    pub fn is_flat(&self) -> bool {
        self.knots.len() == 1
    }

    /// An axis with ascending `knots` in units of 2^−`depth`, at least two, within \[0, 1\]; functions may bend at the
    /// inner knot ½ if `has_kink`.
    ///
    /// Returns `None` when the knots are not so.
    pub fn new(depth: u32, knots: Vec<u16>, has_kink: bool) -> Option<Self> {
        let ascending = knots.windows(2).all(|pair| pair[0] < pair[1]);
        if depth > MAX_DEPTH || !(2..=MAX_KNOTS).contains(&knots.len()) || !ascending {
            return None;
        }
        let unit = 1u32 << depth;
        if knots.last().is_none_or(|last| u32::from(*last) > unit) {
            return None;
        }
        let kink = middle(depth, &knots).filter(|_| has_kink);

        let cells = knots.len() - 1;
        let length = cells + usize::from(kink.is_some());
        let mut axis = Self {
            depth,
            kink,
            firsts: vec![0; unit as usize + 1],
            cells: vec![Cell::default(); length],
            knots,
        };
        for cell in 0..cells {
            let first = axis.first_of(cell);
            let start = usize::from(axis.knots[cell]);
            // The last cell goes on to the end.
            let end = match cell + 1 {
                next if next < cells => usize::from(axis.knots[next]),
                _ => axis.firsts.len(),
            };
            axis.firsts[start..end].fill(first as u32);
            let [falling, rising] = axis.slopes(cell);
            axis.cells[first] = Cell {
                start: start as f32 / unit as f32,
                inverse_width: unit as f32 / f32::from(axis.width(cell)),
                falling: falling as f32,
                rising: rising as f32,
            };
        }
        Some(axis)
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

    /// The first of the three coefficients at coordinates within \[0, 1\]; NaN counts as 0.
    #[inline(always)]
    pub(crate) fn first<V: Vector>(&self, u: V) -> V::Index {
        // Scaling by a power of two is exact, so that u lies in the cell that is found.
        V::gather(
            &self.firsts,
            (u * V::of(f64::from(1u32 << self.depth))).truncate(),
        )
    }

    /// First coefficients of its cells, ascending.
    pub(crate) fn firsts(&self) -> impl Iterator<Item = usize> + '_ {
        let cells = self.knots.len().max(2) - 1;
        (0..cells).map(|cell| self.first_of(cell))
    }

    /// Whether a coefficient is the first of a cell.
    pub(crate) fn has_cell(&self, first: usize) -> bool {
        // At a kink one index is skipped.
        first < self.cells.len() && self.kink.is_none_or(|kink| first != kink)
    }

    /// The nearest coordinate of the cell that begins with a coefficient.
    pub(crate) fn clamp(&self, first: u32, u: f32) -> f32 {
        let cell = &self.cells[first as usize];
        let end = cell.start + 1.0 / cell.inverse_width;
        // max before min: it replaces NaN.
        u.max(cell.start).min(end)
    }

    /// The weights of the three coefficients from `first` on, at a coordinate for which it is that.
    #[inline(always)]
    pub(crate) fn weights(&self, first: u32, u: f32) -> [f32; TAPS] {
        let cell = &self.cells[first as usize];
        let t = (u - cell.start) * cell.inverse_width;
        let s = 1.0 - t;
        let (falling, rising) = (cell.falling * s * s, cell.rising * t * t);
        [falling, 1.0 - falling - rising, rising]
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
        let ends_at =
            |knot: usize| knot == 0 || knot == self.knots.len() - 1 || self.kink == Some(knot);
        let beyond = |knot: usize, cell: usize| {
            if ends_at(knot) {
                0.0
            } else {
                f64::from(self.width(cell))
            }
        };
        let before = beyond(cell, cell.wrapping_sub(1));
        let after = beyond(cell + 1, cell + 1);
        [width / (before + width), width / (width + after)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::simd::Single;

    fn value(axis: &Axis, coefficients: &[f64], u: f32) -> f32 {
        let [first] = axis.first(Single(u));
        let weights = axis.weights(first, u);
        (0..TAPS)
            .map(|k| weights[k] * coefficients[first as usize + k] as f32)
            .sum()
    }

    fn fit(axis: &Axis, f: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut values: Vec<f64> = axis.sites().into_iter().map(f).collect();
        axis.solve(&mut values, 1);
        values
    }

    fn uneven() -> Vec<u16> {
        vec![0, 6, 10, 20, 32, 33, 44, 60, 64]
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
        for knot in axis.knots().skip(1).take(7) {
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
        let [first] = axis.first(Single(f32::NAN));
        assert_eq!(first, 0);
    }

    #[test]
    fn a_flat_axis_has_one_coefficient_for_any_coordinate() {
        let axis = Axis::flat();
        assert_eq!((axis.len(), axis.sites()), (1, vec![0.0]));
        let mut values = vec![7.0];
        axis.solve(&mut values, 1);
        assert_eq!(values, [7.0]);
        for u in [0.0, 0.3, 1.0, f32::NAN] {
            let [first] = axis.first(Single(u));
            let [weight, ..] = axis.weights(first, 0.0);
            assert_eq!((first, weight), (0, 1.0), "{u}");
        }
    }

    #[test]
    fn disordered_knots_are_refused() {
        for knots in [vec![], vec![5], vec![0, 0], vec![5, 2], vec![0, 65]] {
            assert!(Axis::new(6, knots, false).is_none());
        }
        assert!(Axis::new(MAX_DEPTH + 1, vec![0, 1], false).is_none());
    }
}
