//! The cheapest table that keeps a budget of error, bytes and time, in any combination.
//!
//! Given an error, every thread is evaluated by the least that is expected to keep it: the smallest grid, or the fewest
//! directly evaluated tilts if those cost no more (`choose`). The table is then measured; what it errs too much, the next
//! attempt expects less. Without an error the budget of time is met by the most accurate table, tried from the most
//! accurate on; and one of bytes alone by filling them.
//!
//! Time is measured here and now, in batches on one core, and the result of a budget of time depends on the machine. Others
//! give the same bytes everywhere.

use std::hint::black_box;

use super::{BakeError, Baked, Baker, Direct, Preset, Scope, Settings};
use crate::fabric::Fabric;
use crate::metrics::{Pairs, median, nanoseconds_per_pair, protocol_pairs};
use crate::progress::Progress;
use crate::table::Table;

/// What a table may cost; `None` is no limit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Budget {
    /// Mean relative error.
    pub max_error: Option<f64>,
    /// Bytes of samples in memory.
    pub max_bytes: Option<usize>,
    /// Nanoseconds per pair, in batches on one core of this machine.
    pub max_ns: Option<f64>,
}

/// What a table costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// Mean relative error.
    pub error: f64,
    /// Bytes of samples in memory.
    pub bytes: usize,
    /// Nanoseconds per pair, if that matters.
    pub ns: Option<f64>,
}

impl Budget {
    /// Whether `cost` is within.
    pub fn holds(&self, cost: &Cost) -> bool {
        self.excess(cost) <= 1.0
    }

    /// Settings that are expected to keep it: those of the first attempt.
    pub fn settings(&self, settings: &Settings) -> Settings {
        let error = match (self.max_error, self.max_ns) {
            (Some(error), _) => error,
            (None, Some(_)) => ERRORS[0],
            (None, None) => Preset::Fine.settings().max_error,
        };
        self.settings_for(error, settings)
    }

    /// Settings by which that error is expected.
    fn settings_for(&self, error: f64, settings: &Settings) -> Settings {
        let only_bytes = self.max_error.is_none() && self.max_ns.is_none();
        Settings {
            max_bytes: self.max_bytes.unwrap_or(MOST_BYTES),
            max_error: error,
            // A grid is as small as keeps the error; filled up where only bytes count.
            target_error: if only_bytes { 0.0 } else { error },
            direct: if only_bytes {
                settings.direct
            } else {
                Direct::Cheaper
            },
            ..settings.clone()
        }
    }

    /// By which factor `cost` is over the budget, at most, or how close to it.
    fn excess(&self, cost: &Cost) -> f64 {
        let ratio = |cost: f64, most: f64| if cost > 0.0 { cost / most } else { 0.0 };
        let error = self.max_error.map(|most| ratio(cost.error, most));
        let bytes = self
            .max_bytes
            .map(|most| ratio(cost.bytes as f64, most as f64));
        let ns = self
            .max_ns
            .zip(cost.ns)
            .map(|(most, cost)| ratio(cost, most));
        [error, bytes, ns].into_iter().flatten().fold(0.0, f64::max)
    }
}

/// Where memory ends if no budget says so.
const MOST_BYTES: usize = 32 << 20;
/// Errors to try where only time is given, the most accurate first.
const ERRORS: [f64; 6] = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2];
/// Attempts to keep an error that expectations have missed.
const ATTEMPTS: usize = 4;

/// Bakes the cheapest table within `budget`; if nothing found is within, the nearest miss. What `settings` do not concern size and error
/// stays as they have it.
pub(super) fn bake(
    baker: &mut Baker<'_>,
    settings: &Settings,
    budget: &Budget,
    scope: &Scope<'_>,
    progress: Progress<'_>,
) -> Result<Baked, BakeError> {
    let mut expected: Vec<f64> = match (budget.max_error, budget.max_ns) {
        (Some(error), _) => vec![error],
        (None, Some(_)) => ERRORS.to_vec(),
        (None, None) => vec![Preset::Fine.settings().max_error],
    };
    expected.reverse();
    let total = if expected.len() > 1 {
        expected.len()
    } else {
        ATTEMPTS
    };
    let mut best: Option<Baked> = None;
    for attempt in 0..total {
        let Some(error) = expected.pop() else { break };
        let settings = budget.settings_for(error, settings);
        let part = |k: usize| k as f64 / total as f64;
        let progress = progress.part(part(attempt), part(attempt + 1));
        let mut baked = baker.bake_as_set(&settings, scope, progress)?;
        if budget.max_ns.is_some() {
            baked.cost.ns = Some(nanoseconds(baker.fabric(), &baked.table));
        }
        let cost = baked.cost;
        let held = budget.holds(&cost);
        baked.within = held;
        if best
            .as_ref()
            .is_none_or(|best| budget.excess(&cost) < budget.excess(&best.cost))
        {
            best = Some(baked);
        }
        if held {
            break;
        }
        if let Some(most) = budget.max_error
            && cost.error > most
        {
            // As much less expected as it turned out more, and a little.
            expected.push(0.9 * error * most / cost.error);
        }
    }
    Ok(best.expect("there is an attempt"))
}

/// Per pair in batches on this thread, median of rounds.
fn nanoseconds(fabric: &Fabric, table: &Table) -> f64 {
    const PAIRS: usize = 4096;
    const ROUNDS: usize = 15;
    let pairs = Pairs::new(&protocol_pairs(fabric, PAIRS, 1));
    let mut rho = [0, 1, 2].map(|_| vec![0.0; PAIRS]);
    let mut round = || {
        nanoseconds_per_pair(PAIRS, || {
            let slices = rho.each_mut().map(Vec::as_mut_slice);
            table.eval_cos_batch(pairs.lights(), pairs.viewers(), slices);
            black_box(&rho);
        })
    };
    median((0..ROUNDS).map(|_| round()).collect())
}
