//! `sateen render`

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use sateen::fabric::Fabric;
use sateen::model::{ModelKind, Rule, Sadeghi, irawan_of};
use sateen::pattern::Pattern;
use sateen::progress::Progress;
use sateen::render::{
    Cloth, Comparison, Display, Drape, Layer, Light, Picture, Scene, Shape, Swatch, View, compare,
    curtain, curves, curves_csv, curves_svg, load_mesh, render, to_exr, trousers,
};
use sateen::table::Table;
use serde_json::{Value, json};

use crate::Outcome;
use crate::args::{Compared, Direction, Evaluator, PictureArgs, RenderArgs, SceneArg};
use crate::output::{Bar, Output, Usage, go_on, print, print_json, say, use_threads};
use crate::stage;
use crate::subject::{Subject, load_table, provenance};

/// How fabrics are evaluated unless told otherwise: no error can be seen, and a picture takes seconds.
const DEFAULT_RULE: Rule = Rule::Quadrature(8);

pub(crate) fn run(RenderArgs { scene: of }: &RenderArgs) -> Result<Outcome> {
    let args = match of {
        SceneArg::Cylinders(picture) | SceneArg::Sphere(picture) => picture,
        SceneArg::Curtain(drape) | SceneArg::Trousers(drape) | SceneArg::Mesh { drape, .. } => {
            &drape.picture
        }
        SceneArg::Scene(args) => return stage::run(args),
    };
    use_threads(args.jobs)?;
    let format = Format::of(&args.output)?;
    if args.float && format == Format::Png {
        let message = format!(
            "--float is for EXR, but -o {} is a PNG",
            args.output.display()
        );
        return Err(Usage(message).into());
    }
    let sitter = Sitter::load(args)?;
    let looks = match &args.compare {
        Some(sides) => sides
            .iter()
            .map(|side| sitter.look(side))
            .collect::<Result<Vec<Look>>>()?,
        None => vec![sitter.only_look()?],
    };
    let tables: Vec<Arc<Table>> = looks.iter().flat_map(|look| look.tables.clone()).collect();
    args.missing.check(&tables)?;
    let output = Output::prepare(&args.output)?;
    let beside = |extension: &str| Output::prepare(&args.output.with_extension(extension));
    let curve_files = match (of, &args.compare) {
        (SceneArg::Cylinders(_), None) => Some((beside("csv")?, beside("svg")?)),
        _ => None,
    };
    let lights = lights(of, args);
    let view = View {
        size: args.size.into(),
        samples: args.samples,
        lights: &lights,
        repeats: args.repeats,
    };
    let scene = scene(of)?;

    let mut bar = Bar::new(looks.len());
    let mut pictures: Vec<Picture> = Vec::new();
    let mut drawn = None;
    for look in &looks {
        bar.begin(&look.name);
        let share = |share: f64| bar.report(share);
        let progress = Progress::new(&share);
        pictures.push(render(
            &*scene,
            &look.cloth,
            &view,
            progress.part(0.0, 0.9),
        )?);
        if curve_files.is_some() {
            drawn = Some(curves(&look.cloth, &view, progress.part(0.9, 1.0))?);
        }
    }
    drop(bar);
    let comparison = match pictures.as_slice() {
        [a, b] => Some(compare(a, b, args.exposure)),
        _ => None,
    };
    go_on()?;
    let file = File {
        args,
        notes: sitter.notes(of, &view),
        looks: &looks,
        pictures: &pictures,
        comparison: comparison.as_ref(),
    };
    let bytes = match format {
        Format::Png => file.png()?,
        Format::Exr => file.exr()?,
    };
    go_on()?;
    let misses = args.missing.count(&tables)?;
    output.write(&bytes)?;
    if misses > 0 {
        say(&format!(
            "{misses} pairs were not baked, and have the nearest value; --show-missing shows where"
        ));
    }
    if let (Some((csv, svg)), Some(drawn)) = (curve_files, drawn) {
        let title = format!("{}, {}", sitter.name(), looks[0].name);
        csv.write(curves_csv(&drawn).as_bytes())?;
        svg.write(curves_svg(&title, &drawn).as_bytes())?;
    }
    if let Some(comparison) = &comparison {
        tell(comparison, &looks, args)?;
    }
    Ok(Outcome::Done)
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

/// What sits for the picture.
struct Sitter<'a> {
    args: &'a PictureArgs,
    cloth: Subject,
    /// The fabric, or what a table was baked from; none of a pattern.
    fabric: Option<Fabric>,
}

