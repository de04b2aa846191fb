//! Pictures of cloth on cylinders and on a sphere, which show in one frame how it reflects at every angle.
//!
//! The camera is orthographic and looks along the normal of the picture's plane, −z; x is to the right and y upwards. One
//! directional light of irradiance π at normal incidence lights the cloth, and nothing shadows it, so that the radiance of a pixel is
//!
//! ```text
//! L = π ρ(wi, wr),      ρ = BRDF × cosine
//! ```
//!
//! and a white Lambertian surface that faces the light has L = 1. [`Shape::Cylinders`] is the setup of \[Fecho13\] chapters 4 and 5
//! (figures 4.1 and 5.1), [`Shape::Sphere`] the mapping that 6.1.3 proposes. A [`Picture`] holds linear radiance and coverage;
//! [`Display`] is what a screen shows of it, by the exponent 1/2.2 that the thesis takes.

mod cloth;
mod compare;
mod curves;
mod display;
mod exr;
mod shape;

use cloth::Points;
pub use cloth::{Cloth, Swatch};
pub use compare::{Comparison, compare};
pub use curves::{Curve, CurvePoint, CylinderCurve, curves, curves_csv, curves_svg};
pub use display::Display;
pub use exr::{Layer, to_exr};
pub use shape::{Cylinder, Place, Shape};

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::progress::{Cancelled, Progress};

/// Who made a file.
const TOOL: &str = concat!("sateen ", env!("CARGO_PKG_VERSION"));

/// How a picture is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Rows of the picture, at least 1.
    pub size: usize,
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// Unit vector to the light: x right, y up, z to the viewer.
    pub light: [f64; 3],
    /// How often a pattern repeats across half the circumference of a cylinder or the sphere.
    pub repeats: f64,
}

impl View {
    /// A light that is turned from the camera to the right by `azimuth`, and raised by `elevation`, radians.
    pub fn light_at(azimuth: f64, elevation: f64) -> [f64; 3] {
        [
            azimuth.sin() * elevation.cos(),
            elevation.sin(),
            azimuth.cos() * elevation.cos(),
        ]
    }
}

/// Linear radiance and coverage.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// Rows, the first at the top.
    pub height: usize,
    /// `[row][column]`: red, green and blue, already multiplied by coverage, and coverage, the share of the pixel's samples that
    /// meet cloth.
    pub pixels: Vec<[f32; 4]>,
}

/// Pairs that are evaluated at once, about.
const BATCH: usize = 4096;

/// Takes the picture. The result does not depend on the number of threads.
///
/// # Errors
/// When `progress` says stop.
pub fn render(
    shape: Shape,
    cloth: &Cloth,
    view: &View,
    progress: Progress<'_>,
) -> Result<Picture, Cancelled> {
    let (width, height) = (shape.width(view.size), view.size);
    // Of upright cylinders in one colour all rows are the same.
    let is_one_row = shape == Shape::Cylinders && cloth.period().is_none();
    let rows = if is_one_row { 1 } else { height };
    let offsets = offsets(view.samples.max(1));
    let pixels = (BATCH / offsets.len()).clamp(1, width);
    let runs_per_row = width.div_ceil(pixels);
    let steps = progress.steps(rows * runs_per_row);
    let runs: Vec<Vec<[f32; 4]>> = (0..rows * runs_per_row)
        .into_par_iter()
        .map(|run| {
            let from = run % runs_per_row * pixels;
            let columns = from..width.min(from + pixels);
            let run = run_of_pixels(shape, cloth, view, &offsets, run / runs_per_row, columns);
            steps.advance().map(|()| run)
        })
        .collect::<Result<_, Cancelled>>()?;
    let mut pixels = runs.concat();
    if is_one_row {
        pixels = pixels.repeat(height);
    }
    Ok(Picture {
        width,
        height,
        pixels,
    })
}

fn run_of_pixels(
    shape: Shape,
    cloth: &Cloth,
    view: &View,
    offsets: &[[f64; 2]],
    row: usize,
    columns: std::ops::Range<usize>,
) -> Vec<[f32; 4]> {
    let scale = 2.0 / view.size as f64;
    let half_width = 0.5 * shape.width(view.size) as f64;
    let half_height = 0.5 * view.size as f64;
    let mut points = Points::new(cloth, view);
    // Which pixel of the run each point is of.
    let mut owners = Vec::new();
    for (pixel, column) in columns.clone().enumerate() {
        for [dx, dy] in offsets {
            let x = scale * (column as f64 + dx - half_width);
            let y = scale * (half_height - row as f64 - dy);
            if let Some(place) = shape.at(x, y) {
                points.push(&place);
                owners.push(pixel);
            }
        }
    }
    let mut sums = vec![[0.0; 4]; columns.len()];
    for (radiance, owner) in points.radiance().into_iter().zip(owners) {
        for (sum, value) in sums[owner].iter_mut().zip(radiance) {
            *sum += f64::from(value);
        }
        sums[owner][3] += 1.0;
    }
    let share = 1.0 / offsets.len() as f64;
    let mean = |sum: [f64; 4]| sum.map(|sum| (sum * share) as f32);
    sums.into_iter().map(mean).collect()
}

/// Where in a pixel its samples are, from the upper left corner: the additive recurrence on the two-dimensional golden ratio, which
/// is spread evenly for any count, and begins at the centre.
fn offsets(count: u32) -> Vec<[f64; 2]> {
    /// 1/g and 1/g², g³ = g + 1.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    (0..count)
        .map(|k| STEPS.map(|step| (0.5 + f64::from(k) * step).fract()))
        .collect()
}

/// Radiance of ρ under the light.
fn radiance(rho: f32) -> f32 {
    (PI * f64::from(rho)) as f32
}
