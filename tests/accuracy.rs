//! The error of every fabric's standard table, measured by the protocol.

use sateen::bake::{Preset, Provenance, bake};
use sateen::fabric::LIBRARY;
use sateen::progress::Progress;
use sateen::table::Table;

/// Mean and 99th percentile of relative error.
const LIMITS: (f64, f64) = (0.003, 0.025);
/// Velvet's threads stand almost upright: wherever one looks, most of them hide or end.
const VELVET_LIMITS: (f64, f64) = (0.008, 0.07);
/// What the preset promises.
const MAX_DECODED_BYTES: usize = 4 << 20;

#[test]
fn standard_tables_of_the_whole_library_keep_their_promise() {
    let settings = Preset::Standard.settings();
    let mut failures = Vec::new();
    for entry in LIBRARY {
        let table = bake(&entry.load(), &settings, Progress::silent()).expect("nobody stops it");
        let file = table.to_bytes().expect("memory suffices");
        assert_eq!(
            Table::from_bytes(&file).as_ref(),
            Ok(&table),
            "{} reads back as it was",
            entry.name
        );
        let error = Provenance::of(&table).expect("its own metadata").error;
        let (mean, p99) = (error.all.mean, error.all.p99);
        let limits = if entry.name == "velvet" {
            VELVET_LIMITS
        } else {
            LIMITS
        };
        println!(
            "{:32} mean {:.3} %  p99 {:.2} %  max {:.1} %  grazing p99 {:.2} %  {} bytes decoded, {} in the file",
            entry.name,
            100.0 * mean,
            100.0 * p99,
            100.0 * error.all.max,
            100.0 * error.grazing.p99,
            table.decoded_bytes(),
            file.len()
        );
        if !(mean <= limits.0 && p99 <= limits.1 && table.decoded_bytes() <= MAX_DECODED_BYTES) {
            failures.push(entry.name);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}