/// One way to see it.
struct Look {
    /// The evaluator.
    name: String,
    cloth: Cloth,
    /// What it looks up.
    tables: Vec<Arc<Table>>,
}

impl<'a> Sitter<'a> {
    fn load(args: &'a PictureArgs) -> Result<Self> {
        let cloth = Subject::load(&args.subject, args.variant.as_deref())?;
        let fabric = match &cloth {
            Subject::Fabric(fabric) => Some(fabric.clone()),
            Subject::Table(table) => Some(provenance(table, Path::new(&args.subject))?.1),
            Subject::Pattern(_) => None,
        };
        if args.tables.is_some() && fabric.is_some() {
            let message = format!("--tables is for patterns, but {} is none", args.subject);
            return Err(Usage(message).into());
        }
        Ok(Self {
            args,
            cloth,
            fabric,
        })
    }

    fn name(&self) -> &str {
        match (&self.cloth, &self.fabric) {
            (Subject::Pattern(pattern), _) => &pattern.name,
            (_, Some(fabric)) => &fabric.name,
            _ => &self.args.subject,
        }
    }

    /// As `--evaluator` and `--model` say.
    fn only_look(&self) -> Result<Look> {
        let Some(kind) = self.args.model else {
            let default = match (&self.cloth, &self.args.tables) {
                (Subject::Table(_), _) | (Subject::Pattern(_), Some(_)) => Evaluator::Table,
                _ => Evaluator::Direct(DEFAULT_RULE),
            };
            let evaluator = self.args.evaluator.unwrap_or(default);
            if let (Evaluator::Direct(_), Some(_)) = (evaluator, &self.args.tables) {
                let message = "--tables are for --evaluator table";
                return Err(Usage(message.to_owned()).into());
            }
            return self.look(&Compared::Evaluator(evaluator));
        };
        if self.args.evaluator.is_some() {
            let name = kind.name();
            let message = format!("--evaluator is for --model sadeghi, not {name}");
            return Err(Usage(message).into());
        }
        self.look(&Compared::Model(kind))
    }

    fn look(&self, how: &Compared) -> Result<Look> {
        let subject = &self.args.subject;
        let missing = self.args.missing.shown();
        let mut tables = Vec::new();
        let (name, cloth) = match (how, &self.cloth, &self.fabric) {
            (Compared::Evaluator(evaluator), Subject::Pattern(pattern), _) => {
                let swatches = self.swatches(pattern, *evaluator)?;
                tables.extend(swatches.iter().filter_map(|swatch| match swatch {
                    Swatch::Table(table, _) => Some(Arc::clone(table)),
                    Swatch::Direct(_) => None,
                }));
                let cloth = Cloth::Pattern(Arc::new(Pattern::clone(pattern)), swatches.into());
                (evaluator_name(*evaluator), cloth)
            }
            (_, Subject::Pattern(_), _) | (_, _, None) => {
                let message = format!(
                    "{subject} is a pattern, which has no other models and single tables; compare table, midpoint:N, quadrature:N or reference"
                );
                return Err(Usage(message).into());
            }
            (Compared::Evaluator(Evaluator::Table), Subject::Table(table), _) => {
                let table = Arc::new(Table::clone(table));
                tables.push(Arc::clone(&table));
                ("table".to_owned(), Cloth::table(table, Vec::new(), missing))
            }
            (Compared::Evaluator(Evaluator::Table), Subject::Fabric(_), _) => {
                let message = format!(
                    "the evaluator table needs a table, but {subject} is a fabric; bake it first"
                );
                return Err(Usage(message).into());
            }
            (Compared::Evaluator(Evaluator::Direct(rule)), _, Some(fabric)) => {
                let cloth = Cloth::direct(Sadeghi::new(fabric, *rule));
                (evaluator_name(Evaluator::Direct(*rule)), cloth)
            }
            (Compared::Model(kind), _, Some(fabric)) => {
                (kind.name().to_owned(), model(*kind, fabric, subject)?)
            }
            (Compared::File(path), _, Some(fabric)) => {
                let table = table_of(fabric, path)?;
                let single = |albedo: [f64; 3]| albedo.map(|channel| channel as f32);
                let threads = fabric.visible_threads();
                let albedos = threads.map(|thread| single(thread.albedo)).collect();
                let stem = path.file_stem().unwrap_or_default().to_string_lossy();
                tables.push(Arc::clone(&table));
                (
                    format!("table {stem}"),
                    Cloth::table(table, albedos, missing),
                )
            }
        };
        Ok(Look {
            name,
            cloth,
            tables,
        })
    }

