//! What was found, in a sentence or two.

use super::{Baking, Case, Extreme, FabricStress, Verdict};
use crate::report::summary::{percent, plain};

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
