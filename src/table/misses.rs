//! How often a table was asked for what it does not have.

use core::sync::atomic::{AtomicUsize, Ordering};

/// A counter that lookups share. It is no part of what a table is: tables that differ in nothing else are equal.
#[derive(Debug, Default)]
pub(crate) struct Misses(AtomicUsize);

impl Misses {
    pub(crate) fn count(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }

    pub(crate) fn add(&self, pairs: usize) {
        #[cfg(target_has_atomic = "ptr")]
        self.0.fetch_add(pairs, Ordering::Relaxed);
        // A count may be lost where the machine cannot do better.
        #[cfg(not(target_has_atomic = "ptr"))]
        self.0
            .store(self.count().wrapping_add(pairs), Ordering::Relaxed);
    }

    pub(crate) fn reset(&self) {
        self.0.store(0, Ordering::Relaxed);
    }
}

impl Clone for Misses {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Misses {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
