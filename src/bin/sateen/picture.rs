//! What `render`, `render scene` and `compare` do with pictures.

use std::path::Path;

use anyhow::{Result, bail};
use clap::value_parser;
use sateen::evaluator::{Cloth, Missing};
use sateen::model::Rule;
use sateen::pattern::Transfer;
use sateen::render::Comparison;
use serde_json::{Value, json};

use crate::args::{Strict, parse_within};
use crate::output::{Usage, counted, say};

/// How fabrics are evaluated unless told otherwise: no error can be seen, and a picture takes seconds.
pub(crate) const RULE: Rule = Rule::Quadrature(8);

/// How large and how bright pictures are.
#[derive(clap::Args)]
pub(crate) struct SizeArgs {
    /// Rows of the picture. It has as many columns, but twice as many for cylinders.
    #[arg(long, value_name = "N", default_value_t = 512, value_parser = value_parser!(u16).range(1..=4096))]
    pub(crate) size: u16,
    /// Samples per pixel.
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = value_parser!(u32).range(1..=4096))]
    pub(crate) samples: u32,
    /// Stops by which a PNG is brighter.
    #[arg(long, value_name = "EV", default_value_t = 0.0, value_parser = parse_stops, allow_negative_numbers = true)]
    pub(crate) exposure: f64,
    /// The curve of a PNG: srgb, or 2.2 for the power 1/2.2 as the thesis has it.
    #[arg(long, value_name = "CURVE", default_value = "srgb", value_parser = parse_transfer)]
    pub(crate) transfer: Transfer,
}

fn parse_transfer(text: &str) -> Result<Transfer, String> {
    match text {
        "srgb" => Ok(Transfer::Srgb),
        "2.2" => Ok(Transfer::Power(2.2)),
        _ => Err("it is srgb or 2.2".to_owned()),
    }
}

fn parse_stops(text: &str) -> Result<f64, String> {
    parse_within(text, -64.0..=64.0, "stops")
}

/// Says that highlights are cut off, if they are.
pub(crate) fn say_clipped(clipped: usize, of: usize) {
    if clipped > 0 {
        say(&format!(
            "{} of {of} brighter than white, and clipped; lower --exposure, or write an EXR",
            counted(clipped, "pixel")
        ));
    }
}

#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Format {
    Png,
    Exr,
}

impl Format {
    pub(crate) fn of(path: &Path) -> Result<Self> {
        let extension = path.extension().map(|end| end.to_ascii_lowercase());
        match extension.as_deref().and_then(|end| end.to_str()) {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            _ => {
                let message = format!(
                    "-o {}: a picture's name ends in .png or .exr",
                    path.display()
                );
                Err(Usage(message).into())
            }
        }
    }
}

/// What happens to pairs that tables were not baked for.
#[derive(clap::Args)]
pub(crate) struct MissingArgs {
    /// Show in magenta where tables lack pairs.
    #[arg(long)]
    show_missing: bool,
    #[command(flatten)]
    strict: Strict,
}

impl MissingArgs {
    /// What pictures show.
    pub(crate) fn shown(&self) -> Missing {
        if self.show_missing {
            Missing::Magenta
        } else {
            Missing::Nearest
        }
    }

    /// Complains if there are no tables that could lack anything.
    pub(crate) fn check<'a>(&self, mut cloths: impl Iterator<Item = &'a Cloth>) -> Result<()> {
        if (self.show_missing || self.strict.strict) && !cloths.any(Cloth::has_tables) {
            let message = "--show-missing and --strict are for tables, but no table is used; render a table, or give --tables DIR";
            return Err(Usage(message.to_owned()).into());
        }
        Ok(())
    }

    /// How many pairs the tables were not baked for; an error if there are any and `--strict` is given.
    pub(crate) fn count<'a>(&self, cloths: impl Iterator<Item = &'a Cloth>) -> Result<usize> {
        let misses = cloths.map(Cloth::misses).sum();
        if self.strict.strict && misses > 0 {
            bail!(
                "the tables were asked for {misses} pairs that they were not baked for; bake them for this scene, or without --scene"
            );
        }
        Ok(misses)
    }
}

/// How far two pictures of these names are apart.
pub(crate) fn comparison_json([a, b]: [&str; 2], comparison: &Comparison) -> Value {
    json!({
        "a": a,
        "b": b,
        "flip": { "mean": comparison.flip_mean, "max": comparison.flip_max },
        "rmse": comparison.rmse,
        "mean_relative_error": comparison.mean_relative_error,
    })
}

/// The same, for people.
pub(crate) fn comparison_text([a, b]: [&str; 2], comparison: &Comparison) -> String {
    let Comparison {
        flip_mean,
        flip_max,
        rmse,
        mean_relative_error,
        ..
    } = comparison;
    format!(
        "{a} against {b}\n  FLIP                 mean {flip_mean:.5}, at most {flip_max:.4}\n  RMSE                 {rmse:.3e}\n  mean relative error  {:.3} %\n",
        100.0 * mean_relative_error
    )
}
