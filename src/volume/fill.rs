//! The values at a volume's nodes.
//!
//! A function that bends one way lies on one side of the straight lines between its values, on average by two thirds of what it does at
//! the middle (Simpson's rule). Nodes are moved by the mean of that in the cells beside them, axis after axis, so that the lines cross the
//! function. Values at the ends of an axis, where functions bend sharply, and where the cells beside a node bend differently stay as they
//! are. That halves the mean error: in 8 MiB denim's is 0.28 % instead of 0.53 %, polyester lining's 0.26 % instead of 0.46 %.

use half::f16;
use rayon::prelude::*;

use super::Nodes;
use crate::lookup::roots;
use crate::table::Grid;

/// √S and √V.
type Roots = [f32; 2];

/// Appends the texels of a grid, in slabs of `width` and `height`, the rest of which repeats the last ones. Returns what 1 stands for.
pub(super) fn fill(
    grid: &Grid,
    nodes: &[Nodes; 4],
    [width, height]: [usize; 2],
    texels: &mut Vec<[f16; 4]>,
) -> [f32; 2] {
    let values = values(grid, nodes);
    let mut largest = [0.0f32; 2];
    for value in &values {
        largest = [largest[0].max(value[0]), largest[1].max(value[1])];
    }
    let over = largest.map(|x| if x > 0.0 { 1.0 / x } else { 0.0 });
    let [n0, n1, n2, n3] = nodes.each_ref().map(Nodes::count);
    for k in 0..(n3 - 1).max(1) {
        let next = (k + 1).min(n3 - 1);
        for c in 0..n2 {
            for y in 0..height {
                for x in 0..width {
                    let at = |d: usize| {
                        let row = (d * n2 + c) * n1 + y.min(n1 - 1);
                        values[row * n0 + x.min(n0 - 1)]
                    };
                    let ([s, v], [s_next, v_next]) = (at(k), at(next));
                    let numbers = [s * over[0], v * over[1], s_next * over[0], v_next * over[1]];
                    texels.push(numbers.map(f16::from_f32));
                }
            }
        }
    }
    largest.map(|x| x * x)
}

/// The values at all nodes, `[u₃][u₂][u₁][u₀]`.
fn values(grid: &Grid, nodes: &[Nodes; 4]) -> Vec<Roots> {
    let halves = nodes.each_ref().map(Nodes::halves);
    let is_sharp = [0, 1, 2, 3].map(|axis| sharp_nodes(grid, axis, &nodes[axis]));
    let [n0, n1, n2, n3] = nodes.each_ref().map(Nodes::count);
    let mut solid: Vec<Roots> = halves[3]
        .par_iter()
        .map(|u3| {
            let mut plane = Vec::with_capacity(halves[2].len() * n1 * n0);
            for u2 in &halves[2] {
                let mut rows = Vec::with_capacity(halves[1].len() * n0);
                for u1 in &halves[1] {
                    let points = halves[0].iter().map(|u0| [*u0, *u1, *u2, *u3]);
                    let mut row = roots(grid, points);
                    fit(&mut row, 1, &halves[0], &is_sharp[0]);
                    rows.extend(row);
                }
                fit(&mut rows, n0, &halves[1], &is_sharp[1]);
                plane.extend(rows);
            }
            fit(&mut plane, n0 * n1, &halves[2], &is_sharp[2]);
            plane
        })
        .flatten_iter()
        .collect();
    fit(&mut solid, n0 * n1 * n2, &halves[3], &is_sharp[3]);
    debug_assert_eq!(solid.len(), n0 * n1 * n2 * n3);
    solid
}

/// Whether nodes keep their values.
fn sharp_nodes(grid: &Grid, axis: usize, nodes: &Nodes) -> Vec<bool> {
    let has_kink = grid.coordinates().kinks()[axis];
    let last = nodes.count() - 1;
    let places = nodes.places().enumerate();
    places
        .map(|(k, place)| k == 0 || k == last || (has_kink && place == 0.5))
        .collect()
}

/// From values at nodes and middles along an axis, `stride` values at each, to values at the nodes.
fn fit(values: &mut Vec<Roots>, stride: usize, halves: &[f32], is_sharp: &[bool]) {
    // How far the chord lies above the function on average.
    let above = |cell: usize, at: usize, channel: usize| {
        let value = |half: usize| values[half * stride + at][channel];
        let middle = 0.5 * (value(2 * cell) + value(2 * cell + 2)) - value(2 * cell + 1);
        middle * (2.0 / 3.0)
    };
    let mut fitted = Vec::with_capacity(is_sharp.len() * stride);
    for (node, is_sharp) in is_sharp.iter().enumerate() {
        for at in 0..stride {
            let mut value = values[2 * node * stride + at];
            if !is_sharp {
                let [before, here, after] =
                    [2 * node - 2, 2 * node, 2 * node + 2].map(|k| halves[k]);
                let share = (after - here) / (after - before);
                for (channel, value) in value.iter_mut().enumerate() {
                    let (left, right) = (above(node - 1, at, channel), above(node, at, channel));
                    if left * right > 0.0 {
                        *value = (*value - left - (right - left) * share).max(0.0);
                    }
                }
            }
            fitted.push(value);
        }
    }
    *values = fitted;
}
