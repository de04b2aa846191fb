//! What was measured, in a sentence or two.

use super::{FabricReport, Family, Measurement, Report, pareto_front};
use crate::bake::Preset;
use crate::evaluator::Spec;

/// Mean error below which the fastest evaluator is named.
const GOOD: f64 = 5e-3;

impl Measurement {
    /// Whether nothing but rounding separates it from direct integration.
    pub(super) fn is_exact(&self) -> bool {
        self.error.all.mean < 1e-5
    }
}

impl FabricReport {
    /// The table to speak of: the standard one, else the most accurate; without grid the only one.
    pub fn headline(&self) -> Option<&Measurement> {
        let standard = Spec::NamedTable(Preset::Standard.name().to_owned()).to_string();
        let tables = || {
            let is_table = |evaluator: &&Measurement| evaluator.family == Family::Table;
            self.evaluators.iter().filter(is_table)
        };
        let mean = |table: &&Measurement| table.error.all.mean;
        fastest(tables().filter(|table| table.evaluator == standard))
            .or_else(|| tables().min_by(|a, b| mean(a).total_cmp(&mean(b))))
    }

    /// The evaluators than which no other is as accurate and faster, the fastest first.
    pub fn front(&self) -> Vec<&Measurement> {
        let points: Vec<(f64, f64)> = self
            .evaluators
            .iter()
            .map(|evaluator| (evaluator.ns, evaluator.error.all.mean))
            .collect();
        let front = pareto_front(&points);
        front
            .into_iter()
            .map(|index| &self.evaluators[index])
            .collect()
    }

    /// The fastest evaluator with a mean error of at most half a percent.
    pub fn fastest_good(&self) -> Option<&Measurement> {
        fastest(
            self.evaluators
                .iter()
                .filter(|evaluator| evaluator.error.all.mean <= GOOD),
        )
    }

    /// What a person wants to know first.
    pub fn summary(&self) -> String {
        let Some(table) = self.headline() else {
            return "No table was measured.".to_owned();
        };
        let name = short_name(table);
        let subject = match table.decoded_bytes {
            0 if table.is_exact() => {
                "Every tilt has a closed form, so that the table needs no samples. It".to_owned()
            }
            0 => format!("The {name} table evaluates every thread directly at a few tilts. It"),
            _ => format!("The {name} table"),
        };
        let mut text = format!(
            "{subject} is {} off on average and takes {} a pair, {}.",
            percent(table.error.all.mean).replace('<', "less than"),
            time(table.ns),
            against_thesis(table.speedup)
        );
        // What is told alike is alike.
        let ties = |other: &Measurement| time(other.ns) == time(table.ns);
        let is_as_good = |other: &&Measurement| {
            other.ns < table.ns && !ties(other) && other.error.all.mean <= table.error.all.mean
        };
        match fastest(self.evaluators.iter().filter(is_as_good)) {
            None => text += " Nothing measured is as accurate and faster.",
            Some(other) => {
                let (other, ns) = (in_words(other), time(other.ns));
                text += &format!(" But {other} is at least as accurate and takes {ns}.");
            }
        }
        match self.fastest_good() {
            None => text += " Nothing measured stays below 0.5 % error.",
            Some(best) if best == table || (table.error.all.mean <= GOOD && ties(best)) => {
                text += " Below 0.5 % error nothing measured is faster."
            }
            Some(best) => {
                let (best, ns) = (in_words(best), time(best.ns));
                text += &format!(" Below 0.5 % error the fastest is {best}: {ns}.");
            }
        }
        text
    }
}

