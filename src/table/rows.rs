//! Which coefficients a grid has, where it has not all: of each row along the sharp axis, one run.
//!
//! A lookup reads three coefficients of each of up to 27 rows. Rows lie one behind the other among the samples, so that an offset per
//! row is all that it takes to find them; and one number per cell says where along the sharp axis all 27 have their coefficients,
//! or, if they have none in common, which cell nearby has. So a lookup where nothing was baked finds the nearest that was.

use alloc::{collections::VecDeque, vec, vec::Vec};

use super::{Axis, TAPS};

/// Runs of coefficients.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Rows {
    /// By row, `[u₃][u₂][u₁]`.
    runs: Vec<Run>,
    /// By row: which sample its coefficient 0 is, or would be if it had it.
    offsets: Vec<i32>,
    /// By first row of a cell: see [`Cell`].
    cells: Vec<u32>,
    /// From one coefficient of u₁, u₂ and u₃ to the next, in rows; 0 along an axis that has one.
    strides: [usize; 3],
}

/// The coefficients of a row: the first, and how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Run {
    pub(crate) first: u16,
    pub(crate) count: u16,
}

impl Run {
    /// Both ends included.
    #[cfg(feature = "bake")]
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

    /// One past the last.
    pub(crate) fn end(self) -> u16 {
        self.first + self.count
    }
}

/// Where a lookup in a cell of u₁, u₂ and u₃ goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Cell {
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
    /// Rows with these `runs`, of a grid of these axes and number of channels. `None` if there is not a run for each row within the
    /// first axis, or no cell that has all its coefficients.
    pub(crate) fn new(runs: Vec<Run>, axes: &[Axis; 4], channels: usize) -> Option<Self> {
        let lengths = axes.each_ref().map(Axis::len);
        let [n0, n1, n2, n3] = lengths;
        let are_within = runs
            .iter()
            .all(|run| usize::from(run.first) + usize::from(run.count) <= n0);
        if runs.len() != n1 * n2 * n3 || !are_within {
            return None;
        }
        let mut sample = 0;
        let mut offsets = Vec::with_capacity(runs.len());
        for run in &runs {
            let offset = sample as i64 - (channels * usize::from(run.first)) as i64;
            offsets.push(i32::try_from(offset).ok()?);
            sample += channels * usize::from(run.count);
        }
        let mut rows = Self {
            cells: vec![u32::MAX; runs.len()],
            runs,
            offsets,
            strides: strides(axes),
        };
        let mut open = VecDeque::new();
        for f3 in axes[3].firsts() {
            for f2 in axes[2].firsts() {
                for f1 in axes[1].firsts() {
                    let cell = f1 + n1 * (f2 + n2 * f3);
                    if let Some(baked) = rows.common(cell, axes) {
                        rows.cells[cell] = baked.pack();
                        open.push_back((cell, cell));
                    }
                }
            }
        }
        if open.is_empty() {
            return None;
        }
        // Outwards from those that are baked, a step along an axis at a time.
        while let Some((cell, from)) = open.pop_front() {
            let place = [cell % n1, cell / n1 % n2, cell / n1 / n2];
            for (axis, stride) in [1, n1, n1 * n2].into_iter().enumerate() {
                let below = (place[axis] > 0).then(|| cell - stride);
                let above = (place[axis] + 1 < lengths[axis + 1]).then(|| cell + stride);
                for next in [below, above].into_iter().flatten() {
                    if rows.cells[next] == u32::MAX {
                        rows.cells[next] = Cell::Elsewhere(from as u32).pack();
                        open.push_back((next, from));
                    }
                }
            }
        }
        Some(rows)
    }

    /// What all rows of a cell have in common.
    fn common(&self, cell: usize, axes: &[Axis; 4]) -> Option<Cell> {
        let taps = [1, 2, 3].map(|axis| if axes[axis].is_flat() { 1 } else { TAPS });
        let [s1, s2, s3] = self.strides;
        let (mut first, mut end) = (0, u16::MAX);
        for d in 0..taps[2] {
            for c in 0..taps[1] {
                for b in 0..taps[0] {
                    let run = self.runs[cell + d * s3 + c * s2 + b * s1];
                    first = first.max(run.first);
                    end = end.min(if run.count == 0 { 0 } else { run.end() });
                }
            }
        }
        (first + TAPS as u16 <= end).then(|| Cell::Baked {
            first: first.into(),
            last: u32::from(end) - TAPS as u32,
        })
    }

    /// Where a lookup goes in the cell that begins with a row.
    #[inline(always)]
    pub(crate) fn cell(&self, row: usize) -> Cell {
        Cell::unpack(self.cells[row])
    }

    /// From one coefficient of u₁, u₂ and u₃ to the next.
    #[inline(always)]
    pub(crate) fn strides(&self) -> [usize; 3] {
        self.strides
    }

    /// Which sample a row's coefficient 0 is, by row.
    #[inline(always)]
    pub(crate) fn offsets(&self) -> &[i32] {
        &self.offsets
    }

    /// By row.
    pub(crate) fn runs(&self) -> &[Run] {
        &self.runs
    }

    /// Bytes in memory.
    pub(crate) fn bytes(&self) -> usize {
        size_of_val(&self.runs[..]) + size_of_val(&self.offsets[..]) + size_of_val(&self.cells[..])
    }

    /// Whether the cell that begins with these coefficients has all that it needs.
    #[cfg(feature = "bake")]
    pub(crate) fn has(&self, [f0, f1, f2, f3]: [usize; 4]) -> bool {
        let [s1, s2, s3] = self.strides;
        match self.cell(s1 * f1 + s2 * f2 + s3 * f3) {
            Cell::Baked { first, last } => (first as usize..=last as usize).contains(&f0),
            Cell::Elsewhere(_) => false,
        }
    }

    /// How many of the cells have coefficients, of how many.
    pub(crate) fn baked_cells(&self, axes: &[Axis; 4]) -> [usize; 2] {
        let n0 = axes[0].firsts().count();
        let baked = self.cells.iter().map(|cell| match Cell::unpack(*cell) {
            Cell::Baked { first, last } => {
                let (first, last) = (first as usize, last as usize);
                axes[0]
                    .firsts()
                    .filter(|f0| (first..=last).contains(f0))
                    .count()
            }
            Cell::Elsewhere(_) => 0,
        });
        let all = axes[1..].iter().map(|axis| axis.firsts().count());
        [baked.sum(), n0 * all.product::<usize>()]
    }
}

