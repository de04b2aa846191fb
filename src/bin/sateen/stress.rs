//! `sateen stress`

use anyhow::{Context, Result};
use sateen::fabric::Fabric;
use sateen::progress::Progress;
use sateen::stress::{Options, StressReport, stress};

use crate::Outcome;
use crate::args::StressArgs;
use crate::output::{Bar, print, say, use_threads};
use crate::subject::{load_fabric, report_folder, write_files};

/// What is tried unless told otherwise: narrow lobes, wide ones on two threads, and upright threads.
const FABRICS: [&str; 3] = ["polyester-lining", "denim", "velvet"];

pub(crate) fn run(args: &StressArgs) -> Result<Outcome> {
    use_threads(args.jobs)?;
    let names: Vec<String> = if args.fabrics.is_empty() {
        FABRICS.map(str::to_owned).to_vec()
    } else {
        args.fabrics.clone()
    };
    let load = |name: &String| load_fabric(name, args.variant.as_deref());
    let fabrics: Vec<Fabric> = names.iter().map(load).collect::<Result<_>>()?;
    let folder = report_folder(&fabrics, &args.output)?;
    let options = options(args);
    let mut report = StressReport::new(&options);

    let mut bar = Bar::new(fabrics.len());
    for fabric in &fabrics {
        bar.begin(&fabric.name);
        let share = |share: f64| bar.report(share);
        let done = stress(fabric, &options, Progress::new(&share))
            .with_context(|| format!("{} is not in the report", fabric.name))?;
        let summary = format!("{}\n", done.summary());
        report.fabrics.push(done);
        // What is done stays, whatever becomes of the rest.
        write_files(folder, report.files())?;
        bar.suspend(|| print(&summary))?;
    }
    drop(bar);
    say(&format!(
        "every case is in {}",
        folder.join("stress.csv").display()
    ));
    Ok(if report.holds() {
        Outcome::Done
    } else {
        Outcome::OutOfTolerance
    })
}

fn options(args: &StressArgs) -> Options {
    let mut options = if args.quick {
        Options::quick()
    } else {
        Options::default()
    };
    if let Some(presets) = &args.presets {
        options.presets = presets.iter().map(|preset| (*preset).into()).collect();
    }
    if args.no_tables {
        options.presets.clear();
    }
    if let Some(pairs) = args.pairs {
        options.pairs = pairs as usize;
    }
    options.seed = args.seed;
    options
}
