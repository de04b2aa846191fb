//! One axis of a table: where its nodes are, and how to interpolate between them.

use alloc::{vec, vec::Vec};

/// The largest number of nodes on an axis.
pub const MAX_NODES: usize = 1024;

/// How many nodes a value between two of them is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(
    feature = "bake",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum Interpolation {
    /// Two: exact for straight lines.
    Linear,
    /// Four: the cubic through them. Next to the ends and to kinks the four are the nearest on the same side.
    Cubic,
}

impl Interpolation {
    /// Nodes per value.
    pub const fn taps(self) -> usize {
        match self {
            Self::Linear => 2,
            Self::Cubic => 4,
        }
    }
}

/// Nodes on \[0, 1\] in ascending order, with what makes looking up a coordinate fast.
///
/// Interpolation weights are Lagrange's. Within a cell they are cubics of the position t ∈ \[0, 1\] in the cell, whose
/// coefficients are worked out once, so that uneven nodes, ends and kinks cost nothing per lookup.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    nodes: Vec<f32>,
    interpolation: Interpolation,
    cells: Vec<Cell>,
    /// `buckets[⌊x · (len − 1)⌋]` is the cell that holds the lower end of that stretch of \[0, 1\].
    buckets: Vec<u16>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    start: f32,
    inverse_width: f32,
    /// First of the nodes that are interpolated.
    first: u16,
    /// `coefficients[k][j]`: what t^k contributes to the weight of node `first + j`.
    coefficients: [[f32; 4]; 4],
}

/// Nodes and weights that make up the value at a coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stencil {
    /// Index of the first node.
    pub first: usize,
    /// Weights of that node and the following; those past [`Interpolation::taps`] are zero.
    pub weights: [f32; 4],
}

impl Axis {
    /// An axis with `nodes` ascending strictly within \[0, 1\], at least two, that interpolates on either side of `kink`
    /// alone if that is a node.
    ///
    /// Returns `None` when the nodes are not so.
    pub fn new(nodes: Vec<f32>, interpolation: Interpolation, kink: Option<f32>) -> Option<Self> {
        let ascending = nodes.windows(2).all(|pair| pair[0] < pair[1]);
        let inside = nodes.iter().all(|node| (0.0..=1.0).contains(node));
        if nodes.len() < 2 || nodes.len() > MAX_NODES || !ascending || !inside {
            return None;
        }
        let kink = kink.and_then(|kink| nodes.iter().position(|node| *node == kink));
        let last = nodes.len() - 1;
        let cells = (0..last).map(|cell| {
            // The side of the kink that the cell is on.
            let (low, high) = match kink {
                Some(kink) if cell < kink => (0, kink),
                Some(kink) => (kink, last),
                None => (0, last),
            };
            let taps = interpolation.taps().min(high - low + 1);
            let first = (cell + 1)
                .saturating_sub(taps / 2)
                .clamp(low, high + 1 - taps);
            // Four values are always read, so the stencil must not run past the end.
            let read = (interpolation.taps()).min(nodes.len());
            let shifted = first.min(nodes.len() - read);
            Cell::new(&nodes, cell, first, taps, shifted)
        });
        let cells: Vec<Cell> = cells.collect();
        let count = (4 * nodes.len()).next_power_of_two();
        let mut buckets = vec![0u16; count + 1];
        let mut cell = 0;
        for (k, bucket) in buckets.iter_mut().enumerate() {
            let lower = k as f32 / count as f32;
            while cell + 1 < cells.len() && cells[cell + 1].start <= lower {
                cell += 1;
            }
            *bucket = cell as u16;
        }
        Some(Self {
            nodes,
            interpolation,
            cells,
            buckets,
        })
    }

    /// The nodes.
    pub fn nodes(&self) -> &[f32] {
        &self.nodes
    }

    /// How many nodes there are.
    #[expect(clippy::len_without_is_empty, reason = "an axis is never empty")]
    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    /// How values between nodes are made.
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Nodes that are read per value: [`Interpolation::taps`], or all there are.
    #[inline(always)]
    pub fn taps(&self) -> usize {
        self.interpolation.taps().min(self.nodes.len())
    }

    /// The nodes and weights of coordinate `x`; outside the nodes' range, those of its end. NaN counts as below.
    #[inline(always)]
    pub fn stencil(&self, x: f32) -> Stencil {
        let buckets = self.buckets.len() - 1;
        // Rust's float-to-integer conversion saturates, and takes NaN to 0.
        let mut cell = usize::from(self.buckets[((x * buckets as f32) as usize).min(buckets)]);
        while cell + 1 < self.cells.len() && self.cells[cell + 1].start <= x {
            cell += 1;
        }
        let Cell {
            start,
            inverse_width,
            first,
            coefficients: c,
        } = &self.cells[cell];
        #[expect(
            clippy::manual_clamp,
            reason = "max before min turns NaN into 0, clamp would keep it"
        )]
        let t = ((x - start) * inverse_width).max(0.0).min(1.0);
        let mut weights = [0.0; 4];
        for (j, weight) in weights.iter_mut().enumerate() {
            *weight = ((c[3][j] * t + c[2][j]) * t + c[1][j]) * t + c[0][j];
        }
        Stencil {
            first: usize::from(*first),
            weights,
        }
    }
}

