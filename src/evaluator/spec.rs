//! The names of ways to evaluate a fabric.

use std::fmt;
use std::str::FromStr;

use crate::model::{ModelKind, Rule};

/// A way to evaluate a fabric, by name: `table`, `midpoint:50`, `quadrature:8`, `reference`, `oren-nayar`.
///
/// The tool, reports, stress tests and pictures write these names; the tool reads them, but for those of reports alone.
#[derive(Debug, Clone, PartialEq)]
pub enum Spec {
    /// `table`: the table that is at hand.
    Table,
    /// `table:NAME`, where there are several; only written.
    NamedTable(String),
    /// `midpoint:N`, `quadrature:N` or `reference`: direct integration of the microcylinder model.
    Rule(Rule),
    /// The name of another model, with the parameters that the fabric's file has.
    Model(ModelKind),
    /// `fit:MODEL`: another model with the parameters that fit best; only written.
    Fit(ModelKind),
}

/// The most midpoints.
const MAX_MIDPOINTS: u32 = 1_000_000;
/// The most placed tilts per segment.
const MAX_TILTS: u32 = 64;

impl fmt::Display for Spec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Table => f.write_str("table"),
            Self::NamedTable(name) => write!(f, "table:{name}"),
            Self::Rule(Rule::Midpoint(count)) => write!(f, "midpoint:{count}"),
            Self::Rule(Rule::Quadrature(tilts)) => write!(f, "quadrature:{tilts}"),
            Self::Rule(Rule::Adaptive(_)) => f.write_str("reference"),
            Self::Model(kind) => f.write_str(kind.name()),
            Self::Fit(kind) => write!(f, "fit:{}", kind.name()),
        }
    }
}

/// What is wrong with the name of a way to evaluate a fabric.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SpecError {
    /// No such name.
    #[error("it is one of table, midpoint:N, quadrature:N, reference")]
    Unknown,
    /// N of `midpoint:N` or `quadrature:N` is no number, or too small or large.
    #[error("N is 1 to {most}")]
    Count {
        /// The largest.
        most: u32,
    },
}

impl FromStr for Spec {
    type Err = SpecError;

    fn from_str(text: &str) -> Result<Self, SpecError> {
        let within = |count: &str, most: u32, rule: fn(u32) -> Rule| match count.parse() {
            Ok(count) if (1..=most).contains(&count) => Ok(Self::Rule(rule(count))),
            _ => Err(SpecError::Count { most }),
        };
        match text.split_once(':') {
            Some(("midpoint", count)) => within(count, MAX_MIDPOINTS, Rule::Midpoint),
            Some(("quadrature", count)) => within(count, MAX_TILTS, Rule::Quadrature),
            Some(_) => Err(SpecError::Unknown),
            None if text == "table" => Ok(Self::Table),
            None if text == "reference" => Ok(Self::Rule(Rule::REFERENCE)),
            None => ModelKind::named(text)
                .map(Self::Model)
                .ok_or(SpecError::Unknown),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_read_as_they_are_written() {
        let rules = [
            ("midpoint:50", Rule::THESIS),
            ("quadrature:4", Rule::Quadrature(4)),
            ("reference", Rule::REFERENCE),
        ];
        let rules = rules.map(|(name, rule)| (name, Spec::Rule(rule)));
        let others = [
            ("table", Spec::Table),
            ("oren-nayar", Spec::Model(ModelKind::OrenNayar)),
        ];
        for (name, spec) in rules.into_iter().chain(others) {
            assert_eq!(spec.to_string(), name);
            assert_eq!(name.parse(), Ok(spec));
        }
        for bad in [
            "midpoint",
            "midpoint:0",
            "midpoint:-1",
            "midpoint:9999999",
            "quadrature:0",
            "quadrature:65",
            "quad",
            "table:draft",
            "",
        ] {
            assert!(bad.parse::<Spec>().is_err(), "{bad}");
        }
    }
}
