//! Which coefficients a grid has, where it has not all: of each tile, two rows along the sharp axis, one run.
//!
//! A lookup reads three coefficients of each of up to 18 tiles. Tiles lie one behind the other, so that an offset per tile is all
//! that it takes to find them; and one number per cell says where along the sharp axis all 18 have their coefficients,
//! or, if they have none in common, which cell nearby has. So a lookup where nothing was baked finds the nearest that was.
//!
//! Along u₁ places are those of tiles here, of which every cell needs two. [`Axis`] knows the cells of rows.

use alloc::{collections::VecDeque, vec, vec::Vec};
use core::cmp::Ordering;

use super::grid::tiles_of;
use super::{Axis, TAPS};

/// Runs of coefficients.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rows {
    /// The first place along u₁, u₂ and u₃ at which there are any, and from there on how many: tiles beside these have none, and are
    /// not counted.
    low: [usize; 3],
    counts: [usize; 3],
    /// How many make up a value.
    taps: [usize; 3],
    /// By tile: which number its coefficient 0 is, or would be if it had it.
    offsets: Vec<i32>,
    /// By first tile of a cell: see [`Cell`].
    cells: Vec<u32>,
    /// From one place along u₁, u₂ and u₃ to the next, in tiles; 0 along an axis that has one.
    strides: [usize; 3],
}

/// The coefficients of a row or a tile: the first, and how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Run {
    pub(crate) first: u16,
    pub(crate) count: u16,
}

impl Run {
    /// Both ends included.
    pub(crate) fn join(&mut self, first: u16, last: u16) {
        if self.count == 0 {
            *self = Self {
                first,
                count: last + 1 - first,
            };
        } else {
            let end = self.end().max(last + 1);
            self.first = self.first.min(first);
            self.count = end - self.first;
        }
    }

    /// What two have in common.
    fn meet(self, other: Self) -> Self {
        let first = self.first.max(other.first);
        let end = self.end().min(other.end());
        Self {
            first,
            count: end.saturating_sub(first),
        }
    }

    /// One past the last.
    pub(crate) fn end(self) -> u16 {
        self.first + self.count
    }
}

/// Where a lookup in a cell of u₁, u₂ and u₃ goes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Cell {
    /// All its rows have the coefficients that begin from the first to the last of these.
    Baked { first: u32, last: u32 },
    /// Nowhere: this one is the nearest that has.
    Elsewhere(u32),
}

/// Of a number that stands for a cell elsewhere.
const ELSEWHERE: u32 = 1 << 31;
/// Bits of a coefficient's index.
const BITS: u32 = 12;

impl Cell {
    fn pack(self) -> u32 {
        match self {
            Self::Baked { first, last } => first | last << BITS,
            Self::Elsewhere(cell) => cell | ELSEWHERE,
        }
    }

    #[inline(always)]
    fn unpack(number: u32) -> Self {
        if number & ELSEWHERE == 0 {
            Self::Baked {
                first: number & ((1 << BITS) - 1),
                last: number >> BITS,
            }
        } else {
            Self::Elsewhere(number & !ELSEWHERE)
        }
    }
}

impl Rows {
    /// Tiles with these `runs`, `[u₃][u₂][u₁/2]`, of a grid of these axes and number of channels. `None` if there is not a run for each tile
    /// within the first axis, if no cell has all its coefficients, or some coefficient is of no such cell.
    pub(crate) fn new(runs: &[Run], axes: &[Axis; 4], channels: usize) -> Option<Self> {
        let [n0, n1, n2, n3] = axes.each_ref().map(Axis::len);
        let n1 = tiles_of(n1);
        let are_within = runs
            .iter()
            .all(|run| usize::from(run.first) + usize::from(run.count) <= n0);
        if runs.len() != n1 * n2 * n3 || !are_within {
            return None;
        }
        let places = || {
            let rows = runs.iter().enumerate().filter(|(_, run)| run.count > 0);
            rows.map(|(row, _)| place_of(row, [n1, n2, n3]))
        };
        let low = places().reduce(|a, b| [0, 1, 2].map(|k| a[k].min(b[k])))?;
        let high = places().reduce(|a, b| [0, 1, 2].map(|k| a[k].max(b[k])))?;
        let counts = [0, 1, 2].map(|k| high[k] + 1 - low[k]);
        let run_at = |row: usize| {
            let [a, b, c] = place_of(row, counts);
            runs[low[0] + a + n1 * (low[1] + b + n2 * (low[2] + c))]
        };
        let rows = counts.iter().product();
        let mut number = 0;
        let mut offsets = Vec::with_capacity(rows);
        for row in 0..rows {
            let run = run_at(row);
            let offset = i64::from(number) - (2 * channels * usize::from(run.first)) as i64;
            offsets.push(i32::try_from(offset).ok()?);
            number += u32::try_from(2 * channels * usize::from(run.count)).ok()?;
        }
        let is_flat = [1, 2, 3].map(|axis| axes[axis].is_flat());
        let mut rows = Self {
            low,
            counts,
            taps: [0, 1, 2].map(|k| match k {
                _ if is_flat[k] => 1,
                0 => 2,
                _ => TAPS,
            }),
            offsets,
            cells: vec![u32::MAX; rows],
            strides: strides(counts, is_flat),
        };
        let mut open = VecDeque::new();
        for cell in 0..rows.cells.len() {
            let place = place_of(cell, counts);
            let is_cell = (0..3).all(|k| {
                let first = low[k] + place[k];
                let has_cell = match k {
                    0 => cells_of_tile(&axes[1], first).next().is_some(),
                    _ => axes[k + 1].has_cell(first),
                };
                place[k] + rows.taps[k] <= counts[k] && has_cell
            });
            let mut common = Run {
                first: 0,
                count: u16::MAX,
            };
            if is_cell {
                rows.of_cell(cell, |row| common = common.meet(run_at(row)));
            }
            if is_cell && usize::from(common.count) >= TAPS {
                let baked = Cell::Baked {
                    first: common.first.into(),
                    last: u32::from(common.end()) - TAPS as u32,
                };
                rows.cells[cell] = baked.pack();
                open.push_back((cell, cell));
            }
        }
        if open.is_empty() {
            return None;
        }
        // Outwards from those that are baked, a step along an axis at a time.
        while let Some((cell, from)) = open.pop_front() {
            let place = place_of(cell, counts);
            for (axis, stride) in [1, counts[0], counts[0] * counts[1]]
                .into_iter()
                .enumerate()
            {
                let below = (place[axis] > 0).then(|| cell - stride);
                let above = (place[axis] + 1 < counts[axis]).then(|| cell + stride);
                for next in [below, above].into_iter().flatten() {
                    if rows.cells[next] == u32::MAX {
                        rows.cells[next] = Cell::Elsewhere(from as u32).pack();
                        open.push_back((next, from));
                    }
                }
            }
        }
        (rows.runs(axes) == runs).then_some(rows)
    }

