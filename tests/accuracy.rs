//! The error of every fabric's standard table, measured by the protocol.

use sateen::bake::{Preset, Provenance, bake};
use sateen::fabric::LIBRARY;
use sateen::progress::Progress;
use sateen::table::Table;

const MAX_MEAN: f64 = 0.01;
const MAX_P99: f64 = 0.08;
const MAX_DECODED_BYTES: usize = 8 << 20;

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
        if !(mean <= MAX_MEAN && p99 <= MAX_P99 && table.decoded_bytes() <= MAX_DECODED_BYTES) {
            failures.push(entry.name);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}
