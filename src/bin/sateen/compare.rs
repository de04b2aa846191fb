//! `sateen compare`

use std::path::{Path, PathBuf};

use anyhow::{Context, Error, Result, bail};
use sateen::pattern::MAX_IMAGE_BYTES;
use sateen::render::{Picture, compare};

use crate::Outcome;
use crate::args::{Print, parse_share};
use crate::guidance::Looks;
use crate::output::{Usage, print, print_json, talk};
use crate::picture::{comparison_json, comparison_text};
use crate::subject::read;

/// Tell how far a picture, such as an engine's screenshot, looks from one that is right.
///
/// PNG or EXR files of the same size, camera and framing. A PNG is sRGB, unless a gAMA chunk without an sRGB chunk says
/// otherwise, without other tone mapping; of an EXR of several layers the first is read. What is transparent in both is left out; a picture that is opaque all
/// over has a black background, or none.
#[derive(clap::Args)]
pub(crate) struct CompareArgs {
    /// The picture.
    picture: PathBuf,
    /// The truth.
    truth: PathBuf,
    /// The most mean FLIP, from 0 to 1; beyond it the exit status is 3.
    #[arg(long, value_name = "E", value_parser = parse_share)]
    max_flip: Option<f64>,
    #[command(flatten)]
    print: Print,
}

pub(crate) fn run(args: &CompareArgs) -> Result<Outcome> {
    let [a, b] = [load(&args.picture)?, load(&args.truth)?];
    let names = [&args.picture, &args.truth].map(|path| path.to_string_lossy());
    let names = names.each_ref().map(|name| &**name);
    if (a.width, a.height) != (b.width, b.height) {
        bail!(
            "{} has {} × {} pixels, but {} has {} × {}; make both of the same size",
            names[0],
            a.width,
            a.height,
            names[1],
            b.width,
            b.height
        );
    }
    if [&a, &b].iter().all(|picture| is_empty(picture)) {
        bail!("{} and {} show nothing", names[0], names[1]);
    }
    let comparison = compare(&a, &b, 0.0);
    if args.print.json {
        print_json("compare", comparison_json(names, &comparison))?;
    } else {
        print(&comparison_text(names, &comparison))?;
    }
    match args.max_flip {
        Some(most) if !(comparison.flip_mean <= most) => {
            let flip = comparison.flip_mean;
            talk(&format!("{}: mean FLIP {flip:.5} exceeds {most}", names[0]));
            Ok(Outcome::OutOfTolerance)
        }
        _ => Ok(Outcome::Done),
    }
}

/// Without a background that is transparent, what is black is the background: screenshots have no other.
fn load(path: &Path) -> Result<Picture> {
    let name = path.to_string_lossy();
    match Looks::of(&name) {
        None | Some(Looks::Picture) => {}
        Some(looks) => {
            let message = format!(
                "{name} is {}, not a picture: `sateen render sphere FABRIC --compare A B -o FILE` renders and compares evaluators",
                looks.name()
            );
            return Err(Usage(message).into());
        }
    }
    let bytes = read(path, MAX_IMAGE_BYTES as u64)?;
    let mut picture = Picture::from_bytes(&bytes)
        .map_err(Error::msg)
        .with_context(|| format!("cannot read the picture {}", path.display()))?;
    if picture.pixels.iter().all(|pixel| pixel[3] == 1.0) {
        for pixel in &mut picture.pixels {
            pixel[3] = f32::from(u8::from(pixel[..3] != [0.0; 3]));
        }
    }
    Ok(picture)
}

fn is_empty(picture: &Picture) -> bool {
    picture.pixels.iter().all(|pixel| pixel[3] == 0.0)
}
