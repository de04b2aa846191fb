//! `sateen validate`

use anyhow::Result;
use sateen::metrics::{Physics, measure_table};
use sateen::progress::Progress;
use serde_json::{Value, json};

use crate::Outcome;
use crate::args::ValidateArgs;
use crate::output::{Bar, error_lines, print, print_json, sizes, talk, use_threads};
use crate::subject::{load_table, provenance};

pub(crate) fn run(args: &ValidateArgs) -> Result<Outcome> {
    use_threads(args.jobs)?;
    let mut tables = Vec::new();
    for path in &args.tables {
        let (table, file_bytes) = load_table(path)?;
        let (_, fabric) = provenance(&table, path)?;
        tables.push((path, table, file_bytes, fabric));
    }

    let mut bar = Bar::new(tables.len());
    let mut results = Vec::new();
    let mut exceeded = Vec::new();
    for (path, table, file_bytes, fabric) in &tables {
        bar.begin(&fabric.name);
        let report = |share: f64| bar.report(share);
        let error = measure_table(
            fabric,
            table,
            args.pairs as usize,
            args.seed,
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
        if args.json {
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
    if args.json {
        print_json(&Value::from(results))?;
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
