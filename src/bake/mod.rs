//! Fabrics to tables.
//!
//! Per thread: the nodes of the grid are placed (`plan`), the segments' mean response integrated at each (`integrate`)
//! and stored (`encode`). Then the table's error is measured by the protocol of [`crate::metrics`] and written into it,
//! together with everything that made it.

mod encode;
mod integrate;
mod plan;
mod settings;

pub use settings::{Preset, Settings};

use serde::{Deserialize, Serialize};

use crate::chart::Chart;
use crate::fabric::{Fabric, FabricError, Thread};
use crate::metrics::{Baked, ErrorReport, measure};
use crate::progress::{Cancelled, Progress};
use crate::table::{Table, ThreadParameters, ThreadTable};
use integrate::Integrand;
use plan::{Plan, plan_axes};

/// What made a table, as its metadata.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Provenance {
    /// Name and version of the tool.
    pub tool: String,
    /// How it was baked.
    pub settings: Settings,
    /// What was baked.
    pub fabric: FabricText,
    /// What that cost in accuracy.
    pub error: ErrorReport,
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

impl Provenance {
    /// Reads a table's metadata.
    ///
    /// # Errors
    /// When they are not what [`bake`] writes.
    pub fn of(table: &Table) -> Result<Self, toml::de::Error> {
        toml::from_str(table.metadata())
    }
}

impl FabricText {
    /// The fabric.
    ///
    /// # Errors
    /// When the text is no valid fabric.
    pub fn parse(&self) -> Result<Fabric, FabricError> {
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
    let text = FabricText {
        name: fabric.name.clone(),
        variant: fabric.variant.clone(),
        toml: fabric.toml.clone(),
    };
    if text.parse().as_ref() != Ok(fabric) {
        return Err(BakeError::TextDiffers(fabric.name.clone()));
    }
    let sampling = progress.part(0.0, 0.85);
    let visible: Vec<&Thread> = fabric.visible_threads().collect();
    let bytes_per_coefficient = 2 * settings.encoding.bytes();
    let grids = visible
        .iter()
        .filter(|thread| !thread.tangents::<f64>().segments().is_empty())
        .count();
    let max_coefficients = settings.max_bytes / bytes_per_coefficient / grids.max(1);

    let mut threads = Vec::new();
    let mut baked_grids = 0;
    for thread in visible {
        let curve = thread.tangents::<f64>();
        let parameters = ThreadParameters {
            name: thread.name.clone(),
            direction: thread.direction,
            coverage: thread.coverage,
            albedo: thread.albedo,
            optics: thread.optics,
            tilts: curve
                .tilts()
                .iter()
                .map(|tilt| (tilt.angle, tilt.weight))
                .collect(),
            segments: curve
                .segments()
                .iter()
                .map(|s| (s.from, s.to, s.weight))
                .collect(),
        };
        let grid = if curve.segments().is_empty() {
            None
        } else {
            let share = |part: f64| (f64::from(baked_grids) + part) / grids as f64;
            let charts = match &settings.chart {
                Some(chart) => std::slice::from_ref(chart),
                None => &Chart::ALL[..],
            };
            let planning = sampling.part(share(0.0), share(0.25));
            let mut best: Option<(Integrand, Plan)> = None;
            for (index, chart) in charts.iter().enumerate() {
                let part = |k: usize| k as f64 / charts.len() as f64;
                let planning = planning.part(part(index), part(index + 1));
                let integrand = Integrand::new(fabric, thread, *chart, settings.tolerance);
                let plan = plan_axes(
                    fabric,
                    thread,
                    &integrand,
                    settings,
                    max_coefficients,
                    planning,
                )?;
                if best
                    .as_ref()
                    .is_none_or(|(_, best)| plan.error < best.error)
                {
                    best = Some((integrand, plan));
                }
            }
            let (integrand, plan) = best.expect("there are charts");
            let filling = sampling.part(share(0.25), share(1.0));
            baked_grids += 1;
            Some(encode::fill_grid(
                &integrand,
                plan.axes,
                settings.encoding,
                filling,
            )?)
        };
        threads.push(ThreadTable::new(parameters, grid));
    }

    let mut table = Table {
        threads,
        gap: fabric.gap() as f32,
        sigma_u: fabric.sigma_u as f32,
        reweighting: fabric.reweighting,
        metadata: String::new(),
    };
    let measuring = progress.part(0.85, 1.0);
    let error = measure(
        fabric,
        &Baked(&table),
        settings.error_pairs,
        settings.error_seed,
        measuring,
    )?;
    let provenance = Provenance {
        tool: concat!("sateen ", env!("CARGO_PKG_VERSION")).to_owned(),
        settings: settings.clone(),
        fabric: text,
        error,
    };
    table.metadata = toml::to_string(&provenance).expect("numbers, strings and arrays are TOML");
    Ok(table)
}