    /// The tiles of a cell that begins with one.
    fn of_cell(&self, cell: usize, mut with: impl FnMut(usize)) {
        let [s1, s2, s3] = self.strides;
        for d in 0..self.taps[2] {
            for c in 0..self.taps[1] {
                for b in 0..self.taps[0] {
                    with(cell + d * s3 + c * s2 + b * s1);
                }
            }
        }
    }

    /// Where a lookup goes in the cell that begins with these coefficients, and whether that is elsewhere.
    #[inline(always)]
    pub(crate) fn settle(&self, axes: &[Axis; 4], first: [u32; 4]) -> ([u32; 4], bool) {
        let mut is_within = true;
        let mut row = 0;
        for k in 0..3 {
            let place = place_along(k, first).wrapping_sub(self.low[k]);
            is_within &= place < self.counts[k];
            row += self.strides[k] * place.min(self.counts[k] - 1);
        }
        match Cell::unpack(self.cells[row]) {
            Cell::Baked {
                first: from,
                last: to,
            } if is_within && (from..=to).contains(&first[0]) => (first, false),
            _ => (self.nearest(axes, first), true),
        }
    }

    #[cold]
    fn nearest(&self, axes: &[Axis; 4], first: [u32; 4]) -> [u32; 4] {
        // Within the box first; what is elsewhere then is baked.
        let place = [0, 1, 2].map(|k| {
            let last = self.low[k] + self.counts[k] - self.taps[k];
            place_along(k, first).clamp(self.low[k], last) - self.low[k]
        });
        let within: usize = place
            .iter()
            .zip(self.strides)
            .map(|(a, stride)| a * stride)
            .sum();
        let row = match Cell::unpack(self.cells[within]) {
            Cell::Elsewhere(row) => row as usize,
            Cell::Baked { .. } => within,
        };
        let f0 = match Cell::unpack(self.cells[row]) {
            Cell::Baked {
                first: from,
                last: to,
            } => first[0].clamp(from, to),
            Cell::Elsewhere(_) => first[0],
        };
        let [tile, f2, f3] = place_of(row, self.counts);
        let tile = self.low[0] + tile;
        let cells = || cells_of_tile(&axes[1], tile);
        let f1 = match place_along(0, first).cmp(&tile) {
            Ordering::Less => cells().next(),
            Ordering::Equal => Some(first[1] as usize),
            Ordering::Greater => cells().last(),
        };
        [
            f0,
            f1.unwrap_or(2 * tile) as u32,
            (self.low[1] + f2) as u32,
            (self.low[2] + f3) as u32,
        ]
    }

    /// From one tile to the next, and from one coefficient of u₂ and u₃ to the next, in tiles.
    #[inline(always)]
    pub(crate) fn strides(&self) -> [usize; 3] {
        self.strides
    }

    /// By tile: which number its coefficient 0 is.
    #[inline(always)]
    pub(crate) fn offsets(&self) -> &[i32] {
        &self.offsets
    }

    /// The tile that begins a cell.
    #[inline(always)]
    pub(crate) fn tile(&self, first: [u32; 4]) -> u32 {
        let along = |k: usize| self.strides[k] * (place_along(k, first) - self.low[k]);
        (along(0) + along(1) + along(2)) as u32
    }

