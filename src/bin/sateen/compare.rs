//! `sateen compare`

use std::path::Path;

use anyhow::{Context, Error, Result, bail};
use sateen::pattern::MAX_IMAGE_BYTES;
use sateen::render::{Picture, compare};

use crate::Outcome;
use crate::args::CompareArgs;
use crate::output::{print, print_json};
use crate::render::{comparison_json, comparison_text};
use crate::subject::read;

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
    let comparison = compare(&a, &b, 0.0);
    if args.json {
        print_json(&comparison_json(names, &comparison))?;
    } else {
        print(&comparison_text(names, &comparison))?;
    }
    match args.max_flip {
        Some(most) if comparison.flip_mean > most => Ok(Outcome::OutOfTolerance),
        _ => Ok(Outcome::Done),
    }
}

/// What is black covers nothing, as the background of a screenshot.
fn load(path: &Path) -> Result<Picture> {
    let bytes = read(&path.to_string_lossy(), MAX_IMAGE_BYTES as u64)?;
    let mut picture = Picture::from_bytes(&bytes)
        .map_err(Error::msg)
        .with_context(|| format!("cannot read the picture {}", path.display()))?;
    for pixel in &mut picture.pixels {
        if pixel[..3] == [0.0; 3] {
            pixel[3] = 0.0;
        }
    }
    Ok(picture)
}
