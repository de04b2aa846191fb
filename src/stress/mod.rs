//! What holds, and how error grows, where fabrics and directions are extreme.
//!
//! Every fabric is asked at pairs that are hard ([`Geometry`]), and made more extreme than any cloth ([`Sweep`]) and asked again. Of
//! each evaluator a [`Verdict`] says whether values are finite and not negative, how far single precision is from double,
//! whether values step where the model does not, and how far they are from the reference; of each preset whether its promise was
//! kept, and by what means. What is not physical about the model itself is measured beside, so that it is not taken for an error.

mod pairs;
mod records;
mod summary;
mod sweeps;
mod verdict;

pub use pairs::Geometry;
pub use sweeps::Sweep;
pub use verdict::{SinglePair, Verdict, Worst};

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::bake::{Adapted, BakeError, Baked, Baker, Goal, Preset, Request};
use crate::chart::{Chart, Rim};
use crate::evaluator::Spec;
use crate::fabric::Fabric;
use crate::metrics::{Physics, VALIDATION_SEED};
use crate::model::Rule;
use crate::progress::Progress;
use crate::table::Table;
use verdict::Trial;

/// How hard to try.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Presets to bake.
    pub presets: Vec<Preset>,
    /// What to drive to its extremes, with which values.
    pub sweeps: Vec<(Sweep, Vec<f64>)>,
    /// Pairs of each geometry.
    pub pairs: usize,
    /// The seed that draws them.
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        let sweeps = Sweep::ALL.iter();
        Self {
            presets: vec![Preset::Draft, Preset::Standard],
            sweeps: sweeps
                .map(|(sweep, values)| (*sweep, values.to_vec()))
                .collect(),
            pairs: 200,
            seed: VALIDATION_SEED,
        }
    }
}

impl Options {
    /// A rough idea, without tables, within a minute.
    pub fn quick() -> Self {
        let sweeps = Sweep::ALL.iter();
        Self {
            presets: Vec::new(),
            sweeps: sweeps
                .map(|(sweep, values)| (*sweep, Sweep::few(values)))
                .collect(),
            pairs: 50,
            ..Self::default()
        }
    }
}

/// Pairs on which the error of an extreme fabric's table is measured after baking.
const BAKE_PAIRS: usize = 4096;
/// A deviation or step beyond this fails a case: a hundredth of a value is seen.
pub const TOLERANCE: f64 = 1e-2;

/// What was found of all fabrics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StressReport {
    /// Name and version of the tool.
    pub tool: String,
    /// Pairs of each geometry.
    pub pairs: usize,
    /// The seed that drew them.
    pub seed: u64,
    /// The fabrics.
    pub fabrics: Vec<FabricStress>,
}

/// What was found of a fabric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FabricStress {
    /// The fabric's name.
    pub fabric: String,
    /// One line for people.
    pub title: String,
    /// Deviations of the model itself.
    pub physics: Physics,
    /// The fabric as it is, geometry by geometry, then its sweeps.
    pub cases: Vec<Case>,
    /// How error grows as lobes get narrower.
    pub growth: Vec<Growth>,
    /// How well charts are conditioned, by geometry.
    pub charts: Vec<ChartCondition>,
}

/// A fabric, or a more extreme one, at some pairs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// What is extreme.
    pub what: Extreme,
    /// What holds of each evaluator; none if there is no such fabric.
    pub verdicts: Vec<Verdict>,
    /// What became of each preset's table.
    pub bakes: Vec<Baking>,
    /// Why there is no such fabric.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// What is extreme about a case.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Extreme {
    /// The directions; the fabric is itself.
    Pairs(Geometry),
    /// Directions on the planes of the tables' knots and an ulp beside.
    Planes,
    /// The fabric; all geometries.
    Fabric(Sweep, f64),
}

/// What became of a preset's table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Baking {
    /// The preset.
    pub preset: Preset,
    /// Whether its promise is kept; if not, `bake` refuses to write the table.
    pub kept: bool,
    /// What it took beyond the preset's settings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adapted: Option<Adapted>,
    /// Mean relative error over protocol pairs, reached or reachable.
    pub mean: f64,
    /// Its 99th percentile.
    pub p99: f64,
    /// Bytes of samples in memory.
    pub decoded_bytes: usize,
    /// Knots of all axes of all grids.
    pub knots: usize,
    /// Tilts per segment, summed over threads without grid.
    pub direct_tilts: usize,
}

/// How error grows as γ_s falls: the exponent of 1/γ_s that fits its mean best.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Growth {
    /// The evaluator.
    pub evaluator: String,
    /// Of the mean error against the reference.
    pub error: f64,
    /// Of the largest deviation of single precision.
    pub deviation: f64,
}

