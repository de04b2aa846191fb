//! A report for people: one file of HTML that needs no other.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::summary::{bytes, number, percent, short_name, time};
use super::{FabricReport, Report, plot};

const STYLE: &str = include_str!("page.css");

pub(super) fn html(report: &Report) -> String {
    let machine = &report.machine;
    let content = html! {
        p.lead {
            "How far is a baked table from the model that it stands for, how long does a lookup take, and would "
            "integrating directly have been the better choice? " (report.summary())
        }
        (overview(report))
        @for fabric in &report.fabrics { (section(fabric)) }
        h2 id="how" { "How this was measured" }
        p {
            "Relative error is max over channels of |ρ − ρ" sub { "D" } "| / (ρ" sub { "D" } " + 1 % of its mean), with ρ"
            sub { "D" } " by adaptive integration in double precision, on " (report.pairs) " pairs of directions (seed "
            (report.seed) "): half are cosine-weighted, half lie in the highlights. Time is per pair on one core, all "
            "evaluators of a fabric in turn on the same pairs in random order, with warm caches, the median of "
            (report.rounds) @if report.rounds == 1 { " round. " } @else { " rounds. " }
            "The thesis integrates with 50 midpoints; “×” is how many times less time than that an evaluator takes, in "
            "the same rounds, one pair at a time. Times of other machines differ, ratios less so."
        }
        p {
            "Pictures of tables and fits are compared to direct integration on a sphere and on three cylinders, "
            (report.picture_size) " pixels high and lit from the camera: the mean relative error of their pixels, and FLIP, the "
            "difference that the eye sees when one replaces the other, from 0 to 1."
        }
        p {
            "Measured by " (report.tool) " on " (machine.cpu)
            @if !machine.instruction_sets.is_empty() { " (" (machine.instruction_sets.join(", ")) ")" }
            ". The numbers are in " code { "report.csv" } " and " code { "report.json" } " beside this page."
        }
    };
    document("What tables of fabrics cost", &content)
}

/// A page of its own with a heading.
fn document(title: &str, content: &Markup) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="color-scheme" content="light dark";
                title { (title) }
                style { (PreEscaped(style())) }
            }
            body {
                main {
                    h1 { (title) }
                    (content)
                }
            }
        }
    }
    .into_string()
}

fn style() -> String {
    let [paper, ink, lines, link] = plot::page_colours();
    let variables = |mode: usize| {
        format!(
            ":root{{--paper:{};--ink:{};--lines:{};--link:{}}}",
            paper[mode], ink[mode], lines[mode], link[mode]
        )
    };
    format!(
        "{}@media (prefers-color-scheme:dark){{{}}}\n{}{STYLE}",
        variables(0),
        variables(1),
        plot::style_sheet()
    )
}

fn overview(report: &Report) -> Markup {
    html! {
        div.wide {
            table {
                thead {
                    tr {
                        th { "fabric" } th { "table" } th { "mean" } th { "p99" } th { "grazing p99" } th { "rim p99" } th { "time" } th { "×" }
                        th { "memory" } th { "file" } th { "FLIP" } th { "fastest below 0.5 %" }
                    }
                }
                tbody {
                    @for fabric in &report.fabrics {
                        tr {
                            td { a href=(format!("#{}", fabric.fabric)) { (fabric.title) } }
                            @if let Some(table) = fabric.headline() {
                                td { (short_name(table)) }
                                td { (percent(table.error.all.mean)) }
                                td { (percent(table.error.all.p99)) }
                                td { (percent(table.error.grazing.p99)) }
                                td { (percent(table.error.rim.p99)) }
                                td { (time(table.ns)) }
                                td { (number(table.speedup)) }
                                td { (bytes(table.decoded_bytes)) }
                                td { (bytes(table.file_bytes)) }
                                td { (table.looks.map_or("–".to_owned(), |looks| number(looks.sphere.flip))) }
                                @match fabric.fastest_good() {
                                    Some(best) => td { (short_name(best)) ", " (time(best.ns)) },
                                    None => td { "–" },
                                }
                            } @else {
                                td colspan="11" { "no table was measured" }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn section(fabric: &FabricReport) -> Markup {
    let front = fabric.front();
    html! {
        section id=(fabric.fabric) {
            h2 { (fabric.title) }
            p.lead { (fabric.summary()) }
            p { (fabric.physics.to_string()) " Mean reflectance over azimuths, brightest channel: " (fabric.physics.reflectance.to_string()) "." }
            @for evaluator in &fabric.evaluators {
                @if let Some(reflectance) = &evaluator.reflectance {
                    p.note { (evaluator.evaluator) " reflects " (reflectance.to_string()) @if !reflectance.conserves_energy() { ", more than arrives" } "." }
                }
            }
            div.plots {
                @for plot in plot::all(fabric) {
                    figure {
                        (PreEscaped(plot.inlined()))
                        figcaption { (plot.caption) }
                    }
                }
            }
            details {
                summary { "All " (fabric.evaluators.len()) " evaluators" }
                div.wide {
                    table {
                        thead {
                            tr {
                                th { "evaluator" } th { "mean" } th { "p50" } th { "p95" } th { "p99" } th { "p99.9" } th { "max" }
                                th { "grazing p99" } th { "rim p99" } th { "rim, both p99" } th { "rim, last p99" } th { "RMSE / mean" } th { "time" } th { "×" } th { "memory" } th { "file" }
                                th { "sphere" } th { "FLIP" } th { "cylinders" } th { "FLIP" }
                            }
                        }
                        tbody {
                            @for evaluator in &fabric.evaluators {
                                @let all = &evaluator.error.all;
                                tr.front[front.contains(&evaluator)] {
                                    td { (evaluator.evaluator) @if evaluator.batch { ", batch" } }
                                    @for error in [all.mean, all.p50, all.p95, all.p99, all.p999, all.max] {
                                        td { (percent(error)) }
                                    }
                                    @for set in [&evaluator.error.grazing, &evaluator.error.rim, &evaluator.error.rim_both, &evaluator.error.rim_last] {
                                        td { (percent(set.p99)) }
                                    }
                                    td { (percent(evaluator.error.rmse_over_mean)) }
                                    td { (time(evaluator.ns)) }
                                    td { (number(evaluator.speedup)) }
                                    td { (bytes(evaluator.decoded_bytes)) }
                                    td { (bytes(evaluator.file_bytes)) }
                                    @for look in evaluator.looks.iter().flat_map(|looks| [looks.sphere, looks.cylinders]) {
                                        td { (percent(look.error)) }
                                        td { (number(look.flip)) }
                                    }
                                }
                            }
                        }
                    }
                }
                p.note { "Bold: nothing measured is both faster and as accurate." }
            }
        }
    }
}
