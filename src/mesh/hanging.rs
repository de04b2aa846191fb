//! Cloth that hangs: a pleated curtain and a trouser leg (and for scenes a skirt), as \[Fecho13\] figures A.2 to A.4 show.
//!
//! A curtain's warp hangs down. Across it the cloth does not stretch: with s along the weft,
//!
//! ```text
//! z(s) = a cos θ(s),   θ = 2π n (s + 0.04 sin 2π·1.5 s),   x(s) = ∫ √(1 − z'²) ds
//! ```
//!
//! and the pleats open slowly and lean a little from the rail down. A trouser leg is a tube around a line that bends at the knee, with
//! wrinkles where it bends; its warp goes down the leg.

use std::f64::consts::{PI, TAU};

use glam::Vec2;

use super::Mesh;

const PLEATS: f64 = 7.0;
/// Amplitude of pleats at the rail, in widths of the flat cloth: just short of pleats whose sides are parallel.
const DEPTH: f64 = 0.0162;

/// A pleated curtain, 1 wide before it is pleated and 0.9 high.
pub fn curtain() -> Mesh {
    const HEIGHT: f64 = 0.9;
    const COLUMNS: u32 = 640;
    let theta = |s: f64, v: f64| TAU * PLEATS * (s + 0.04 * (TAU * 1.5 * s + 0.7 * v).sin());
    let depth = |v: f64| DEPTH * (1.0 - 0.25 * v);
    let z = |s: f64, v: f64| depth(v) * theta(s, v).cos();
    // ∫ √(1 − z'²) ds along the rail and along the hem; between them x changes evenly.
    const STEPS: usize = 4000;
    let edge = |v: f64| {
        let step = 1.0 / STEPS as f64;
        let mut sums = vec![0.0];
        for k in 0..STEPS {
            let s = step * k as f64;
            let slope = (z(s + step, v) - z(s, v)) / step;
            sums.push(sums[k] + step * (1.0 - slope * slope).max(0.0).sqrt());
        }
        sums
    };
    let edges = [edge(0.0), edge(1.0)];
    let between = |sums: &[f64], s: f64| {
        let (k, part) = cell(s, STEPS);
        sums[k] + (sums[k + 1] - sums[k]) * part - 0.5 * sums[STEPS]
    };
    let size = Vec2::new(HEIGHT as f32, 1.0);
    Mesh::sheet(160, COLUMNS, size, |u, s| {
        let [rail, hem] = edges.each_ref().map(|sums| between(sums, s));
        [rail + (hem - rail) * u, -HEIGHT * u, z(s, u)]
    })
}

/// A bent trouser leg, seen from the side.
pub fn trousers() -> Mesh {
    const LENGTH: f64 = 1.0;
    const RADIUS: f64 = 0.14;
    /// How far the knee bends, radians.
    const BEND: f64 = 0.9;
    /// Along how much of the leg it does.
    const KNEE: f64 = 0.12;
    // The direction of the leg's line at a share of its length: down and forwards, then down and backwards.
    let lean = |u: f64| BEND * (0.35 - 1.0 / (1.0 + (-(u - 0.5) / (0.25 * KNEE)).exp()));
    const STEPS: usize = 2000;
    let mut line = vec![[0.0; 2]];
    for k in 0..STEPS {
        let (sin, cos) = lean((k as f64 + 0.5) / STEPS as f64).sin_cos();
        let [x, y] = line[k];
        let step = LENGTH / STEPS as f64;
        line.push([x + step * sin, y - step * cos]);
    }
    let size = Vec2::new(LENGTH as f32, (TAU * RADIUS) as f32);
    Mesh::sheet(400, 240, size, move |u, v| {
        let (k, part) = cell(u, STEPS);
        let [x, y] = [0, 1].map(|axis| line[k][axis] + (line[k + 1][axis] - line[k][axis]) * part);
        let (sin, cos) = lean(u).sin_cos();
        let around = TAU * v - PI;
        // Wrinkles stand across the leg behind the knee, where cloth is pressed together, and die out from there.
        let beside = (u - 0.5) / KNEE;
        let pressed = (-beside * beside).exp() * (0.6 - 0.4 * around.cos());
        let wrinkle = 0.11 * pressed * (TAU * 2.6 * beside + 0.8 * around.sin()).sin();
        let radius = RADIUS * (1.15 - 0.3 * u + wrinkle);
        // Around the line: forwards is (cos, −sin) turned from down.
        let (side, forwards) = (radius * around.sin(), radius * around.cos());
        [x + forwards * cos, y + forwards * sin, side]
    })
}

/// A skirt, 0.8 long, as a tube that widens downwards into folds. Its warp hangs down.
pub fn skirt() -> Mesh {
    const LENGTH: f64 = 0.8;
    const WAIST: f64 = 0.13;
    const FOLDS: f64 = 9.0;
    let size = Vec2::new(LENGTH as f32, (TAU * WAIST) as f32);
    Mesh::sheet(120, 720, size, |u, v| {
        let around = TAU * v - PI;
        let fold = 0.16 * u * (FOLDS * around + 0.6 * (2.0 * around).sin()).cos();
        let radius = WAIST * (1.0 + 0.9 * u) * (1.0 + fold);
        [radius * around.sin(), -LENGTH * u, radius * around.cos()]
    })
}

/// Which of `steps` even cells a share of their whole is in, and how far along it.
fn cell(share: f64, steps: usize) -> (usize, f64) {
    let at = (share * steps as f64).clamp(0.0, steps as f64 - 1e-9);
    (at as usize, at.fract())
}