fn strides(axes: &[Axis; 4]) -> [usize; 3] {
    let lengths = axes.each_ref().map(Axis::len);
    let mut stride = 1;
    [1, 2, 3].map(|axis| {
        let this = stride;
        stride *= lengths[axis];
        if axes[axis].is_flat() { 0 } else { this }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_know_what_they_have_and_where_to_go_instead() {
        let axis = || Axis::new(2, vec![0, 1, 2, 3, 4], false).unwrap();
        let axes = [axis(), axis(), Axis::flat(), Axis::flat()];
        // Coefficients 1 to 4 of rows 2 to 4: the cell of u₁ that begins with row 2, where two cells of u₀ are.
        let mut runs = vec![Run::default(); 6];
        runs[2..5].fill(Run { first: 1, count: 4 });
        let rows = Rows::new(runs.clone(), &axes, 2).unwrap();
        assert_eq!(rows.cell(2), Cell::Baked { first: 1, last: 2 });
        for row in [0, 1, 3] {
            assert_eq!(rows.cell(row), Cell::Elsewhere(2), "{row}");
        }
        assert_eq!(rows.offsets(), [0, 0, -2, 6, 14, 24]);
        assert_eq!(rows.baked_cells(&axes), [2, 16]);

        runs[3].count = 1;
        assert!(
            Rows::new(runs.clone(), &axes, 2).is_none(),
            "no cell is whole"
        );
        runs[3].count = 6;
        assert!(
            Rows::new(runs.clone(), &axes, 2).is_none(),
            "beyond the axis"
        );
        assert!(
            Rows::new(runs[..5].to_vec(), &axes, 2).is_none(),
            "a row is missing"
        );
    }
}
