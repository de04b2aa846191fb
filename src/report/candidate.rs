//! What is measured: every way to evaluate a fabric, ready to run.
//!
//! A new kind is a few lines in `of_fabric`, and its colour in `plot`.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use super::{Options, ReportError};
use crate::bake::{Baker, Direct, Preset, Settings, size_name};
use crate::evaluator::{Evaluator, Missing, Pace, Spec};
use crate::fabric::{Fabric, Strand, Thread};
use crate::fit::{FitError, fit};
use crate::metrics::{Pairs, Reflectance};
use crate::model::{ModelKind, Rule, sweep_parts};
use crate::progress::Progress;
use crate::table::Table;

/// The evaluator that all times are compared to: the rule of the thesis, one pair at a time.
pub const THESIS: &str = "midpoint:50";
const THESIS_SAMPLES: u32 = 50;

/// How an evaluator works.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Family {
    /// Direct integration at tilts that are spread evenly along the threads.
    Midpoint,
    /// Direct integration at tilts that are placed for each pair.
    Quadrature,
    /// A baked table.
    Table,
    /// The best fit of another model.
    Fit,
}

/// An evaluator to measure.
pub(super) struct Candidate {
    /// What the tool calls it: `midpoint:4`, `table:standard`.
    pub(super) name: String,
    /// How it works.
    pub(super) family: Family,
    /// Whether it takes many pairs at once.
    pub(super) batch: bool,
    /// Bytes that an evaluation reads, parameters aside: samples of tables, tilts of direct integration.
    pub(super) decoded_bytes: usize,
    /// Bytes of the file that it is made from: a table, or the fabric's TOML. A fit has none yet.
    pub(super) file_bytes: usize,
    /// How much it reflects, if that is not what the fabric does.
    pub(super) reflectance: Option<Reflectance>,
    pub(super) evaluator: Evaluator,
}

impl Candidate {
    /// An evaluator that takes a pair at a time.
    fn single(
        spec: &Spec,
        family: Family,
        (decoded_bytes, file_bytes): (usize, usize),
        evaluator: Evaluator,
    ) -> Self {
        // The thesis' rule is timed as one would write it down; the others use what is fast.
        let pace = match family {
            Family::Midpoint => Pace::Plain,
            _ => Pace::Single,
        };
        Self {
            name: spec.to_string(),
            family,
            batch: false,
            decoded_bytes,
            file_bytes,
            reflectance: None,
            evaluator: evaluator.at_pace(pace),
        }
    }

    /// The same evaluator, one pair at a time and many at once.
    fn both(spec: &Spec, family: Family, bytes: (usize, usize), evaluator: Evaluator) -> Vec<Self> {
        let batch = Self {
            batch: true,
            evaluator: evaluator.clone(),
            ..Self::single(spec, family, bytes, evaluator.clone())
        };
        vec![Self::single(spec, family, bytes, evaluator), batch]
    }

    /// Evaluates all `pairs` into the first elements of `rho`.
    pub(super) fn eval(&self, pairs: &Pairs, rho: &mut [Vec<f32>; 3]) {
        self.evaluator.eval_cos_batch(
            pairs.lights(),
            pairs.viewers(),
            rho.each_mut().map(|rho| &mut rho[..pairs.count()]),
        );
    }
}

