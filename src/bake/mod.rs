//! Fabrics to tables.
//!
//! Per thread: how its segments are evaluated is chosen (`choose`), the knots of a grid are placed (`plan`), the segments'
//! mean response integrated at its sites (`integrate`) and stored (`encode`). Then the table's error is measured by the protocol of [`crate::metrics`] and written into it,
//! together with everything that made it.

mod budget;
mod choose;
#[doc(hidden)]
pub mod enclosure;
mod encode;
mod forecast;
mod integrate;
mod plan;
mod promise;
mod scope;
mod settings;
mod size;

pub use budget::{Budget, Cost, bake_within};
pub use choose::{Choice, Direct};
pub use forecast::{Forecast, GridForecast, Projection, ThreadForecast, forecast};
pub use promise::{Adapted, Promise, bake_as_promised};
pub use scope::{Scope, ScopeNote};
pub use settings::{Preset, Settings};
pub use size::{size_name, size_named};

use serde::{Deserialize, Serialize};

use crate::fabric::{Fabric, TextError, Thread};
use crate::metrics::{ErrorReport, measure_table};
use crate::needs::Needs;
use crate::progress::{Cancelled, Progress};
use crate::table::{CHANNELS, Content, Grids, Table, ThreadParameters, ThreadTable};
use choose::{Planned, Representation, choose, plan_curve};

/// What made a table, as its metadata.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name and version of the tool.
    pub tool: String,
    /// How it was to be baked …
    pub settings: Settings,
    /// … and how else it was, to keep the preset's promise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub adapted: Option<Adapted>,
    /// What it was baked for, if not for everything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scope: Option<ScopeNote>,
    /// What was baked.
    pub fabric: FabricText,
    /// What that cost in accuracy.
    pub error: ErrorReport,
    /// How threads with segments are evaluated, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub choices: Vec<Choice>,
}

/// A fabric's parameters as text.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FabricText {
    /// The name, with the albedo variant.
    pub name: String,
    /// The albedo variant that was chosen, if there are several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub variant: Option<String>,
    /// The fabric's TOML file.
    pub toml: String,
}

/// Name and version of what writes a table.
const TOOL: &str = concat!("sateen ", env!("CARGO_PKG_VERSION"));

impl Provenance {
    /// Whether [`bake_for`] makes the same of `fabric`, `settings` and `scope`: the text, the variant, every setting, what is
    /// needed and the tool's version are those of the table.
    pub fn is_of(&self, fabric: &Fabric, settings: &Settings, scope: &Scope<'_>) -> bool {
        self.tool == TOOL
            && self.settings == *settings
            && self.scope == scope.note()
            && self.fabric == FabricText::of(fabric)
    }

    /// Reads a table's metadata.
    ///
    /// # Errors
    /// When they are not what [`bake`] writes.
    pub fn of(table: &Table) -> Result<Self, toml::de::Error> {
        toml::from_str(table.metadata())
    }

    fn to_text(&self) -> String {
        toml::to_string(self).expect("numbers, strings and arrays are TOML")
    }
}

impl FabricText {
    fn of(fabric: &Fabric) -> Self {
        Self {
            name: fabric.name.clone(),
            variant: fabric.variant.clone(),
            toml: fabric.toml.clone(),
        }
    }

    /// The fabric.
    ///
    /// # Errors
    /// When the text is no valid fabric.
    pub fn parse(&self) -> Result<Fabric, TextError> {
        Fabric::from_toml(&self.toml, &self.name, self.variant.as_deref())
    }
}

/// Why there is no table.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum BakeError {
    /// The caller wants it no more.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
    /// A fabric's fields were changed, but not the text that would be recorded as what made the table.
    #[error(
        "the parameters of {0} are not those of its TOML text; change the text and read it again"
    )]
    TextDiffers(String),
    /// There is no pair of directions to bake.
    #[error("nothing ever asks for {0}: there is no table to bake")]
    NotNeeded(String),
}

