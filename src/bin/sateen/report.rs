//! `sateen report`

use anyhow::{Context, Result};
use sateen::fabric::{Fabric, LIBRARY, LibraryEntry};
use sateen::progress::Progress;
use sateen::report::{Options, Report, measure};

use crate::Outcome;
use crate::args::ReportArgs;
use crate::output::{Bar, print, say, use_threads};
use crate::subject::{load_fabric, report_folder, write_files};

pub(crate) fn run(args: &ReportArgs) -> Result<Outcome> {
    use_threads(args.jobs)?;
    let fabrics: Vec<Fabric> = if args.fabrics.is_empty() {
        LIBRARY.iter().map(LibraryEntry::load).collect()
    } else {
        let load = |name: &String| load_fabric(name, args.variant.as_deref());
        args.fabrics.iter().map(load).collect::<Result<_>>()?
    };
    let folder = report_folder(&fabrics, &args.output)?;
    let options = options(args);
    let mut report = Report::new(&options);

    let mut bar = Bar::new(fabrics.len());
    for fabric in &fabrics {
        bar.begin(&fabric.name);
        let share = |share: f64| bar.report(share);
        let done = measure(fabric, &options, Progress::new(&share))
            .with_context(|| format!("{} is not in the report", fabric.name))?;
        let summary = format!("{}: {}\n", fabric.name, done.summary());
        report.fabrics.push(done);
        // What is done stays, whatever becomes of the rest.
        write_files(folder, report.files())?;
        bar.suspend(|| print(&summary))?;
    }
    drop(bar);
    say(&format!(
        "the report is {}",
        folder.join("index.html").display()
    ));
    Ok(Outcome::Done)
}

fn options(args: &ReportArgs) -> Options {
    let mut options = if args.quick {
        Options::quick()
    } else {
        Options::default()
    };
    if let Some(presets) = &args.presets {
        options.presets = presets.iter().map(|preset| (*preset).into()).collect();
    }
    if args.no_sweep {
        options.sizes.clear();
        options.encodings.clear();
    }
    if args.no_fits {
        options.fits.clear();
    }
    if let Some(sizes) = &args.sizes {
        options.sizes.clone_from(sizes);
    }
    if let Some(pairs) = args.pairs {
        options.pairs = pairs as usize;
    }
    options.seed = args.seed;
    options
}
