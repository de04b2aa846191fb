//! A stress report for people: one file of HTML that needs no other.

use maud::{Markup, PreEscaped, html};
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::records::text;
use super::{Baking, Case, Extreme, FabricStress, StressReport, Sweep, TOLERANCE, Verdict};
use crate::report::page::document;
use crate::report::plot::{
    BLUE, Drawn, GREY, INK, LABEL_FONT, LINES, ORANGE, PAPER, Plot, RADIUS, Root, draw, font,
    log_axis, plain,
};
use crate::report::summary::{bytes, percent};

/// Deviations below are drawn there.
const LEAST: f64 = 1e-9;

pub(super) fn html(report: &StressReport) -> String {
    let content = html! {
        p.lead {
            "Every evaluator is asked where it is hard: at grazing, along and across threads, on highlights, at the end of "
            "visibility; and of fabrics that are stiffer than any cloth. " (report.summary())
        }
        @for fabric in &report.fabrics { (section(fabric)) }
        h2 id="how" { "How this was measured" }
        p {
            (report.pairs) " pairs of each geometry (seed " (report.seed) "), a tenth of that of stiff fabrics, in numbers of "
            "single precision. “f32–f64” is how far single precision, alone and in batches, is from the same rule in double "
            "precision, beyond what that takes on where the directions differ in their last bits: where a model jumps, "
            "any side of the jump is right. Of the reference it is how far its tolerance of 1e-7 is from one of 1e-11, of a "
            "table how far batches are from single lookups. “Step” is how much more a value changes over a millionth of a "
            "radian than the model's. All are relative to the value plus a hundredth of its mean. A case fails where a value is "
            "not finite or negative, or one of the two exceeds " (percent(TOLERANCE)) "."
        }
        p { "Measured by " (report.tool) ". The numbers are in " code { "stress.csv" } " and " code { "stress.json" } " beside this page." }
    };
    document("What holds where fabrics are stiff", &content)
}

impl StressReport {
    /// All fabrics in a sentence or two.
    pub fn summary(&self) -> String {
        let parts = self.fabrics.iter().map(FabricStress::summary);
        parts.collect::<Vec<_>>().join(" ")
    }
}

impl FabricStress {
    /// What a person wants to know first.
    pub fn summary(&self) -> String {
        let count = self.cases.len();
        let fail = self.cases.iter().filter(|case| !case.holds()).count();
        let verdicts = || {
            let rows = self.cases.iter();
            rows.flat_map(|case| case.verdicts.iter().map(move |verdict| (case, verdict)))
        };
        let worst = |value: fn(&Verdict) -> f64| {
            let of = |(_, verdict): &(&Case, &Verdict)| value(verdict);
            verdicts().max_by(|a, b| of(a).total_cmp(&of(b)))
        };
        let mut text = match fail {
            0 => format!("{}: all {count} cases hold.", self.fabric),
            _ => format!("{}: {fail} of {count} cases fail.", self.fabric),
        };
        let is_single = |verdict: &Verdict| {
            !verdict.evaluator.starts_with("table") && verdict.evaluator != "reference"
        };
        let deviation = verdicts()
            .filter(|(_, verdict)| is_single(verdict))
            .max_by(|a, b| a.1.deviation.value.total_cmp(&b.1.deviation.value));
        if let Some((case, verdict)) = deviation {
            text += &format!(
                " Single precision is at most {} from double ({}, {}).",
                percent(verdict.deviation.value),
                verdict.evaluator,
                label(&case.what)
            );
        }
        if let Some((case, verdict)) = worst(|verdict| verdict.step.value) {
            text += &format!(
                " The largest step is {} ({}, {}).",
                percent(verdict.step.value),
                verdict.evaluator,
                label(&case.what)
            );
        }
        let bakes = || self.cases.iter().flat_map(|case| &case.bakes);
        let outcomes = ["direct", "larger", "refused"].map(|outcome| {
            let is_so = |baking: &&Baking| baking.outcome() == outcome;
            bakes().filter(is_so).count()
        });
        if bakes().count() > 0 {
            text += &format!(
                " Of {} tables, {} needed direct evaluation and {} larger grids to keep their promise, and {} are refused.",
                bakes().count(),
                outcomes[0],
                outcomes[1],
                outcomes[2]
            );
        }
        text
    }
}

/// A case's name for people.
fn label(what: &Extreme) -> String {
    match what.name() {
        (name, None) => name,
        (name, Some(value)) => format!("{name} {}", plain(value)),
    }
}

