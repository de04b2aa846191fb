//! `sateen scene`

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result};
use sateen::bake::{Budget, Forecast, GridForecast, Preset, Projection, Scope, forecast};
use sateen::chart::Coordinates;
use sateen::fabric::LIBRARY;
use sateen::needs::Needs;
use sateen::progress::Progress;
use sateen::scene::{Albedo, Analysis, FabricUse, Scene};
use sateen::table::Content;
use serde_json::{Value, json};

use crate::Outcome;
use crate::args::{Print, Workers};
use crate::forecast::forecast_svg;
use crate::guidance::{self, Looks};
use crate::output::{Bar, Output, Usage, bytes, counted, print, print_json, use_workers};
use crate::subject::{Subject, What};

/// Say what a scene needs of its fabrics, and what a bake for it leaves out.
#[derive(clap::Args)]
pub(crate) struct ExplainArgs {
    /// A TOML, glTF or GLB file.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// How large and how accurate the tables would be.
    #[arg(long, value_enum, default_value_t = Preset::Standard)]
    preset: Preset,
    /// Draw which part of every table's box is needed, projected onto two coordinates at a time: FABRIC.svg in this folder.
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Write what is needed of each fabric as a recording, FABRIC.needs in this folder.
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    #[command(flatten)]
    print: Print,
    #[command(flatten)]
    workers: Workers,
}

pub(crate) fn run(args: &ExplainArgs) -> Result<Outcome> {
    use_workers(&args.workers)?;
    let scene = load_scene(&args.scene)?;
    let fabrics = scene.fabrics();
    let file = |folder: &Path, name: &str, end: &str| {
        Output::prepare(&folder.join(format!("{name}.{end}")))
    };
    for folder in args.output.iter().chain(&args.record) {
        // Before the work, to find out.
        Output::prepare(&folder.join("scene"))?;
    }
    let settings = args.preset.settings();

    let mut bar = Bar::new(fabrics.len() + 1);
    bar.begin("analysing", &scene.name);
    let report = |share: f64| bar.report(share);
    let start = Instant::now();
    let analysis = scene.analyse(Progress::new(&report))?;
    let seconds = start.elapsed().as_secs_f64();
    let mut found = Vec::new();
    for (name, used) in &fabrics {
        bar.begin("forecasting", name);
        let needs = &analysis.needs[name];
        let report = |share: f64| bar.report(share);
        let scope = scope_of(used, needs);
        // As a bake of the scene has it.
        let budget = Budget {
            max_error: used.max_error,
            ..Budget::default()
        };
        let settings = match used.max_error {
            Some(_) => budget.settings(&settings),
            None => settings.clone(),
        };
        let forecast = (!needs.is_empty())
            .then(|| forecast(&used.fabric, &settings, &scope, Progress::new(&report)))
            .transpose()?;
        if let (Some(folder), Some(forecast)) = (&args.output, &forecast) {
            let title = format!("{name} in {}", scene.name);
            let svg = forecast_svg(&title, forecast);
            file(folder, name, "svg")?.write(svg.as_bytes())?;
        }
        if let Some(folder) = &args.record {
            file(folder, name, "needs")?.write(&needs.to_bytes())?;
        }
        found.push((used, needs, forecast));
    }
    drop(bar);
    if args.print.json {
        print_json("scene", to_json(&scene, &analysis, seconds, &found))?;
    } else {
        print(&to_text(&scene, &analysis, seconds, &found))?;
    }
    Ok(Outcome::Done)
}

type Found<'a> = (&'a FabricUse, &'a Needs, Option<Forecast>);

pub(crate) fn load_scene(path: &Path) -> Result<Scene> {
    let others = [
        Looks::Fabric,
        Looks::Table,
        Looks::Picture,
        Looks::Pairs,
        Looks::Mesh,
    ];
    // glTF files may have cameras and lights.
    let is_obj = path
        .extension()
        .is_some_and(|end| end.eq_ignore_ascii_case("obj"));
    guidance::refuse(path, &others[..4 + usize::from(is_obj)], "a scene")?;
    let name = path.display();
    // Which file, its errors say themselves.
    Scene::load(path).or_else(|error| {
        match Subject::load(&path.to_string_lossy(), None).map(|subject| subject.what) {
            Ok(What::Fabric(_)) => Err(Usage(format!(
                "{name} is a fabric, not a scene; `sateen bake {name}` bakes it"
            ))
            .into()),
            Ok(What::Pattern(_)) => Err(Usage(format!(
                "{name} is a pattern, not a scene; `sateen bake {name}` bakes it"
            ))
            .into()),
            _ => Err(error).context("cannot read the scene"),
        }
    })
}

