//! `sateen record`

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use sateen::needs::{MAX_NEEDS_BYTES, Needs};
use sateen::text::read_capped;

use crate::Outcome;
use crate::eval::read_pairs;
use crate::output::{Output, say};

/// Record pairs of directions that a program asked for, to bake only these.
///
/// Programs in Rust call `Needs::add_pair` and write `Needs::to_bytes`; others may write CSV.
#[derive(clap::Args)]
pub(crate) struct RecordArgs {
    /// CSV files of pairs, as `eval` reads them, or - for stdin; and recordings, which are joined.
    #[arg(value_name = "CSV|NEEDS", required = true)]
    inputs: Vec<PathBuf>,
    /// The recording to write, for `bake --needs`.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

pub(crate) fn run(args: &RecordArgs) -> Result<Outcome> {
    let output = Output::prepare(&args.output)?;
    // A recording may grow.
    output.is_none_of(
        args.inputs
            .iter()
            .map(|path| &**path)
            .filter(|path| !is_recording(path)),
    )?;
    let mut needs = Needs::none();
    for path in &args.inputs {
        if is_recording(path) {
            needs.join(&load_needs(path)?);
        } else {
            for [wi, wr] in read_pairs(path, &[])?.directions() {
                let single = |w: &[f64; 3]| w.map(|x| x as f32);
                needs.add_pair(single(wi), single(wr));
            }
        }
    }
    output.write(&needs.to_bytes())?;
    say(&format!(
        "{}: {:.2} % of all pairs of directions",
        args.output.display(),
        100.0 * needs.share()
    ));
    Ok(Outcome::Done)
}

fn is_recording(path: &Path) -> bool {
    path.extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("needs"))
}

/// A recording.
pub(crate) fn load_needs(path: &Path) -> Result<Needs> {
    let cannot = || format!("cannot read the recording {}", path.display());
    let bytes = read_capped(path, MAX_NEEDS_BYTES as u64).with_context(cannot)?;
    Needs::from_bytes(&bytes).with_context(cannot)
}
