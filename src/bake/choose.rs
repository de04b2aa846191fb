//! How a thread's segments are best evaluated: from a grid, or directly at a few placed tilts. A thread whose direction changes
//! along its curve is always in grids: where it sweeps no rule places tangents for a pair, and fixed ones err more at any cost.
//! (Directions that only jump are better written as threads of their own, of which each is evaluated as is best.)
//!
//! Cost is counted in evaluations of one tilt ([`crate::brdf::ThreadPair::response`]). Measured in batches on AVX2 (AMD
//! Zen 3): a tilt 9 ns, what [`PlacedNodes`] does once per segment 18 ns, a grid of any size up to a few megabytes 45 to
//! 60 ns. A grid costs the same for any number of segments, and for narrow lobes, where direct evaluation needs many nodes;
//! for a single segment and wide lobes nothing beats three or four nodes. Where threads stand almost upright, grids err most
//! and direct evaluation least.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Settings;
use super::integrate::Integrand;
use super::plan::{Aim, Plan};
use super::survey::{Survey, Values};
use crate::brdf::{PlacedNodes, Reweighting, ThreadPair};
use crate::chart::Chart;
use crate::model::gauss_legendre;
use crate::progress::{Cancelled, Progress};
use crate::table::{Axis, CHANNELS, Encoding};

/// Of a grid, in evaluations of a tilt.
const GRID_COST: usize = 5;
/// Of direct evaluation per segment, besides its nodes.
const SEGMENT_COST: usize = 2;
/// The most nodes per segment that are tried.
const MAX_NODES: usize = 16;
/// Direct evaluation that rescues a thread from a bad grid shall be better than asked for by this factor: it costs little
/// more, and tails gain.
const RESCUE: f64 = 3.0;

/// When segments are evaluated directly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Direct {
    /// Never: all threads have grids.
    Never,
    /// Where it has no larger error than a grid, and costs no more.
    ///
    /// And where a grid of the size allowed would err more than [`Settings::max_error`].
    Worthwhile,
    /// Where it keeps [`Settings::max_error`] and costs no more than a grid.
    ///
    /// And where such a grid would err too much.
    #[cfg_attr(feature = "cli", value(skip))]
    Cheaper,
    /// Always: there are no grids.
    Always,
}

/// What was chosen for a thread, and instead of what.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// The thread's name.
    pub thread: String,
    /// Whether its segments have a grid.
    pub grid: bool,
    /// Mean relative error of the thread to expect from the best grid, if one was planned.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grid_error: Option<f64>,
    /// How many tilts per segment direct evaluation takes to be as good as wanted: see [`Direct`].
    pub direct_nodes: usize,
    /// Its error.
    pub direct_error: f64,
    /// Its cost over that of a grid.
    pub direct_cost: f64,
}

/// What to evaluate a thread's segments by.
pub(super) enum Representation {
    Grid(Box<Planned>),
    Direct(Vec<[f64; 2]>),
    /// All of a thread whose direction changes along its curve.
    Curve {
        response: Box<Planned>,
        projection: Box<Planned>,
    },
}

impl Representation {
    /// How many grids there are to fill.
    pub(super) fn grids(&self) -> usize {
        match self {
            Self::Direct(_) => 0,
            Self::Grid(_) => 1,
            Self::Curve { .. } => 2,
        }
    }
}

/// A grid to fill.
pub(super) struct Planned {
    pub(super) integrand: Integrand,
    pub(super) plan: Plan,
    pub(super) encoding: Encoding,
}

