//! Plots, as SVG.
//!
//! Colours are attributes in the SVG; a style sheet replaces each by its counterpart where the reader prefers dark.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::summary::{bytes, plain, short_name};
use super::{Axis, FabricReport, Family, HeatMap, Measurement, THESIS, pareto_front};

const PAPER: RGBColor = RGBColor(0xFF, 0xFF, 0xFE);
const INK: RGBColor = RGBColor(0x1F, 0x29, 0x37);
const LINES: RGBColor = RGBColor(0xE5, 0xE7, 0xEB);
const GREY: RGBColor = RGBColor(0x76, 0x7F, 0x8C);
const ORANGE: RGBColor = RGBColor(0xD9, 0x6B, 0x06);
const BLUE: RGBColor = RGBColor(0x1D, 0x5F, 0xD6);
const GREEN: RGBColor = RGBColor(0x1B, 0x85, 0x4A);

/// Every colour and what it is in the dark.
const DARK: [(RGBColor, RGBColor); 7] = [
    (PAPER, RGBColor(0x15, 0x19, 0x20)),
    (INK, RGBColor(0xE4, 0xE7, 0xEC)),
    (LINES, RGBColor(0x2E, 0x35, 0x40)),
    (GREY, RGBColor(0x9A, 0xA4, 0xB2)),
    (ORANGE, RGBColor(0xF5, 0x9E, 0x42)),
    (BLUE, RGBColor(0x6A, 0xA5, 0xFF)),
    (GREEN, RGBColor(0x5C, 0xC7, 0x8A)),
];

/// Units of the drawing, half that in pixels on a phone.
const SIZE: (u32, u32) = (640, 520);
const FONT: u32 = 25;
const LABEL_FONT: u32 = 22;
const RADIUS: i32 = 7;
/// Errors below are drawn there: rounding of single precision.
const LEAST_ERROR: f64 = 1e-6;

/// A drawing.
pub(super) struct Plot {
    /// What it shows, for the name of its file.
    pub(super) name: &'static str,
    /// For those who cannot see it.
    pub(super) caption: String,
    pub(super) svg: String,
}

impl Plot {
    /// As part of a page that has the style sheet.
    pub(super) fn inlined(&self) -> String {
        let role = format!("<svg role=\"img\" aria-label=\"{}\"", escape(&self.caption));
        self.svg.replacen("<svg", &role, 1)
    }

    /// As a file of its own.
    pub(super) fn standalone(&self) -> String {
        let style = format!(
            "xmlns=\"http://www.w3.org/2000/svg\">\n<style>{}</style>",
            style_sheet()
        );
        self.svg
            .replacen("xmlns=\"http://www.w3.org/2000/svg\">", &style, 1)
    }
}

/// All plots of a fabric.
pub(super) fn all(fabric: &FabricReport) -> Vec<Plot> {
    let has_bytes = |evaluator: &&Measurement| (BYTES.value)(evaluator).is_some();
    let mut plots = vec![Plot {
        name: "time",
        caption: "Error against time; the line is the front that nothing beats.".to_owned(),
        svg: draw(|root| error_against(root, fabric, &TIME)),
    }];
    if fabric.evaluators.iter().filter(has_bytes).count() > 1 {
        plots.push(Plot {
            name: "bytes",
            caption: "Error of tables against memory. Direct integration needs next to none."
                .to_owned(),
            svg: draw(|root| error_against(root, fabric, &BYTES)),
        });
    }
    for map in &fabric.heat {
        let (name, coordinates) = match map.x {
            Axis::Psi => ("psi-theta_d", "ψ and θ_d"),
            _ => ("phi_d-phi_h", "φ_d and φ_h"),
        };
        plots.push(Plot {
            name,
            caption: format!(
                "Where {} errs: mean relative error by {coordinates} in the frame of the {}.",
                map.evaluator, map.thread
            ),
            svg: draw(|root| heat_map(root, map)),
        });
    }
    plots
}

/// Dark counterparts of the drawings' colours.
pub(super) fn style_sheet() -> String {
    let rule = |(light, dark): &(RGBColor, RGBColor)| {
        let (light, dark) = (hex(*light), hex(*dark));
        format!("[fill=\"{light}\"]{{fill:{dark}}}[stroke=\"{light}\"]{{stroke:{dark}}}")
    };
    let rules: String = DARK.iter().map(rule).collect();
    format!(
        "svg text{{font-family:system-ui,sans-serif}}svg rect{{shape-rendering:crispEdges}}@media (prefers-color-scheme:dark){{{rules}}}"
    )
}

