//! `sateen fit`

use std::path::{Path, PathBuf};

use anyhow::Result;
use sateen::fabric::Models;
use sateen::fit::fit;
use sateen::model::ModelKind;
use sateen::progress::Progress;
use serde_json::json;

use crate::Outcome;
use crate::args::{Dye, Workers};
use crate::output::{Bar, Output, print, print_json, say, use_workers};
use crate::subject::load_fabric;

/// Fit another model to a fabric.
///
/// Prints the section of its parameters and says what the mean relative error is, measured as `validate` measures tables.
#[derive(clap::Args)]
pub(crate) struct FitArgs {
    /// The model to fit.
    #[arg(value_name = "MODEL", value_enum)]
    model: ModelKind,
    /// A name from the library, or a TOML file.
    #[arg(value_name = "FABRIC")]
    fabric: String,
    /// The TOML file to write: the whole fabric with the section [default: the section to stdout].
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    dye: Dye,
    #[command(flatten)]
    workers: Workers,
    /// Print the parameters and their error as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &FitArgs) -> Result<Outcome> {
    use_workers(&args.workers)?;
    let mut fabric = load_fabric(&args.fabric, args.dye.variant.as_deref())?;
    let output = args.output.as_deref().map(Output::prepare).transpose()?;
    if let Some(output) = &output {
        // Comments and other variants are not written.
        output.is_none_of([Path::new(&args.fabric)])?;
    }

    let mut bar = Bar::new(1);
    bar.begin(&format!("fitting {} to", args.model.name()), &fabric.name);
    let share = |share: f64| bar.report(share);
    let fit = fit(&fabric, args.model, Progress::new(&share))?;
    drop(bar);
    say(&format!(
        "{} of {}: relative error {:.1} % on average, {:.1} % at the 99th percentile",
        args.model.name(),
        fabric.name,
        100.0 * fit.error.all.mean,
        100.0 * fit.error.all.p99
    ));
    if args.json {
        let parameters: toml::Table = toml::from_str(&fit.models.to_toml())?;
        let json = json!({
            "fabric": fabric.name,
            "model": args.model.name(),
            "parameters": parameters,
            "error": fit.error,
        });
        print_json("fit", json)?;
    } else if output.is_none() {
        print(fit.models.to_toml().trim_start())?;
    }
    if let Some(output) = output {
        take(args.model, &mut fabric.models, fit.models);
        output.write(fabric.to_toml().as_bytes())?;
    }
    Ok(Outcome::Done)
}

/// Puts the fitted model into the fabric's, and leaves the others.
fn take(kind: ModelKind, models: &mut Models, fitted: Models) {
    match kind {
        ModelKind::Lambert => models.lambert = fitted.lambert,
        ModelKind::OrenNayar => models.oren_nayar = fitted.oren_nayar,
        ModelKind::TorranceSparrow => models.torrance_sparrow = fitted.torrance_sparrow,
        ModelKind::Irawan => models.irawan = fitted.irawan,
    }
}