impl Report {
    /// All fabrics in a sentence or two; nothing of none.
    pub fn summary(&self) -> String {
        let tables: Vec<(&FabricReport, &Measurement)> = self
            .fabrics
            .iter()
            .filter_map(|fabric| Some((fabric, fabric.headline()?)))
            .collect();
        let worst = |value: fn(&Measurement) -> f64| {
            tables
                .iter()
                .max_by(|a, b| value(a.1).total_cmp(&value(b.1)))
                .map(|(fabric, table)| (fabric.fabric.as_str(), value(table)))
        };
        let (Some((mean_of, mean)), Some((p99_of, p99))) = (
            worst(|table| table.error.all.mean),
            worst(|table| table.error.all.p99),
        ) else {
            return String::new();
        };
        let speedups = || tables.iter().map(|(_, table)| table.speedup);
        let (least, most) = (
            speedups().fold(f64::INFINITY, f64::min),
            speedups().fold(0.0, f64::max),
        );
        format!(
            "The worst mean error is {} ({mean_of}), the worst 99th percentile {} ({p99_of}). A lookup takes {} to {} times less than the thesis' 50 tilts.",
            percent(mean),
            percent(p99),
            number(least),
            number(most)
        )
    }
}

fn fastest<'a>(evaluators: impl Iterator<Item = &'a Measurement>) -> Option<&'a Measurement> {
    evaluators.min_by(|a, b| a.ns.total_cmp(&b.ns))
}

/// `table:standard` as `standard`; others as they are.
pub(super) fn short_name(evaluator: &Measurement) -> &str {
    let name = evaluator.evaluator.as_str();
    name.strip_prefix("table:").unwrap_or(name)
}

fn in_words(evaluator: &Measurement) -> String {
    let batches = if evaluator.batch { " in batches" } else { "" };
    let name = short_name(evaluator);
    match (evaluator.family, name.split_once(':')) {
        (Family::Table, _) => format!("the {name} table{batches}"),
        (Family::Midpoint, Some((_, "1"))) => format!("a single tilt{batches}"),
        (Family::Midpoint, Some((_, tilts))) => {
            format!("direct integration with {tilts} tilts{batches}")
        }
        (Family::Quadrature, Some((_, tilts))) => {
            format!("direct integration with {tilts} placed tilts{batches}")
        }
        (Family::Fit, Some((_, model))) => format!("the best fit of {model}"),
        (_, None) => format!("{name}{batches}"),
    }
}

fn against_thesis(speedup: f64) -> String {
    if speedup >= 1.0 {
        format!("{} times less than the thesis' 50 tilts", number(speedup))
    } else {
        format!(
            "{} times more than the thesis' 50 tilts",
            number(1.0 / speedup)
        )
    }
}

/// Two digits that mean something.
pub(super) fn number(x: f64) -> String {
    if !(x > 0.0) {
        return "0".to_owned();
    }
    let decimals = 1 - x.log10().floor() as i32;
    let step = 10f64.powi(decimals);
    let rounded = (x * step).round() / step;
    format!("{rounded:.*}", decimals.max(0) as usize)
}

/// A number without the dust of its powers of ten.
pub(crate) fn plain(x: f64) -> String {
    format!("{}", format!("{x:.6e}").parse::<f64>().unwrap_or(x))
}

/// A share as percent.
pub(crate) fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent < 1e-3 {
        "< 0.001 %".to_owned()
    } else {
        format!("{} %", number(percent))
    }
}

/// Nanoseconds.
pub(super) fn time(ns: f64) -> String {
    if ns < 1e3 {
        format!("{} ns", number(ns))
    } else {
        format!("{} µs", number(ns / 1e3))
    }
}

/// `4.1 MB`.
pub(super) fn bytes(count: usize) -> String {
    match count {
        0 => "–".to_owned(),
        1..1000 => format!("{count} B"),
        1000..1_000_000 => format!("{} kB", number(count as f64 / 1e3)),
        _ => format!("{} MB", number(count as f64 / 1e6)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_two_digits() {
        let shown = [0.0, 0.0734, 0.5, 3.2159, 9.99, 41.3, 253.0, 12345.0].map(number);
        assert_eq!(
            shown,
            ["0", "0.073", "0.50", "3.2", "10.0", "41", "250", "12000"]
        );
        assert_eq!(percent(0.000734), "0.073 %");
        assert_eq!(percent(1e-9), "< 0.001 %");
        assert_eq!(time(9876.0), "9.9 µs");
        assert_eq!(bytes(4_120_000), "4.1 MB");
    }
}
