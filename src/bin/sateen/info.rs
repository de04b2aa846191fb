//! `sateen info`

use std::path::PathBuf;

use anyhow::Result;
use sateen::bake::{Provenance, ScopeNote};
use sateen::chart::Coordinates;
use sateen::fabric::Fabric;
use sateen::metrics::Reflectance;
use sateen::model::ModelKind;
use sateen::table::{Axis, Content, Energy, Grid, Table, ThreadTable, VERSION};
use serde_json::{Map, Value, json};

use crate::Outcome;
use crate::args::Print;
use crate::output::{adapted_line, bytes, counted, error_lines, print, print_json, sizes};
use crate::subject::{load_table, provenance};

/// Say what a table is and what made it.
#[derive(clap::Args)]
pub(crate) struct InfoArgs {
    /// A table that `bake` wrote.
    #[arg(value_name = "TABLE")]
    table: PathBuf,
    #[command(flatten)]
    print: Print,
    /// Print the fabric's parameters as the TOML file that was baked.
    #[arg(long, conflicts_with = "json")]
    toml: bool,
}

pub(crate) fn run(args: &InfoArgs) -> Result<Outcome> {
    let (table, file_bytes) = load_table(&args.table)?;
    let (provenance, fabric) = provenance(&table, &args.table)?;
    if args.toml {
        print(&provenance.fabric.toml)?;
    } else if args.print.json {
        print_json("info", info_json(&table, &provenance, &fabric, file_bytes))?;
    } else {
        print(&info_text(&table, &provenance, &fabric, file_bytes))?;
    }
    Ok(Outcome::Done)
}

fn info_text(table: &Table, provenance: &Provenance, fabric: &Fabric, file_bytes: usize) -> String {
    let settings = &provenance.settings;
    let preset = settings.preset.name();
    let mut text = format!(
        "{}: {}\n  source     {}\n  made by    {}, preset {preset}, target error {} %, at most {} in memory\n",
        fabric.name,
        fabric.title,
        fabric.source,
        provenance.tool,
        100.0 * settings.target_error,
        bytes(settings.max_bytes),
    );
    text += adapted_line(provenance.adapted);
    text += &format!(
        "  size       {}, format {VERSION}\n",
        sizes(table.decoded_bytes(), file_bytes)
    );
    text += &format!("  projection {}\n", name_of(&table.reweighting()));
    let reflectance = Reflectance::of_fabric(fabric);
    text += &format!("  reflects   {reflectance}\n");
    text += &energy_text(fabric, &reflectance);
    for (kind, reflectance) in reflectance_of_models(fabric) {
        text += &format!("  {} reflects {reflectance}", kind.name());
        text += if reflectance.conserves_energy() {
            "\n"
        } else {
            ", more than arrives\n"
        };
    }
    text += &sampling_text(table);
    text += &scope_text(provenance.scope.as_ref());
    for thread in table.threads() {
        text += &thread_text(thread);
    }
    for thread in fabric.threads.iter().filter(|thread| !thread.is_visible()) {
        text += &format!("  {:<10} left out: it covers nothing\n", thread.name);
    }
    text += &format!(
        "recorded error against direct integration, seed {}\n",
        provenance.error.seed
    );
    text + &error_lines(&provenance.error)
}

/// Of the other models that the fabric's file has parameters of.
fn reflectance_of_models(fabric: &Fabric) -> impl Iterator<Item = (ModelKind, Reflectance)> {
    ModelKind::ALL.into_iter().filter_map(|kind| {
        // Files are checked to have spines.
        let model = kind.prepare::<f64>(&fabric.models).ok()??;
        Some((kind, Reflectance::of(&*model)))
    })
}

/// What there is for path tracers, and what becomes of views that would get more than arrives.
fn sampling_text(table: &Table) -> String {
    let mut text = String::new();
    if table.has_albedo() {
        let what = if table.has_sampling() {
            "albedos by view, and where light comes from"
        } else {
            "albedos by view"
        };
        text += &format!("  sampling   {}: {what}\n", bytes(table.sampling_bytes()));
    }
    if table.energy() == Energy::PerView {
        text += "  energy     ρ is divided by the albedo of views where that is above 1\n";
    }
    text
}

/// What the table was baked for, and what that left out.
pub(crate) fn scope_text(scope: Option<&ScopeNote>) -> String {
    let Some(scope) = scope else {
        return String::new();
    };
    let mut text = String::new();
    match scope.share {
        Some(share) if share > 0.0 => {
            text += &format!(
                "  baked for  {:.1} % of all pairs of directions; others get the nearest value, and are counted\n",
                100.0 * share
            );
        }
        Some(_) => {
            text += "  baked for  light from the viewer's direction; other pairs get the nearest value, and are counted\n";
        }
        None => {}
    }
    if scope.fixed_albedo {
        text += "  albedo     stays as it is\n";
    }
    text
}

fn energy_text(fabric: &Fabric, reflectance: &Reflectance) -> String {
    let mut text = String::new();
    if fabric.rho_scale < 1.0 {
        text += &format!("             scaled by {}\n", fabric.rho_scale);
    }
    if !reflectance.conserves_energy() {
        text += "             more than arrives: so are the parameters; `bake --energy clamp` scales ρ\n";
    }
    text
}

