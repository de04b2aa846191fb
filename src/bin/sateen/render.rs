//! `sateen render`

use std::borrow::Cow;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Subcommand;
use sateen::evaluator::{Cloth, Spec, SpecError};
use sateen::fabric::Fabric;
use sateen::progress::Progress;
use sateen::render::{
    Comparison, Display, Drape, Layer, Light, Picture, Scene, Shape, View, compare, curtain,
    curves, curves_csv, curves_svg, is_of_curves, load_mesh, render, to_exr, trousers,
};
use serde_json::json;

use crate::Outcome;
use crate::args::{Dye, Workers, parse_within};
use crate::cloth::{WayArgs, dyed_table, not_for_patterns};
use crate::output::{Bar, Output, Usage, counted, go_on, print, print_json, say, use_workers};
use crate::picture::{
    Format, MissingArgs, RULE, SizeArgs, comparison_json, comparison_text, say_clipped,
};
use crate::stage::{self, StageArgs};
use crate::subject::{Subject, What};

/// Take pictures of cloth on cylinders, on a sphere, as a curtain, or on a mesh.
///
/// Lights have irradiance π, so that white cloth which scatters evenly and faces one has radiance 1. A PNG shows radiance as
/// sRGB at the --exposure, a transparent background, and what made it as text; an EXR has linear radiance without --exposure.
#[derive(clap::Args)]
pub(crate) struct RenderArgs {
    #[command(subcommand)]
    what: RenderArg,
}

/// What is rendered.
#[derive(Subcommand)]
enum RenderArg {
    #[command(flatten)]
    Cloth(SceneArg),
    /// A scene of cameras, lights and cloths, from a TOML, glTF or GLB file.
    Scene(StageArgs),
}

/// What one cloth lies on.
#[derive(Subcommand)]
enum SceneArg {
    /// Three upright cylinders, their warp vertical, horizontal and diagonal.
    ///
    /// Beside the picture the radiance across each of them is written, as a drawing and as numbers: the same name ending in
    /// .svg and .csv.
    Cylinders(PictureArgs),
    /// A sphere whose slices through the centre are cylinders of every orientation.
    Sphere(PictureArgs),
    /// A pleated curtain, its warp hanging down.
    Curtain(DrapeArgs),
    /// A trouser leg bent at the knee, its warp along the leg.
    Trousers(DrapeArgs),
    /// A mesh with texture coordinates; the warp runs along the first of them.
    Mesh {
        /// An OBJ, glTF or GLB file.
        #[arg(value_name = "MESH")]
        mesh: PathBuf,
        #[command(flatten)]
        drape: DrapeArgs,
    },
}

/// How cloth that hangs is looked at.
#[derive(clap::Args)]
struct DrapeArgs {
    #[command(flatten)]
    picture: PictureArgs,
    /// How far it is turned, its right side to the viewer, in degrees.
    #[arg(long, value_name = "A", default_value_t = 0.0, value_parser = parse_degrees, allow_negative_numbers = true)]
    turn_deg: f64,
}

/// How a picture is taken.
#[derive(clap::Args)]
struct PictureArgs {
    /// A name from the library, the TOML file of a fabric or a pattern, or a table.
    #[arg(value_name = "FABRIC|TABLE|PATTERN")]
    subject: String,
    /// The picture to write, which ends in .png or .exr.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    way: WayArgs,
    /// Two evaluators, the second as the truth: writes both pictures, their difference and FLIP (the difference that the eye sees),
    /// and prints how large they are. Each is table, midpoint:N, quadrature:N, reference, another model's name as --model has
    /// it, or the file of a table of the same fabric, which is dyed like it.
    #[arg(long, num_args = 2, value_names = ["A", "B"], value_parser = parse_side, conflicts_with_all = ["evaluator", "model"])]
    compare: Option<Vec<Side>>,
    #[command(flatten)]
    missing: MissingArgs,
    #[command(flatten)]
    view: SizeArgs,
    /// How far the light is turned from the camera to the right, in degrees.
    #[arg(long, value_name = "A", value_parser = parse_degrees, allow_negative_numbers = true)]
    light_deg: Option<f64>,
    /// How far the light is raised, in degrees.
    #[arg(long, value_name = "A", value_parser = parse_degrees, allow_negative_numbers = true)]
    light_elevation_deg: Option<f64>,
    /// The direction to the light, instead of angles; several are lights of the same strength. x right, y up, z to the viewer, of any
    /// length [default: one at the camera; for curtains, trousers and meshes three: before them to the left, beside them to the right,
    /// and a weak one from the viewer].
    #[arg(long, value_name = "X,Y,Z", value_parser = parse_direction, allow_hyphen_values = true, conflicts_with_all = ["light_deg", "light_elevation_deg"])]
    light: Vec<Direction>,
    /// How often a pattern repeats across half the circumference, along a curtain, or along a mesh's texture coordinate of 1.
    #[arg(long, value_name = "N", default_value_t = 4.0, value_parser = parse_repeats)]
    repeats: f64,
    /// Store 32-bit floats in an EXR, not halves.
    #[arg(long)]
    float: bool,
    /// Print what --compare finds as JSON.
    #[arg(long, requires = "compare")]
    json: bool,
    #[command(flatten)]
    dye: Dye,
    #[command(flatten)]
    workers: Workers,
}

