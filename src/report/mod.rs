//! Error against time against bytes, of every way to evaluate a fabric.
//!
//! Error is that of [`crate::metrics`], of what an evaluator returns in single precision. Time is that of one core, all
//! evaluators in turn on the same pairs, several rounds, of which the median counts; times of different machines are hard
//! to compare, so the figure to quote is the ratio to the thesis' 50 samples in the same rounds.

mod candidate;
mod front;
mod heat;
mod look;
mod machine;
mod page;
mod plot;
pub(crate) mod records;
pub(crate) mod summary;
mod timing;

pub use candidate::{Family, THESIS};
pub use front::pareto_front;
pub use heat::{Axis, HeatMap};
pub use look::{Look, Looks};
pub use machine::Machine;
#[doc(hidden)]
pub use records::schema;

use candidate::Candidate;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::bake::{BakeError, Preset};
use crate::fabric::Fabric;
use crate::fit::FitError;
use crate::metrics::{
    DEFAULT_PAIRS, PairErrors, Pairs, Physics, Reflectance, Truth, VALIDATION_SEED, median,
};
use crate::model::ModelKind;
use crate::progress::{Cancelled, Progress};
use crate::table::Error;

/// What to measure. The thesis' 50 midpoints are always measured, since all times are compared to them.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Numbers of samples of the midpoint rule.
    pub midpoints: Vec<u32>,
    /// Numbers of placed tilts per segment.
    pub quadratures: Vec<u32>,
    /// Presets to bake.
    pub presets: Vec<Preset>,
    /// Most bytes in memory of other tables to bake with the standard encoding.
    pub sizes: Vec<usize>,
    /// Other models to fit.
    pub fits: Vec<ModelKind>,
    /// Pairs to measure error on.
    pub pairs: usize,
    /// The seed that draws them.
    pub seed: u64,
    /// Rounds of timing.
    pub rounds: usize,
    /// Rows of the pictures that are compared.
    pub picture_size: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            midpoints: vec![1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 50, 100],
            quadratures: vec![1, 2, 3, 4, 5, 6, 8, 10, 12, 16],
            presets: vec![Preset::Draft, Preset::Standard, Preset::Fine],
            sizes: vec![64 << 10, 256 << 10, 1 << 20, 4 << 20, 16 << 20],
            fits: ModelKind::ALL.to_vec(),
            pairs: DEFAULT_PAIRS,
            seed: VALIDATION_SEED,
            rounds: 9,
            picture_size: 256,
        }
    }
}

impl Options {
    /// A few evaluators, roughly, within seconds.
    pub fn quick() -> Self {
        Self {
            midpoints: vec![1, 4, 16, 50],
            quadratures: vec![1, 3, 6],
            presets: vec![Preset::Draft],
            sizes: Vec::new(),
            // Irawan's takes a while.
            fits: ModelKind::ALL[..3].to_vec(),
            pairs: 512,
            rounds: 1,
            picture_size: 96,
            ..Self::default()
        }
    }
}

/// What was measured of all fabrics.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name and version of the tool.
    pub tool: String,
    /// What times were measured on.
    pub machine: Machine,
    /// Pairs that error was measured on.
    pub pairs: usize,
    /// The seed that drew them.
    pub seed: u64,
    /// Rounds of timing.
    pub rounds: usize,
    /// Rows of the pictures that were compared.
    pub picture_size: usize,
    /// The fabrics.
    pub fabrics: Vec<FabricReport>,
}

/// What was measured of a fabric.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FabricReport {
    /// The fabric's name.
    pub fabric: String,
    /// One line for people.
    pub title: String,
    /// How far the model itself is from reciprocity and from conserving energy.
    pub physics: Physics,
    /// Every evaluator.
    pub evaluators: Vec<Measurement>,
    /// Where the table errs that [`FabricReport::headline`] gives; empty if it is exact.
    pub heat: Vec<HeatMap>,
}

/// What was measured of an evaluator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measurement {
    /// Its name, as `midpoint:4` or `table:standard`.
    pub evaluator: String,
    /// How it works.
    pub family: Family,
    /// Whether it takes many pairs at once.
    pub batch: bool,
    /// How far it is from direct integration.
    pub error: PairErrors,
    /// Nanoseconds per pair, median of rounds.
    pub ns: f64,
    /// How many times less that is than [`THESIS`] takes, median of the rounds' ratios.
    pub speedup: f64,
    /// Bytes that an evaluation reads.
    pub decoded_bytes: usize,
    /// Bytes of the file.
    pub file_bytes: usize,
    /// How much it reflects, if it is another model's fit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reflectance: Option<Reflectance>,
    /// How far its pictures are from those of direct integration, of tables and fits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub looks: Option<Looks>,
}

