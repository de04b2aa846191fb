//! `sateen render scene`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use anyhow::{Context, Result};
use clap::value_parser;
use sateen::evaluator::{Cloth, Evaluator, Missing};
use sateen::fabric::Fabric;
use sateen::needs::Needs;
use sateen::progress::Progress;
use sateen::render::{Display, Layer, Picture, to_exr};
use sateen::scene::{Material, Pose, Scene, Stage};
use serde_json::json;

use crate::Outcome;
use crate::args::{Print, Workers};
use crate::cloth::table_in;
use crate::output::{Bar, Output, counted, print, print_json, use_workers};
use crate::picture::{Format, MissingArgs, RULE, SizeArgs, say_clipped};
use crate::scene::load_scene;

/// How a picture of a scene is taken.
#[derive(clap::Args)]
pub(crate) struct StageArgs {
    /// A TOML, glTF or GLB file.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// The picture to write, which ends in .png or .exr.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// The folder of the tables to take it with: what `bake --scene SCENE -o DIR` wrote [default: fabrics are integrated directly].
    #[arg(long, value_name = "DIR")]
    tables: Option<PathBuf>,
    /// Also take it with the tables in this folder, and say how many pixels differ; the exit status is 3 if any do.
    #[arg(long, value_name = "DIR", requires = "tables")]
    against: Option<PathBuf>,
    /// How many pictures to take, each from a camera, with lights and in a state drawn anew within their ranges; the last is
    /// written [default: one, in the middle of all ranges].
    #[arg(long, value_name = "N", value_parser = value_parser!(u32).range(1..=1_000_000))]
    draws: Option<u32>,
    /// The first of the seeds that draw them.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "draws")]
    seed: u64,
    #[command(flatten)]
    missing: MissingArgs,
    /// Write the pairs that the pictures ask for, by cloth, into this folder, as recordings for `bake --needs`.
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    #[command(flatten)]
    view: SizeArgs,
    #[command(flatten)]
    print: Print,
    #[command(flatten)]
    workers: Workers,
}

pub(crate) fn run(args: &StageArgs) -> Result<Outcome> {
    use_workers(&args.workers)?;
    let format = Format::of(&args.output)?;
    let scene = load_scene(&args.scene)?;
    let cloths = wardrobe(&scene, args.tables.as_deref(), args.missing.shown())?;
    args.missing.check(cloths.values())?;
    let other = match &args.against {
        Some(folder) => Some(wardrobe(&scene, Some(folder), Missing::Nearest)?),
        None => None,
    };
    let output = Output::prepare(&args.output)?;
    let poses: Vec<Pose> = match args.draws {
        Some(draws) => (0..u64::from(draws))
            .map(|k| scene.pose(args.seed + k))
            .collect(),
        None => vec![scene.default_pose()],
    };
    let stage = Stage::new(&scene);
    let mut bar = Bar::new(poses.len());
    let (mut pixels, mut different, mut last) = (0, 0, None);
    let mut recorded: BTreeMap<String, Needs> = BTreeMap::new();
    for (index, pose) in poses.iter().enumerate() {
        bar.begin(
            "taking",
            &format!("picture {} of {}", index + 1, scene.name),
        );
        let report = |share: f64| bar.report(share);
        let progress = Progress::new(&report);
        let take = |cloths: &BTreeMap<String, Cloth>, progress: Progress<'_>| {
            let size = args.view.size.into();
            stage.picture(pose, cloths, size, args.view.samples, true, progress)
        };
        let picture = take(&cloths, progress.part(0.0, 0.5))?;
        if let Some(other) = &other {
            let differs =
                |(a, b): (&[f32; 4], &[f32; 4])| a.map(f32::to_bits) != b.map(f32::to_bits);
            let others = take(other, progress.part(0.5, 1.0))?;
            let pairs = picture.pixels.iter().zip(&others.pixels);
            pixels += picture.pixels.len();
            different += pairs.filter(|pair| differs(*pair)).count();
        }
        if args.record.is_some() {
            for (cloth, pairs) in stage.pairs(pose, args.view.size.into(), args.view.samples) {
                let needs = recorded.entry(cloth).or_insert_with(Needs::none);
                for [wi, wr] in pairs {
                    needs.add_pair(wi, wr);
                }
            }
        }
        last = Some(picture);
    }
    drop(bar);
    let picture = last.context("no picture was taken")?;
    let misses = args.missing.count(cloths.values())?;
    output.write(&encode(&picture, format, &scene, args)?)?;
    if let Some(folder) = &args.record {
        for (cloth, needs) in &recorded {
            let name = Path::new(cloth).file_stem().unwrap_or_default();
            let path = folder.join(name).with_extension("needs");
            Output::prepare(&path)?.write(&needs.to_bytes())?;
        }
    }
    let misses_of = |cloths: &BTreeMap<String, Cloth>| cloths.values().map(Cloth::misses).sum();
    let of_other: Option<usize> = other.as_ref().map(misses_of);
    if args.print.json {
        let json = json!({
            "scene": scene.name,
            "pictures": poses.len(),
            "pixels_compared": pixels,
            "pixels_different": different,
            "misses": misses,
            "misses_of_other": of_other,
        });
        print_json("render-scene", json)?;
    } else if let Some(of_other) = of_other {
        print(&format!(
            "{}: {different} of {pixels} pixels of {} differ; {misses} and {of_other} pairs were not baked\n",
            scene.name,
            counted(poses.len(), "picture")
        ))?;
    } else if misses > 0 {
        print(&format!(
            "{}: {} not baked, the nearest value taken\n",
            scene.name,
            counted(misses, "pair")
        ))?;
    }
    Ok(if different > 0 {
        Outcome::OutOfTolerance
    } else {
        Outcome::Done
    })
}

fn encode(picture: &Picture, format: Format, scene: &Scene, args: &StageArgs) -> Result<Vec<u8>> {
    let notes = vec![
        ("scene", scene.name.clone()),
        ("samples", args.view.samples.to_string()),
    ];
    match format {
        Format::Png => {
            let notes = [notes, vec![("exposure", args.view.exposure.to_string())]].concat();
            let display = Display::of(picture, args.view.exposure, args.view.transfer);
            say_clipped(display.clipped, display.pixels.len());
            display.to_png(&notes).context("cannot encode the PNG")
        }
        Format::Exr => {
            let mut layer = Layer::of("scene", picture);
            layer.notes = notes;
            to_exr(&[layer], picture.width, false).context("cannot encode the EXR")
        }
    }
}

/// What the objects of a scene wear, by the name of the cloth.
fn wardrobe(
    scene: &Scene,
    tables: Option<&Path>,
    missing: Missing,
) -> Result<BTreeMap<String, Cloth>> {
    let evaluator = |fabric: &Fabric| match tables {
        None => Ok(Evaluator::rule(fabric, RULE)),
        Some(folder) => table_in(folder, fabric, missing, "bake the scene again"),
    };
    let mut cloths = BTreeMap::new();
    for object in &scene.objects {
        if cloths.contains_key(&object.cloth) {
            continue;
        }
        let cloth = match &object.material {
            Material::Fabric(fabric) => evaluator(fabric)?.into(),
            Material::Pattern(pattern) => {
                let evaluators = pattern.bakes().map(evaluator).collect::<Result<_>>()?;
                Cloth::pattern(Arc::clone(pattern), evaluators)
            }
        };
        cloths.insert(object.cloth.clone(), cloth);
    }
    Ok(cloths)
}
