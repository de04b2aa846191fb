//! Any bytes: they are no table, or one that evaluates to light and comes back from its bytes.
#![no_main]

use sateen::table::Table;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Ok(table) = Table::from_bytes(bytes) {
        sateen_fuzz::check_table(&table);
    }
});
