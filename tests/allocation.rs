//! No file makes a reader ask for more memory than is declared, and a small one that is no table asks for little.
//!
//! What zstd's decoder itself asks for is not counted: a context of fixed size, since whole frames are decoded into one piece
//! of memory. One test, for the allocator counts what all threads ask for.
#![cfg(feature = "bake")]

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::hostile::{
    self, LARGEST, PLANES, bomb, empty, full_header, grid_bytes, small_hostile_files, stored,
    table_of_grid,
};
use sateen::fabric::{Fabric, MAX_TOML_BYTES};
use sateen::metrics::{MAX_CSV_LINE_BYTES, PairsFile, PairsFileError};
use sateen::table::{MAX_DECODED_BYTES, Table};

/// The system's allocator, and the most bytes that were ever in use.
struct Counting;

static IN_USE: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

fn count(bytes: usize) {
    let in_use = IN_USE.fetch_add(bytes, Ordering::Relaxed) + bytes;
    MOST.fetch_max(in_use, Ordering::Relaxed);
}

#[expect(unsafe_code, reason = "an allocator is")]
// SAFETY: all is handed on to the system's allocator. (A place is not kept when it grows: `realloc` takes the new one first.)
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: the caller's promises are those that are asked for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        IN_USE.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The result of `f`, and the most bytes that were in use meanwhile, besides those before.
fn most_bytes<T>(f: impl FnOnce() -> T) -> (T, usize) {
    let before = IN_USE.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let result = f();
    (result, MOST.load(Ordering::Relaxed) - before)
}

/// For errors, parameters and the tables of axes, whatever samples there are.
const LITTLE: usize = 1 << 20;
/// What `Table::from_bytes` promises.
const CAP: usize = 3 * MAX_DECODED_BYTES as usize;

#[test]
fn files_ask_for_no_more_memory_than_is_declared() {
    small_hostile_files_are_refused_for_little();
    the_largest_table_keeps_the_cap();
    a_map_of_the_largest_table_is_not_copied();
    bombs_that_are_tables_keep_the_cap();
    a_header_as_large_as_they_come_keeps_the_cap();
    long_lines_of_pairs_are_refused_for_little();
    many_pairs_take_what_is_declared();
    long_fabrics_are_refused_for_little();
}

fn small_hostile_files_are_refused_for_little() {
    for (name, bytes) in small_hostile_files() {
        let (result, most) = most_bytes(|| Table::from_bytes(&bytes).is_err());
        assert!(result, "{name} is no table");
        assert!(most <= LITTLE, "{name}: {most} bytes");
    }
}

fn the_largest_table_keeps_the_cap() {
    let samples = vec![1; MAX_DECODED_BYTES as usize];
    let bytes = table_of_grid(LARGEST, empty(), stored(samples));
    let (result, most) = most_bytes(|| Table::from_bytes(&bytes).is_ok());
    assert!(result && most <= CAP, "{most}");
}

fn a_map_of_the_largest_table_is_not_copied() {
    let samples = vec![1; MAX_DECODED_BYTES as usize];
    let table = Table::from_bytes(&table_of_grid(LARGEST, empty(), stored(samples))).unwrap();
    // A vector of bytes of this size begins at a multiple of 16.
    let map: Arc<Vec<u8>> = Arc::new(table.to_mappable_bytes());
    drop(table);
    let (table, most) = most_bytes(|| Table::from_shared(map).unwrap());
    assert_eq!(table.lent_bytes(), table.decoded_bytes());
    assert!(most <= LITTLE, "{most}");
}

fn bombs_that_are_tables_keep_the_cap() {
    let blocks = (MAX_DECODED_BYTES >> 17) as usize;
    let samples = hostile::Chunk {
        codec: PLANES,
        decoded_bytes: grid_bytes(LARGEST),
        stored: bomb(blocks, Some(MAX_DECODED_BYTES)),
    };
    let bytes = table_of_grid(LARGEST, empty(), samples);
    let (result, most) = most_bytes(|| Table::from_bytes(&bytes).is_ok());
    assert!(result && most <= CAP, "{most}");
}

fn a_header_as_large_as_they_come_keeps_the_cap() {
    let bytes = full_header();
    let (result, most) = most_bytes(|| Table::from_bytes(&bytes).is_ok());
    assert!(result && most <= CAP, "{most}");
    // Its parts take a few times what they take in the file.
    assert!(most <= 16 * bytes.len(), "{most} of {}", bytes.len());
}

fn long_lines_of_pairs_are_refused_for_little() {
    let header = "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z\n";
    // Cells take the CSV reader eight times what a comma takes.
    let most_allowed = 64 * MAX_CSV_LINE_BYTES as usize;
    for before in ["", header] {
        for repeated in [",", "x", "\"", "\n\""] {
            let text = format!("{before}{}", repeated.repeat(8 << 20));
            let (result, most) = most_bytes(|| PairsFile::read(text.as_bytes(), "long"));
            let error = result.expect_err("that is no number");
            assert!(most <= most_allowed, "{repeated:?}: {most} bytes: {error}");
        }
    }
    let text = format!("{header}{}", "x".repeat(8 << 20));
    assert!(matches!(
        PairsFile::read(text.as_bytes(), "long"),
        Err(PairsFileError::LineTooLong { line: 2, .. })
    ));
}

fn many_pairs_take_what_is_declared() {
    // The shortest rows, and those of many empty cells.
    let columns = 1000;
    let short = format!(
        "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z\n{}",
        "0,0,1,0,0,1\n".repeat(100_000)
    );
    let wide = format!(
        "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z{}\n{}",
        ",".repeat(columns),
        format!("0,0,1,0,0,1{}\n", ",".repeat(columns)).repeat(2000)
    );
    for text in [short, wide] {
        let (result, most) = most_bytes(|| PairsFile::read(text.as_bytes(), "many").is_ok());
        // Eleven times the line at rest; the old and the new place of the longest list while it doubles.
        assert!(
            result && most <= 30 * text.len(),
            "{most} of {}",
            text.len()
        );
    }
}

fn long_fabrics_are_refused_for_little() {
    for repeated in ["a", "a.", "[", "{a=", "\n", "[[thread]]\n"] {
        let text = repeated.repeat(2 * MAX_TOML_BYTES / repeated.len());
        let (result, most) = most_bytes(|| Fabric::from_toml(&text, "long", None).is_err());
        assert!(result && most <= LITTLE, "{repeated:?}: {most}");
        // What is not too long is read, and refused in time.
        let text = &text[..MAX_TOML_BYTES];
        let (result, most) = most_bytes(|| Fabric::from_toml(text, "long", None).is_err());
        assert!(result, "{repeated:?}");
        assert!(most <= 512 * text.len(), "{repeated:?}: {most}");
    }
}
