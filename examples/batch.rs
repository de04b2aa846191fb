//! Evaluates many pairs at once, with AVX-512, AVX2 or NEON, whichever the machine has: several times as fast as one by one.
//!
//! `cargo run --release --example batch -- denim.sateen`, after `sateen bake denim -o denim.sateen`.
#![allow(clippy::print_stdout, reason = "it is what an example is for")]

use std::error::Error;
use std::time::Instant;

use sateen::table::Table;

const PAIRS: usize = 4096;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: batch TABLE")?;
    let table = Table::from_bytes(&std::fs::read(path)?)?;

    // One slice for each coordinate: lights go around, the viewer rises.
    let turn = |k: usize| k as f32 / PAIRS as f32;
    let column = |of: &dyn Fn(f32) -> f32| (0..PAIRS).map(|k| of(turn(k))).collect::<Vec<_>>();
    let light_x = column(&|s| 0.6 * (40.0 * s).cos());
    let light_y = column(&|s| 0.6 * (40.0 * s).sin());
    let light_z = vec![0.8; PAIRS];
    let view_x = vec![0.0; PAIRS];
    let view_y = column(&|s| (1.5 * (1.0 - s)).sin());
    let view_z = column(&|s| (1.5 * (1.0 - s)).cos());
    let (mut red, mut green, mut blue) = (vec![0.0; PAIRS], vec![0.0; PAIRS], vec![0.0; PAIRS]);

    let start = Instant::now();
    table.eval_cos_batch(
        [&light_x, &light_y, &light_z],
        [&view_x, &view_y, &view_z],
        [&mut red, &mut green, &mut blue],
    );
    let nanoseconds = start.elapsed().as_secs_f64() * 1e9 / PAIRS as f64;
    let mean = |channel: &[f32]| channel.iter().sum::<f32>() / PAIRS as f32;
    println!("{PAIRS} pairs, {nanoseconds:.0} ns each");
    println!(
        "mean of BRDF × cosine: {:.5} {:.5} {:.5}",
        mean(&red),
        mean(&green),
        mean(&blue)
    );
    Ok(())
}
