//! Radiance across the cylinders, averaged along the axis (\[Fecho13\] figures 4.2 to 5.11), as numbers and as a drawing.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write;

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use rayon::prelude::*;

use super::points::Points;
use super::{Cloth, Cylinder, Scene, Shape, View};
use crate::progress::{Cancelled, Progress};

/// Radiance across a cylinder.
#[derive(Debug, Clone, PartialEq)]
pub struct CylinderCurve {
    /// Which one.
    pub cylinder: Cylinder,
    /// From left to right.
    pub curve: Curve,
}

/// Radiance from left to right.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve(
    /// By ascending angle.
    pub Vec<CurvePoint>,
);

/// Where on a cylinder, and how bright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint {
    /// Angle of the normal from the camera to the right, radians.
    pub angle: f64,
    /// Linear RGB.
    pub radiance: [f64; 3],
}

impl CurvePoint {
    /// Where across the cylinder that is seen, −1 to 1.
    pub fn x(&self) -> f64 {
        self.angle.sin()
    }
}

impl Curve {
    /// Highlights: indices of the local maxima of `value` that stand out by at least `share` of the largest value. A maximum stands
    /// out by how far one must come down from it to get higher, on the shallower side; beyond the ends of the curve it is
    /// dark. Of a plateau the middle counts.
    pub fn peaks(&self, share: f64, value: impl Fn([f64; 3]) -> f64) -> Vec<usize> {
        let values: Vec<f64> = self.0.iter().map(|point| value(point.radiance)).collect();
        let most = values.iter().copied().fold(0.0, f64::max);
        let mut peaks = Vec::new();
        let mut from = 0;
        while from < values.len() {
            let height = values[from];
            let same = values[from..].iter().take_while(|x| **x == height);
            let to = from + same.count().max(1);
            let rises = from == 0 || values[from - 1] < height;
            let falls = to == values.len() || values[to] < height;
            if rises && falls {
                let left = descent(height, values[..from].iter().rev());
                let right = descent(height, values[to..].iter());
                if height > 0.0 && left.min(right) >= share * most {
                    peaks.push((from + to - 1) / 2);
                }
            }
            from = to;
        }
        peaks
    }
}

/// How far down from `height` on the way to what is higher, or into the dark.
fn descent<'a>(height: f64, way: impl Iterator<Item = &'a f64>) -> f64 {
    let mut lowest = height;
    for x in way {
        if *x > height {
            return height - lowest;
        }
        lowest = lowest.min(*x);
    }
    height
}

/// Points of a curve: every quarter of a degree.
const POINTS: u32 = 719;
/// Heights that a pattern is averaged over.
const HEIGHTS: u32 = 64;

/// The curves of the three cylinders, from the left.
///
/// # Errors
/// When `progress` says stop.
pub fn curves(
    cloth: &Cloth,
    view: &View<'_>,
    progress: Progress<'_>,
) -> Result<Vec<CylinderCurve>, Cancelled> {
    let heights = if cloth.period().is_some() { HEIGHTS } else { 1 };
    // The picture is 10/3 radii high.
    let height = |k: u32| (f64::from(2 * k + 1) / f64::from(heights) - 1.0) / 0.6;
    let steps = progress.steps(3 * POINTS as usize);
    Cylinder::ALL
        .into_iter()
        .map(|cylinder| {
            let point = |k: u32| {
                let angle = FRAC_PI_2 * (f64::from(2 * (k + 1)) / f64::from(POINTS + 1) - 1.0);
                let mut radiance = [0.0; 3];
                for light in view.lights {
                    let mut points =
                        Points::new(cloth, light, view.repeats / Shape::Cylinders.span());
                    for k in 0..heights {
                        points.push(&cylinder.at(angle, height(k)));
                    }
                    for point in points.radiance() {
                        for (sum, value) in radiance.iter_mut().zip(point) {
                            *sum += f64::from(value) / f64::from(heights);
                        }
                    }
                }
                steps.advance().map(|()| CurvePoint { angle, radiance })
            };
            let points: Vec<CurvePoint> = (0..POINTS)
                .into_par_iter()
                .map(point)
                .collect::<Result<_, Cancelled>>()?;
            Ok(CylinderCurve {
                cylinder,
                curve: Curve(points),
            })
        })
        .collect()
}