/// Chooses for a thread with segments.
fn choose(
    survey: &mut Survey<'_>,
    settings: &Settings,
    max_coefficients: usize,
    progress: Progress<'_>,
) -> Result<(Representation, Choice), Cancelled> {
    let grid = match settings.direct {
        Direct::Always => None,
        _ => Some(plan_grid(
            survey,
            settings,
            max_coefficients,
            progress.part(0.0, 0.9),
        )?),
    };
    let grid_error = grid.as_ref().map(|grid| grid.plan.error);
    let fails = grid_error.is_none_or(|error| error > settings.max_error);
    let wanted = match (settings.direct, grid_error) {
        (Direct::Worthwhile, _) if fails => settings.max_error / RESCUE,
        (Direct::Worthwhile, Some(grid_error)) => grid_error,
        _ => settings.max_error,
    };
    let (nodes, tilts, direct_error) = direct_nodes(survey, wanted, progress.part(0.9, 1.0))?;
    let thread = survey.thread;
    let segments = thread.tangents::<f64>().segments().len();
    let direct_cost = (segments * (tilts + SEGMENT_COST)) as f64 / GRID_COST as f64;
    let costs_no_more = direct_cost <= 1.0 && direct_error <= wanted;
    let directly = match settings.direct {
        Direct::Never => false,
        Direct::Worthwhile if fails => grid_error.is_none_or(|error| direct_error < error),
        Direct::Worthwhile => costs_no_more,
        Direct::Cheaper => fails || costs_no_more,
        Direct::Always => true,
    };
    let choice = Choice {
        thread: thread.name.clone(),
        grid: !directly,
        grid_error,
        direct_nodes: tilts,
        direct_error,
        direct_cost,
    };
    Ok(match grid {
        Some(grid) if !directly => (Representation::Grid(Box::new(grid)), choice),
        _ => (Representation::Direct(nodes), choice),
    })
}

/// The most bytes of a projection that only the viewer sees …
const PROJECTION_BYTES: usize = 32 << 10;
/// … and the largest part of a thread's that it takes.
const PROJECTION_PART: usize = 8;
/// How much less a projection shall err than a response: it divides all of the fabric.
const PROJECTION_ERROR: f64 = 0.25;

/// The grids of a thread whose direction changes along its curve.
fn plan_curve(
    survey: &mut Survey<'_>,
    settings: &Settings,
    max_coefficients: usize,
    progress: Progress<'_>,
) -> Result<Representation, Cancelled> {
    let Survey { fabric, thread, .. } = *survey;
    let strands = thread.strands(thread.direction());
    let coefficient_bytes = |encoding: Encoding| CHANNELS * encoding.bytes();
    let max_bytes = max_coefficients * coefficient_bytes(settings.encoding);
    let aim = |encoding, max_bytes, target_error| Aim {
        encoding,
        max_coefficients: max_bytes / coefficient_bytes(encoding),
        target_error,
    };
    let of_projection = match fabric.reweighting {
        Reweighting::View => aim(
            Encoding::SqrtI16,
            PROJECTION_BYTES.min(max_bytes / PROJECTION_PART),
            PROJECTION_ERROR * settings.target_error,
        ),
        // One of both directions is like that of the response, and has as much room.
        Reweighting::Both => aim(settings.encoding, max_bytes / 2, settings.target_error),
    };
    let integrand =
        |chart| Integrand::of_projection(fabric, thread, &strands, chart, settings.tolerance);
    let planning = progress.part(0.0, 0.3);
    let projection = best_chart(survey, settings, integrand, of_projection, planning)?;

    let taken: usize = projection.plan.axes.iter().map(Axis::len).product();
    let left = max_bytes.saturating_sub(taken * coefficient_bytes(projection.encoding));
    let of_response = aim(settings.encoding, left, settings.target_error);
    let integrand =
        |chart| Integrand::of_curve(fabric, thread, &strands, chart, settings.tolerance);
    let planning = progress.part(0.3, 1.0);
    let response = best_chart(survey, settings, integrand, of_response, planning)?;
    Ok(Representation::Curve {
        response: Box::new(response),
        projection: Box::new(projection),
    })
}

/// The grid in the chart that promises the least error.
fn plan_grid(
    survey: &mut Survey<'_>,
    settings: &Settings,
    max_coefficients: usize,
    progress: Progress<'_>,
) -> Result<Planned, Cancelled> {
    let Survey { fabric, thread, .. } = *survey;
    let integrand = |chart| Integrand::of_segments(fabric, thread, chart, settings.tolerance);
    let aim = Aim {
        encoding: settings.encoding,
        max_coefficients,
        target_error: settings.target_error,
    };
    best_chart(survey, settings, integrand, aim, progress)
}

