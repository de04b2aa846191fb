//! The flags that several verbs have. What a verb alone has is in its file.

use std::ops::RangeInclusive;

use clap::value_parser;
use sateen::bake::{size_name, size_named};
use sateen::metrics::VALIDATION_SEED;

/// The most workers that may be asked for.
pub(crate) const MAX_JOBS: u16 = 1024;

/// How parallel work is shared.
#[derive(clap::Args)]
pub(crate) struct Workers {
    /// How many workers share the work [default: one for each core]. The result does not depend on it.
    #[arg(short, long, value_name = "N", value_parser = value_parser!(u16).range(1..=i64::from(MAX_JOBS)))]
    pub(crate) jobs: Option<u16>,
}

/// How pairs of directions are drawn.
#[derive(clap::Args)]
pub(crate) struct Draw {
    /// The seed that draws the pairs. The error recorded in a table was measured with 2013.
    #[arg(long, value_name = "SEED", default_value_t = VALIDATION_SEED)]
    pub(crate) seed: u64,
}

/// How fabrics are dyed.
#[derive(clap::Args)]
pub(crate) struct Dye {
    /// Which of the named albedos of a TOML file to use [default: the first by name].
    #[arg(long, value_name = "NAME")]
    pub(crate) variant: Option<String>,
}

/// How results are printed.
#[derive(clap::Args)]
pub(crate) struct Print {
    /// Print all results as JSON.
    #[arg(long)]
    pub(crate) json: bool,
}

/// What happens to pairs that tables were not baked for.
#[derive(clap::Args)]
pub(crate) struct Strict {
    /// Fail where a table was not baked for a pair, instead of using the nearest value.
    #[arg(long)]
    pub(crate) strict: bool,
}

/// A number from `range`.
pub(crate) fn parse_within(
    text: &str,
    range: RangeInclusive<f64>,
    what: &str,
) -> Result<f64, String> {
    match text.trim().parse() {
        Ok(number) if range.contains(&number) => Ok(number),
        _ => Err(format!(
            "it is a number of {what}, from {} to {}",
            range.start(),
            range.end()
        )),
    }
}

/// From here on an error without a percent sign is more likely a percentage whose sign was forgotten.
const DOUBTFUL: f64 = 0.1;

/// A share of error.
pub(crate) fn parse_error(text: &str) -> Result<f64, String> {
    match parse_share(text)? {
        share if share >= DOUBTFUL && !text.ends_with('%') => Err(format!(
            "without a percent sign it is below {DOUBTFUL}; write {share}% or {}%",
            100.0 * share
        )),
        share => Ok(share),
    }
}

pub(crate) fn parse_share(text: &str) -> Result<f64, String> {
    let (number, unit) = text
        .strip_suffix('%')
        .map_or((text, 1.0), |number| (number, 0.01));
    match number.trim().parse::<f64>() {
        Ok(share) if share >= 0.0 && share.is_finite() => Ok(share * unit),
        _ => Err("it is a share like 0.01 or 1%".to_owned()),
    }
}

/// What a grid needs at least.
pub(crate) const LEAST_SIZE: usize = 16 << 10;
/// The most that a reader takes.
const MOST_SIZE: usize = 256 << 20;

pub(crate) fn parse_size(text: &str) -> Result<usize, String> {
    parse_size_within(text, LEAST_SIZE..=MOST_SIZE)
}

/// A size in bytes from `range`.
pub(crate) fn parse_size_within(text: &str, range: RangeInclusive<usize>) -> Result<usize, String> {
    let size = size_named(text).filter(|size| range.contains(size));
    size.ok_or_else(|| {
        let [least, most] = [range.start(), range.end()].map(|size| size_name(*size));
        format!("it is a size like 64KiB, 1.5MiB or 8MB, from {least} to {most}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_have_the_names_that_files_and_reports_have() {
        use clap::ValueEnum;
        use sateen::{bake::Preset, export::Format, model::ModelKind};
        fn check<T: ValueEnum + serde::Serialize>(name: fn(T) -> &'static str) {
            for value in T::value_variants() {
                let written = serde_json::to_value(value).unwrap();
                assert_eq!(written, name(value.clone()));
                let flag = value.to_possible_value().unwrap();
                assert_eq!(flag.get_name(), name(value.clone()));
            }
        }
        check(Preset::name);
        let flag = |flag: Option<clap::builder::PossibleValue>| flag.unwrap().get_name().to_owned();
        for format in Format::ALL {
            assert_eq!(flag(format.to_possible_value()), format.name());
        }
        for kind in ModelKind::ALL {
            assert_eq!(flag(kind.to_possible_value()), kind.name());
        }
    }

    #[test]
    fn shares_and_sizes_are_understood() {
        assert_eq!(parse_share("1%"), Ok(0.01));
        assert_eq!(parse_share("0.05"), Ok(0.05));
        assert_eq!(parse_share("50%"), Ok(0.5));
        assert_eq!(parse_share("0.5"), Ok(0.5));
        assert_eq!(parse_error("50%"), Ok(0.5));
        assert!(parse_error("0.5").unwrap_err().contains("0.5% or 50%"));
        assert!(parse_error("0.1").is_err());
        for bad in ["", "%", "-1", "nan", "inf", "x"] {
            assert!(parse_share(bad).is_err(), "{bad}");
            assert!(parse_error(bad).is_err(), "{bad}");
        }
        assert_eq!(parse_size("64KiB"), Ok(65536));
        assert_eq!(parse_size("1.5MiB"), Ok(3 << 19));
        assert_eq!(parse_size("8MB"), Ok(8_000_000));
        for text in ["16.5 kB", "16.5KB", "16.5kb"] {
            assert_eq!(parse_size(text), Ok(16_500), "{text}");
        }
        assert_eq!(parse_size("1mib"), Ok(1 << 20));
        for bad in [
            "",
            "64",
            "1B",
            "1GiB",
            "nanMiB",
            "infMiB",
            "15KiB",
            "257MiB",
            "-1MiB",
            "99999999999999999MiB",
        ] {
            assert!(parse_size(bad).is_err(), "{bad}");
        }
    }
}