/// The colour of paper, ink, lines and links: light and dark.
pub(super) fn page_colours() -> [[String; 2]; 4] {
    [0, 1, 2, 5].map(|index| [hex(DARK[index].0), hex(DARK[index].1)])
}

fn hex(colour: RGBColor) -> String {
    format!("#{:02X}{:02X}{:02X}", colour.0, colour.1, colour.2)
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('"', "&quot;")
}

type Root<'a> = DrawingArea<SVGBackend<'a>, Shift>;
type DrawError<'a> = DrawingAreaErrorKind<<SVGBackend<'a> as DrawingBackend>::ErrorType>;
type Drawn<'a> = Result<(), DrawError<'a>>;

fn draw(what: impl for<'a> Fn(&Root<'a>) -> Drawn<'a>) -> String {
    let mut svg = String::new();
    let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
    root.fill(&PAPER)
        .and_then(|()| what(&root))
        .and_then(|()| root.present())
        .expect("drawing into memory");
    drop(root);
    svg
}

/// What error is drawn against.
struct Against {
    label: &'static str,
    value: fn(&Measurement) -> Option<f64>,
    tick: fn(f64) -> String,
}

const TIME: Against = Against {
    label: "time per pair [ns]",
    value: |evaluator| Some(evaluator.ns),
    tick: plain,
};
/// A table without grid has no place on a logarithmic axis, and direct integration would leave tables none.
const BYTES: Against = Against {
    label: "bytes in memory",
    value: |evaluator| {
        // In batches a table has the same bytes and errs alike.
        let counts = evaluator.family == Family::Table && !evaluator.batch;
        let bytes = counts.then_some(evaluator.decoded_bytes as f64);
        bytes.filter(|bytes| *bytes > 0.0)
    },
    tick: |x| bytes(x as usize).replace(".0", ""),
};

fn error_against<'a>(root: &Root<'a>, fabric: &FabricReport, against: &Against) -> Drawn<'a> {
    let (evaluators, points): (Vec<&Measurement>, Vec<(f64, f64)>) = fabric
        .evaluators
        .iter()
        .filter_map(|evaluator| {
            let error = 100.0 * evaluator.error.all.mean.max(LEAST_ERROR);
            Some((evaluator, ((against.value)(evaluator)?, error)))
        })
        .unzip();
    let (x, y) = (
        log_axis(points.iter().map(|point| point.0)),
        log_axis(points.iter().map(|point| point.1)),
    );
    let entries = legend_entries(&evaluators);
    let mut chart = ChartBuilder::on(root)
        .margin(14)
        .margin_top((20 + LEGEND_ROW * entries.len().div_ceil(LEGEND_COLUMNS)) as i32)
        .margin_right(30)
        .x_label_area_size(66)
        .y_label_area_size(96)
        .build_cartesian_2d(
            x.range.clone().log_scale().with_key_points(x.ticks),
            y.range.clone().log_scale().with_key_points(y.ticks),
        )?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(LINES)
        .axis_style(LINES)
        .label_style(font(LABEL_FONT).color(&INK))
        .axis_desc_style(font(FONT).color(&INK))
        .x_desc(against.label)
        .y_desc("mean relative error [%]")
        .x_label_formatter(&|x| (against.tick)(*x))
        .y_label_formatter(&|y| plain(*y))
        .draw()?;

    let front = pareto_front(&points);
    chart.draw_series([PathElement::new(
        front.iter().map(|index| points[*index]).collect::<Vec<_>>(),
        INK.stroke_width(2),
    )])?;
    let pixels: Vec<(i32, i32)> = points
        .iter()
        .map(|point| chart.backend_coord(point))
        .collect();
    let (columns, rows) = chart.plotting_area().get_pixel_range();
    legend(root, &entries)?;
    let mut names = Names {
        columns,
        rows,
        taken: Vec::new(),
    };
    for (evaluator, pixel) in evaluators.iter().zip(&pixels) {
        dot(root, *pixel, evaluator.family, evaluator.batch)?;
        names.keep_off(*pixel, RADIUS);
    }
    for ends in front.windows(2) {
        names.keep_off_line(pixels[ends[0]], pixels[ends[1]]);
    }

    // Tables first, since they are fewer; the names that find no room are left out.
    let is_named = |index: &usize| front.contains(index) || evaluators[*index].evaluator == THESIS;
    let is_table = |index: &usize| evaluators[*index].family == Family::Table;
    let (tables, others): (Vec<usize>, Vec<usize>) = (0..points.len())
        .filter(|index| is_named(index) || is_table(index))
        .partition(is_table);
    for index in tables.into_iter().chain(others) {
        let name = short_name(evaluators[index]);
        if let Some(((x, y), side)) = names.place(pixels[index], name, front.contains(&index)) {
            let colour = colour(evaluators[index].family);
            let style = font(LABEL_FONT)
                .color(&colour)
                .pos(Pos::new(side, VPos::Center));
            root.draw(&Text::new(name.to_owned(), (x, y), style))?;
        }
    }
    Ok(())
}

