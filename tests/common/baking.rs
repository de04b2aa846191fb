//! Fabrics and small tables.

use std::collections::BTreeMap;
use std::sync::{Mutex, OnceLock};

use sateen::bake::{Direct, Preset, Settings, bake};
use sateen::fabric::Fabric;
use sateen::progress::Progress;
use sateen::table::Table;

/// The library's fabric.
pub(crate) fn fabric(name: &str) -> Fabric {
    Fabric::from_library(name).unwrap_or_else(|| panic!("the library has {name}"))
}

/// Settings for tables of a few kilobytes, baked in a moment, with a grid for every thread that can have one.
pub(crate) fn tiny() -> Settings {
    Settings {
        max_bytes: 32 << 10,
        error_pairs: 256,
        tolerance: 1e-3,
        direct: Direct::Never,
        sampling: false,
        ..Preset::Draft.settings()
    }
}

/// A table of a few kilobytes, baked once in a process.
///
/// # Panics
/// On a worker of rayon: it might wait for a bake that waits for this worker.
pub(crate) fn tiny_table(name: &str) -> &'static Table {
    static TABLES: Mutex<BTreeMap<String, &'static OnceLock<Table>>> = Mutex::new(BTreeMap::new());
    assert_eq!(rayon::current_thread_index(), None, "{name} on a worker");
    let table = {
        let mut tables = TABLES.lock().expect("nothing panics meanwhile");
        *tables
            .entry(name.to_owned())
            .or_insert_with(|| Box::leak(Box::default()))
    };
    table.get_or_init(|| bake_tiny(name))
}

/// Bakes the table of [`tiny_table`] anew.
pub(crate) fn bake_tiny(name: &str) -> Table {
    bake(&fabric(name), tiny(), Progress::silent())
        .expect("nobody stops it")
        .table
}