const CSV_HEADER: &str = "cylinder,x,angle_deg,r,g,b\n";

/// Whether a file begins as those of [`curves_csv`] and [`curves_svg`] do.
pub fn is_of_curves(file: &[u8]) -> bool {
    let (width, height) = SVG_SIZE;
    let svg = format!("<svg width=\"{width}\" height=\"{height}\"");
    file.starts_with(CSV_HEADER.as_bytes()) || file.starts_with(svg.as_bytes())
}

/// The curves as CSV: cylinder, x from −1 to 1, the angle in degrees, and linear radiance.
pub fn curves_csv(curves: &[CylinderCurve]) -> String {
    let mut csv = CSV_HEADER.to_owned();
    for CylinderCurve { cylinder, curve } in curves {
        for point in &curve.0 {
            let [r, g, b] = point.radiance.map(|x| x as f32);
            writeln!(
                csv,
                "{},{:.6},{:.2},{r},{g},{b}",
                cylinder.name(),
                point.x(),
                point.angle.to_degrees()
            )
            .expect("writing to a string");
        }
    }
    csv
}

const PAPER: RGBColor = RGBColor(0xFF, 0xFF, 0xFE);
const INK: RGBColor = RGBColor(0x1F, 0x29, 0x37);
const LINES: RGBColor = RGBColor(0xE5, 0xE7, 0xEB);
/// Red, green and blue that can be told apart on paper.
const CHANNELS: [RGBColor; 3] = [
    RGBColor(0xD0, 0x2B, 0x2B),
    RGBColor(0x1B, 0x85, 0x4A),
    RGBColor(0x1D, 0x5F, 0xD6),
];
const SVG_SIZE: (u32, u32) = (1200, 420);

/// The curves side by side as SVG.
pub fn curves_svg(title: &str, curves: &[CylinderCurve]) -> String {
    let mut svg = String::new();
    draw(&mut svg, title, curves).expect("drawing into memory");
    svg
}

fn draw(
    svg: &mut String,
    title: &str,
    curves: &[CylinderCurve],
) -> Result<(), Box<dyn std::error::Error>> {
    let root = SVGBackend::with_string(svg, SVG_SIZE).into_drawing_area();
    root.fill(&PAPER)?;
    let font = |size: u32| ("sans-serif", size).into_text_style(&SVG_SIZE).color(&INK);
    let centred = font(24).pos(Pos::new(HPos::Center, VPos::Top));
    root.draw(&Text::new(
        title.to_owned(),
        (SVG_SIZE.0 as i32 / 2, 12),
        centred,
    ))?;
    let all = curves.iter().flat_map(|curve| &curve.curve.0);
    let most = all
        .flat_map(|point| point.radiance)
        .fold(0.0, f64::max)
        .max(1e-6);
    let (_, below) = root.split_vertically(44);
    for (area, CylinderCurve { cylinder, curve }) in below
        .split_evenly((1, curves.len().max(1)))
        .iter()
        .zip(curves)
    {
        let mut chart = ChartBuilder::on(area)
            .margin(12)
            .x_label_area_size(58)
            .y_label_area_size(66)
            .build_cartesian_2d(-1.0..1.0, 0.0..1.05 * most)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(LINES)
            .axis_style(LINES)
            .x_labels(5)
            .y_labels(6)
            .label_style(font(17))
            .axis_desc_style(font(19))
            .x_desc(format!("warp {}", cylinder.name()))
            .y_desc("radiance")
            .draw()?;
        for (channel, colour) in CHANNELS.iter().enumerate() {
            let at = |at: &CurvePoint| (at.x(), at.radiance[channel]);
            let line: Vec<(f64, f64)> = curve.0.iter().map(at).collect();
            chart.draw_series([PathElement::new(line, colour.stroke_width(2))])?;
        }
    }
    root.present()?;
    drop(below);
    drop(root);
    Ok(())
}