fn thread_text(thread: &ThreadTable) -> String {
    let mut parts = vec![format!("covers {:.0} %", 100.0 * thread.coverage())];
    let tilts: Vec<String> = thread
        .tangents()
        .tilts()
        .iter()
        .map(|tilt| format!("{:.0}°", tilt.angle.to_degrees()))
        .collect();
    if !tilts.is_empty() {
        parts.push(format!("tilts {} in closed form", tilts.join(" ")));
    }
    if let Some(grid) = thread.grid() {
        parts.push(grid_text(grid));
    }
    if let Some((rim, tilts)) = thread.rim() {
        let from = 0.01 * f64::from(rim.hundredths());
        parts.push(format!(
            "within {:.0}° of its horizon {tilts} tilts per segment",
            from.to_degrees()
        ));
    }
    if let Some(grid) = thread.projection_grid() {
        parts.push(format!("projection {}", grid_text(grid)));
    }
    if let Some(nodes) = thread.direct_nodes() {
        let segments = thread.tangents().segments().len();
        parts.push(format!(
            "{} evaluated at {} each",
            counted(segments, "segment"),
            counted(nodes, "placed tilt")
        ));
    }
    format!("  {:<10} {}\n", thread.name(), parts.join(", "))
}

fn grid_text(grid: &Grid) -> String {
    let coordinates = grid.coordinates();
    let names = coordinates.names();
    let axis = |(axis, name): (&Axis, &&str)| format!("{name} {}", axis.len());
    let axes: Vec<String> = grid.axes().iter().zip(names).map(axis).collect();
    let (chart, fold) = match coordinates {
        Coordinates::Thread {
            chart,
            ends_fold,
            sides_fold,
            ..
        } => {
            let mut fold = String::new();
            if ends_fold {
                fold += &format!(", folded at {} = 0 (both ends look the same)", names[0]);
            }
            if !sides_fold {
                fold += ", not folded at phi_h = 0 (its sides differ)";
            }
            (name_of(&chart), fold)
        }
        Coordinates::Isotropic => (
            "isotropic".to_owned(),
            ", without a fourth axis (all directions look the same)".to_owned(),
        ),
        Coordinates::View { .. } => ("view".to_owned(), String::new()),
    };
    let [baked, cells] = grid.baked_cells();
    let mut left_out = String::new();
    if baked < cells {
        left_out += &format!(
            ", of which {:.1} % of the cells are needed",
            100.0 * baked as f64 / cells as f64
        );
    }
    left_out += match grid.content() {
        Content::Both => "",
        Content::Surface => ", without V (the albedo is 0 and stays so)",
        Content::Volume => ", without S (eta is 1: no surface reflects)",
        Content::Dyed => ", S + A V in one channel (the albedo is grey and stays as it is)",
    };
    format!(
        "{chart} chart, {} coefficients{left_out}, {}{fold}",
        axes.join(" × "),
        bytes(grid.bytes())
    )
}

/// The name that files and flags use.
fn name_of(value: &impl serde::Serialize) -> String {
    serde_json::to_value(value)
        .ok()
        .and_then(|name| name.as_str().map(str::to_owned))
        .unwrap_or_default()
}

fn info_json(table: &Table, provenance: &Provenance, fabric: &Fabric, file_bytes: usize) -> Value {
    let axis = |(axis, name): (&Axis, &&str)| json!({ "name": name, "coefficients": axis.len(), "knots": axis.knots().collect::<Vec<f64>>() });
    let grid = |grid: &Grid| {
        let coordinates = grid.coordinates();
        let (chart, ends_fold, sides_fold) = match coordinates {
            Coordinates::Thread {
                chart,
                ends_fold,
                sides_fold,
                ..
            } => (name_of(&chart), ends_fold, sides_fold),
            Coordinates::Isotropic => ("isotropic".to_owned(), false, true),
            Coordinates::View { .. } => ("view".to_owned(), false, false),
        };
        json!({
            "chart": chart,
            "folded": ends_fold,
            "sides_folded": sides_fold,
            "bytes": grid.bytes(),
            "content": grid.content(),
            "cells": { "baked": grid.baked_cells()[0], "all": grid.baked_cells()[1] },
            "axes": grid.axes().iter().zip(coordinates.names()).map(axis).collect::<Value>(),
        })
    };
    let thread = |thread: &ThreadTable| {
        let tangents = thread.tangents();
        let tilts = tangents
            .tilts()
            .iter()
            .map(|tilt| json!({ "angle": tilt.angle, "weight": tilt.weight }));
        let segments = tangents
            .segments()
            .iter()
            .map(|part| json!({ "from": part.from, "to": part.to, "weight": part.weight }));
        json!({
            "name": thread.name(),
            "coverage": thread.coverage(),
            "albedo": thread.albedo(),
            "tilts": tilts.collect::<Value>(),
            "segments": segments.collect::<Value>(),
            "direct_nodes": thread.direct_nodes(),
            "rim": thread.rim().map(|(rim, tilts)| json!({ "from": 0.01 * f64::from(rim.hundredths()), "nodes": tilts })),
            "grid": thread.grid().map(grid),
            "projection_grid": thread.projection_grid().map(grid),
        })
    };
    json!({
        "format": format!("{VERSION}"),
        "file_bytes": file_bytes,
        "decoded_bytes": table.decoded_bytes(),
        "reweighting": table.reweighting(),
        "rho_scale": table.rho_scale(),
        "energy": table.energy(),
        "sampling_bytes": table.sampling_bytes(),
        "reflectance": Reflectance::of_fabric(fabric),
        "reflectance_of_models": reflectance_of_models(fabric)
            .map(|(kind, reflectance)| (kind.name().to_owned(), json!(reflectance)))
            .collect::<Map<String, Value>>(),
        "threads": table.threads().iter().map(thread).collect::<Value>(),
        "tool": provenance.tool,
        "scope": provenance.scope,
        "settings": provenance.settings,
        "fabric": provenance.fabric,
        "error": provenance.error,
        "choices": provenance.choices,
    })
}
