//! Any text: it is no fabric, or one that every rule of integration evaluates to light.
#![no_main]

use sateen::fabric::{Fabric, Thread};
use sateen::model::{Model, Rule, Sadeghi};
use sateen_fuzz::{PAIRS, is_light};

/// More are right, but too slow to integrate again and again.
const MOST_SEGMENTS: usize = 32;
/// What FORMAT.md allows.
const MOST_PARTS: usize = 4096;

libfuzzer_sys::fuzz_target!(|text: &str| {
    let Ok(fabric) = Fabric::from_toml(text, "fuzz.toml", None) else {
        return;
    };
    fabric.threads.iter().for_each(check_tangents);
    let segments = fabric
        .visible_threads()
        .map(|thread| thread.tangent_lengths.len());
    if segments.sum::<usize>() > MOST_SEGMENTS {
        return;
    }
    let single =
        [Rule::Midpoint(4), Rule::Quadrature(4)].map(|rule| Sadeghi::<f32>::new(&fabric, rule));
    let adaptive = Sadeghi::<f64>::new(&fabric, Rule::Adaptive(1e-3));
    for [wi, wr] in PAIRS {
        for model in &single {
            let (plain, fast) = (model.eval_cos(wi, wr), model.eval_cos_fast(wi, wr));
            assert!(
                is_light(&plain) && is_light(&fast),
                "{wi:?} {wr:?}: {plain:?} {fast:?}"
            );
        }
        let rho = adaptive.eval_cos(wi.map(f64::from), wr.map(f64::from));
        assert!(
            rho.iter().all(|rho| rho.is_finite() && *rho >= 0.0),
            "{wi:?} {wr:?}: {rho:?}"
        );
    }
});

/// Panics unless the thread's parts are what a table of it may hold.
fn check_tangents(thread: &Thread) {
    let tangents = thread.tangents::<f64>();
    let (tilts, segments) = (tangents.tilts(), tangents.segments());
    assert!(tilts.len() <= MOST_PARTS && segments.len() <= MOST_PARTS);
    assert!(segments.iter().all(|s| (s.from as f32) < s.to as f32));
    let weights = tilts.iter().map(|tilt| tilt.weight);
    let weights = weights.chain(segments.iter().map(|segment| segment.weight));
    assert!(weights.clone().all(|weight| (0.0..=1.0).contains(&weight)));
    let sum: f64 = weights.sum();
    assert!((sum - 1.0).abs() <= 1e-6, "{sum}");
    let strands = thread.strands(thread.direction());
    let straight = strands.straight.iter().map(|strand| strand.share);
    let sum: f64 = straight
        .chain(strands.sweeps.iter().map(|sweep| sweep.share))
        .sum();
    assert!((sum - 1.0).abs() <= 1e-6, "{sum}");
    assert!(!thread.is_straight() || strands.straight.len() == 1);
    // Whatever they say, they say it within the time that an input has.
    strands.are_isotropic();
    strands.look_the_same_from_both_sides();
}
