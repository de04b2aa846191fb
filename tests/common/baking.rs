//! Fabrics and small tables.

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
        ..Preset::Draft.settings()
    }
}

/// A table of a few kilobytes.
pub(crate) fn tiny_table(name: &str) -> Table {
    bake(&fabric(name), &tiny(), Progress::silent())
        .expect("nobody stops it")
        .table
}
