//! What is found of a thread once, however many tables of whatever size are baked of it.

use rayon::prelude::*;

use super::integrate::Integrand;
use super::plan::Ladders;
use crate::brdf::ThreadPair;
use crate::chart::Chart;
use crate::fabric::{Fabric, Thread};
use crate::metrics::protocol_pairs;
use crate::progress::{Cancelled, Progress};
use crate::table::Encoding;

/// Pairs that direct evaluation is judged on.
const PAIRS: usize = 512;
const SEED: u64 = 1;
/// Of the integrals that it is judged by.
const TOLERANCE: f64 = 1e-6;

/// What is known of a visible thread; nothing at first.
pub(super) struct Survey<'a> {
    pub(super) fabric: &'a Fabric,
    pub(super) thread: &'a Thread,
    ladders: Vec<(Integrand, Encoding, Ladders)>,
    values: Option<Values>,
}

/// S + A V of a thread's segments at pairs, A being the largest channel of the albedo.
pub(super) struct Values {
    pub(super) pairs: Vec<(ThreadPair<f64>, f64)>,
    /// A hundredth of their mean.
    pub(super) floor: f64,
}

impl<'a> Survey<'a> {
    /// Of every visible thread.
    pub(super) fn of(fabric: &'a Fabric) -> Vec<Self> {
        let survey = |thread| Self {
            fabric,
            thread,
            ladders: Vec::new(),
            values: None,
        };
        fabric.visible_threads().map(survey).collect()
    }

    /// Of an `integrand` of this thread.
    pub(super) fn ladders(
        &mut self,
        integrand: &Integrand,
        encoding: Encoding,
        progress: Progress<'_>,
    ) -> Result<&Ladders, Cancelled> {
        let is_it = |known: &(Integrand, Encoding, Ladders)| {
            known.0.is_of(integrand) && known.1.is_root() == encoding.is_root()
        };
        let index = match self.ladders.iter().position(is_it) {
            Some(index) => index,
            None => {
                let ladders =
                    Ladders::climb(self.fabric, self.thread, integrand, encoding, progress)?;
                self.ladders.push((integrand.clone(), encoding, ladders));
                self.ladders.len() - 1
            }
        };
        Ok(&self.ladders[index].2)
    }

    /// What direct evaluation is judged by.
    pub(super) fn values(&mut self, progress: Progress<'_>) -> Result<&Values, Cancelled> {
        let values = match self.values.take() {
            Some(values) => values,
            None => Values::new(self.fabric, self.thread, progress)?,
        };
        Ok(self.values.insert(values))
    }
}

impl Values {
    fn new(fabric: &Fabric, thread: &Thread, progress: Progress<'_>) -> Result<Self, Cancelled> {
        let steps = progress.steps(PAIRS);
        let brightest = thread.albedo.iter().copied().fold(0.0, f64::max);
        let frame = thread.frame::<f64>();
        let integrand = Integrand::of_segments(fabric, thread, Chart::Thesis, TOLERANCE);
        let pairs: Vec<(ThreadPair<f64>, f64)> = protocol_pairs(fabric, PAIRS, SEED)
            .par_iter()
            .map(|pair| {
                let (wi, wr) = (frame.to_thread(pair.wi), frame.to_thread(pair.wr));
                let response = integrand.at_pair(wi, wr);
                let value = response.surface + brightest * response.volume;
                steps.advance()?;
                Ok((ThreadPair::new(wi, wr, fabric.sigma_u), value))
            })
            .collect::<Result<_, _>>()?;
        let floor = 0.01 * pairs.iter().map(|(_, value)| value).sum::<f64>() / pairs.len() as f64;
        Ok(Self { pairs, floor })
    }
}