fn section(fabric: &FabricStress) -> Markup {
    html! {
        section id=(fabric.fabric) {
            h2 { (fabric.title) }
            p.lead { (fabric.summary()) }
            p { (fabric.physics.to_string()) }
            div.plots {
                @for plot in plots_of(fabric) {
                    figure {
                        (PreEscaped(plot.inlined()))
                        figcaption { (plot.caption) }
                    }
                }
            }
            (growth(fabric))
            details {
                summary { "All " (fabric.cases.len()) " cases" }
                div.wide { (cases(fabric)) }
            }
            details {
                summary { "Charts in single precision" }
                div.wide { (charts(fabric)) }
            }
        }
    }
}

fn growth(fabric: &FabricStress) -> Markup {
    let stiff = |case: &&Case| matches!(case.what, Extreme::Fabric(Sweep::GammaS, _));
    let rows: Vec<&Case> = fabric.cases.iter().filter(stiff).collect();
    html! {
        @if let Some(first) = rows.first() {
            div.wide {
                table {
                    thead {
                        tr {
                            th { "γ_s" }
                            @for verdict in &first.verdicts { th { (verdict.evaluator) } th { "f32–f64" } }
                            @for baking in &first.bakes { th { (text(&baking.preset)) } th { "memory" } }
                        }
                    }
                    tbody {
                        @for case in &rows {
                            tr {
                                td { @if let Extreme::Fabric(_, gamma) = case.what { (plain(gamma)) "°" } }
                                @for verdict in &case.verdicts {
                                    td { (percent(verdict.mean_error)) }
                                    td { (percent(verdict.deviation.value)) }
                                }
                                @for baking in &case.bakes {
                                    td { (baking.outcome()) ", " (percent(baking.mean)) }
                                    td { (bytes(baking.decoded_bytes)) }
                                }
                            }
                        }
                        tr.front {
                            td { "exponent" }
                            @for growth in &fabric.growth {
                                td { (format!("{:+.2}", growth.error)) }
                                td { (format!("{:+.2}", growth.deviation)) }
                            }
                        }
                    }
                }
            }
            p.note { "Mean errors on hard pairs; of presets, what became of the table and its mean error on protocol pairs. The last line is the exponent of 1/γ_s by which errors grow." }
        }
    }
}

