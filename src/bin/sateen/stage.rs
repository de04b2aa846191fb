//! `sateen render scene`

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use sateen::fabric::Fabric;
use sateen::model::{Rule, Sadeghi};
use sateen::needs::Needs;
use sateen::progress::Progress;
use sateen::render::{Cloth, Display, Layer, Missing, Picture, Swatch, to_exr};
use sateen::scene::{Material, Pose, Scene, Stage};
use sateen::table::Table;
use serde_json::json;

use crate::Outcome;
use crate::args::{MissingArgs, StageArgs};
use crate::output::{Bar, Output, Usage, print, print_json, use_threads};
use crate::render::{Format, table_of};
use crate::scene::load_scene;

/// How fabrics are evaluated without tables.
const RULE: Rule = Rule::Quadrature(8);

pub(crate) fn run(args: &StageArgs) -> Result<Outcome> {
    use_threads(args.jobs)?;
    let format = Format::of(&args.output)?;
    let scene = load_scene(&args.scene)?;
    let wardrobe = Wardrobe::load(&scene, args.tables.as_deref(), args.missing.shown())?;
    args.missing.check(&wardrobe.tables)?;
    let other = match &args.against {
        Some(folder) => Some(Wardrobe::load(&scene, Some(folder), Missing::Nearest)?),
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
        bar.begin(&format!("{} {}", scene.name, index + 1));
        let report = |share: f64| bar.report(share);
        let progress = Progress::new(&report);
        let take = |wardrobe: &Wardrobe, progress: Progress<'_>| {
            let size = args.size.into();
            stage.picture(pose, &wardrobe.cloths, size, args.samples, true, progress)
        };
        let picture = take(&wardrobe, progress.part(0.0, 0.5))?;
        if let Some(other) = &other {
            let differs =
                |(a, b): (&[f32; 4], &[f32; 4])| a.map(f32::to_bits) != b.map(f32::to_bits);
            let others = take(other, progress.part(0.5, 1.0))?;
            let pairs = picture.pixels.iter().zip(&others.pixels);
            pixels += picture.pixels.len();
            different += pairs.filter(|pair| differs(*pair)).count();
        }
        if args.record.is_some() {
            for (cloth, pairs) in stage.pairs(pose, args.size.into(), args.samples) {
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
    let misses = args.missing.count(&wardrobe.tables)?;
    output.write(&encode(&picture, format, &scene, args)?)?;
    if let Some(folder) = &args.record {
        for (cloth, needs) in &recorded {
            let name = Path::new(cloth).file_stem().unwrap_or_default();
            let path = folder.join(name).with_extension("needs");
            Output::prepare(&path)?.write(&needs.to_bytes())?;
        }
    }
    let of_other = other.as_ref().map(|other| misses_of(&other.tables));
    if args.json {
        print_json(&json!({
            "scene": scene.name,
            "pictures": poses.len(),
            "pixels_compared": pixels,
            "pixels_different": different,
            "misses": misses,
            "misses_of_other": of_other,
        }))?;
    } else if let Some(of_other) = of_other {
        print(&format!(
            "{}: {different} of {pixels} pixels of {} pictures differ; {misses} and {of_other} pairs were not baked\n",
            scene.name,
            poses.len()
        ))?;
    } else if misses > 0 {
        print(&format!(
            "{}: {misses} pairs were not baked, and have the nearest value\n",
            scene.name
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
        ("samples", args.samples.to_string()),
    ];
    match format {
        Format::Png => {
            let notes = [notes, vec![("exposure", args.exposure.to_string())]].concat();
            let display = Display::of(picture, args.exposure);
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
struct Wardrobe {
    cloths: BTreeMap<String, Cloth>,
    tables: Vec<Arc<Table>>,
}

impl Wardrobe {
    fn load(scene: &Scene, tables: Option<&Path>, missing: Missing) -> Result<Self> {
        let mut wardrobe = Self {
            cloths: BTreeMap::new(),
            tables: Vec::new(),
        };
        for object in &scene.objects {
            if wardrobe.cloths.contains_key(&object.cloth) {
                continue;
            }
            let mut table_in = |folder: &Path, fabric: &Fabric| {
                let table = table_of(fabric, &folder.join(format!("{}.sateen", fabric.name)))?;
                wardrobe.tables.push(Arc::clone(&table));
                Ok(table)
            };
            let cloth = match (&object.material, tables) {
                (Material::Fabric(fabric), None) => Cloth::direct(Sadeghi::new(fabric, RULE)),
                (Material::Fabric(fabric), Some(folder)) => {
                    let table = table_in(folder, fabric)?;
                    let single = |albedo: [f64; 3]| albedo.map(|channel| channel as f32);
                    let threads = fabric.visible_threads();
                    let albedos = threads.map(|thread| single(thread.albedo)).collect();
                    Cloth::table(table, albedos, missing)
                }
                (Material::Pattern(pattern), tables) => {
                    let swatch = |fabric: &Fabric| match tables {
                        None => Ok(Swatch::Direct(Box::new(Sadeghi::new(fabric, RULE)))),
                        Some(folder) => {
                            table_in(folder, fabric).map(|table| Swatch::Table(table, missing))
                        }
                    };
                    let swatches = pattern.bakes().map(swatch).collect::<Result<_>>()?;
                    Cloth::Pattern(Arc::clone(pattern), swatches)
                }
            };
            wardrobe.cloths.insert(object.cloth.clone(), cloth);
        }
        Ok(wardrobe)
    }
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
    pub(crate) fn check(&self, tables: &[Arc<Table>]) -> Result<()> {
        if (self.show_missing || self.strict) && tables.is_empty() {
            let message = "--show-missing and --strict are for tables, and none is looked up; render a table, or give --tables DIR";
            return Err(Usage(message.to_owned()).into());
        }
        Ok(())
    }

    /// How many pairs the tables were not baked for; an error if there are any and `--strict` is given.
    pub(crate) fn count(&self, tables: &[Arc<Table>]) -> Result<usize> {
        let misses = misses_of(tables);
        if self.strict && misses > 0 {
            bail!(
                "{misses} pairs were asked of tables that were not baked for them; bake them for this scene, or without --scene"
            );
        }
        Ok(misses)
    }
}

fn misses_of(tables: &[Arc<Table>]) -> usize {
    tables.iter().map(|table| table.misses()).sum()
}
