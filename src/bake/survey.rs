//! What is found of a thread once, however many tables of whatever size are baked of it.

use rayon::prelude::*;

use super::integrate::Integrand;
use super::plan::Ladders;
use crate::brdf::{PlacedNodes, ThreadPair};
use crate::chart::{Chart, Rim, height};
use crate::fabric::{Fabric, Thread};
use crate::metrics::{Pair, PairKind, protocol_pairs};
use crate::model::gauss_legendre;
use crate::progress::{Cancelled, Progress};

/// Pairs that direct evaluation is judged on, of all and of those near the horizon …
const PAIRS: usize = 512;
/// … which are among so many.
const DRAWN: usize = 8192;
/// The height below which they count as near: that of the widest rim, and its band.
const NEAR: f64 = 0.25;
const SEED: u64 = 1;
/// Of the integrals that it is judged by.
const TOLERANCE: f64 = 1e-6;

/// What is known of a visible thread; nothing at first.
pub(super) struct Survey<'a> {
    pub(super) fabric: &'a Fabric,
    pub(super) thread: &'a Thread,
    ladders: Vec<(Integrand, Ladders)>,
    values: Option<Values>,
}

/// S + A V of a thread's segments at pairs, A being the largest channel of the albedo, and how far direct evaluation is from it.
pub(super) struct Values {
    pairs: Vec<Judged>,
    /// Pairs near the thread's horizon.
    rim: Vec<Judged>,
    /// Heights of all pairs that were drawn, and whether they are render pairs, whose density is that of what is seen.
    heights: Vec<(f64, PairKind)>,
    /// A hundredth of the mean over the pairs.
    floor: f64,
    /// By N − 1.
    errors: Vec<DirectErrors>,
}

/// A pair that direct evaluation is judged on.
struct Judged {
    pair: ThreadPair<f64>,
    height: f64,
    value: f64,
}

/// Relative errors of direct evaluation with N nodes per segment: of S + A V of the segments, relative to itself plus a hundredth of
/// its mean.
pub(super) struct DirectErrors {
    pub(super) rule: Vec<[f64; 2]>,
    /// How many tilts per segment that takes.
    pub(super) tilts: usize,
    /// The mean over pairs.
    pub(super) mean: f64,
    /// The mean of the worst hundredth of pairs near the horizon.
    pub(super) tail: f64,
    /// By the pairs near the horizon.
    rim: Vec<f64>,
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
        progress: Progress<'_>,
    ) -> Result<&Ladders, Cancelled> {
        let is_it = |known: &(Integrand, Ladders)| known.0.is_of(integrand);
        let index = match self.ladders.iter().position(is_it) {
            Some(index) => index,
            None => {
                let ladders = Ladders::climb(self.fabric, self.thread, integrand, progress)?;
                self.ladders.push((integrand.clone(), ladders));
                self.ladders.len() - 1
            }
        };
        Ok(&self.ladders[index].1)
    }

    /// What direct evaluation is judged by.
    pub(super) fn values(&mut self, progress: Progress<'_>) -> Result<&mut Values, Cancelled> {
        let values = match self.values.take() {
            Some(values) => values,
            None => Values::new(self.fabric, self.thread, progress)?,
        };
        Ok(self.values.insert(values))
    }

    /// The errors of direct evaluation with up to `count` nodes per segment.
    pub(super) fn direct(
        &mut self,
        count: usize,
        progress: Progress<'_>,
    ) -> Result<(&Values, &[DirectErrors]), Cancelled> {
        let thread = self.thread;
        let values = self.values(progress)?;
        while values.errors.len() < count {
            let errors = values.measure(thread, values.errors.len() + 1, progress)?;
            values.errors.push(errors);
        }
        Ok((values, &values.errors[..count]))
    }
}

