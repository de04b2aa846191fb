//! `sateen fabrics`

use anyhow::Result;
use sateen::fabric::{Fabric, LIBRARY, LibraryEntry, Thread};
use serde_json::{Value, json};

use crate::Outcome;
use crate::args::FabricsArgs;
use crate::output::{print, print_json};

pub(crate) fn run(args: &FabricsArgs) -> Result<Outcome> {
    let fabrics: Vec<Fabric> = LIBRARY.iter().map(LibraryEntry::load).collect();
    if args.json {
        print_json(&fabrics.iter().map(fabric_json).collect())?;
        return Ok(Outcome::Done);
    }
    let widest = fabrics.iter().map(|fabric| fabric.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for fabric in &fabrics {
        let threads: Vec<&str> = fabric.visible_threads().map(|thread| thread.name.as_str()).collect();
        text += &format!("{:<widest$}  {:<10}  {}\n", fabric.name, threads.join("+"), fabric.title);
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
        "correlation_width_deg": fabric.sigma_u.to_degrees(),
        "threads": fabric.threads.iter().map(thread_json).collect::<Value>(),
    })
}

fn thread_json(thread: &Thread) -> Value {
    json!({
        "name": thread.name,
        "direction_deg": thread.direction.to_degrees(),
        "coverage": thread.coverage,
        "albedo": thread.albedo,
        "eta": thread.optics.eta,
        "k_d": thread.optics.k_d,
        "gamma_s_deg": thread.optics.gamma_s.to_degrees(),
        "gamma_v_deg": thread.optics.gamma_v.to_degrees(),
        "tangent_offsets_deg": thread.tangent_offsets.iter().map(|offset| offset.to_degrees()).collect::<Value>(),
        "tangent_lengths": thread.tangent_lengths,
    })
}