/// Columns and rows.
type Room = (Range<i32>, Range<i32>);

const LEGEND_COLUMNS: usize = 3;
/// Units of the drawing.
const LEGEND_ROW: usize = 28;

/// What there is to say which colour is which of.
fn legend_entries(evaluators: &[&Measurement]) -> Vec<(Family, bool, String)> {
    let families = [
        (Family::Midpoint, "midpoints"),
        (Family::Quadrature, "quadrature"),
        (Family::Table, "tables"),
        (Family::Fit, "fits"),
    ];
    let is_there = |family: Family, batch: bool| {
        let mut all = evaluators.iter();
        all.any(|other| other.family == family && other.batch == batch)
    };
    let entry = |(family, name): (Family, &str)| {
        let single = (family, false, name.to_owned());
        [single, (family, true, format!("{name}, batch"))]
    };
    let entries = families.into_iter().flat_map(entry);
    entries
        .filter(|(family, batch, _)| is_there(*family, *batch))
        .collect()
}

/// Which colours are which, above the plot.
fn legend<'a>(root: &Root<'a>, entries: &[(Family, bool, String)]) -> Drawn<'a> {
    for (index, (family, batch, name)) in entries.iter().enumerate() {
        let (column, row) = (index % LEGEND_COLUMNS, index / LEGEND_COLUMNS);
        let x = 30 + (column * (SIZE.0 as usize - 30) / LEGEND_COLUMNS) as i32;
        let y = 22 + (row * LEGEND_ROW) as i32;
        dot(root, (x, y), *family, *batch)?;
        let style = font(LABEL_FONT)
            .color(&INK)
            .pos(Pos::new(HPos::Left, VPos::Center));
        root.draw(&Text::new(name.clone(), (x + 16, y), style))?;
    }
    Ok(())
}

/// The mark of an evaluator: filled for batches, hollow for single pairs.
fn dot<'a>(root: &Root<'a>, place: (i32, i32), family: Family, batch: bool) -> Drawn<'a> {
    let colour = colour(family);
    let inner = if batch { colour } else { PAPER };
    root.draw(&Circle::new(place, RADIUS, inner.filled()))?;
    root.draw(&Circle::new(place, RADIUS, colour.stroke_width(3)))
}

fn colour(family: Family) -> RGBColor {
    match family {
        Family::Midpoint => GREY,
        Family::Quadrature => ORANGE,
        Family::Table => BLUE,
        Family::Fit => GREEN,
    }
}

fn font(size: u32) -> TextStyle<'static> {
    ("sans-serif", size).into_text_style(&SIZE)
}

struct LogAxis {
    range: Range<f64>,
    ticks: Vec<f64>,
}

/// An axis around positive `values`, with ticks at 1, 2 and 5, or at powers of ten where that would be many.
fn log_axis(values: impl Iterator<Item = f64>) -> LogAxis {
    let (least, most) = values.fold((f64::INFINITY, 0.0), |(least, most), x| {
        (x.min(least), x.max(most))
    });
    let (from, to) = if least <= most {
        (least / 1.6, most * 1.6)
    } else {
        (0.1, 10.0)
    };
    let decades = from.log10().floor() as i32..=to.log10().ceil() as i32;
    let steps: &[f64] = match (to / from).log10() {
        ..2.0 => &[1.0, 2.0, 5.0],
        ..3.0 => &[1.0, 3.0],
        _ => &[1.0],
    };
    let ticks = decades.flat_map(|decade| steps.iter().map(move |step| step * 10f64.powi(decade)));
    LogAxis {
        ticks: ticks.filter(|tick| (from..to).contains(tick)).collect(),
        range: from..to,
    }
}

/// Names beside points, none across another, a point or a line.
struct Names {
    columns: Range<i32>,
    rows: Range<i32>,
    taken: Vec<Room>,
}

impl Names {
    /// Keeps names from what is within `radius` of a place.
    fn keep_off(&mut self, (x, y): (i32, i32), radius: i32) {
        let around = |x: i32| x - radius..x + radius;
        self.taken.push((around(x), around(y)));
    }

    /// Keeps names from a line.
    fn keep_off_line(&mut self, from: (i32, i32), to: (i32, i32)) {
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let steps = (dx.abs().max(dy.abs()) / 4).max(1);
        for step in 0..=steps {
            self.keep_off((from.0 + dx * step / steps, from.1 + dy * step / steps), 2);
        }
    }

