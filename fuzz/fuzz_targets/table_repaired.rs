//! As `table`, behind the checksums: magic, lengths and checksums are made right before the bytes are read.
#![no_main]

use sateen::table::Table;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Some(bytes) = sateen_fuzz::repaired(bytes) else {
        return;
    };
    if let Ok(table) = Table::from_bytes(&bytes) {
        sateen_fuzz::check_table(&table);
    }
});
