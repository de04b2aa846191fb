//! Time of evaluators.

use std::time::{Duration, Instant};

/// An evaluator goes on for so long at a time; the clock is good to a thousandth of that.
const VISIT: Duration = Duration::from_millis(5);

/// Nanoseconds per pair that `pass` over that many `pairs` takes on this thread, over some milliseconds.
pub fn nanoseconds_per_pair(pairs: usize, mut pass: impl FnMut()) -> f64 {
    // Tables and branches become familiar first.
    pass();
    let start = Instant::now();
    let mut passes = 0.0;
    while start.elapsed() < VISIT {
        pass();
        passes += 1.0;
    }
    start.elapsed().as_secs_f64() * 1e9 / (passes * pairs as f64)
}

/// The middle of `values`; the upper one of two. Zero of none.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
