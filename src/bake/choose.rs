//! How a thread's segments are best evaluated: from a grid, or directly at a few placed tilts. A thread whose direction changes
//! along its curve is always in grids: where it sweeps no rule places tangents for a pair, and fixed ones err more at any cost.
//! (Directions that only jump are better written as threads of their own, of which each is evaluated as is best.)
//!
//! A grid costs the same for any number of segments, and for narrow lobes, where direct evaluation needs many nodes; for a single segment
//! and wide lobes nothing beats a few nodes (`price`). Where threads stand almost upright, grids err most and direct evaluation least.
//!
//! Grids of straight threads end at a rim before the horizon ([`Rim`]), where they err most and knots are spent on what is hardly seen;
//! pairs beyond are evaluated directly. How far before, and at how many tilts, is whatever makes error times price the least. Mean error
//! (99th percentile) of protocol pairs by where grids end, in radians, with half of [`TAIL`]; bold is what is chosen.
//!
//! | | bytes | 0 | 0.10 | 0.15 | 0.20 | 0.25 | 0.30 |
//! |---|---|---|---|---|---|---|---|
//! | denim | 3840 KiB | 0.090 (0.98) | 0.045 (0.51) | 0.045 (0.53) in 2.9 MB | **0.038 (0.40) in 2.5 MB** | 0.041 (0.42) in 1.7 MB | 0.032 (0.39) in 0.7 MB |
//! | denim | 1250 KiB | | 0.102 (0.91) | 0.078 (0.65) | **0.069 (0.56)** | 0.049 (0.46) | |
//! | polyester lining | 1220 KiB | | | | **0.074 (0.64)** | 0.046 (0.44) | |
//!
//! Beyond 0.20 it is a third of the pairs of a sphere that take both ways, so that is the most; 0.15 was never the best. The worst
//! hundredth of pairs near the horizon says how many tilts it takes at least, of direct threads too: it may err [`TAIL`] times as much as
//! a thread on average. With half of that it took up to three tilts more, and the worst of all pairs erred half as much.
//!
//! Threads whose direction changes along their curve, and felt, have grids up to the horizon: fixed tangents err more there at any cost.

use serde::{Deserialize, Serialize};

use super::Settings;
use super::integrate::Integrand;
use super::plan::{Aim, Plan};
use super::survey::{DirectErrors, Survey};
use crate::brdf::Reweighting;
use crate::chart::{Chart, Rim};
use crate::progress::{Cancelled, Progress};
use crate::table::{Axis, CHANNELS, COEFFICIENT_BYTES};

/// The most nodes per segment that are tried.
const MAX_NODES: usize = 16;
/// Where a thread's grid may end.
const RIMS: [Rim; 3] = [rim(0), rim(10), rim(20)];
/// Direct evaluation that rescues a thread from a bad grid shall be better than asked for by this factor: it costs little
/// more, and tails gain.
const RESCUE: f64 = 3.0;
/// The worst hundredth of pairs near the horizon errs at most so many times what a thread may on average.
const TAIL: f64 = 10.0;
/// Direct evaluation that takes no more time than this many grids is worthwhile if it errs less by as much.
const DEAR: f64 = 1.35;

const fn rim(hundredths: u8) -> Rim {
    match Rim::new(hundredths) {
        Some(rim) => rim,
        None => panic!("too wide"),
    }
}

/// When segments are evaluated directly.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Direct {
    /// Never: all threads have grids.
    Never,
    /// Where it errs less than a grid by at least as much as it costs more, which is up to a third more.
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
    /// Where the grid ends before the thread's horizon, if it does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rim: Option<RimChoice>,
    /// How many tilts per segment direct evaluation takes to be as good as wanted: see [`Direct`].
    pub direct_nodes: usize,
    /// Its error.
    pub direct_error: f64,
    /// Its cost over that of a grid.
    pub direct_cost: f64,
}

/// What evaluates pairs near a thread's horizon.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct RimChoice {
    /// How far before the horizon the grid ends, in radians.
    pub from: f64,
    /// How many tilts per segment are evaluated beyond.
    pub nodes: usize,
}

/// What to evaluate a thread's segments by.
pub(super) enum Representation {
    /// A grid, and the nodes beyond its rim, if it has one.
    Grid {
        grid: Box<Planned>,
        nodes: Vec<[f64; 2]>,
    },
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
            Self::Grid { .. } => 1,
            Self::Curve { .. } => 2,
        }
    }
}

