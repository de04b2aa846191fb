//! A report for programs. CSV has one row per fabric and evaluator, JSON has everything, with the same numbers.

use serde::Serialize;

use super::{Family, Report};

#[derive(Serialize)]
struct Row<'a> {
    fabric: &'a str,
    evaluator: &'a str,
    family: Family,
    batch: bool,
    pairs: usize,
    mean: f64,
    p50: f64,
    p95: f64,
    p99: f64,
    p999: f64,
    max: f64,
    grazing_pairs: usize,
    grazing_mean: f64,
    grazing_p99: f64,
    grazing_max: f64,
    rim_pairs: usize,
    rim_mean: f64,
    rim_p99: f64,
    rim_max: f64,
    rim_both_pairs: usize,
    rim_both_mean: f64,
    rim_both_p99: f64,
    rim_both_max: f64,
    rim_last_pairs: usize,
    rim_last_mean: f64,
    rim_last_p99: f64,
    rim_last_max: f64,
    rmse_over_mean: f64,
    ns: f64,
    speedup: f64,
    decoded_bytes: usize,
    file_bytes: usize,
    sphere_flip: Option<f64>,
    sphere_error: Option<f64>,
    cylinders_flip: Option<f64>,
    cylinders_error: Option<f64>,
}

pub(super) fn csv(report: &Report) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for fabric in &report.fabrics {
        for evaluator in &fabric.evaluators {
            let error = &evaluator.error;
            let all = &error.all;
            let looks = evaluator.looks;
            let row = Row {
                fabric: &fabric.fabric,
                evaluator: &evaluator.evaluator,
                family: evaluator.family,
                batch: evaluator.batch,
                pairs: all.pairs,
                mean: all.mean,
                p50: all.p50,
                p95: all.p95,
                p99: all.p99,
                p999: all.p999,
                max: all.max,
                grazing_pairs: error.grazing.pairs,
                grazing_mean: error.grazing.mean,
                grazing_p99: error.grazing.p99,
                grazing_max: error.grazing.max,
                rim_pairs: error.rim.pairs,
                rim_mean: error.rim.mean,
                rim_p99: error.rim.p99,
                rim_max: error.rim.max,
                rim_both_pairs: error.rim_both.pairs,
                rim_both_mean: error.rim_both.mean,
                rim_both_p99: error.rim_both.p99,
                rim_both_max: error.rim_both.max,
                rim_last_pairs: error.rim_last.pairs,
                rim_last_mean: error.rim_last.mean,
                rim_last_p99: error.rim_last.p99,
                rim_last_max: error.rim_last.max,
                rmse_over_mean: error.rmse_over_mean,
                ns: evaluator.ns,
                speedup: evaluator.speedup,
                decoded_bytes: evaluator.decoded_bytes,
                file_bytes: evaluator.file_bytes,
                sphere_flip: looks.map(|looks| looks.sphere.flip),
                sphere_error: looks.map(|looks| looks.sphere.error),
                cylinders_flip: looks.map(|looks| looks.cylinders.flip),
                cylinders_error: looks.map(|looks| looks.cylinders.error),
            };
            writer.serialize(row).expect("a row goes into memory");
        }
    }
    let bytes = writer.into_inner().expect("all rows go into memory");
    String::from_utf8(bytes).expect("names and numbers are text")
}

/// What a program reads first: which keys there are, and what they mean.
#[doc(hidden)]
pub fn schema(what: &str) -> String {
    format!("sateen-{what}/1")
}

#[derive(Serialize)]
struct Versioned<'a, T> {
    schema: String,
    #[serde(flatten)]
    content: &'a T,
}

/// Everything, to be read by people, too.
pub(crate) fn json(what: &str, content: &impl Serialize) -> String {
    let schema = schema(what);
    let text = serde_json::to_string_pretty(&Versioned { schema, content });
    text.expect("numbers, names and lists are JSON") + "\n"
}
