//! `sateen render scene`

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use sateen::fabric::Fabric;
use sateen::model::{Rule, Sadeghi};
use sateen::needs::Needs;
use sateen::progress::Progress;
use sateen::render::{Cloth, Display, Layer, Picture, Swatch, to_exr};
use sateen::scene::{Material, Pose, Scene, Stage};
use sateen::table::Table;
use serde_json::json;

use crate::Outcome;
use crate::args::StageArgs;
use crate::output::{Bar, Output, Usage, print, print_json, use_threads};
use crate::render::{Format, table_of};
use crate::scene::load_scene;

/// How fabrics are evaluated without tables.
const RULE: Rule = Rule::Quadrature(8);

pub(crate) fn run(args: &StageArgs) -> Result<Outcome> {
    use_threads(args.jobs)?;
    let format = Format::of(&args.output)?;
    let scene = load_scene(&args.scene)?;
    let wardrobe = Wardrobe::load(&scene, args.tables.as_deref(), args.show_missing)?;
    let other = match &args.against {
        Some(folder) => Some(Wardrobe::load(&scene, Some(folder), false)?),
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
    let misses = wardrobe.misses();
    if args.strict && misses > 0 {
        bail!(
            "{misses} pairs were asked of tables that were not baked for them; bake them for this scene, or without --scene"
        );
    }
    output.write(&encode(&picture, format, &scene, args)?)?;
    if let Some(folder) = &args.record {
        for (cloth, needs) in &recorded {
            let name = Path::new(cloth).file_stem().unwrap_or_default();
            let path = folder.join(name).with_extension("needs");
            Output::prepare(&path)?.write(&needs.to_bytes())?;
        }
    }
    let of_other = other.as_ref().map(Wardrobe::misses);
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
    /// Tables of fabrics …
    tables: Vec<Arc<Table>>,
    /// … and of patterns.
    swatches: Vec<Arc<[Swatch]>>,
}

impl Wardrobe {
    fn load(scene: &Scene, tables: Option<&Path>, shows_missing: bool) -> Result<Self> {
        let mut wardrobe = Self {
            cloths: BTreeMap::new(),
            tables: Vec::new(),
            swatches: Vec::new(),
        };
        for object in &scene.objects {
            if wardrobe.cloths.contains_key(&object.cloth) {
                continue;
            }
            let cloth = match (&object.material, tables) {
                (Material::Fabric(fabric), None) => Cloth::direct(Sadeghi::new(fabric, RULE)),
                (Material::Fabric(fabric), Some(folder)) => {
                    let table = Arc::new(*table_in(folder, fabric)?);
                    wardrobe.tables.push(Arc::clone(&table));
                    let single = |albedo: [f64; 3]| albedo.map(|channel| channel as f32);
                    let threads = fabric.visible_threads();
                    let albedos = threads.map(|thread| single(thread.albedo)).collect();
                    if shows_missing {
                        Cloth::tinted(table, albedos)
                    } else {
                        Cloth::shared(table, albedos)
                    }
                }
                (Material::Pattern(_), Some(_)) if shows_missing => {
                    let message = format!(
                        "--show-missing is for fabrics, but {} is a pattern",
                        object.cloth
                    );
                    return Err(Usage(message).into());
                }
                (Material::Pattern(pattern), tables) => {
                    let swatch = |fabric: &Fabric| match tables {
                        None => Ok(Swatch::Direct(Box::new(Sadeghi::new(fabric, RULE)))),
                        Some(folder) => table_in(folder, fabric).map(Swatch::Table),
                    };
                    let swatches: Arc<[Swatch]> =
                        pattern.bakes().map(swatch).collect::<Result<_>>()?;
                    wardrobe.swatches.push(Arc::clone(&swatches));
                    Cloth::Pattern(Arc::clone(pattern), swatches)
                }
            };
            wardrobe.cloths.insert(object.cloth.clone(), cloth);
        }
        Ok(wardrobe)
    }

    /// Pairs that the tables were not baked for.
    fn misses(&self) -> usize {
        let of_swatch = |swatch: &Swatch| match swatch {
            Swatch::Table(table) => table.misses(),
            Swatch::Direct(_) => 0,
        };
        let of_tables = self.tables.iter().map(|table| table.misses());
        let of_patterns = self.swatches.iter().flat_map(|swatches| swatches.iter());
        of_tables.chain(of_patterns.map(of_swatch)).sum()
    }
}

fn table_in(folder: &Path, fabric: &Fabric) -> Result<Box<Table>> {
    table_of(fabric, &folder.join(format!("{}.sateen", fabric.name)))
}