/// Everything that `options` ask to measure of a fabric; tables are baked.
pub(super) fn of_fabric(
    fabric: &Fabric,
    options: &Options,
    progress: Progress<'_>,
) -> Result<Vec<Candidate>, ReportError> {
    let samples = options.midpoints.iter().copied().chain([THESIS_SAMPLES]);
    let midpoints = BTreeSet::from_iter(samples).into_iter().map(Rule::Midpoint);
    let quadratures = options.quadratures.iter().copied().map(Rule::Quadrature);
    let mut candidates: Vec<Candidate> = midpoints
        .chain(quadratures)
        .flat_map(|rule| direct(fabric, rule))
        .collect();

    let (fitting, baking) = (progress.part(0.0, 0.3), progress.part(0.3, 1.0));
    for (index, kind) in options.fits.iter().enumerate() {
        let share = |index: usize| index as f64 / options.fits.len() as f64;
        let part = fitting.part(share(index), share(index + 1));
        candidates.push(fitted(fabric, *kind, part)?);
    }

    let mut bakes = bakes(options);
    if fabric.visible_threads().all(Thread::has_closed_form) {
        // All tables are the same: closed forms and no samples.
        bakes.truncate(1);
    }
    let cost = |settings: &Settings| settings.max_bytes as f64;
    let total: f64 = bakes.iter().map(|(_, settings)| cost(settings)).sum();
    let mut done = 0.0;
    let mut baker = Baker::new(fabric)?;
    for (name, settings) in bakes {
        let end = done + cost(&settings) / total;
        let baked = baker.bake(settings, baking.part(done, end))?;
        done = end;
        candidates.extend(tables(name, baked.table)?);
    }
    Ok(candidates)
}

/// The evaluators of a rule, one pair at a time and many.
fn direct(fabric: &Fabric, rule: Rule) -> Vec<Candidate> {
    // A tilt or node is two numbers, a segment's ends and density are five, a tangent of what sweeps five.
    let (family, numbers) = match rule {
        Rule::Quadrature(nodes) => {
            let of_thread = |thread: &Thread| {
                let strands = thread.strands(0.0);
                let curves = strands.straight.iter().map(Strand::tangents::<f64>);
                let straight = curves.map(|x| 3 * x.tilts().len() + 5 * x.segments().len());
                let parts: usize = strands.sweeps.iter().map(sweep_parts).sum();
                let nodes = nodes as usize;
                straight.sum::<usize>() + 5 * parts * nodes + 2 * nodes
            };
            let numbers = fabric.visible_threads().map(of_thread).sum();
            (Family::Quadrature, numbers)
        }
        Rule::Midpoint(samples) => {
            let numbers = 2 * fabric.visible_threads().count() * samples as usize;
            (Family::Midpoint, numbers)
        }
        Rule::Adaptive(_) => (Family::Quadrature, 0),
    };
    let bytes = (numbers * size_of::<f32>(), fabric.toml.len());
    let evaluator = Evaluator::rule(fabric, rule);
    Candidate::both(&Spec::Rule(rule), family, bytes, evaluator)
}

/// The best fit of another model.
fn fitted(
    fabric: &Fabric,
    kind: ModelKind,
    progress: Progress<'_>,
) -> Result<Candidate, ReportError> {
    let models = fit(fabric, kind, progress)?.models;
    let exact = kind.prepare::<f64>(&models).map_err(FitError::from)?;
    let model = kind.prepare::<f32>(&models).map_err(FitError::from)?;
    let evaluator = model.expect("it was fitted").into();
    Ok(Candidate {
        reflectance: exact.map(|exact| Reflectance::of(&*exact)),
        ..Candidate::single(&Spec::Fit(kind), Family::Fit, (0, 0), evaluator)
    })
}

/// The evaluators of one table.
fn tables(name: String, table: Table) -> Result<Vec<Candidate>, ReportError> {
    let bytes = (table.decoded_bytes(), table.to_bytes()?.len());
    let evaluator = Evaluator::table(table, Vec::new(), Missing::Nearest);
    let spec = Spec::NamedTable(name);
    Ok(Candidate::both(&spec, Family::Table, bytes, evaluator))
}

/// The tables to bake, by name.
fn bakes(options: &Options) -> Vec<(String, Settings)> {
    // Error is measured here, on other pairs: what a bake measures would only take time.
    let settings = |preset: Preset| Settings {
        error_pairs: 1,
        ..preset.settings()
    };
    let standard = || settings(Preset::Standard);
    let presets = options
        .presets
        .iter()
        .map(|preset| (preset.name().to_owned(), settings(*preset)));
    let sizes = options.sizes.iter().map(|size| {
        let settings = Settings {
            max_bytes: *size,
            // The size is to be used, and by grids.
            target_error: 0.0,
            direct: Direct::Never,
            ..standard()
        };
        (size_name(*size), settings)
    });
    presets.chain(sizes).collect()
}
