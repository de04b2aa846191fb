//! Time, interleaved: every candidate once per round, so that whatever the machine does befalls all of them.

use std::hint::black_box;
use std::time::{Duration, Instant};

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::candidate::{Candidate, Pairs};
use crate::metrics::Pair;
use crate::progress::{Cancelled, Progress};

/// Pairs that are timed: few enough to stay in a core's cache beside a table.
const MAX_PAIRS: usize = 4096;
/// A candidate goes on for so long in a round; the clock is good to a thousandth of that.
const VISIT: Duration = Duration::from_millis(5);

/// The pairs to time, at most [`MAX_PAIRS`] of `pairs`, in random order.
pub(super) fn timed_pairs(pairs: &[Pair], seed: u64) -> Pairs {
    let mut pairs = pairs.to_vec();
    pairs.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    pairs.truncate(MAX_PAIRS);
    Pairs::new(&pairs)
}

/// Nanoseconds per pair of every candidate in every round, on this thread: `[round][candidate]`.
pub(super) fn interleaved(
    candidates: &[Candidate],
    pairs: &Pairs,
    rounds: usize,
    progress: Progress<'_>,
) -> Result<Vec<Vec<f64>>, Cancelled> {
    let mut rho = [0, 1, 2].map(|_| vec![0.0; pairs.count()]);
    let steps = progress.steps(rounds * candidates.len());
    let mut visit = |candidate: &Candidate| {
        let mut pass = || {
            candidate.eval(black_box(pairs), &mut rho);
            black_box(&rho);
        };
        // Its table and its branches become familiar again.
        pass();
        let start = Instant::now();
        let mut passes = 0.0;
        while start.elapsed() < VISIT {
            pass();
            passes += 1.0;
        }
        let nanoseconds = start.elapsed().as_secs_f64() * 1e9;
        steps
            .advance()
            .map(|()| nanoseconds / (passes * pairs.count() as f64))
    };
    (0..rounds)
        .map(|_| candidates.iter().map(&mut visit).collect())
        .collect()
}

/// The middle of `values`; the upper one of two. Zero of none.
pub(super) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(0.0)
}