/// A unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Direction([f64; 3]);

/// One side of a comparison.
#[derive(Debug, Clone, PartialEq)]
enum Side {
    Spec(Spec),
    File(PathBuf),
}

fn parse_side(text: &str) -> Result<Side, String> {
    if text.ends_with(".sateen") || text.contains(['/', '\\']) {
        return Ok(Side::File(text.into()));
    }
    text.parse().map(Side::Spec).map_err(|error: SpecError| {
        format!("{error}, another model's name, or the file of a table, which ends in .sateen")
    })
}

fn parse_degrees(text: &str) -> Result<f64, String> {
    parse_within(text, -360.0..=360.0, "degrees")
}

fn parse_repeats(text: &str) -> Result<f64, String> {
    parse_within(text, 1e-3..=1e4, "repeats")
}

fn parse_direction(text: &str) -> Result<Direction, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|x| x.trim().parse()).collect();
    let wrong = || "it is three numbers as 0.5,0,1, not all 0".to_owned();
    let [x, y, z] = numbers
        .ok()
        .and_then(|numbers| <[f64; 3]>::try_from(numbers).ok())
        .ok_or_else(wrong)?;
    let length = x.hypot(y).hypot(z);
    if length > 0.0 && length.is_finite() {
        Ok(Direction([x, y, z].map(|component| component / length)))
    } else {
        Err(wrong())
    }
}

pub(crate) fn run(args: &RenderArgs) -> Result<Outcome> {
    match &args.what {
        RenderArg::Cloth(scene) => picture(scene),
        RenderArg::Scene(args) => stage::run(args),
    }
}

fn picture(of: &SceneArg) -> Result<Outcome> {
    let args = match of {
        SceneArg::Cylinders(picture) | SceneArg::Sphere(picture) => picture,
        SceneArg::Curtain(drape) | SceneArg::Trousers(drape) | SceneArg::Mesh { drape, .. } => {
            &drape.picture
        }
    };
    use_workers(&args.workers)?;
    let format = Format::of(&args.output)?;
    if args.float && format == Format::Png {
        let message = format!(
            "--float is for EXR, but -o {} is a PNG",
            args.output.display()
        );
        return Err(Usage(message).into());
    }
    let subject = Subject::load(&args.subject, args.dye.variant.as_deref())?;
    let sitter = Sitter::new(args, &subject)?;
    let looks = match &args.compare {
        Some(sides) => sides
            .iter()
            .map(|side| sitter.side(side))
            .collect::<Result<Vec<Look>>>()?,
        None => vec![sitter.only_look()?],
    };
    let cloths = || looks.iter().map(|look| &look.cloth);
    args.missing.check(cloths())?;
    let output = Output::prepare(&args.output)?;
    let beside = |extension: &str| {
        let path = args.output.with_extension(extension);
        keep_foreign(&path)?;
        Output::prepare(&path)
    };
    let curve_files = match (of, &args.compare) {
        (SceneArg::Cylinders(_), None) => Some((beside("csv")?, beside("svg")?)),
        _ => None,
    };
    let lights = lights(of, args);
    let view = View {
        size: args.view.size.into(),
        samples: args.view.samples,
        lights: &lights,
        repeats: args.repeats,
    };
    let scene = scene(of)?;

    let mut bar = Bar::new(looks.len());
    let mut pictures: Vec<Picture> = Vec::new();
    let mut drawn = None;
    for look in &looks {
        bar.begin("rendering", &look.name);
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
        [a, b] => Some(compare(a, b, args.view.exposure)),
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
    let misses = args.missing.count(cloths())?;
    output.write(&bytes)?;
    if misses > 0 {
        say(&format!(
            "{} not baked, the nearest value taken; --show-missing shows where",
            counted(misses, "pair")
        ));
    }
    if let (Some((csv, svg)), Some(drawn)) = (curve_files, drawn) {
        let title = format!("{}, {}", sitter.name(), looks[0].name);
        csv.write(curves_csv(&drawn).as_bytes())?;
        svg.write(curves_svg(&title, &drawn).as_bytes())?;
        let names = ["csv", "svg"].map(|end| args.output.with_extension(end));
        let [csv, svg] = names.each_ref().map(|path| path.display());
        say(&format!(
            "the radiance across each cylinder is in {csv} and {svg}"
        ));
    }
    if let Some(comparison) = &comparison {
        tell(comparison, &looks, args)?;
    }
    Ok(Outcome::Done)
}

/// What sits for the picture.
struct Sitter<'a> {
    args: &'a PictureArgs,
    subject: &'a Subject,
    /// The fabric, or what a table was baked from; none of a pattern.
    fabric: Option<Cow<'a, Fabric>>,
}

