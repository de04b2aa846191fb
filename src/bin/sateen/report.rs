//! `sateen report`

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::value_parser;
use sateen::bake::Preset;
use sateen::fabric::{Fabric, LIBRARY, LibraryEntry};
use sateen::progress::Progress;
use sateen::report::{Options, Report, measure};

use crate::Outcome;
use crate::args::{Draw, Dye, Workers, parse_size};
use crate::output::{Bar, print, say, use_workers};
use crate::subject::{load_fabric, report_folder, write_files};

/// Measure error, time and bytes of every evaluator.
///
/// Writes index.html, report.csv, report.json and plots. Every number of midpoints and every table is measured on the same
/// pairs, in turn and on one core; the figure to quote is the ratio to midpoint:50 in the same run. Other work is shared by all
/// workers.
#[derive(clap::Args)]
pub(crate) struct ReportArgs {
    /// Names from the library, or TOML files [default: the whole library].
    #[arg(value_name = "FABRIC")]
    fabrics: Vec<String>,
    /// The folder to write to.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// A rough report within seconds: few evaluators, a draft table, 512 pairs, one round of timing.
    #[arg(long)]
    quick: bool,
    /// Presets to bake, with commas between them [default: all; fine takes minutes per fabric].
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    presets: Option<Vec<Preset>>,
    /// Other sizes in memory to bake, such as 64KiB,16MiB, with a grid for every thread [default: 64KiB,256KiB,1MiB,4MiB,16MiB].
    #[arg(long, value_delimiter = ',', value_parser = parse_size, value_name = "LIST")]
    sizes: Option<Vec<usize>>,
    /// Bake only the sizes of the presets.
    #[arg(long, conflicts_with = "sizes")]
    no_sweep: bool,
    /// Fit no other models, which takes up to half a minute per fabric.
    #[arg(long)]
    no_fits: bool,
    #[command(flatten)]
    dye: Dye,
    /// How many pairs of directions [default: 65536].
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=10_000_000))]
    pairs: Option<u32>,
    #[command(flatten)]
    draw: Draw,
    #[command(flatten)]
    workers: Workers,
}

pub(crate) fn run(args: &ReportArgs) -> Result<Outcome> {
    use_workers(&args.workers)?;
    let fabrics: Vec<Fabric> = if args.fabrics.is_empty() {
        LIBRARY.iter().map(LibraryEntry::load).collect()
    } else {
        let load = |name: &String| load_fabric(name, args.dye.variant.as_deref());
        args.fabrics.iter().map(load).collect::<Result<_>>()?
    };
    let folder = report_folder(&fabrics, &args.output, "index.html")?;
    let options = options(args);
    let mut report = Report::new(&options);

    let mut bar = Bar::new(fabrics.len());
    for fabric in &fabrics {
        bar.begin("measuring", &fabric.name);
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
        options.presets.clone_from(presets);
    }
    if args.no_sweep {
        options.sizes.clear();
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
    options.seed = args.draw.seed;
    options
}
