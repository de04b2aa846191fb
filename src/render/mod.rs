//! Pictures of cloth on cylinders and on a sphere, which show in one frame how it reflects at every angle.
//!
//! The camera is orthographic and looks along the normal of the picture's plane, −z; x is to the right and y upwards. Directional
//! lights of irradiance π e at normal incidence light the cloth, so that the radiance of a pixel is
//!
//! ```text
//! L = Σ π e ρ(wi, wr),      ρ = BRDF × cosine
//! ```
//!
//! and a white Lambertian surface that faces one light of strength e = 1 has L = 1. [`Shape::Cylinders`] is the setup of \[Fecho13\] chapters 4 and 5
//! (figures 4.1 and 5.1), [`Shape::Sphere`] the mapping that 6.1.3 proposes, neither of which
//! shadows itself; a [`Drape`] is cloth that hangs, or any mesh, and does. A [`Picture`] holds linear radiance and coverage;
//! [`Display`] is what a screen shows of it.

mod caption;
mod compare;
mod curves;
mod display;
mod drape;
mod exr;
mod points;
mod shape;

pub use compare::{Comparison, compare};
pub use curves::{Curve, CurvePoint, CylinderCurve, curves, curves_csv, curves_svg, is_of_curves};
pub use display::Display;
pub use drape::Drape;
pub use exr::{Layer, to_exr};
#[cfg(feature = "scene")]
pub(crate) use points::Pairs;
use points::Points;
pub use shape::{Cylinder, Shape};

pub use crate::evaluator::{Cloth, MISSING, Missing};

use std::f64::consts::PI;

use rayon::prelude::*;

pub use crate::mesh::{Mesh, MeshError, Place, curtain, load_mesh, skirt, trousers};
use crate::progress::{Cancelled, Progress};

/// How a picture is taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View<'a> {
    /// Rows of the picture, at least 1.
    pub size: usize,
    /// Samples per pixel, at least 1.
    pub samples: u32,
    /// What lights the cloth.
    pub lights: &'a [Light],
    /// How often a pattern repeats across half the circumference of a cylinder or the sphere, or along a curtain's rail.
    pub repeats: f64,
}

/// A directional light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Unit vector to it: x right, y up, z to the viewer.
    pub direction: [f64; 3],
    /// Its irradiance at normal incidence over π.
    pub strength: f64,
}

impl Light {
    /// One light of irradiance π.
    pub const fn of(direction: [f64; 3]) -> Self {
        Self {
            direction,
            strength: 1.0,
        }
    }

    /// The direction to a light that is turned from the camera to the right by `azimuth`, and raised by `elevation`, radians.
    pub fn direction_at(azimuth: f64, elevation: f64) -> [f64; 3] {
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

/// What is seen in a picture, half the height of which is 1.
pub trait Scene: Sync {
    /// Columns of a picture of that many rows.
    fn width(&self, height: usize) -> usize;

    /// The cloth seen at (x, y), from the middle of the picture to the right and upwards.
    fn at(&self, x: f64, y: f64) -> Option<Seen>;

    /// Whether nothing is between a place and the light in that direction.
    fn is_lit(&self, seen: &Seen, light: [f64; 3]) -> bool;

    /// The length of cloth, in units of [`Place::arc`], along which a pattern repeats [`View::repeats`] times.
    fn span(&self) -> f64;

    /// Whether all rows are the same if the cloth is the same everywhere.
    fn has_equal_rows(&self) -> bool;
}

/// Cloth that is seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// How the cloth lies there.
    pub place: Place,
    /// Where: x right, y up, z to the viewer, half the height of the picture 1.
    pub position: [f64; 3],
}

/// Pairs that are evaluated at once, about.
const BATCH: usize = 4096;

/// Takes the picture. The result does not depend on the number of workers.
///
/// # Errors
/// When `progress` says stop.
pub fn render(
    scene: &dyn Scene,
    cloth: &Cloth,
    view: &View<'_>,
    progress: Progress<'_>,
) -> Result<Picture, Cancelled> {
    let (width, height) = (scene.width(view.size), view.size);
    let is_one_row = scene.has_equal_rows() && cloth.period().is_none();
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
            let run = run_of_pixels(scene, cloth, view, &offsets, run / runs_per_row, columns);
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
    scene: &dyn Scene,
    cloth: &Cloth,
    view: &View<'_>,
    offsets: &[[f64; 2]],
    row: usize,
    columns: std::ops::Range<usize>,
) -> Vec<[f32; 4]> {
    let scale = 2.0 / view.size as f64;
    let half_width = 0.5 * scene.width(view.size) as f64;
    let half_height = 0.5 * view.size as f64;
    // What samples meet, and which pixel of the run they are of.
    let mut met = Vec::new();
    for (pixel, column) in columns.clone().enumerate() {
        for [dx, dy] in offsets {
            let x = scale * (column as f64 + dx - half_width);
            let y = scale * (half_height - row as f64 - dy);
            met.extend(scene.at(x, y).map(|seen| (pixel, seen)));
        }
    }
    let mut sums = vec![[0.0; 4]; columns.len()];
    for (pixel, _) in &met {
        sums[*pixel][3] += 1.0;
    }
    for light in view.lights {
        let mut points = Points::new(cloth, light, view.repeats / scene.span());
        let mut owners = Vec::new();
        let lit = met
            .iter()
            .filter(|(_, seen)| scene.is_lit(seen, light.direction));
        for (pixel, seen) in lit {
            points.push(&seen.place);
            owners.push(*pixel);
        }
        for (radiance, owner) in points.radiance().into_iter().zip(owners) {
            for (sum, value) in sums[owner].iter_mut().zip(radiance) {
                *sum += f64::from(value);
            }
        }
    }
    let share = 1.0 / offsets.len() as f64;
    let mean = |sum: [f64; 4]| sum.map(|sum| (sum * share) as f32);
    sums.into_iter().map(mean).collect()
}

/// Where in a pixel its samples are, from the upper left corner: the additive recurrence on the two-dimensional golden ratio, which
/// is spread evenly for any count, and begins at the centre.
pub(crate) fn offsets(count: u32) -> Vec<[f64; 2]> {
    /// 1/g and 1/g², g³ = g + 1.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    (0..count)
        .map(|k| STEPS.map(|step| (0.5 + f64::from(k) * step).fract()))
        .collect()
}

/// Radiance of ρ under a light.
fn radiance(rho: f32, strength: f64) -> f32 {
    (PI * strength * f64::from(rho)) as f32
}
