//! `sateen validate`

use std::path::PathBuf;

use anyhow::Result;
use clap::value_parser;
use sateen::metrics::{DEFAULT_PAIRS, Physics, measure_table};
use sateen::progress::Progress;
use serde_json::json;

use crate::Outcome;
use crate::args::{Draw, Print, Workers, parse_error};
use crate::output::{Bar, Usage, error_lines, print, print_json, sizes, talk, use_workers};
use crate::subject::{load_table, provenance};
use crate::verify;

/// Measure tables against direct integration.
///
/// Relative error is max over channels of |table − direct| / (direct + 1 % of the mean), over pairs of which half are
/// cosine-weighted and half near highlights, the same for the same seed.
#[derive(clap::Args)]
pub(crate) struct ValidateArgs {
    /// Tables that `bake` wrote; with --list the folder that they are in.
    #[arg(value_name = "TABLE|DIR", required = true)]
    tables: Vec<PathBuf>,
    /// Check a folder against the list that `bake --list` filled it from: that every table is there, is the file of its manifest and
    /// keeps its preset's promise. What is missing, stale or damaged is listed, and the exit status is 3.
    #[arg(long, value_name = "FILE")]
    list: Option<PathBuf>,
    /// With --list: measure errors anew, too. Without, those that were recorded are taken.
    #[arg(long, requires = "list")]
    pub(crate) measure: bool,
    /// Exit with status 3 when the mean relative error of any table exceeds this (0.01 or 1%).
    #[arg(long, value_name = "E", value_parser = parse_error)]
    pub(crate) max_error: Option<f64>,
    /// How many pairs of directions.
    #[arg(long, value_name = "N", default_value_t = DEFAULT_PAIRS as u32, value_parser = value_parser!(u32).range(1..=100_000_000))]
    pub(crate) pairs: u32,
    #[command(flatten)]
    pub(crate) draw: Draw,
    #[command(flatten)]
    workers: Workers,
    #[command(flatten)]
    pub(crate) print: Print,
}

pub(crate) fn run(args: &ValidateArgs) -> Result<Outcome> {
    use_workers(&args.workers)?;
    if let Some(list) = &args.list {
        let [folder] = &*args.tables else {
            let message = "--list checks one folder: `sateen validate DIR --list FILE`";
            return Err(Usage(message.to_owned()).into());
        };
        return verify::run(args, folder, list);
    }
    let mut tables = Vec::new();
    for path in &args.tables {
        if path.is_dir() {
            let message = format!(
                "{} is a folder: name tables, or with --list the list that it was baked from",
                path.display()
            );
            return Err(Usage(message).into());
        }
        let (table, file_bytes) = load_table(path)?;
        let (_, fabric) = provenance(&table, path)?;
        tables.push((path, table, file_bytes, fabric));
    }

    let mut bar = Bar::new(tables.len());
    let mut results = Vec::new();
    let mut exceeded = Vec::new();
    for (path, table, file_bytes, fabric) in &tables {
        bar.begin("measuring", &fabric.name);
        let report = |share: f64| bar.report(share);
        let error = measure_table(
            fabric,
            table,
            args.pairs as usize,
            args.draw.seed,
            Progress::new(&report),
        )?;
        if let Some(limit) = args.max_error.filter(|limit| !(error.all.mean <= *limit)) {
            let mean = 100.0 * error.all.mean;
            exceeded.push(format!(
                "{}: mean error {mean:.3} % exceeds {} %",
                path.display(),
                100.0 * limit
            ));
        }
        let physics = Physics::of(fabric);
        if args.print.json {
            results.push(json!({
                "path": path,
                "fabric": fabric.name,
                "decoded_bytes": table.decoded_bytes(),
                "file_bytes": file_bytes,
                "error": error,
                "physics": physics,
            }));
        } else {
            let sizes = sizes(table.decoded_bytes(), *file_bytes);
            let text = format!(
                "{}: {}, {sizes}\n{}  {physics}\n",
                path.display(),
                fabric.name,
                error_lines(&error)
            );
            bar.suspend(|| print(&text))?;
        }
    }
    drop(bar);
    if args.print.json {
        print_json("validate", json!({ "tables": results }))?;
    }
    for message in &exceeded {
        talk(message);
    }
    Ok(if exceeded.is_empty() {
        Outcome::Done
    } else {
        Outcome::OutOfTolerance
    })
}
