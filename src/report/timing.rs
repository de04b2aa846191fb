//! Time, interleaved: every candidate once per round, so that whatever the machine does befalls all of them.

use std::hint::black_box;

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::candidate::Candidate;
use crate::metrics::{Pair, Pairs, nanoseconds_per_pair};
use crate::progress::{Cancelled, Progress};

/// Pairs that are timed: few enough to stay in a core's cache beside a table.
const MAX_PAIRS: usize = 4096;

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
        let nanoseconds = nanoseconds_per_pair(pairs.count(), || {
            candidate.eval(black_box(pairs), &mut rho);
            black_box(&rho);
        });
        steps.advance().map(|()| nanoseconds)
    };
    (0..rounds)
        .map(|_| candidates.iter().map(&mut visit).collect())
        .collect()
}