fn best_chart(
    survey: &mut Survey<'_>,
    settings: &Settings,
    integrand: impl Fn(Chart) -> Integrand,
    aim: Aim,
    progress: Progress<'_>,
) -> Result<Planned, Cancelled> {
    let charts = match &settings.chart {
        Some(chart) => std::slice::from_ref(chart),
        None => &Chart::ALL[..],
    };
    let mut integrands: Vec<Integrand> = charts.iter().map(|chart| integrand(*chart)).collect();
    // What is no function of a thread's four coordinates is the same in any chart.
    integrands.dedup_by_key(|integrand| integrand.coordinates());
    let count = integrands.len() as f64;
    let mut grids = Vec::new();
    for (index, integrand) in integrands.into_iter().enumerate() {
        let progress = progress.part(index as f64 / count, (index + 1) as f64 / count);
        let ladders = survey.ladders(&integrand, aim.encoding, progress)?;
        let plan = ladders.plan(aim.max_coefficients, aim.target_error);
        grids.push(Planned {
            integrand,
            plan,
            encoding: aim.encoding,
        });
    }
    let best = grids
        .into_iter()
        .min_by(|a, b| a.plan.error.total_cmp(&b.plan.error));
    Ok(best.expect("there are charts"))
}

/// The least nodes per segment whose mean relative error is at most `wanted`, or the most; how many tilts that takes; and that
/// error: of S + A V of the segments, relative to itself plus a hundredth of its mean, A being the largest channel of the albedo.
fn direct_nodes(
    survey: &mut Survey<'_>,
    wanted: f64,
    progress: Progress<'_>,
) -> Result<(Vec<[f64; 2]>, usize, f64), Cancelled> {
    let thread = survey.thread;
    let Values { pairs, floor } = survey.values(progress)?;
    let steps = progress.part(1.0, 1.0).steps(1);
    let brightest = thread.albedo.iter().copied().fold(0.0, f64::max);
    let curve = thread.tangents::<f64>();
    let mut count = 1;
    loop {
        let rule = gauss_legendre(count);
        let nodes = PlacedNodes::<f64>::new(&curve, &thread.optics, &rule);
        let error_of = |(pair, value): &(ThreadPair<f64>, f64)| {
            steps.check()?;
            let response = nodes.mean_response(pair, &thread.optics);
            let error = (response.surface + brightest * response.volume - value).abs();
            Ok(if error > 0.0 {
                error / (value + floor)
            } else {
                0.0
            })
        };
        let errors: Vec<f64> = pairs
            .par_iter()
            .map(error_of)
            .collect::<Result<_, Cancelled>>()?;
        // In their order, whatever the workers do.
        let error = errors.iter().sum::<f64>() / pairs.len() as f64;
        if error <= wanted || count == MAX_NODES {
            return Ok((rule, nodes.tilts(), error));
        }
        count += 1;
    }
}

/// How to evaluate every thread (none for one of single tilts), and why. The bytes allowed are shared equally by those
/// that get a grid.
pub(super) fn choose_all(
    threads: &mut [Survey<'_>],
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<(Vec<Option<Representation>>, Vec<Choice>), Cancelled> {
    let max_coefficients = settings.max_bytes / (CHANNELS * settings.encoding.bytes());
    let mut open: Vec<usize> = (0..threads.len())
        .filter(|index| !threads[*index].thread.has_closed_form())
        .collect();
    let mut chosen: Vec<Option<(Representation, Option<Choice>)>> =
        threads.iter().map(|_| None).collect();
    // Those without a grid leave their share to the others, which then plan again. That may go on, but seldom does.
    for round in 0..2 {
        let from = 0.5 * f64::from(round);
        let part = |k: usize| from + 0.5 * k as f64 / open.len() as f64;
        for (k, index) in open.iter().enumerate() {
            let share = max_coefficients / open.len();
            let progress = progress.part(part(k), part(k + 1));
            let survey = &mut threads[*index];
            chosen[*index] = Some(if survey.thread.is_straight() {
                let (chosen, choice) = choose(survey, settings, share, progress)?;
                (chosen, Some(choice))
            } else {
                (plan_curve(survey, settings, share, progress)?, None)
            });
        }
        let with_grid = |index: &usize| {
            let chosen = chosen[*index].as_ref();
            chosen.is_some_and(|(chosen, _)| chosen.grids() > 0)
        };
        let grids: Vec<usize> = open.iter().copied().filter(with_grid).collect();
        if grids.len() == open.len() {
            break;
        }
        open = grids;
    }
    let choices = chosen
        .iter()
        .flatten()
        .filter_map(|(_, choice)| choice.clone())
        .collect();
    let plans = chosen
        .into_iter()
        .map(|chosen| chosen.map(|(representation, _)| representation));
    Ok((plans.collect(), choices))
}