impl Report {
    /// Nothing measured yet.
    pub fn new(options: &Options) -> Self {
        Self {
            tool: crate::TOOL.to_owned(),
            machine: Machine::detect(),
            pairs: options.pairs,
            seed: options.seed,
            rounds: options.rounds,
            picture_size: options.picture_size,
            fabrics: Vec::new(),
        }
    }

    /// The names and contents of the files that show it: CSV, JSON, plots and a page.
    pub fn files(&self) -> Vec<(String, String)> {
        let mut files = vec![
            ("report.csv".to_owned(), records::csv(self)),
            ("report.json".to_owned(), records::json("report", self)),
            ("index.html".to_owned(), page::html(self)),
        ];
        for fabric in &self.fabrics {
            for plot in plot::all(fabric) {
                files.push((
                    format!("{}-{}.svg", fabric.fabric, plot.name),
                    plot.standalone(),
                ));
            }
        }
        files
    }
}

/// Why nothing was measured.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A table could not be baked.
    #[error(transparent)]
    Bake(#[from] BakeError),
    /// A table could not be written.
    #[error(transparent)]
    Table(#[from] Error),
    /// Another model could not be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// The caller wants it no more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

/// Bakes the tables of `fabric` and measures every evaluator. All but the times is the same for the same input, on any
/// number of workers; times are taken on the calling one.
///
/// # Errors
/// When `progress` says stop, or a table cannot be made.
pub fn measure(
    fabric: &Fabric,
    options: &Options,
    progress: Progress<'_>,
) -> Result<FabricReport, ReportError> {
    let truth = Truth::new(fabric, options.pairs, options.seed, progress.part(0.0, 0.1))?;
    let candidates = candidate::of_fabric(fabric, options, progress.part(0.1, 0.75))?;

    let pairs = Pairs::new(truth.pairs());
    let steps = progress.part(0.8, 0.85).steps(candidates.len());
    let values: Vec<Vec<[f64; 3]>> = candidates
        .par_iter()
        .map(|candidate| {
            let mut rho = [0, 1, 2].map(|_| vec![0.0; pairs.count()]);
            candidate.eval(&pairs, &mut rho);
            let value = |pair: usize| [0, 1, 2].map(|channel| f64::from(rho[channel][pair]));
            steps
                .advance()
                .map(|()| (0..pairs.count()).map(value).collect())
        })
        .collect::<Result<_, Cancelled>>()?;

    let truths = look::Truths::new(fabric, options.picture_size, progress.part(0.75, 0.8))?;
    let looks = candidates
        .iter()
        .map(|candidate| match candidate.family {
            Family::Table | Family::Fit => truths.looks(candidate).map(Some),
            Family::Midpoint | Family::Quadrature => Ok(None),
        })
        .collect::<Result<Vec<Option<Looks>>, Cancelled>>()?;

    let timed = timing::timed_pairs(truth.protocol_pairs(), options.seed);
    let times = timing::interleaved(
        &candidates,
        &timed,
        options.rounds,
        progress.part(0.85, 1.0),
    )?;
    let is_thesis = |candidate: &Candidate| candidate.name == THESIS && !candidate.batch;
    let thesis = candidates
        .iter()
        .position(is_thesis)
        .expect("it is always measured");
    let hundredth = |x: f64| (100.0 * x).round() / 100.0;

    let mut report = FabricReport {
        fabric: fabric.name.clone(),
        title: fabric.title.clone(),
        physics: Physics::of(fabric),
        evaluators: Vec::new(),
        heat: Vec::new(),
    };
    for (index, (candidate, values)) in candidates.iter().zip(&values).enumerate() {
        let of_rounds =
            |value: &dyn Fn(&Vec<f64>) -> f64| hundredth(median(times.iter().map(value).collect()));
        report.evaluators.push(Measurement {
            evaluator: candidate.name.clone(),
            family: candidate.family,
            batch: candidate.batch,
            error: truth.errors_of(values),
            ns: of_rounds(&|round| round[index]),
            speedup: of_rounds(&|round| round[thesis] / round[index]),
            decoded_bytes: candidate.decoded_bytes,
            file_bytes: candidate.file_bytes,
            reflectance: candidate.reflectance.clone(),
            looks: looks[index],
        });
    }
    if let Some(table) = report.headline().filter(|table| !table.is_exact()) {
        let index = report.evaluators.iter().position(|other| other == table);
        let errors = truth.relative_errors(&values[index.expect("it is one of them")]);
        report.heat = heat::maps(&table.evaluator, fabric, truth.protocol_pairs(), &errors);
    }
    Ok(report)
}