fn cases(fabric: &FabricStress) -> Markup {
    html! {
        table {
            thead {
                tr {
                    th { "case" } th { "evaluator" } th { "holds" } th { "not finite" } th { "negative" } th { "f32–f64" } th { "step" }
                    th { "mean error" } th { "largest error" } th { "bake" }
                }
            }
            tbody {
                @for case in &fabric.cases {
                    @if let Some(reason) = &case.refused {
                        tr { td { (label(&case.what)) } td colspan="9" { "no such fabric: " (reason) } }
                    }
                    @for verdict in &case.verdicts {
                        tr.front[!verdict.holds()] {
                            td { (label(&case.what)) }
                            td { (verdict.evaluator) }
                            td { @if verdict.holds() { "yes" } @else { "no" } }
                            td { (verdict.not_finite) }
                            td { (verdict.negative) }
                            td { (percent(verdict.deviation.value)) }
                            td { (percent(verdict.step.value)) }
                            td { (percent(verdict.mean_error)) }
                            td { (percent(verdict.error.value)) }
                            td {
                                @for baking in case.bakes.iter().filter(|baking| verdict.evaluator.ends_with(&text(&baking.preset))) {
                                    (baking.outcome()) ", " (percent(baking.mean)) ", " (bytes(baking.decoded_bytes))
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn charts(fabric: &FabricStress) -> Markup {
    html! {
        table {
            thead { tr { th { "chart" } th { "pairs" } th { "u₀" } th { "u₁" } th { "u₂" } th { "u₃" } th { "inverse" } } }
            tbody {
                @for condition in &fabric.charts {
                    tr {
                        td { (text(&condition.chart)) }
                        td { (text(&condition.geometry)) }
                        @for difference in condition.coordinates { td { (format!("{difference:.0e}")) } }
                        td { (format!("{:.0e}", condition.inverse)) }
                    }
                }
            }
        }
        p.note { "The largest difference of a coordinate between precisions, and the largest distance between a direction and what the inverse makes of its coordinates in double precision." }
    }
}

/// The plots of all fabrics as files.
pub(super) fn plots(report: &StressReport) -> Vec<(String, String)> {
    let of = |fabric: &FabricStress| {
        let name = fabric.fabric.clone();
        let plots = plots_of(fabric).into_iter();
        plots
            .map(move |plot| (format!("{name}-{}.svg", plot.name), plot.standalone()))
            .collect::<Vec<_>>()
    };
    report.fabrics.iter().flat_map(of).collect()
}

fn plots_of(fabric: &FabricStress) -> Vec<Plot> {
    let stiff: Vec<(f64, &Case)> = fabric
        .cases
        .iter()
        .filter_map(|case| match case.what {
            Extreme::Fabric(Sweep::GammaS, gamma) if !case.verdicts.is_empty() => {
                Some((gamma, case))
            }
            _ => None,
        })
        .collect();
    if stiff.len() < 2 {
        return Vec::new();
    }
    vec![
        Plot {
            name: "error",
            caption: "Mean error on hard pairs as lobes become narrow.".to_owned(),
            svg: draw(|root| {
                against_gamma(root, &stiff, "mean relative error [%]", |verdict| {
                    verdict.mean_error
                })
            }),
        },
        Plot {
            name: "precision",
            caption: "The largest deviation of single from double precision.".to_owned(),
            svg: draw(|root| {
                against_gamma(root, &stiff, "f32–f64 [%]", |verdict| {
                    verdict.deviation.value
                })
            }),
        },
    ]
}

/// Points of γ_s and a percentage.
type Line = Vec<(f64, f64)>;

fn against_gamma<'a>(
    root: &Root<'a>,
    stiff: &[(f64, &Case)],
    label: &str,
    value: impl Fn(&Verdict) -> f64,
) -> Drawn<'a> {
    let names: Vec<&str> = stiff[0]
        .1
        .verdicts
        .iter()
        .map(|verdict| verdict.evaluator.as_str())
        .collect();
    let line = |name: &str| -> Line {
        let points = stiff.iter().filter_map(|(gamma, case)| {
            let verdict = case
                .verdicts
                .iter()
                .find(|verdict| verdict.evaluator == name)?;
            Some((*gamma, 100.0 * value(verdict).max(LEAST)))
        });
        points.collect()
    };
    // What is nowhere above the least shown, as the reference's error, says nothing.
    let says = |line: &Line| line.iter().any(|point| point.1 > 100.0 * LEAST);
    let (names, lines): (Vec<&str>, Vec<Line>) = names
        .into_iter()
        .map(|name| (name, line(name)))
        .filter(|(_, line)| says(line))
        .unzip();
    let (x, y) = (
        log_axis(stiff.iter().map(|(gamma, _)| *gamma)),
        log_axis(lines.iter().flatten().map(|point| point.1)),
    );
    let mut chart = ChartBuilder::on(root)
        .margin(14)
        .margin_right(30)
        .x_label_area_size(66)
        .y_label_area_size(110)
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
        .axis_desc_style(font(LABEL_FONT).color(&INK))
        .x_desc("γ_s [°]")
        .y_desc(label)
        .x_label_formatter(&|x| plain(*x))
        .y_label_formatter(&|y| plain(*y))
        .draw()?;
    let (columns, rows) = chart.plotting_area().get_pixel_range();
    for (index, (name, line)) in names.iter().zip(&lines).enumerate() {
        let colour = match *name {
            "reference" => INK,
            "midpoint:50" => GREY,
            "quadrature:4" => ORANGE,
            _ => BLUE,
        };
        // Presets share a colour: their marks differ.
        let filled = if *name == "table:draft" {
            PAPER
        } else {
            colour
        };
        chart.draw_series([PathElement::new(line.clone(), colour.stroke_width(2))])?;
        let marks = line.iter().map(|point| chart.backend_coord(point));
        let legend = (columns.end - 170, rows.start + 20 + 28 * index as i32);
        for place in marks.collect::<Vec<_>>().into_iter().chain([legend]) {
            root.draw(&Circle::new(place, RADIUS - 2, filled.filled()))?;
            root.draw(&Circle::new(place, RADIUS - 2, colour.stroke_width(2)))?;
        }
        let style = font(LABEL_FONT)
            .color(&INK)
            .pos(Pos::new(HPos::Left, VPos::Center));
        root.draw(&Text::new(
            (*name).to_owned(),
            (legend.0 + 16, legend.1),
            style,
        ))?;
    }
    Ok(())
}