/// A grid to fill.
pub(super) struct Planned {
    pub(super) integrand: Integrand,
    pub(super) plan: Plan,
}

/// A grid, and what evaluates pairs beyond its rim.
struct Rimmed {
    grid: Planned,
    nodes: Vec<[f64; 2]>,
    tilts: usize,
    /// Mean relative error to expect, and price.
    error: f64,
    price: f64,
}

impl Rimmed {
    /// What errs less is worth as much more time. Where error is as small as wanted knots are saved, and b bytes err in proportion to
    /// b^−¾, about.
    fn score(&self, target_error: f64) -> f64 {
        let coefficients: usize = self.grid.plan.axes.iter().map(Axis::len).product();
        self.error.max(target_error) * self.price * (coefficients as f64).powf(0.75)
    }
}

/// Chooses for a thread with segments.
fn choose(
    survey: &mut Survey<'_>,
    settings: &Settings,
    max_coefficients: usize,
    progress: Progress<'_>,
) -> Result<(Representation, Choice), Cancelled> {
    let thread = survey.thread;
    let segments = thread.tangents::<f64>().segments().len();
    let prices = settings.made_for.prices();
    let grid = match settings.direct {
        Direct::Always => None,
        _ => Some(plan_grid(
            survey,
            settings,
            max_coefficients,
            progress.part(0.0, 0.9),
        )?),
    };
    let grid_error = grid.as_ref().map(|grid| grid.error);
    let fails = grid_error.is_none_or(|error| error > settings.max_error);
    let grid_price = grid
        .as_ref()
        .map_or(prices.grid(0.0, 0.0), |grid| grid.price);
    let (_, all) = survey.direct(MAX_NODES, progress.part(0.9, 1.0))?;
    let cost = |direct: &DirectErrors| prices.direct(segments, direct.tilts) / grid_price;
    let direct = if settings.direct == Direct::Worthwhile && !fails {
        let score = |direct: &DirectErrors| direct.mean.max(settings.target_error) * cost(direct);
        let even = even(all, settings);
        even.min_by(|a, b| score(a).total_cmp(&score(b)))
    } else {
        let wanted = match settings.direct {
            Direct::Worthwhile => settings.max_error / RESCUE,
            _ => settings.max_error,
        };
        even(all, settings).find(|direct| direct.mean <= wanted)
    };
    let (direct, keeps) = match direct {
        Some(direct) => (direct, true),
        None => (&all[MAX_NODES - 1], false),
    };
    let direct_cost = cost(direct);
    let errs_less = |factor: f64| grid_error.is_none_or(|error| direct.mean * factor < error);
    let directly = match settings.direct {
        Direct::Never => false,
        Direct::Worthwhile if fails => errs_less(1.0),
        Direct::Worthwhile => keeps && direct_cost <= DEAR && errs_less(direct_cost),
        Direct::Cheaper => fails || keeps && direct_cost <= 1.0,
        Direct::Always => true,
    };
    let mut choice = Choice {
        thread: thread.name.clone(),
        grid: !directly,
        grid_error,
        rim: None,
        direct_nodes: direct.tilts,
        direct_error: direct.mean,
        direct_cost,
    };
    Ok(match grid {
        Some(Rimmed {
            grid, nodes, tilts, ..
        }) if !directly => {
            choice.rim = (!nodes.is_empty()).then(|| RimChoice {
                from: 0.01 * f64::from(grid.integrand.coordinates().rim().hundredths()),
                nodes: tilts,
            });
            let grid = Box::new(grid);
            (Representation::Grid { grid, nodes }, choice)
        }
        _ => (Representation::Direct(direct.rule.clone()), choice),
    })
}

/// The most coefficients of a projection that only the viewer sees …
const PROJECTION_COEFFICIENTS: usize = 8 << 10;
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
    let aim = |max_coefficients, target_error| Aim {
        max_coefficients,
        target_error,
    };
    let of_projection = match fabric.reweighting {
        Reweighting::View => aim(
            PROJECTION_COEFFICIENTS.min(max_coefficients / PROJECTION_PART),
            PROJECTION_ERROR * settings.target_error,
        ),
        // One of both directions is like that of the response, and has as much room.
        Reweighting::Both => aim(max_coefficients / 2, settings.target_error),
    };
    let integrand =
        |chart| Integrand::of_projection(fabric, thread, &strands, chart, settings.tolerance);
    let planning = progress.part(0.0, 0.3);
    let projection = best_chart(survey, settings, integrand, of_projection, planning)?;

    let taken: usize = projection.plan.axes.iter().map(Axis::len).product();
    let left = max_coefficients.saturating_sub(taken);
    let of_response = aim(left, settings.target_error);
    let integrand =
        |chart| Integrand::of_curve(fabric, thread, &strands, chart, settings.tolerance);
    let planning = progress.part(0.3, 1.0);
    let response = best_chart(survey, settings, integrand, of_response, planning)?;
    Ok(Representation::Curve {
        response: Box::new(response),
        projection: Box::new(projection),
    })
}

