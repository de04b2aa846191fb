//! Tables that no bake writes, though every number is in its range, evaluate to light all the same.

use crate::common::hostile::{
    Chunk, empty, file_with, grid_with, nodes, nothing, stored, thread_with,
};
use crate::common::{assert_light, hostile_directions};
use proptest::collection::{btree_set, vec};
use proptest::prelude::*;
use sateen::table::Table;

/// Numbers of a range: its ends, and any of their orders of magnitude between them.
fn within(from: f64, to: f64) -> impl Strategy<Value = f64> {
    let between = (from.ln(), to.ln());
    prop_oneof![
        1 => Just(from),
        1 => Just(to),
        4 => (0.0f64..=1.0).prop_map(move |share| {
            (between.0 + share * (between.1 - between.0)).exp().clamp(from, to)
        }),
    ]
}

/// 0, or a number from the smallest to `to`.
fn up_to(to: f64) -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(0.0), 4 => within(1e-300, to)]
}

/// Direction, coverage, albedo, η, k_d, γ_s and γ_v.
fn numbers() -> impl Strategy<Value = Vec<f64>> {
    let gamma = || within(1.74e-5, 20.0);
    let albedo = [up_to(1000.0), up_to(1000.0), up_to(1000.0)];
    (
        (-7.0..=7.0, within(1e-12, 1.0), albedo),
        (within(1.0, 100.0), up_to(1.0), gamma(), gamma()),
    )
        .prop_map(
            |((direction, coverage, [r, g, b]), (eta, k_d, gamma_s, gamma_v))| {
                vec![direction, coverage, r, g, b, eta, k_d, gamma_s, gamma_v]
            },
        )
}

const QUARTER: f64 = std::f64::consts::FRAC_PI_2;

/// Tilts and segments whose weights sum to 1.
fn parts() -> impl Strategy<Value = (Vec<[f64; 2]>, Vec<[f64; 3]>)> {
    let angle = || prop_oneof![Just(-QUARTER), Just(QUARTER), Just(0.0), -QUARTER..=QUARTER];
    let weight = || within(1e-12, 1.0);
    let tilts = vec((angle(), weight()), 0..3);
    let segments = vec((angle(), within(1e-6, 2.0 * QUARTER), weight()), 0..3);
    (tilts, segments).prop_filter_map("a thread has parts", |(tilts, segments)| {
        let weights = tilts.iter().map(|tilt| tilt.1);
        let sum: f64 = weights.chain(segments.iter().map(|s| s.2)).sum();
        let tilts: Vec<[f64; 2]> = tilts.iter().map(|(a, w)| [*a, w / sum]).collect();
        let segment = |(from, width, weight): &(f64, f64, f64)| {
            let to = (from + width).min(QUARTER);
            ((*from as f32) < to as f32).then_some([*from, to, weight / sum])
        };
        let segments = segments.iter().map(segment).collect::<Option<Vec<_>>>()?;
        (!tilts.is_empty() || !segments.is_empty()).then_some((tilts, segments))
    })
}

/// How segments are evaluated, and the samples of a grid.
fn evaluation() -> impl Strategy<Value = (Vec<u8>, Option<Chunk>)> {
    let node = (-0.999..0.999, within(1e-300, 2.0)).prop_map(|(node, weight)| [node, weight]);
    let direct = vec(node, 1..5).prop_map(|list| (nodes(&list), None));
    let knots = || {
        btree_set(
            prop_oneof![Just(0), Just(8192), Just(16384), 0u16..=16384],
            2..5,
        )
    };
    let scale = || within(1e-45, f64::from(f32::MAX)).prop_map(|x| x as f32);
    let grid = (
        (0u8..2, 0u8..2, prop_oneof![Just(1u8), Just(3), Just(4)]),
        (scale(), scale()),
        (knots(), knots(), knots(), knots()),
        any::<u64>(),
    );
    let grid = grid.prop_map(|((chart, fold, encoding), (s, v), (a, b, c, d), seed)| {
        let knots = [a, b, c, d].map(|knots| knots.into_iter().collect::<Vec<u16>>());
        // A kink within the first or the third axis has a coefficient of its own.
        let coefficients = |(axis, knots): (usize, &Vec<u16>)| {
            let inner = &knots[1..knots.len() - 1];
            knots.len() + 1 + usize::from(axis % 2 == 0 && inner.contains(&8192))
        };
        let count: usize = knots.iter().enumerate().map(coefficients).product();
        let bytes = if encoding == 4 { 2 * count } else { 4 * count };
        let samples = (0..bytes as u64).map(|k| (seed.wrapping_mul(2 * k + 1) >> 56) as u8);
        let samples = stored(samples.collect());
        (
            grid_with(
                [chart, fold, encoding],
                [s.max(f32::MIN_POSITIVE), v.max(f32::MIN_POSITIVE)],
                knots,
            ),
            Some(samples),
        )
    });
    prop_oneof![direct, grid]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn parameters_at_the_ends_of_their_ranges_evaluate_to_light(
        numbers in numbers(),
        (tilts, segments) in parts(),
        (evaluation, samples) in evaluation(),
        reweighting in 0u8..2,
        sigma_u in within(0.0175, 19.9),
        pairs in vec((0usize..1000, 0usize..1000), 16),
    ) {
        let (evaluation, samples) = match segments.is_empty() {
            true => (nothing(), None),
            false => (evaluation, samples),
        };
        let thread = thread_with(&numbers, &tilts, &segments, &evaluation);
        let chunks: Vec<Chunk> = [Some(empty()), samples].into_iter().flatten().collect();
        let bytes = file_with(reweighting, sigma_u as f32, &[thread], &chunks);
        let table = Table::from_bytes(&bytes);
        prop_assert!(table.is_ok(), "{table:?}");
        let directions = hostile_directions();
        let at = |index: usize| directions[index % directions.len()];
        let pairs: Vec<[[f32; 3]; 2]> = pairs.iter().map(|(i, r)| [at(*i), at(*r)]).collect();
        assert_light("in range", &table.unwrap(), &pairs);
    }
}
