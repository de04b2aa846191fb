//! `sateen stress`

use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::value_parser;
use sateen::bake::Preset;
use sateen::fabric::Fabric;
use sateen::progress::Progress;
use sateen::stress::{Options, StressReport, stress};

use crate::Outcome;
use crate::args::{Draw, Dye, Print, Workers};
use crate::output::{Bar, print, print_json, say, use_workers};
use crate::subject::{load_fabric, report_folder, write_files};

/// What is tried unless told otherwise: narrow lobes, wide ones on two threads, and upright threads.
const FABRICS: [&str; 3] = ["polyester-lining", "denim", "velvet"];

/// Try every evaluator on extreme fabrics and directions.
///
/// Drives each parameter of a fabric to its extremes, asks at directions that are hard, and writes stress.csv and stress.json: what
/// is finite, how far single precision is from double, where values step, and whether tables keep their preset's promise. The exit
/// status is 3 if a case fails.
#[derive(clap::Args)]
pub(crate) struct StressArgs {
    /// Names from the library, or TOML files [default: polyester-lining, denim and velvet].
    #[arg(value_name = "FABRIC")]
    fabrics: Vec<String>,
    /// The folder to write to.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// A rough report within a minute: three values of each parameter, few pairs, and no tables unless --presets says so.
    #[arg(long)]
    quick: bool,
    /// Presets to bake in every case, with commas between them [default: draft,standard, which take an hour per fabric].
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    presets: Option<Vec<Preset>>,
    /// Bake no tables: they take most of the time.
    #[arg(long, conflicts_with = "presets")]
    no_tables: bool,
    #[command(flatten)]
    dye: Dye,
    /// How many pairs of each geometry [default: 200].
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    pairs: Option<u32>,
    #[command(flatten)]
    draw: Draw,
    #[command(flatten)]
    workers: Workers,
    #[command(flatten)]
    print: Print,
}

pub(crate) fn run(args: &StressArgs) -> Result<Outcome> {
    use_workers(&args.workers)?;
    let names: Vec<String> = if args.fabrics.is_empty() {
        FABRICS.map(str::to_owned).to_vec()
    } else {
        args.fabrics.clone()
    };
    let load = |name: &String| load_fabric(name, args.dye.variant.as_deref());
    let fabrics: Vec<Fabric> = names.iter().map(load).collect::<Result<_>>()?;
    let folder = report_folder(&fabrics, &args.output, "stress.csv")?;
    let options = options(args);
    let mut report = StressReport::new(&options);

    let mut bar = Bar::new(fabrics.len());
    for fabric in &fabrics {
        bar.begin("trying", &fabric.name);
        let share = |share: f64| bar.report(share);
        let done = stress(fabric, &options, Progress::new(&share))
            .with_context(|| format!("{} is not in the report", fabric.name))?;
        let summary = format!("{}\n", done.summary());
        report.fabrics.push(done);
        // What is done stays, whatever becomes of the rest.
        write_files(folder, report.files())?;
        if !args.print.json {
            bar.suspend(|| print(&summary))?;
        }
    }
    drop(bar);
    if args.print.json {
        print_json("stress", serde_json::to_value(&report)?)?;
    }
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
        options.presets.clone_from(presets);
    }
    if args.no_tables {
        options.presets.clear();
    }
    if let Some(pairs) = args.pairs {
        options.pairs = pairs as usize;
    }
    options.seed = args.draw.seed;
    options
}