/// How exact a chart's coordinates are in single precision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ChartCondition {
    /// The chart.
    pub chart: Chart,
    /// The pairs.
    pub geometry: Geometry,
    /// The largest difference of each coordinate between precisions.
    pub coordinates: [f64; 4],
    /// The largest distance, in double precision, between a direction and what the inverse makes of its coordinates: where ranges
    /// shrink to nothing, coordinates no longer tell directions apart.
    pub inverse: f64,
}

impl Case {
    /// Whether all values are finite, none negative, and single precision and smoothness within [`TOLERANCE`].
    pub fn holds(&self) -> bool {
        self.verdicts.iter().all(Verdict::holds)
    }
}

impl Verdict {
    /// See [`Case::holds`].
    pub fn holds(&self) -> bool {
        self.not_finite == 0
            && self.negative == 0
            && self.deviation.value <= TOLERANCE
            && self.step.value <= TOLERANCE
    }
}

impl StressReport {
    /// Nothing found yet.
    pub fn new(options: &Options) -> Self {
        Self {
            tool: crate::TOOL.to_owned(),
            pairs: options.pairs,
            seed: options.seed,
            fabrics: Vec::new(),
        }
    }

    /// Whether all cases hold.
    pub fn holds(&self) -> bool {
        let cases = |fabric: &FabricStress| fabric.cases.iter().all(Case::holds);
        self.fabrics.iter().all(cases)
    }

    /// The names and contents of the files that hold it: CSV and JSON.
    pub fn files(&self) -> Vec<(String, String)> {
        vec![
            ("stress.csv".to_owned(), records::csv(self)),
            (
                "stress.json".to_owned(),
                crate::report::records::json("stress", self),
            ),
        ]
    }
}

/// Tries a fabric. The same input gives the same result on any number of workers.
///
/// # Errors
/// When `progress` says stop.
pub fn stress(
    fabric: &Fabric,
    options: &Options,
    progress: Progress<'_>,
) -> Result<FabricStress, BakeError> {
    let extreme = options
        .sweeps
        .iter()
        .flat_map(|(sweep, values)| values.iter().map(|value| (*sweep, *value)));
    let extreme: Vec<(Sweep, f64)> = extreme.collect();
    let count = extreme.len() as f64 + 2.0;
    let part = |k: usize| progress.part(k as f64 / count, (k + 1) as f64 / count);

    let bakes = bakes(fabric, options, part(0))?;
    let tables: Vec<&(Baking, Table)> = bakes.iter().collect();
    let mut cases = Vec::new();
    for geometry in Geometry::ALL {
        let pairs = geometry.pairs(fabric, options.pairs, options.seed);
        let what = Extreme::Pairs(geometry);
        cases.push(case(what, fabric, pairs, &tables));
    }
    let planes: Vec<SinglePair> = tables
        .iter()
        .flat_map(|(_, table)| pairs::on_planes(table, options.pairs, options.seed))
        .collect();
    if !planes.is_empty() {
        cases.push(case(Extreme::Planes, fabric, planes, &tables));
    }

    for (index, (sweep, value)) in extreme.into_iter().enumerate() {
        let what = Extreme::Fabric(sweep, value);
        let progress = part(index + 1);
        match sweep.apply(fabric, value) {
            Err(error) => cases.push(Case {
                what,
                verdicts: Vec::new(),
                bakes: Vec::new(),
                refused: Some(error.message),
            }),
            Ok(extreme) => {
                let bakes = self::bakes(&extreme, options, progress)?;
                let each = options.pairs.div_ceil(Geometry::ALL.len()).max(20);
                let pairs = Geometry::ALL
                    .iter()
                    .flat_map(|geometry| geometry.pairs(&extreme, each, options.seed))
                    .collect();
                cases.push(case(
                    what,
                    &extreme,
                    pairs,
                    &bakes.iter().collect::<Vec<_>>(),
                ));
            }
        }
        progress.steps(1).advance()?;
    }
    Ok(FabricStress {
        fabric: fabric.name.clone(),
        title: fabric.title.clone(),
        physics: Physics::of(fabric),
        growth: growth(&cases),
        charts: conditions(fabric, options),
        cases,
    })
}

fn bakes(
    fabric: &Fabric,
    options: &Options,
    progress: Progress<'_>,
) -> Result<Vec<(Baking, Table)>, BakeError> {
    let weights: Vec<f64> = options
        .presets
        .iter()
        .map(|preset| preset.settings().max_bytes as f64)
        .collect();
    let total: f64 = weights.iter().sum();
    let mut done = 0.0;
    let mut bakes = Vec::new();
    let mut baker = Baker::new(fabric)?;
    for (preset, weight) in options.presets.iter().zip(weights) {
        let mut settings = preset.settings();
        settings.error_pairs = BAKE_PAIRS;
        let end = done + weight / total;
        let request = Request {
            goal: Goal::Promise,
            ..settings.into()
        };
        let baked = baker.bake(request, progress.part(done, end))?;
        done = end;
        bakes.push((Baking::new(*preset, &baked), baked.table));
    }
    Ok(bakes)
}