    /// A table or model for every fabric that a pattern needs.
    fn swatches(&self, pattern: &Pattern, evaluator: Evaluator) -> Result<Vec<Swatch>> {
        let swatch = |fabric: &Fabric| match (evaluator, &self.args.tables) {
            (Evaluator::Direct(rule), _) => {
                Ok(Swatch::Direct(Box::new(Sadeghi::new(fabric, rule))))
            }
            (Evaluator::Table, Some(folder)) => {
                let path = folder.join(format!("{}.sateen", fabric.name));
                let missing = self.args.missing.shown();
                table_of(fabric, &path).map(|table| Swatch::Table(table, missing))
            }
            (Evaluator::Table, None) => {
                let message = format!(
                    "the evaluator table of a pattern needs --tables DIR, where `sateen bake {} -o DIR` wrote",
                    self.args.subject
                );
                Err(Usage(message).into())
            }
        };
        pattern.bakes().map(swatch).collect()
    }

    /// What a file says of all its pictures.
    fn notes(&self, scene: &SceneArg, view: &View<'_>) -> Vec<(&'static str, String)> {
        let lights = view.lights.iter().map(|light| {
            let [x, y, z] = light.direction;
            format!("{x},{y},{z}")
        });
        let mut notes = vec![
            ("fabric", self.name().to_owned()),
            ("scene", scene_name(scene)),
            ("light", lights.collect::<Vec<_>>().join(" ")),
            ("view", "orthographic, from 0,0,1".to_owned()),
            ("samples", view.samples.to_string()),
        ];
        if matches!(self.cloth, Subject::Pattern(_)) {
            notes.push(("repeats", view.repeats.to_string()));
        }
        notes
    }
}

/// A table of a fabric that is dyed in any way.
pub(crate) fn table_of(fabric: &Fabric, path: &Path) -> Result<Arc<Table>> {
    let (table, _) = load_table(path)?;
    let (_, baked) = provenance(&table, path)?;
    if !baked.is_dyed_like(fabric) {
        bail!(
            "{} is a table of {}, which is not the {} to be rendered; bake that",
            path.display(),
            baked.name,
            fabric.name
        );
    }
    Ok(Arc::new(table))
}

/// Another model with the parameters that the fabric's file has, or that its threads stand for.
fn model(kind: ModelKind, fabric: &Fabric, subject: &str) -> Result<Cloth> {
    let mut models = fabric.models.clone();
    if kind == ModelKind::Irawan && models.irawan.is_none() {
        models.irawan = Some(irawan_of(fabric));
    }
    let name = kind.name();
    let Some(model) = kind.prepare(&models)? else {
        let section = name.replace('-', "_");
        bail!(
            "{subject} has no section [{section}]; `sateen fit {name} {subject} -o FILE` writes it into one"
        );
    };
    Ok(Cloth::other(model))
}

fn evaluator_name(evaluator: Evaluator) -> String {
    match evaluator {
        Evaluator::Table => "table".to_owned(),
        Evaluator::Direct(Rule::Midpoint(count)) => format!("midpoint:{count}"),
        Evaluator::Direct(Rule::Quadrature(count)) => format!("quadrature:{count}"),
        Evaluator::Direct(Rule::Adaptive(_)) => "reference".to_owned(),
    }
}

/// Width over height of what hangs, and how far the view of it is from above, radians.
const ASPECT: f64 = 1.0;
const FROM_ABOVE: f64 = 0.12;
/// What lights it, unless told otherwise: a light before it to the left, one beside it to the right, and a weak one from where it is seen.
const LIGHTS: [([f64; 3], f64); 3] = [
    ([-0.48, 0.36, 0.8], 0.8),
    ([0.936, 0.0, 0.352], 0.4),
    ([0.0, 0.28, 0.96], 0.3),
];

fn scene(of: &SceneArg) -> Result<Box<dyn Scene>> {
    let (mesh, drape) = match of {
        SceneArg::Cylinders(_) => return Ok(Box::new(Shape::Cylinders)),
        SceneArg::Sphere(_) => return Ok(Box::new(Shape::Sphere)),
        SceneArg::Curtain(drape) => (curtain(), drape),
        SceneArg::Trousers(drape) => (trousers(), drape),
        SceneArg::Mesh { mesh, drape } => (load_mesh(mesh)?, drape),
        SceneArg::Scene(_) => bail!("a scene is no single mesh"),
    };
    let drape = Drape::new(mesh, drape.turn_deg.to_radians(), FROM_ABOVE, ASPECT);
    Ok(Box::new(drape.context("the mesh has no triangles")?))
}