/// One way to see it.
struct Look {
    /// The evaluator.
    name: String,
    cloth: Cloth,
}

impl<'a> Sitter<'a> {
    fn new(args: &'a PictureArgs, subject: &'a Subject) -> Result<Self> {
        args.way.check_tables(subject)?;
        let fabric = match subject.what {
            What::Pattern(_) => None,
            _ => Some(subject.fabric()?),
        };
        Ok(Self {
            args,
            subject,
            fabric,
        })
    }

    fn name(&self) -> &str {
        match (&self.subject.what, &self.fabric) {
            (What::Pattern(pattern), _) => &pattern.name,
            (_, Some(fabric)) => &fabric.name,
            _ => &self.args.subject,
        }
    }

    /// As `--evaluator` and `--model` say.
    fn only_look(&self) -> Result<Look> {
        self.look(&self.args.way.spec(self.subject, RULE)?)
    }

    fn look(&self, spec: &Spec) -> Result<Look> {
        let missing = self.args.missing.shown();
        Ok(Look {
            name: spec.to_string(),
            cloth: self.args.way.cloth(self.subject, spec, missing)?,
        })
    }

    /// One side of `--compare`.
    fn side(&self, side: &Side) -> Result<Look> {
        let path = match side {
            Side::Spec(spec) => return self.look(spec),
            Side::File(path) => path,
        };
        let Some(fabric) = &self.fabric else {
            return Err(not_for_patterns(self.subject));
        };
        let missing = self.args.missing.shown();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Look {
            name: Spec::NamedTable(stem.into_owned()).to_string(),
            cloth: dyed_table(path, fabric, missing, "give a table of that fabric")?.into(),
        })
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
        if matches!(self.subject.what, What::Pattern(_)) {
            notes.push(("repeats", view.repeats.to_string()));
        }
        notes
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
        let (stops, transfer) = (self.args.view.exposure, self.args.view.transfer);
        let shown = self
            .pictures
            .iter()
            .map(|of| Display::of(of, stops, transfer));
        let mut parts: Vec<Display> = shown.collect();
        let clipped = parts.iter().map(|part| part.clipped).sum();
        say_clipped(clipped, parts.iter().map(|part| part.pixels.len()).sum());
        let mut notes = self.notes.clone();
        let names: Vec<&str> = self.looks.iter().map(|look| look.name.as_str()).collect();
        notes.push(("evaluator", names.join(", ")));
        notes.push(("exposure", stops.to_string()));
        if let Some(comparison) = self.comparison {
            parts.extend(comparison.panels(transfer));
            let captions = [
                format!("A: {}", names[0]),
                format!("B: {}", names[1]),
                format!("|A - B| × {}", comparison.factor),
                format!("FLIP {:.4}", comparison.flip_mean),
            ];
            let bar = Comparison::colours();
            let bars = [&[][..], &[], &[], &bar];
            let captioned = parts.iter().zip(&captions).zip(bars);
            parts = captioned
                .map(|((part, caption), bar)| part.captioned(caption, bar))
                .collect();
            notes.push(("panels", "A, B, |A - B| times factor, FLIP".to_owned()));
            notes.extend(numbers(comparison));
        }
        notes.push(("Software", sateen::TOOL.to_owned()));
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
        return print_json("compare", json);
    }
    print(&comparison_text(names, comparison))?;
    if factor > 1.0 {
        say(&format!("the difference is shown {factor} times as large"));
    }
    Ok(())
}

/// Refuses to replace a file beside the picture that is no drawing of curves: nobody has named it.
fn keep_foreign(path: &Path) -> Result<()> {
    let mut begin = Vec::new();
    match std::fs::File::open(path) {
        Ok(file) if path.is_file() => file.take(64).read_to_end(&mut begin)?,
        _ => return Ok(()),
    };
    if begin.is_empty() || is_of_curves(&begin) {
        return Ok(());
    }
    bail!(
        "{} would be replaced by the radiance across the cylinders; move it, or name another picture with -o",
        path.display()
    )
}