/// The grid in the chart that promises the least error, ending where that is worth its time.
fn plan_grid(
    survey: &mut Survey<'_>,
    settings: &Settings,
    max_coefficients: usize,
    progress: Progress<'_>,
) -> Result<Rimmed, Cancelled> {
    let Survey { fabric, thread, .. } = *survey;
    let aim = Aim {
        max_coefficients,
        target_error: settings.target_error,
    };
    let rims = match settings.direct {
        Direct::Never => &RIMS[..1],
        _ => &RIMS[..],
    };
    let part = |k: usize| k as f64 / rims.len() as f64;
    let mut best: Option<Rimmed> = None;
    for (k, rim) in rims.iter().enumerate() {
        let integrand =
            |chart| Integrand::of_segments(fabric, thread, chart, *rim, settings.tolerance);
        let progress = progress.part(part(k), part(k + 1));
        let grid = best_chart(survey, settings, integrand, aim, progress)?;
        let rimmed = with_nodes(survey, settings, grid, progress)?;
        let score = |rimmed: &Rimmed| rimmed.score(settings.target_error);
        if best
            .as_ref()
            .is_none_or(|best| score(&rimmed) < score(best))
        {
            best = Some(rimmed);
        }
    }
    Ok(best.expect("there are rims"))
}

/// A grid with the nodes beyond its rim that are best for it.
fn with_nodes(
    survey: &mut Survey<'_>,
    settings: &Settings,
    grid: Planned,
    progress: Progress<'_>,
) -> Result<Rimmed, Cancelled> {
    let prices = settings.made_for.prices();
    let rim = grid.integrand.coordinates().rim();
    let error = grid.plan.error;
    if rim.is_none() {
        return Ok(Rimmed {
            grid,
            nodes: Vec::new(),
            tilts: 0,
            error,
            price: prices.grid(0.0, 0.0),
        });
    }
    let segments = survey.thread.tangents::<f64>().segments().len();
    let (values, all) = survey.direct(MAX_NODES, progress.part(1.0, 1.0))?;
    let share = values.share_beyond(rim);
    let of = |direct: &DirectErrors| {
        (
            error + values.error_beyond(rim, direct),
            prices.grid(share, prices.direct(segments, direct.tilts)),
        )
    };
    let score = |direct: &&DirectErrors| {
        let (error, price) = of(direct);
        error.max(settings.target_error) * price
    };
    let best = even(all, settings)
        .min_by(|a, b| score(a).total_cmp(&score(b)))
        .unwrap_or(&all[MAX_NODES - 1]);
    let (error, price) = of(best);
    Ok(Rimmed {
        grid,
        nodes: best.rule.clone(),
        tilts: best.tilts,
        error,
        price,
    })
}

/// Those whose worst pairs near the horizon err little enough.
fn even<'a>(
    all: &'a [DirectErrors],
    settings: &Settings,
) -> impl Iterator<Item = &'a DirectErrors> {
    let most = TAIL * settings.max_error;
    all.iter().filter(move |direct| direct.tail <= most)
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
        let ladders = survey.ladders(&integrand, progress)?;
        let plan = ladders.plan(aim.max_coefficients, aim.target_error);
        grids.push(Planned { integrand, plan });
    }
    let best = grids
        .into_iter()
        .min_by(|a, b| a.plan.error.total_cmp(&b.plan.error));
    Ok(best.expect("there are charts"))
}

/// How to evaluate every thread (none for one of single tilts), and why. The bytes allowed are shared equally by those
/// that get a grid.
pub(super) fn choose_all(
    threads: &mut [Survey<'_>],
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<(Vec<Option<Representation>>, Vec<Choice>), Cancelled> {
    let max_coefficients = settings.max_bytes / (CHANNELS * COEFFICIENT_BYTES);
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
