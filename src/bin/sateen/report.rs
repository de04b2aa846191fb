//! `sateen report`

use std::path::Path;

use anyhow::{Context, Result};
use sateen::fabric::{Fabric, LIBRARY, LibraryEntry};
use sateen::progress::Progress;
use sateen::report::{Options, Report, measure};

use crate::Outcome;
use crate::args::ReportArgs;
use crate::output::{Bar, Output, Usage, print, say, use_threads};
use crate::subject::load_fabric;

pub(crate) fn run(args: &ReportArgs) -> Result<Outcome> {
    use_threads(args.jobs)?;
    let fabrics: Vec<Fabric> = if args.fabrics.is_empty() {
        LIBRARY.iter().map(LibraryEntry::load).collect()
    } else {
        let load = |name: &String| load_fabric(name, args.variant.as_deref());
        args.fabrics.iter().map(load).collect::<Result<_>>()?
    };
    for (index, fabric) in fabrics.iter().enumerate() {
        if fabrics[..index]
            .iter()
            .any(|other| other.name == fabric.name)
        {
            let message = format!(
                "two fabrics are called {}, and their plots would be the same files",
                fabric.name
            );
            return Err(Usage(message).into());
        }
    }
    let folder = args.output.as_path();
    if folder.is_file() {
        let message = format!(
            "-o {}: a report needs a folder, but this is a file",
            folder.display()
        );
        return Err(Usage(message).into());
    }
    let options = options(args);
    let mut report = Report::new(&options);
    // Before the work, to find out whether the folder can be written to.
    Output::prepare(&folder.join("index.html"))?;

    let mut bar = Bar::new(fabrics.len());
    for fabric in &fabrics {
        bar.begin(&fabric.name);
        let share = |share: f64| bar.report(share);
        let done = measure(fabric, &options, Progress::new(&share))
            .with_context(|| format!("{} is not in the report", fabric.name))?;
        let summary = format!("{}: {}\n", fabric.name, done.summary());
        report.fabrics.push(done);
        // What is done stays, whatever becomes of the rest.
        write(&report, folder)?;
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
    if let Some(sizes) = &args.sizes {
        options.sizes.clone_from(sizes);
    }
    if let Some(pairs) = args.pairs {
        options.pairs = pairs as usize;
    }
    options.seed = args.seed;
    options
}

fn write(report: &Report, folder: &Path) -> Result<()> {
    for (name, text) in report.files() {
        Output::prepare(&folder.join(name))?.write(text.as_bytes())?;
    }
    Ok(())
}
