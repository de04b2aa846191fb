//! What presets promise, and how a bake keeps it for a fabric whose lobes are narrower than those of most.
//!
//! Narrow lobes on curves with many ends, or threads that hardly face the viewer, may need more knots than a preset's size
//! allows, or err in few places so much that the mean does not tell. Then all threads are evaluated directly, whose accuracy
//! depends little on a lobe's width; and if that does not suffice either, grids get four times the bytes. What is not kept
//! even so is said, never written as if it were.

use serde::{Deserialize, Serialize};

use super::{BakeError, Baked, Baker, Direct, Preset, Scope, Settings};
use crate::fabric::{Fabric, Thread};
use crate::metrics::ErrorReport;
use crate::progress::Progress;

/// The most error of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Promise {
    /// Mean relative error.
    pub mean: f64,
    /// Its 99th percentile.
    pub p99: f64,
}

/// What a table was made with beyond what its preset's settings say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Adapted {
    /// All threads are evaluated directly.
    Direct,
    /// Grids have four times the bytes.
    Larger,
}

impl Preset {
    /// What its tables keep to.
    pub fn promise(self) -> Promise {
        let (mean, p99) = match self {
            Self::Draft => (1.5e-2, 0.1),
            Self::Standard => (3e-3, 2.5e-2),
            Self::Fine => (8e-4, 8e-3),
        };
        Promise { mean, p99 }
    }
}

impl Promise {
    /// Whether an error is within.
    pub fn holds(&self, error: &ErrorReport) -> bool {
        self.excess(error) <= 1.0
    }

    /// By which factor an error is beyond, at most, or how close to it.
    fn excess(&self, error: &ErrorReport) -> f64 {
        f64::max(error.all.mean / self.mean, error.all.p99 / self.p99)
    }
}

impl Adapted {
    /// What is tried if the settings alone do not suffice, in this order.
    const ATTEMPTS: [Self; 2] = [Self::Direct, Self::Larger];

    /// The settings to try, if they are others than those.
    fn apply(self, fabric: &Fabric, settings: &Settings) -> Option<Settings> {
        let mut adapted = settings.clone();
        let none_is_straight = !fabric.visible_threads().any(Thread::is_straight);
        match (self, settings.direct) {
            (_, Direct::Always) | (Self::Direct, Direct::Never) => return None,
            (Self::Direct, _) if none_is_straight => return None,
            (Self::Direct, _) => {
                adapted.direct = Direct::Always;
                // A few more tilts cost little, and the mean says little of the 99th percentile.
                adapted.max_error *= 0.1;
            }
            (Self::Larger, _) => adapted.max_bytes *= 4,
        }
        Some(adapted)
    }
}

/// Bakes a table that keeps the promise of the settings' preset, by other means if need be; if nothing does, the nearest miss.
pub(super) fn bake(
    baker: &mut Baker<'_>,
    settings: &Settings,
    scope: &Scope<'_>,
    progress: Progress<'_>,
) -> Result<Baked, BakeError> {
    let promise = settings.preset.promise();
    let fabric = baker.fabric();
    let adapted = Adapted::ATTEMPTS
        .into_iter()
        .filter_map(|adapted| Some((Some(adapted), adapted.apply(fabric, settings)?)));
    let mut best: Option<(Baked, f64)> = None;
    for (adapted, tried) in std::iter::once((None, settings.clone())).chain(adapted) {
        // Few fabrics need another attempt: a bar that begins again is more honest than one that is never full.
        let mut baked = baker.bake_as_set(&tried, scope, progress)?;
        let excess = promise.excess(&baked.provenance.error);
        baked.within = excess <= 1.0;
        baked.provenance.settings = settings.clone();
        baked.provenance.adapted = adapted;
        let is_kept = baked.within;
        if best.as_ref().is_none_or(|(_, least)| excess < *least) {
            best = Some((baked, excess));
        }
        if is_kept {
            break;
        }
    }
    let (mut baked, _) = best.expect("there is an attempt");
    baked.record();
    Ok(baked)
}