impl Values {
    fn new(fabric: &Fabric, thread: &Thread, progress: Progress<'_>) -> Result<Self, Cancelled> {
        let steps = progress.steps(2 * PAIRS);
        let brightest = thread.albedo.iter().copied().fold(0.0, f64::max);
        let frame = thread.frame::<f64>();
        let integrand = Integrand::of_segments(fabric, thread, Chart::Thesis, Rim::NONE, TOLERANCE);
        let to_thread = |pair: &Pair| (frame.to_thread(pair.wi), frame.to_thread(pair.wr));
        let judged = |pair: &Pair| {
            let (wi, wr) = to_thread(pair);
            let response = integrand.at_pair(wi, wr);
            steps.advance()?;
            Ok(Judged {
                pair: ThreadPair::new(wi, wr, fabric.sigma_u),
                height: height(wi, wr),
                value: response.surface + brightest * response.volume,
            })
        };
        let drawn = protocol_pairs(fabric, DRAWN, SEED);
        let height_of = |pair: &Pair| {
            let (wi, wr) = to_thread(pair);
            height(wi, wr)
        };
        let near: Vec<&Pair> = drawn
            .iter()
            .filter(|pair| height_of(pair) < NEAR)
            .take(PAIRS)
            .collect();
        let pairs: Vec<Judged> = drawn[..PAIRS]
            .par_iter()
            .map(judged)
            .collect::<Result<_, Cancelled>>()?;
        let rim = near
            .into_par_iter()
            .map(judged)
            .collect::<Result<_, Cancelled>>()?;
        let mean = pairs.iter().map(|pair| pair.value).sum::<f64>() / pairs.len() as f64;
        Ok(Self {
            heights: drawn
                .iter()
                .map(|pair| (height_of(pair), pair.kind))
                .collect(),
            pairs,
            rim,
            floor: 0.01 * mean,
            errors: Vec::new(),
        })
    }

    fn measure(
        &self,
        thread: &Thread,
        count: usize,
        progress: Progress<'_>,
    ) -> Result<DirectErrors, Cancelled> {
        let steps = progress.part(1.0, 1.0).steps(1);
        let rule = gauss_legendre(count);
        let nodes = PlacedNodes::<f64>::new(&thread.tangents(), &thread.optics, &rule);
        let brightest = thread.albedo.iter().copied().fold(0.0, f64::max);
        let error_of = |judged: &Judged| {
            steps.check()?;
            let response = nodes.mean_response(&judged.pair, &thread.optics);
            let error = (response.surface + brightest * response.volume - judged.value).abs();
            Ok(if error > 0.0 {
                error / (judged.value + self.floor)
            } else {
                0.0
            })
        };
        let errors_of = |pairs: &[Judged]| {
            pairs
                .par_iter()
                .map(error_of)
                .collect::<Result<Vec<f64>, Cancelled>>()
        };
        // In their order, whatever the workers do.
        let mean = errors_of(&self.pairs)?.iter().sum::<f64>() / self.pairs.len() as f64;
        let rim = errors_of(&self.rim)?;
        let mut worst = rim.clone();
        worst.sort_by(|a, b| b.total_cmp(a));
        worst.truncate(rim.len().div_ceil(100));
        let tail = worst.iter().sum::<f64>() / worst.len().max(1) as f64;
        Ok(DirectErrors {
            tilts: nodes.tilts(),
            rule,
            mean,
            tail,
            rim,
        })
    }

    /// What direct evaluation adds to the mean error of a grid with that rim.
    pub(super) fn error_beyond(&self, rim: Rim, direct: &DirectErrors) -> f64 {
        let near = |(height, _): &&(f64, PairKind)| *height < NEAR;
        let share = self.heights.iter().filter(near).count() as f64 / self.heights.len() as f64;
        let beyond = |judged: &Judged| 1.0 - rim.share_of_box(judged.height);
        let errors = self.rim.iter().zip(&direct.rim);
        let sum: f64 = errors.map(|(judged, error)| beyond(judged) * error).sum();
        share * sum / self.rim.len().max(1) as f64
    }

    /// The share of what is seen that takes direct evaluation with that rim.
    pub(super) fn share_beyond(&self, rim: Rim) -> f64 {
        let seen = self
            .heights
            .iter()
            .filter(|(_, kind)| *kind == PairKind::Render);
        let beyond = |(height, _): &&(f64, PairKind)| rim.share_of_box(*height) < 1.0;
        seen.clone().filter(beyond).count() as f64 / seen.count().max(1) as f64
    }
}