    /// By tile `[u₃][u₂][u₁/2]`: what cells need.
    pub(crate) fn runs(&self, axes: &[Axis; 4]) -> Vec<Run> {
        let [_, n1, n2, n3] = axes.each_ref().map(Axis::len);
        let n1 = tiles_of(n1);
        let mut runs = vec![Run::default(); n1 * n2 * n3];
        for (cell, number) in self.cells.iter().enumerate() {
            if let Cell::Baked { first, last } = Cell::unpack(*number) {
                self.of_cell(cell, |row| {
                    let [a, b, c] = place_of(row, self.counts);
                    let [a, b, c] = [self.low[0] + a, self.low[1] + b, self.low[2] + c];
                    runs[a + n1 * (b + n2 * c)].join(first as u16, last as u16 + TAPS as u16 - 1);
                });
            }
        }
        runs
    }

    /// Bytes in memory.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.offsets[..]) + size_of_val(&self.cells[..])
    }

    /// Whether the cell that begins with these coefficients has all that it needs.
    #[cfg(feature = "bake")]
    pub(crate) fn has(&self, axes: &[Axis; 4], first: [usize; 4]) -> bool {
        !self.settle(axes, first.map(|first| first as u32)).1
    }

    /// How many of the cells have coefficients, of how many.
    pub(crate) fn baked_cells(&self, axes: &[Axis; 4]) -> [usize; 2] {
        let n0 = axes[0].firsts().count();
        let cells = self.cells.iter().enumerate();
        let baked = cells.map(|(cell, number)| match Cell::unpack(*number) {
            Cell::Baked { first, last } => {
                let (first, last) = (first as usize, last as usize);
                let along = axes[0].firsts().filter(|f0| (first..=last).contains(f0));
                let [tile, ..] = place_of(cell, self.counts);
                along.count() * cells_of_tile(&axes[1], self.low[0] + tile).count()
            }
            Cell::Elsewhere(_) => 0,
        });
        let all = axes[1..].iter().map(|axis| axis.firsts().count());
        [baked.sum(), n0 * all.product::<usize>()]
    }
}

/// First coefficients along u₁ of the cells that begin in a tile.
fn cells_of_tile(axis: &Axis, tile: usize) -> impl Iterator<Item = usize> {
    let rows = if axis.is_flat() { 1 } else { 2 };
    (2 * tile..2 * tile + rows).filter(|first| axis.has_cell(*first))
}

/// The place of a cell along u₁, in tiles, u₂ or u₃.
#[inline(always)]
fn place_along(k: usize, first: [u32; 4]) -> usize {
    match k {
        0 => first[1] as usize / 2,
        _ => first[k + 1] as usize,
    }
}

/// The places along u₁, u₂ and u₃ of a row or tile, by how many there are.
pub(crate) fn place_of(row: usize, [n1, n2, _]: [usize; 3]) -> [usize; 3] {
    [row % n1, row / n1 % n2, row / n1 / n2]
}

fn strides(counts: [usize; 3], is_flat: [bool; 3]) -> [usize; 3] {
    let mut stride = 1;
    [0, 1, 2].map(|k| {
        let this = stride;
        stride *= counts[k];
        if is_flat[k] { 0 } else { this }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_know_what_they_have_and_where_to_go_instead() {
        let axis = || Axis::new(2, vec![0, 1, 2, 3, 4], false).unwrap();
        let axes = [axis(), axis(), Axis::flat(), Axis::flat()];
        // Six rows along u₁ are three tiles. Coefficients 1 to 4 of the last two: cells of u₁ that begin with rows 2 and 3, where two
        // cells of u₀ are.
        let mut runs = vec![Run::default(); 3];
        runs[1..].fill(Run { first: 1, count: 4 });
        let rows = Rows::new(&runs, &axes, 2).unwrap();
        assert_eq!(rows.runs(&axes), runs);
        for f1 in 0..4 {
            for f0 in 0..4 {
                let is_baked = f1 >= 2 && (1..3).contains(&f0);
                let expected = ([f0.clamp(1, 2), f1.max(2), 0, 0], !is_baked);
                assert_eq!(rows.settle(&axes, [f0, f1, 0, 0]), expected, "{f0} {f1}");
            }
        }
        assert_eq!(rows.tile([1, 2, 0, 0]), 0);
        assert_eq!(rows.offsets(), [-4, 12]);
        assert_eq!(rows.baked_cells(&axes), [4, 16]);

        let with = |tile: usize, run: Run| {
            let mut changed = runs.clone();
            changed[tile] = run;
            Rows::new(&changed, &axes, 2)
        };
        let none = "no cell is whole";
        assert!(with(1, Run { first: 1, count: 1 }).is_none(), "{none}");
        assert!(
            with(1, Run { first: 1, count: 6 }).is_none(),
            "beyond the axis"
        );
        let longer = with(0, Run { first: 1, count: 4 });
        assert!(longer.is_some(), "a cell begins in the first tile, too");
        assert!(with(0, Run { first: 5, count: 1 }).is_none(), "of no cell");
        assert!(
            Rows::new(&runs[..2], &axes, 2).is_none(),
            "a tile is missing"
        );
    }
}
