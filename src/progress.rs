//! Long work that tells how far it is, and can be told to stop.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicU64, Ordering};

/// The caller asked to stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("interrupted")]
pub struct Cancelled;

/// Told the share of the work that is done, 0 to 1, from any thread; [`ControlFlow::Break`] stops the work soon.
pub type Report<'a> = &'a (dyn Fn(f64) -> ControlFlow<()> + Sync);

/// A stretch of the work.
#[derive(Clone, Copy)]
pub struct Progress<'a> {
    report: Report<'a>,
    from: f64,
    to: f64,
}

impl<'a> Progress<'a> {
    /// The whole of the work.
    pub fn new(report: Report<'a>) -> Self {
        Self {
            report,
            from: 0.0,
            to: 1.0,
        }
    }

    /// Work that nobody watches.
    pub fn silent() -> Self {
        Self::new(&|_| ControlFlow::Continue(()))
    }

    /// The part of this stretch between two shares of it.
    pub fn part(&self, from: f64, to: f64) -> Self {
        let at = |share: f64| self.from + (self.to - self.from) * share;
        Self {
            report: self.report,
            from: at(from),
            to: at(to),
        }
    }

    /// Divides the stretch into equal steps.
    pub fn steps(&self, count: usize) -> Steps<'a> {
        Steps {
            progress: *self,
            count: count.max(1) as f64,
            done: AtomicU64::new(0),
        }
    }
}

/// Equal steps of a stretch, taken in any order on any thread.
pub struct Steps<'a> {
    progress: Progress<'a>,
    count: f64,
    done: AtomicU64,
}

impl Steps<'_> {
    /// One more step is done.
    ///
    /// # Errors
    /// When the caller wants no more.
    pub fn advance(&self) -> Result<(), Cancelled> {
        self.report(self.done.fetch_add(1, Ordering::Relaxed) + 1)
    }

    /// Within a step that may take long.
    ///
    /// # Errors
    /// When the caller wants no more.
    pub fn check(&self) -> Result<(), Cancelled> {
        self.report(self.done.load(Ordering::Relaxed))
    }

    fn report(&self, done: u64) -> Result<(), Cancelled> {
        let share = done as f64 / self.count;
        let Progress { report, from, to } = self.progress;
        match report(from + (to - from) * share) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(Cancelled),
        }
    }
}