fn scene_name(of: &SceneArg) -> String {
    match of {
        SceneArg::Cylinders(_) => Shape::Cylinders.name().to_owned(),
        SceneArg::Sphere(_) => Shape::Sphere.name().to_owned(),
        SceneArg::Curtain(_) => "curtain".to_owned(),
        SceneArg::Trousers(_) => "trousers".to_owned(),
        SceneArg::Mesh { mesh, .. } => mesh.display().to_string(),
        SceneArg::Scene(args) => args.scene.display().to_string(),
    }
}

fn lights(of: &SceneArg, args: &PictureArgs) -> Vec<Light> {
    if !args.light.is_empty() {
        let lights = args.light.iter();
        return lights.map(|Direction(light)| Light::of(*light)).collect();
    }
    let is_shape = matches!(of, SceneArg::Cylinders(_) | SceneArg::Sphere(_));
    let angles = [args.light_deg, args.light_elevation_deg];
    if angles == [None; 2] && !is_shape {
        let light = |(direction, strength)| Light {
            direction,
            strength,
        };
        return LIGHTS.map(light).to_vec();
    }
    let [azimuth, elevation] = angles.map(|angle| angle.unwrap_or(0.0).to_radians());
    vec![Light::of(Light::direction_at(azimuth, elevation))]
}

/// What is written, as either format has it.
struct File<'a> {
    args: &'a PictureArgs,
    notes: Vec<(&'static str, String)>,
    looks: &'a [Look],
    pictures: &'a [Picture],
    comparison: Option<&'a Comparison>,
}

impl File<'_> {
    /// The picture, or from left to right A, B, their difference and FLIP.
    fn png(&self) -> Result<Vec<u8>> {
        let stops = self.args.exposure;
        let shown = self.pictures.iter().map(|of| Display::of(of, stops));
        let mut parts: Vec<Display> = shown.collect();
        let mut notes = self.notes.clone();
        let names: Vec<&str> = self.looks.iter().map(|look| look.name.as_str()).collect();
        notes.push(("evaluator", names.join(", ")));
        notes.push(("exposure", stops.to_string()));
        if let Some(comparison) = self.comparison {
            parts.extend(comparison.panels());
            notes.push(("panels", "A, B, |A - B| times factor, FLIP".to_owned()));
            notes.extend(numbers(comparison));
        }
        notes.push(("Software", TOOL.to_owned()));
        Display::beside(&parts)
            .to_png(&notes)
            .context("cannot encode the PNG")
    }

    /// A layer for every evaluator, and for the difference and FLIP.
    fn exr(&self) -> Result<Vec<u8>> {
        let mut layers: Vec<Layer> = Vec::new();
        for (look, picture) in self.looks.iter().zip(self.pictures) {
            let name = if layers.iter().any(|layer| layer.name == look.name) {
                format!("{} again", look.name)
            } else {
                look.name.clone()
            };
            let mut layer = Layer::of(&name, picture);
            layer.notes.clone_from(&self.notes);
            layer.notes.push(("evaluator", look.name.clone()));
            layers.push(layer);
        }
        if let Some(comparison) = self.comparison {
            let notes = [self.notes.clone(), numbers(comparison)].concat();
            let mut difference = Layer::of("difference", &comparison.difference);
            difference.notes.clone_from(&notes);
            layers.push(difference);
            layers.push(Layer {
                name: "flip".to_owned(),
                notes,
                channels: vec![("Y", comparison.flip.clone())],
            });
        }
        to_exr(&layers, self.pictures[0].width, self.args.float).context("cannot encode the EXR")
    }
}

const TOOL: &str = concat!("sateen ", env!("CARGO_PKG_VERSION"));

fn numbers(comparison: &Comparison) -> Vec<(&'static str, String)> {
    vec![
        ("factor", comparison.factor.to_string()),
        ("flip mean", comparison.flip_mean.to_string()),
        ("flip max", comparison.flip_max.to_string()),
        ("rmse", comparison.rmse.to_string()),
        (
            "mean relative error",
            comparison.mean_relative_error.to_string(),
        ),
    ]
}

fn tell(comparison: &Comparison, looks: &[Look], args: &PictureArgs) -> Result<()> {
    let factor = comparison.factor;
    let names = [&*looks[0].name, &looks[1].name];
    if args.json {
        let mut json = comparison_json(names, comparison);
        json["factor"] = json!(factor);
        return print_json(&json);
    }
    print(&comparison_text(names, comparison))?;
    if factor > 1.0 {
        say(&format!("the difference is shown {factor} times as large"));
    }
    Ok(())
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