/// Bakes `fabric` and measures the error of the result. The same input gives the same table on any number of threads.
///
/// # Errors
/// When `progress` says stop, or the fabric is not what its TOML text says.
pub fn bake(
    fabric: &Fabric,
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<Table, BakeError> {
    bake_for(fabric, settings, &Scope::default(), progress)
}

/// Bakes what `scope` needs of `fabric`. Where it does, the table is that of [`bake`], to the last bit, unless fixed albedos are in it; the error is measured
/// on pairs that it has.
///
/// # Errors
/// As [`bake`]; and when nothing is needed.
pub fn bake_for(
    fabric: &Fabric,
    settings: &Settings,
    scope: &Scope<'_>,
    progress: Progress<'_>,
) -> Result<Table, BakeError> {
    if scope.needs.is_some_and(Needs::is_empty) {
        return Err(BakeError::NotNeeded(fabric.name.clone()));
    }
    let text = FabricText::of(fabric);
    if text.parse().as_ref() != Ok(fabric) {
        return Err(BakeError::TextDiffers(fabric.name.clone()));
    }
    let sampling = progress.part(0.0, 0.85);
    let visible: Vec<&Thread> = fabric.visible_threads().collect();
    let (plans, planned) = choose_all(fabric, &visible, settings, sampling.part(0.0, 0.3))?;
    let filling = sampling.part(0.3, 1.0);
    let to_fill: usize = plans.iter().flatten().map(Representation::grids).sum();
    let mut filled = 0;
    let mut fill = |thread: &Thread, planned: Planned, content: Content| {
        let share = |filled: usize| filled as f64 / to_fill as f64;
        let filling = filling.part(share(filled), share(filled + 1));
        filled += 1;
        encode::fill_grid(thread, planned, content, scope, filling)
    };
    let mut threads = Vec::new();
    for (thread, plan) in visible.into_iter().zip(plans) {
        let mut parameters = ThreadParameters {
            name: thread.name.clone(),
            direction: thread.direction(),
            coverage: thread.coverage,
            albedo: thread.albedo,
            optics: thread.optics,
            tilts: Vec::new(),
            segments: Vec::new(),
            nodes: Vec::new(),
        };
        if thread.is_straight() {
            let curve = thread.tangents::<f64>();
            let tilts = curve.tilts().iter();
            parameters.tilts = tilts.map(|tilt| (tilt.angle, tilt.weight)).collect();
            let segments = curve.segments().iter();
            parameters.segments = segments.map(|s| (s.from, s.to, s.weight)).collect();
        }
        let grids = match plan {
            None => Grids::None,
            Some(Representation::Direct(nodes)) => {
                parameters.nodes = nodes;
                Grids::None
            }
            Some(Representation::Grid(planned)) => {
                Grids::Segments(fill(thread, *planned, scope.content(thread))?)
            }
            Some(Representation::Curve {
                response,
                projection,
            }) => Grids::Curve {
                response: fill(thread, *response, scope.content(thread))?,
                projection: fill(thread, *projection, Content::Both)?,
            },
        };
        threads.push(ThreadTable::new(parameters, grids));
    }

    let mut table = Table::new(
        threads,
        fabric.gap() as f32,
        fabric.sigma_u as f32,
        fabric.rho_scale as f32,
        fabric.reweighting,
    );
    let measuring = progress.part(0.85, 1.0);
    let error = measure_table(
        fabric,
        &table,
        settings.error_pairs,
        settings.error_seed,
        measuring,
    )?;
    let provenance = Provenance {
        tool: TOOL.to_owned(),
        settings: settings.clone(),
        adapted: None,
        scope: scope.note(),
        fabric: text,
        error,
        choices: planned,
    };
    table.metadata = provenance.to_text();
    Ok(table)
}

/// How to evaluate every thread (none for one of single tilts), and why. The bytes allowed are shared equally by those
/// that get a grid.
fn choose_all(
    fabric: &Fabric,
    threads: &[&Thread],
    settings: &Settings,
    progress: Progress<'_>,
) -> Result<(Vec<Option<Representation>>, Vec<Choice>), Cancelled> {
    let max_coefficients = settings.max_bytes / (CHANNELS * settings.encoding.bytes());
    let mut open: Vec<usize> = (0..threads.len())
        .filter(|index| !threads[*index].has_closed_form())
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
            let thread = threads[*index];
            chosen[*index] = Some(if thread.is_straight() {
                let (chosen, choice) = choose(fabric, thread, settings, share, progress)?;
                (chosen, Some(choice))
            } else {
                let planned = plan_curve(fabric, thread, settings, share, progress)?;
                (planned, None)
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
