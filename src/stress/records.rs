//! A stress report for programs. CSV has one row per case and evaluator, JSON has everything, with the same numbers.

use serde::Serialize;

use super::{Baking, Case, Extreme, StressReport};
use crate::bake::Adapted;

#[derive(Serialize, Default)]
struct Row<'a> {
    fabric: &'a str,
    case: String,
    value: Option<f64>,
    evaluator: &'a str,
    holds: bool,
    pairs: usize,
    not_finite: usize,
    negative: usize,
    deviation: f64,
    step: f64,
    mean_error: f64,
    max_error: f64,
    /// `kept`, `direct`, `larger`, `refused`, or nothing where nothing is baked.
    bake: &'static str,
    bake_mean: Option<f64>,
    bake_p99: Option<f64>,
    decoded_bytes: Option<usize>,
    knots: Option<usize>,
    direct_tilts: Option<usize>,
    refused: Option<&'a str>,
}

pub(super) fn csv(report: &StressReport) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for fabric in &report.fabrics {
        for case in &fabric.cases {
            for row in rows(&fabric.fabric, case) {
                writer.serialize(row).expect("a row goes into memory");
            }
        }
    }
    let bytes = writer.into_inner().expect("all rows go into memory");
    String::from_utf8(bytes).expect("names and numbers are text")
}

fn rows<'a>(fabric: &'a str, case: &'a Case) -> Vec<Row<'a>> {
    let (name, value) = case.what.name();
    let mut rows: Vec<Row<'a>> = Vec::new();
    for verdict in &case.verdicts {
        let is_of = |baking: &&Baking| {
            verdict.evaluator.strip_prefix("table:") == Some(baking.preset.name())
        };
        let baking = case.bakes.iter().find(is_of);
        rows.push(Row {
            fabric,
            case: name.clone(),
            value,
            evaluator: &verdict.evaluator,
            holds: verdict.holds(),
            pairs: verdict.pairs,
            not_finite: verdict.not_finite,
            negative: verdict.negative,
            deviation: verdict.deviation.value,
            step: verdict.step.value,
            mean_error: verdict.mean_error,
            max_error: verdict.error.value,
            bake: baking.map_or("", Baking::outcome),
            bake_mean: baking.map(|baking| baking.mean),
            bake_p99: baking.map(|baking| baking.p99),
            decoded_bytes: baking.map(|baking| baking.decoded_bytes),
            knots: baking.map(|baking| baking.knots),
            direct_tilts: baking.map(|baking| baking.direct_tilts),
            refused: None,
        });
    }
    if let Some(reason) = &case.refused {
        rows.push(Row {
            fabric,
            case: name,
            value,
            holds: true,
            refused: Some(reason),
            ..Row::default()
        });
    }
    rows
}

impl Baking {
    /// In a word.
    pub(super) fn outcome(&self) -> &'static str {
        match (self.kept, self.adapted) {
            (false, _) => "refused",
            (true, None) => "kept",
            (true, Some(Adapted::Direct)) => "direct",
            (true, Some(Adapted::Larger)) => "larger",
        }
    }
}

impl Extreme {
    /// A name, and the value of a sweep.
    pub(super) fn name(&self) -> (String, Option<f64>) {
        match self {
            Self::Pairs(geometry) => (text(geometry), None),
            Self::Planes => ("planes".to_owned(), None),
            Self::Fabric(sweep, value) => (text(sweep), Some(*value)),
        }
    }
}

/// What something that is a name in JSON is called.
pub(super) fn text(name: &impl Serialize) -> String {
    match serde_json::to_value(name) {
        Ok(serde_json::Value::String(name)) => name,
        _ => String::new(),
    }
}
