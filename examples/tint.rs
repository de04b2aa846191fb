//! Dyes cloth: a table holds no albedo, so other colours need no new bake.
//!
//! `cargo run --example tint -- denim.sateen`, after `sateen bake denim -o denim.sateen`.
#![allow(clippy::print_stdout, reason = "it is what an example is for")]

use std::error::Error;

use sateen::table::Table;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: tint TABLE")?;
    let table = Table::from_bytes(&std::fs::read(path)?)?;
    let to_light = [0.0, 0.6, 0.8];
    let to_viewer = [0.0, 0.0, 1.0];

    println!("as it is   {:.5?}", table.eval_cos(to_light, to_viewer));
    for (name, albedo) in [("red", [0.3, 0.01, 0.02]), ("blue", [0.01, 0.03, 0.3])] {
        // One albedo for each thread, linear RGB, in the order of `threads`; here the same for all.
        let albedos = vec![albedo; table.threads().len()];
        let rho = table.eval_cos_with(&albedos, to_light, to_viewer);
        println!("{name:<10} {rho:.5?}");
    }
    Ok(())
}
