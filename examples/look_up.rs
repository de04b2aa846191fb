//! Loads a table and evaluates one pair of directions.
//!
//! `cargo run --example look_up -- denim.sateen`, after `sateen bake denim -o denim.sateen`.
#![allow(clippy::print_stdout, reason = "it is what an example is for")]

use std::error::Error;

use sateen::table::Table;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: look_up TABLE")?;
    // Checks the whole file: from here on nothing can fail.
    let table = Table::from_bytes(&std::fs::read(path)?)?;

    // Unit vectors in the surface frame: x along the warp, y along the weft, z the normal.
    let to_light = [0.0, 0.6, 0.8];
    let to_viewer = [0.0, 0.0, 1.0];

    let brdf = table.eval(to_light, to_viewer);
    println!("BRDF           {brdf:.5?} 1/sr, linear RGB");

    // With the cosine in it: times the light's irradiance at normal incidence it is radiance.
    let irradiance = 3.0;
    let radiance = table
        .eval_cos(to_light, to_viewer)
        .map(|rho| rho * irradiance);
    println!("radiance       {radiance:.5?}");
    Ok(())
}
