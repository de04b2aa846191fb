//! `sateen fabrics`

use anyhow::Result;
use sateen::fabric::{Fabric, LIBRARY, LibraryEntry, Thread};
use serde_json::{Value, json};

use crate::Outcome;
use crate::args::Print;
use crate::output::{print, print_json};

/// List the fabrics of the library.
#[derive(clap::Args)]
pub(crate) struct FabricsArgs {
    #[command(flatten)]
    print: Print,
}

pub(crate) fn run(args: &FabricsArgs) -> Result<Outcome> {
    let fabrics: Vec<Fabric> = LIBRARY.iter().map(LibraryEntry::load).collect();
    if args.print.json {
        let fabrics: Value = fabrics.iter().map(fabric_json).collect();
        print_json("fabrics", json!({ "fabrics": fabrics }))?;
        return Ok(Outcome::Done);
    }
    let widest = |of: fn(&Fabric) -> &str| {
        let widths = fabrics.iter().map(|fabric| of(fabric).chars().count());
        widths.max().unwrap_or(0)
    };
    let (name, title) = (
        widest(|fabric| &fabric.name),
        widest(|fabric| &fabric.title),
    );
    let mut text = String::new();
    for fabric in &fabrics {
        let threads: Vec<&str> = fabric
            .visible_threads()
            .map(|thread| thread.name.as_str())
            .collect();
        text += &format!(
            "{:<name$}  {:<title$}  {}\n",
            fabric.name,
            fabric.title,
            threads.join("+")
        );
    }
    print(&text)?;
    Ok(Outcome::Done)
}

fn fabric_json(fabric: &Fabric) -> Value {
    json!({
        "name": fabric.name,
        "title": fabric.title,
        "source": fabric.source,
        "reweighting": fabric.reweighting,
        "correlation_width_deg": degrees(fabric.sigma_u),
        "rho_scale": fabric.rho_scale,
        "threads": fabric.threads.iter().map(thread_json).collect::<Value>(),
    })
}

fn thread_json(thread: &Thread) -> Value {
    let directions: Value = if thread.is_straight() {
        degrees(thread.direction()).into()
    } else {
        thread.directions.iter().copied().map(degrees).collect()
    };
    json!({
        "name": thread.name,
        "direction_deg": directions,
        "coverage": thread.coverage,
        "albedo": thread.albedo,
        "eta": thread.optics.eta,
        "k_d": thread.optics.k_d,
        "gamma_s_deg": degrees(thread.optics.gamma_s),
        "gamma_v_deg": degrees(thread.optics.gamma_v),
        "tangent_offsets_deg": thread.tangent_offsets.iter().map(|offset| degrees(*offset)).collect::<Value>(),
        "tangent_lengths": thread.tangent_lengths,
    })
}

/// As the file has it: without the noise that radians and back leave behind.
fn degrees(radians: f64) -> f64 {
    (radians.to_degrees() * 1e9).round() / 1e9
}