/// What a scene asks of a fabric.
pub(crate) fn scope_of<'a>(used: &FabricUse, needs: &'a Needs) -> Scope<'a> {
    Scope {
        needs: Some(needs),
        fixed_albedo: used.albedo == Albedo::Fixed,
    }
}

/// Library fabrics that are on no mesh.
fn unused(fabrics: &BTreeMap<String, FabricUse>) -> usize {
    LIBRARY
        .iter()
        .filter(|entry| !fabrics.contains_key(entry.name))
        .count()
}

fn to_text(scene: &Scene, analysis: &Analysis, seconds: f64, found: &[Found<'_>]) -> String {
    let mut text = format!("{}: {}\n", scene.name, scene.title);
    for object in &analysis.objects {
        text += &format!(
            "  {:<12} {} in {}, {}, {} and {}: {:.1} % of all pairs of {}\n",
            object.name,
            counted(object.triangles, "triangle"),
            counted(object.patches, "patch"),
            counted(object.placements, "placement"),
            counted(object.lights, "light"),
            counted(object.cameras, "camera"),
            100.0 * object.share,
            object.fabrics.join(", "),
        );
    }
    text += &format!("  analysed in {seconds:.1} s\n");
    for material in &scene.left_out {
        text += &format!("  left out: the material {material}, which is no fabric\n");
    }
    text += &format!(
        "  left out: {} of the library, on no mesh\n",
        counted(unused(&scene.fabrics()), "fabric")
    );
    for (used, needs, forecast) in found {
        let name = &used.fabric.name;
        match forecast {
            None => text += &format!("{name}: left out: no light and camera ever see it\n"),
            Some(forecast) => {
                text += &format!("{name}: {}\n", asked_for(used, needs));
                text += &forecast_text(forecast);
            }
        }
    }
    text
}

fn asked_for(used: &FabricUse, needs: &Needs) -> String {
    let pairs = if needs.has_no_pairs() {
        "light from the viewer's direction alone".to_owned()
    } else {
        format!("{:.1} % of all pairs of directions", 100.0 * needs.share())
    };
    let albedo = match used.albedo {
        Albedo::Fixed => "an albedo that stays",
        Albedo::Varies => "any albedo",
    };
    let error = used.max_error.map_or(String::new(), |error| {
        format!(", a mean error of {} %", 100.0 * error)
    });
    format!("{pairs}, {albedo}{error}")
}

fn forecast_text(forecast: &Forecast) -> String {
    let mut text = String::new();
    for thread in &forecast.threads {
        match &thread.grid {
            None => {
                let how = match thread.direct_nodes {
                    Some(tilts) => format!("{} per segment", counted(tilts, "placed tilt")),
                    None => "closed form".to_owned(),
                };
                text += &format!(
                    "  {:<10} {how}: there is nothing to leave out\n",
                    thread.thread
                );
            }
            Some(grid) => {
                text += &format!("  {:<10} {}\n", thread.thread, grid_text(grid));
                text += &drawing(&grid.projections);
            }
        }
    }
    text
}

fn grid_text(grid: &GridForecast) -> String {
    let share = |[part, all]: [usize; 2]| 100.0 * part as f64 / all as f64;
    let mut text = format!(
        "{:.1} % of the cells, {} instead of {} ({:.1} %), {:.1} s of integration instead of {:.1} s",
        share(grid.cells),
        bytes(grid.bytes[0]),
        bytes(grid.bytes[1]),
        share(grid.bytes),
        grid.seconds[0],
        grid.seconds[1],
    );
    if grid.cells[0] == grid.cells[1] && grid.collapsed.is_empty() {
        text += "\n             kept: all cells, since a part would take no less memory";
    }
    for reason in reasons(grid) {
        text += &format!("\n             left out: {reason}");
    }
    text
}

/// What a grid leaves out, and why.
fn reasons(grid: &GridForecast) -> Vec<String> {
    let mut reasons = Vec::new();
    let names = grid.coordinates.names();
    let collapsed: Vec<&str> = grid.collapsed.iter().map(|axis| names[*axis]).collect();
    if !collapsed.is_empty() {
        reasons.push(format!(
            "{}, since light comes from the viewer's direction",
            collapsed.join(" and ")
        ));
    }
    if grid.cells[0] < grid.cells[1] {
        reasons.push("cells that no light and camera reach".to_owned());
    }
    match grid.content {
        Content::Both => {}
        Content::Surface => {
            reasons.push("V, since the albedo is 0 and stays so".to_owned());
        }
        Content::Volume => {
            reasons.push("S, since no surface reflects where eta is 1".to_owned());
        }
        Content::Dyed => {
            reasons.push("a channel of two, since the albedo is grey and stays as it is".to_owned())
        }
    }
    match grid.coordinates {
        Coordinates::Isotropic => {
            reasons
                .push("a fourth axis, since the cloth looks the same in all directions".to_owned());
        }
        Coordinates::Thread {
            ends_fold,
            sides_fold,
            ..
        } => {
            if ends_fold {
                reasons.push(format!(
                    "half of {}, since both ends look the same",
                    names[0]
                ));
            }
            if sides_fold {
                reasons.push("half of phi_h, since both sides look the same".to_owned());
            }
        }
        Coordinates::View { .. } => {}
    }
    reasons
}

/// Two projections side by side, darker where more is needed.
fn drawing([left, right]: &[Projection; 2]) -> String {
    const ROWS: usize = 8;
    const COLUMNS: usize = 30;
    const SHADES: [char; 5] = ['·', '░', '▒', '▓', '█'];
    let row = |projection: &Projection, row: usize| -> String {
        let cell = |axis: usize, share: f64, count: usize| {
            let knots = &projection.knots[axis];
            let (from, to) = (knots[0], knots[knots.len() - 1]);
            let place = from + share * (to - from);
            knots[1..]
                .iter()
                .take_while(|knot| **knot < place)
                .count()
                .min(count - 1)
        };
        let up = 1.0 - (row as f64 + 0.5) / ROWS as f64;
        let shares = &projection.shares[cell(1, up, projection.shares.len())];
        (0..COLUMNS)
            .map(|column| {
                let right = (column as f64 + 0.5) / COLUMNS as f64;
                let share = shares[cell(0, right, shares.len())];
                let shade = if share > 0.0 {
                    1 + (share * 3.999) as usize
                } else {
                    0
                };
                SHADES[shade.min(4)]
            })
            .collect()
    };
    let mut text = String::new();
    for k in 0..ROWS {
        text += &format!("             {}  {}\n", row(left, k), row(right, k));
    }
    let label = |projection: &Projection| match projection.axes {
        [right, ""] => right.to_owned(),
        [right, up] => format!("{right} right, {up} up"),
    };
    text + &format!("             {:<30}  {}\n", label(left), label(right))
}

fn to_json(scene: &Scene, analysis: &Analysis, seconds: f64, found: &[Found<'_>]) -> Value {
    let grid = |grid: &GridForecast| {
        json!({
            "content": grid.content,
            "collapsed": grid.collapsed.iter().map(|axis| grid.coordinates.names()[*axis]).collect::<Value>(),
            "cells": { "needed": grid.cells[0], "all": grid.cells[1] },
            "bytes": { "needed": grid.bytes[0], "all": grid.bytes[1] },
            "sites": { "needed": grid.sites[0], "all": grid.sites[1] },
            "seconds": { "needed": grid.seconds[0], "all": grid.seconds[1] },
            "left_out": reasons(grid),
        })
    };
    let fabric = |(used, needs, forecast): &Found<'_>| {
        let threads = forecast.as_ref().map(|forecast| {
            let thread = |thread: &sateen::bake::ThreadForecast| {
                json!({ "thread": thread.thread, "direct_nodes": thread.direct_nodes, "grid": thread.grid.as_ref().map(grid) })
            };
            forecast.threads.iter().map(thread).collect::<Value>()
        });
        json!({
            "fabric": used.fabric.name,
            "objects": used.objects,
            "albedo": if used.albedo == Albedo::Fixed { "fixed" } else { "varies" },
            "max_error": used.max_error,
            "share": needs.share(),
            "collocated_only": needs.has_no_pairs(),
            "threads": threads,
        })
    };
    let object = |object: &sateen::scene::ObjectNeeds| {
        json!({
            "object": object.name,
            "fabrics": object.fabrics,
            "triangles": object.triangles,
            "patches": object.patches,
            "placements": object.placements,
            "cameras": object.cameras,
            "lights": object.lights,
            "share": object.share,
        })
    };
    json!({
        "scene": scene.name,
        "seconds": seconds,
        "objects": analysis.objects.iter().map(object).collect::<Value>(),
        "left_out": { "materials": scene.left_out, "library_fabrics": unused(&scene.fabrics()) },
        "fabrics": found.iter().map(fabric).collect::<Value>(),
    })
}
