//! The direct model against an independent float64 implementation of the same equations, whose values for all fabrics of
//! the library are in `tests/data/golden_view.csv` and `golden_both.csv`: random, highlight and extreme pairs.

use crate::common::fabric;
use sateen::brdf::{Components, Reweighting};
use sateen::model::{Rule, Sadeghi};

/// Largest deviation allowed, relative to values above 1 and absolute below.
const TOLERANCE: f64 = 1e-6;
/// Rows that deviate by more than [`TOLERANCE`] of their own value are checked against the midpoint rule: the golden
/// values' panels do not end at the kinks of M, which costs them up to 4e-5 of a small value. The count divides every
/// curve of the library where its segments end.
const MIDPOINTS: u32 = 416_000;

fn components(name: &str, reweighting: Reweighting, rule: Rule, pair: &[f64]) -> Vec<f64> {
    let mut fabric = fabric(name);
    fabric.reweighting = reweighting;
    let names: Vec<String> = fabric
        .visible_threads()
        .map(|thread| thread.name.clone())
        .collect();
    let model = Sadeghi::<f64>::new(&fabric, rule);
    let Components { threads, q, rho } =
        model.components([pair[0], pair[1], pair[2]], [pair[3], pair[4], pair[5]]);
    let mut values = Vec::new();
    for name in ["warp", "weft"] {
        let thread = names
            .iter()
            .position(|other| other == name)
            .map(|index| threads[index]);
        values.extend(thread.map_or([0.0; 3], |thread| {
            [
                thread.response.surface,
                thread.response.volume,
                thread.projection,
            ]
        }));
    }
    values.push(q);
    values.extend(rho);
    values
}

/// Compares all rows and says how it went.
fn agree(golden: &str, reweighting: Reweighting) -> String {
    let (mut rows, mut rechecked, mut worst) = (0, 0, 0f64);
    for line in golden.lines().skip(1) {
        let (name, numbers) = line.split_once(',').expect("name and numbers");
        let numbers: Vec<f64> = numbers
            .split(',')
            .map(|number| number.parse().expect("a number"))
            .collect();
        let (pair, expected) = numbers.split_at(6);
        let values = components(name, reweighting, Rule::REFERENCE, pair);
        assert_eq!(values.len(), expected.len());
        let mut recheck = false;
        for (value, expected) in values.iter().zip(expected) {
            let deviation = (value - expected).abs();
            worst = worst.max(deviation / expected.abs().max(1.0));
            assert!(
                deviation <= TOLERANCE * expected.abs().max(1.0),
                "{value} for {expected} in {line}"
            );
            recheck |= deviation > TOLERANCE * expected.abs().max(1e-6);
        }
        if recheck {
            rechecked += 1;
            let midpoints = components(name, reweighting, Rule::Midpoint(MIDPOINTS), pair);
            for (value, expected) in values.iter().zip(midpoints) {
                assert!(
                    (value - expected).abs() <= 1e-6 * expected.abs().max(1e-6),
                    "{value} for {expected} in {line}"
                );
            }
        }
        rows += 1;
    }
    assert!(rows > 1000 && rechecked < rows / 20);
    format!(
        "{rows} rows, worst deviation {worst:.1e}, {rechecked} checked against {MIDPOINTS} midpoints"
    )
}

#[test]
fn agrees_with_the_golden_values_for_the_view_projection() {
    agree(include_str!("../data/golden_view.csv"), Reweighting::View);
}

#[test]
fn agrees_with_the_golden_values_for_the_two_sided_projection() {
    agree(include_str!("../data/golden_both.csv"), Reweighting::Both);
}
