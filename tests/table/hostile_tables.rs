//! Tables that no bake writes, though every number is in its range, evaluate to light all the same.

use std::sync::Arc;

use crate::common::hostile::{
    Axis, Chunk, box_of_runs, empty, file_with, grid_with, nodes, nothing, stored, thread_with,
    with_rim,
};
use crate::common::{assert_light, hostile_directions};
use proptest::collection::vec;
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

/// How far neighbouring cells may differ.
const UNEVEN: u32 = 128;
/// 1, in units of 2⁻¹⁴.
const UNIT: u16 = 1 << 14;

/// Knots that are halves of halves: the cells of \[0, 1\] or \[½, 1\], of which some are halved, again and again.
fn halves() -> impl Strategy<Value = Axis> {
    let start = prop_oneof![4 => Just(0u16), 1 => Just(UNIT / 2)];
    (
        start,
        vec(any::<prop::sample::Index>(), 0..12),
        any::<bool>(),
    )
        .prop_map(|(start, halved, bends)| {
            let mut knots = vec![start, UNIT];
            for index in halved {
                let cell = index.index(knots.len() - 1);
                let half = (knots[cell + 1] - knots[cell]) / 2;
                let mut finer = knots.clone();
                finer.insert(cell + 1, knots[cell] + half);
                let widths: Vec<u32> = finer.windows(2).map(|k| u32::from(k[1] - k[0])).collect();
                let is_even = |pair: &[u32]| pair[0].max(pair[1]) <= UNEVEN * pair[0].min(pair[1]);
                if half > 0 && widths.windows(2).all(is_even) {
                    knots = finer;
                }
            }
            let has_middle = knots[1..knots.len() - 1].contains(&(UNIT / 2));
            Axis {
                bends: bends && has_middle,
                ..Axis::of(knots)
            }
        })
}

/// An axis, or the place that one has collapsed to: its lower end or its middle.
fn axis() -> impl Strategy<Value = Axis> {
    let point = (0u8..2).prop_map(|place| Axis {
        depth: place,
        knots: vec![place.into()],
        bends: false,
    });
    prop_oneof![4 => halves(), 1 => point]
}

/// How segments are evaluated, and the chunks of a grid.
type Evaluation = (Vec<u8>, Vec<Chunk>);

fn evaluation() -> impl Strategy<Value = Evaluation> {
    let node = || (-0.999..0.999, within(1e-300, 2.0)).prop_map(|(node, weight)| [node, weight]);
    let direct = vec(node(), 1..5).prop_map(|list| (nodes(&list), Vec::new()));
    let scale = || within(1e-45, f64::from(f32::MAX)).prop_map(|x| x as f32);
    let rim = proptest::option::of((1u32..=50, vec(node(), 1..4)));
    let grid = (
        (0u8..2, 0u8..2, 0u8..4),
        (scale(), scale()),
        (halves(), axis(), axis(), axis()),
        proptest::option::of(any::<[[u16; 2]; 4]>()),
        (any::<u64>(), any::<bool>()),
        rim,
    );
    let grid = grid.prop_map(
        |((chart, fold, content), (s, v), (a, b, c, d), part, (seed, is_extreme), rim)| {
            let axes = [a, b, c, d];
            let channels = if content == 0 { 2 } else { 1 };
            let runs = part.map(|ends| box_of_runs(&axes, ends));
            let coefficients = match &runs {
                None => {
                    let [n0, n1, n2, n3] = axes.each_ref().map(Axis::len);
                    n0 * n1.div_ceil(2) * n2 * n3
                }
                Some(runs) => runs.iter().map(|[_, count]| usize::from(*count)).sum(),
            };
            let number = |k: usize| (seed.wrapping_mul(2 * k as u64 + 1) >> 48) as i16;
            let extreme = |x: i16| if x < 0 { i16::MIN } else { i16::MAX };
            let numbers = (0..2 * channels * coefficients)
                .map(number)
                .map(|x| if is_extreme { extreme(x) } else { x });
            let mut chunks = vec![stored(numbers.flat_map(i16::to_le_bytes).collect())];
            let leaves_out = content << 1 | u8::from(runs.is_some());
            if let Some(runs) = runs {
                let numbers = runs.as_flattened().iter();
                chunks.push(stored(numbers.flat_map(|x| x.to_le_bytes()).collect()));
            }
            let scale = [s.max(f32::MIN_POSITIVE), v.max(f32::MIN_POSITIVE)];
            let grid = grid_with([chart, fold], leaves_out, scale, &axes);
            let evaluation = match rim {
                None => grid,
                Some((hundredths, list)) => with_rim(hundredths, &nodes(&list), &grid),
            };
            (evaluation, chunks)
        },
    );
    prop_oneof![1 => direct, 4 => grid]
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
            true => (nothing(), Vec::new()),
            false => (evaluation, samples),
        };
        let thread = thread_with(&numbers, &tilts, &segments, &evaluation);
        let chunks = [vec![empty()], samples].concat();
        let bytes = file_with(reweighting, sigma_u as f32, &[thread], &chunks);
        let table = Table::from_bytes(&bytes);
        prop_assert!(table.is_ok(), "{table:?}");
        let table = table.unwrap();
        let directions = hostile_directions();
        let at = |index: usize| directions[index % directions.len()];
        let pairs: Vec<[[f32; 3]; 2]> = pairs.iter().map(|(i, r)| [at(*i), at(*r)]).collect();
        assert_light("in range", &table, &pairs);
        let written = table.to_mappable_bytes();
        prop_assert_eq!(&written, &bytes);
        let map: Arc<Vec<u8>> = Arc::new(written);
        let mapped = Table::from_shared(map).unwrap();
        assert_light("in range, in place", &mapped, &pairs);
        prop_assert_eq!(mapped, table);
    }
}