    /// Where the name of a point goes, vertically centred, and at which of its ends.
    fn place(
        &mut self,
        (x, y): (i32, i32),
        name: &str,
        is_on_front: bool,
    ) -> Option<((i32, i32), HPos)> {
        let width = (f64::from(LABEL_FONT) * 0.46 * name.chars().count() as f64) as i32;
        let half = LABEL_FONT as i32 * 2 / 5;
        // Left of and below the front there is nothing.
        let sides = if is_on_front { [-1, 1] } else { [1, -1] };
        let heights = [0, 10, -10, 20, -20].map(|dy| if is_on_front { dy } else { -dy });
        for dy in heights {
            for side in sides {
                let start = x + side * (RADIUS + 7);
                let columns = if side > 0 {
                    start..start + width
                } else {
                    start - width..start
                };
                let rows = y + dy - half..y + dy + half;
                let overlaps = |a: &Range<i32>, b: &Range<i32>| a.start < b.end && b.start < a.end;
                let is_inside = columns.start >= self.columns.start
                    && columns.end <= self.columns.end
                    && rows.start >= self.rows.start
                    && rows.end <= self.rows.end;
                if is_inside
                    && !self
                        .taken
                        .iter()
                        .any(|taken| overlaps(&taken.0, &columns) && overlaps(&taken.1, &rows))
                {
                    self.taken.push((columns, rows));
                    return Some((
                        (start, y + dy),
                        if side > 0 { HPos::Left } else { HPos::Right },
                    ));
                }
            }
        }
        None
    }
}

/// Error of the ends of the colours, the same in all maps.
const HEAT: (f64, f64) = (1e-4, 1e-1);

fn heat_colour(error: f64) -> RGBColor {
    let (from, to) = (HEAT.0.ln(), HEAT.1.ln());
    let share = (error.max(1e-12).ln() - from) / (to - from);
    ViridisRGB.get_color(share.clamp(0.0, 1.0))
}

fn heat_map<'a>(root: &Root<'a>, map: &HeatMap) -> Drawn<'a> {
    let (left, right) = root.split_horizontally(SIZE.0 - 120);
    // In units of bins.
    let (columns, rows) = (map.columns as i32, map.rows as i32);
    let quarters = |count: i32| (0..=4).map(move |k| k * count / 4).collect::<Vec<i32>>();
    let value = |axis: Axis, bin: i32, count: i32| {
        let (from, to) = axis.ends();
        plain(from + (to - from) * f64::from(bin) / f64::from(count))
    };
    let mut chart = ChartBuilder::on(&left)
        .margin(14)
        .x_label_area_size(66)
        .y_label_area_size(96)
        .build_cartesian_2d(
            (0..columns).with_key_points(quarters(columns)),
            (0..rows).with_key_points(quarters(rows)),
        )?;
    chart
        .configure_mesh()
        .disable_mesh()
        .axis_style(LINES)
        .label_style(font(LABEL_FONT).color(&INK))
        .axis_desc_style(font(FONT).color(&INK))
        .x_desc(map.x.label())
        .y_desc(map.y.label())
        .x_label_formatter(&|bin| value(map.x, *bin, columns))
        .y_label_formatter(&|bin| value(map.y, *bin, rows))
        .draw()?;
    let bins = map.mean.iter().zip(0..);
    chart.draw_series(bins.filter_map(|(mean, bin)| {
        let (x, y) = (bin % columns, bin / columns);
        let style = heat_colour((*mean)?).filled();
        Some(Rectangle::new([(x, y), (x + 1, y + 1)], style))
    }))?;

    let (_, rows) = chart.plotting_area().get_pixel_range();
    let (top, height) = (f64::from(rows.start), f64::from(rows.end - rows.start));
    const STEPS: i32 = 48;
    for step in 0..STEPS {
        let at = |step: i32| (top + height * (1.0 - f64::from(step) / f64::from(STEPS))) as i32;
        let error = HEAT.0 * (HEAT.1 / HEAT.0).powf((f64::from(step) + 0.5) / f64::from(STEPS));
        right.draw(&Rectangle::new(
            [(6, at(step + 1)), (26, at(step))],
            heat_colour(error).filled(),
        ))?;
    }
    for decade in 0..=3 {
        let y = (top + height * (1.0 - f64::from(decade) / 3.0)) as i32;
        let text = format!("{} %", plain(100.0 * HEAT.0 * 10f64.powi(decade)));
        let style = font(LABEL_FONT)
            .color(&INK)
            .pos(Pos::new(HPos::Left, VPos::Center));
        right.draw(&Text::new(text, (34, y), style))?;
    }
    Ok(())
}