impl Cell {
    /// The cell between nodes `cell` and `cell + 1`, interpolating `taps` nodes from `from` on, with weights stored as
    /// of the nodes from `first` ≤ `from` on.
    fn new(nodes: &[f32], cell: usize, from: usize, taps: usize, first: usize) -> Self {
        let (start, end) = (f64::from(nodes[cell]), f64::from(nodes[cell + 1]));
        let t_of = |node: usize| (f64::from(nodes[node]) - start) / (end - start);
        let mut coefficients = [[0.0f32; 4]; 4];
        for j in from..from + taps {
            // Π (t − t_m)/(t_j − t_m), multiplied out.
            let mut polynomial = [1.0, 0.0, 0.0, 0.0];
            for m in (from..from + taps).filter(|m| *m != j) {
                let (t_m, scale) = (t_of(m), 1.0 / (t_of(j) - t_of(m)));
                for k in (0..4).rev() {
                    let lower = if k > 0 { polynomial[k - 1] } else { 0.0 };
                    polynomial[k] = scale * (lower - t_m * polynomial[k]);
                }
            }
            for k in 0..4 {
                coefficients[k][j - first] = polynomial[k] as f32;
            }
        }
        Self {
            start: start as f32,
            inverse_width: (1.0 / (end - start)) as f32,
            first: first as u16,
            coefficients,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn interpolate(axis: &Axis, x: f32, f: impl Fn(f32) -> f32) -> f32 {
        let Stencil { first, weights } = axis.stencil(x);
        (0..axis.taps())
            .map(|j| weights[j] * f(axis.nodes()[first + j]))
            .sum()
    }

    fn uneven() -> Vec<f32> {
        vec![0.0, 0.1, 0.15, 0.3, 0.5, 0.52, 0.7, 0.95, 1.0]
    }

    #[test]
    fn cubic_interpolation_is_exact_for_cubics_and_for_kinks_at_a_node() {
        let axis = Axis::new(uneven(), Interpolation::Cubic, Some(0.5)).unwrap();
        let f = |x: f32| {
            if x < 0.5 {
                1.125 + (x - 0.5) * x * x
            } else {
                1.125 + (x - 0.5) * (3.0 - x * x)
            }
        };
        for k in 0..=1000 {
            let x = k as f32 / 1000.0;
            assert!((interpolate(&axis, x, f) - f(x)).abs() < 2e-6, "{x}");
        }
    }

    #[test]
    fn linear_interpolation_meets_the_nodes() {
        let axis = Axis::new(uneven(), Interpolation::Linear, None).unwrap();
        for node in uneven() {
            assert!((interpolate(&axis, node, |x| x * x) - node * node).abs() < 1e-6);
        }
    }

    #[test]
    fn few_nodes_lower_the_order_but_never_leave_the_axis() {
        for count in 2..6usize {
            let nodes: Vec<f32> = (0..count).map(|k| k as f32 / (count - 1) as f32).collect();
            for kink in nodes.iter().map(|node| Some(*node)).chain([None]) {
                let axis = Axis::new(nodes.clone(), Interpolation::Cubic, kink).unwrap();
                for k in -10..=20 {
                    let x = k as f32 / 10.0;
                    let Stencil { first, weights } = axis.stencil(x);
                    assert!(first + axis.taps() <= count);
                    assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                    assert!((interpolate(&axis, x, |x| x) - x.clamp(0.0, 1.0)).abs() < 1e-5);
                }
            }
        }
    }

    #[test]
    fn a_coordinate_that_is_no_number_is_looked_up_like_the_lower_end() {
        let axis = Axis::new(uneven(), Interpolation::Cubic, None).unwrap();
        assert_eq!(axis.stencil(f32::NAN), axis.stencil(0.0));
        assert_eq!(axis.stencil(f32::INFINITY), axis.stencil(1.0));
    }

    #[test]
    fn disordered_nodes_are_refused() {
        for nodes in [
            vec![],
            vec![0.5],
            vec![0.0, 0.0],
            vec![0.5, 0.2],
            vec![0.0, 1.5],
            vec![0.0, f32::NAN],
        ] {
            assert!(Axis::new(nodes, Interpolation::Linear, None).is_none());
        }
    }
}