impl Baking {
    fn new(preset: Preset, baked: &Baked) -> Self {
        let Baked {
            table, provenance, ..
        } = baked;
        let grids = || table.threads().iter().filter_map(|thread| thread.grid());
        let axes = grids().flat_map(|grid| grid.axes());
        let choices = provenance.choices.iter();
        Self {
            preset,
            kept: baked.within,
            adapted: provenance.adapted,
            mean: provenance.error.all.mean,
            p99: provenance.error.all.p99,
            decoded_bytes: table.decoded_bytes(),
            knots: axes.map(|axis| axis.knots().len()).sum(),
            direct_tilts: choices
                .filter(|choice| !choice.grid)
                .map(|choice| choice.direct_nodes)
                .sum(),
        }
    }
}

fn case(
    what: Extreme,
    fabric: &Fabric,
    pairs: Vec<SinglePair>,
    tables: &[&(Baking, Table)],
) -> Case {
    let trial = Trial::new(fabric, pairs);
    let mut verdicts = vec![
        trial.reference(),
        trial.rule(Rule::THESIS),
        trial.rule(Rule::Quadrature(4)),
    ];
    for (baking, table) in tables {
        let spec = Spec::NamedTable(baking.preset.name().to_owned());
        verdicts.push(trial.table(&spec, table));
    }
    Case {
        what,
        verdicts,
        bakes: tables.iter().map(|(baking, _)| baking.clone()).collect(),
        refused: None,
    }
}

fn growth(cases: &[Case]) -> Vec<Growth> {
    let extreme: Vec<(f64, &Case)> = cases
        .iter()
        .filter_map(|case| match case.what {
            Extreme::Fabric(Sweep::GammaS, gamma) => Some((gamma, case)),
            _ => None,
        })
        .collect();
    let Some((_, first)) = extreme.first() else {
        return Vec::new();
    };
    let names = first.verdicts.iter().map(|verdict| &verdict.evaluator);
    let of = |name: &str, value: fn(&Verdict) -> f64| {
        let points = extreme.iter().filter_map(|(gamma, case)| {
            let mut verdicts = case.verdicts.iter();
            let verdict = verdicts.find(|verdict| verdict.evaluator == name)?;
            Some((-gamma.ln(), value(verdict).max(1e-9).ln()))
        });
        slope(&points.collect::<Vec<_>>())
    };
    names
        .map(|name| Growth {
            evaluator: name.clone(),
            error: of(name, |verdict| verdict.mean_error),
            deviation: of(name, |verdict| verdict.deviation.value),
        })
        .collect()
}

/// Of the line that fits points best, in the sense of least squares.
fn slope(points: &[(f64, f64)]) -> f64 {
    let count = points.len().max(1) as f64;
    let mean = |value: fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / count;
    let (x, y) = (mean(|point| point.0), mean(|point| point.1));
    let (mut xy, mut xx) = (0.0, 0.0);
    for point in points {
        xy += (point.0 - x) * (point.1 - y);
        xx += (point.0 - x) * (point.0 - x);
    }
    if xx > 0.0 { xy / xx } else { 0.0 }
}

fn conditions(fabric: &Fabric, options: &Options) -> Vec<ChartCondition> {
    let Some(thread) = fabric.visible_threads().next() else {
        return Vec::new();
    };
    let frame = thread.frame::<f64>();
    let trials = Chart::ALL
        .into_iter()
        .flat_map(|chart| Geometry::ALL.map(|geometry| (chart, geometry)));
    let condition = |(chart, geometry): (Chart, Geometry)| {
        let mut condition = ChartCondition {
            chart,
            geometry,
            coordinates: [0.0; 4],
            inverse: 0.0,
        };
        for pair in geometry.pairs(fabric, options.pairs, options.seed) {
            // Both precisions start from the same numbers.
            let single = pair.map(|w| frame.to_thread(w.map(f64::from)).map(|x| x as f32));
            let [wi, wr] = single.map(|w| w.map(f64::from));
            let exact = chart.coordinates(Rim::NONE, wi, wr);
            let rounded = chart.coordinates(Rim::NONE, single[0], single[1]);
            for k in 0..4 {
                let difference = (f64::from(rounded[k]) - exact[k]).abs();
                condition.coordinates[k] = condition.coordinates[k].max(difference);
            }
            let (back_i, back_r) = chart.directions(Rim::NONE, exact);
            // The chart is blind to the mirror of sides.
            let distance = |side: f64| {
                let of = |a: [f64; 3], b: [f64; 3]| {
                    (a[0] - b[0]).hypot(side * a[1] - b[1]).hypot(a[2] - b[2])
                };
                of(wi, back_i).max(of(wr, back_r))
            };
            condition.inverse = condition.inverse.max(distance(1.0).min(distance(-1.0)));
        }
        condition
    };
    trials
        .collect::<Vec<_>>()
        .into_par_iter()
        .map(condition)
        .collect()
}
