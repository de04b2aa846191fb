//! Bytes that are not a whole and unchanged table are refused, and old tables stay readable.

use crate::common::hostile::{
    Chunk, chunk_range, empty, first_chunk_entry, full_header, grid_bytes, repair_chunk,
    repair_header, small_hostile_files, stored, table_of_grid,
};
use crate::common::{assert_refused_or_light, bake_tiny, fabric, tiny};
use sateen::bake::{Provenance, bake};
use sateen::chart::Chart;
use sateen::progress::Progress;
use sateen::table::{Encoding, Error, MAX_DECODED_BYTES, Table};

/// A table of silk crepe de chine as format 2.0 wrote it: tilts, a grid, a thread of one tilt.
const GOLDEN_2_0: &[u8] = include_bytes!("../data/tables/silk-crepe-de-chine-2.0.sateen");
/// The same table, its chunks stored: for readers without zstd (`tests/core.rs`).
const GOLDEN_2_0_STORED: &[u8] =
    include_bytes!("../data/tables/silk-crepe-de-chine-2.0-stored.sateen");
/// Felt: three axes for its response, one for its projection, and axes that say where they bend.
const GOLDEN_2_3: &[u8] = include_bytes!("../data/tables/felt-2.3.sateen");
/// Format 1.0 was never released.
const GOLDEN_1_0: &[u8] = include_bytes!("../data/tables/silk-crepe-de-chine-1.0.sateen");

fn refused(bytes: &[u8]) -> Error {
    Table::from_bytes(bytes).expect_err("these bytes are no table")
}

/// Changes the header and makes its checksum right again.
fn with_header(bytes: &[u8], change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    change(&mut bytes);
    repair_header(&mut bytes);
    bytes
}

#[test]
fn golden_tables_of_every_version_stay_readable() {
    let table = Table::from_bytes(GOLDEN_2_0).unwrap();
    assert_eq!(table.threads().len(), 2);
    assert_eq!(table.threads()[0].tangents().tilts().len(), 2);
    assert!(table.threads()[0].grid().is_some() && table.threads()[1].grid().is_none());
    let provenance = Provenance::of(&table).unwrap();
    assert_eq!(
        provenance.fabric.parse().unwrap().name,
        "silk-crepe-de-chine"
    );
    assert_evaluates(
        &table,
        include_str!("../data/tables/silk-crepe-de-chine-2.0.txt"),
    );
    // It is written as it was.
    assert_eq!(table.format(), (2, 0));
    assert_eq!(Table::from_bytes(GOLDEN_2_0_STORED).as_ref(), Ok(&table));
    assert_eq!(
        table.to_bytes().map(|bytes| Table::from_bytes(&bytes)),
        Ok(Ok(table))
    );
}

#[test]
fn golden_tables_of_curves_stay_readable() {
    let table = Table::from_bytes(GOLDEN_2_3).unwrap();
    assert_eq!(table.format(), (2, 3));
    assert!(table.threads()[0].projection_grid().is_some());
    assert_evaluates(&table, include_str!("../data/tables/felt-2.3.txt"));
    assert_eq!(
        table.to_bytes().map(|bytes| Table::from_bytes(&bytes)),
        Ok(Ok(table))
    );
}

/// The expected ρ as text, of one pair.
fn assert_evaluates(table: &Table, expected: &str) {
    let rho = table.eval_cos([0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]);
    let expected: Vec<f32> = expected
        .split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect();
    assert_eq!(expected.len(), rho.len());
    for (value, expected) in rho.iter().zip(&expected) {
        assert!(
            (value - expected).abs() <= 1e-5 * expected,
            "{rho:?} for {expected:?}"
        );
    }
}

#[test]
fn tables_from_before_the_first_release_are_refused_and_say_so() {
    let error = refused(GOLDEN_1_0);
    assert_eq!(error, Error::Version { major: 1, minor: 0 });
    assert!(error.to_string().contains("bake again"), "{error}");
}

#[test]
fn every_chart_and_encoding_comes_back_from_its_bytes() {
    for chart in Chart::ALL {
        for encoding in Encoding::ALL {
            let settings = sateen::bake::Settings {
                chart: Some(chart),
                encoding,
                ..tiny()
            };
            let table = bake(&fabric("corduroy"), &settings, Progress::silent())
                .unwrap()
                .table;
            assert_eq!(
                Table::from_bytes(&table.to_bytes().unwrap()),
                Ok(table),
                "{chart:?} {encoding:?}"
            );
        }
    }
}

#[test]
fn direct_threads_come_back_from_their_bytes() {
    let settings = sateen::bake::Settings {
        direct: sateen::bake::Direct::Always,
        ..tiny()
    };
    let table = bake(&fabric("denim"), &settings, Progress::silent())
        .unwrap()
        .table;
    assert_eq!(table.decoded_bytes(), 0);
    assert!(
        table
            .threads()
            .iter()
            .all(|thread| thread.direct_nodes().is_some())
    );
    assert_eq!(Table::from_bytes(&table.to_bytes().unwrap()), Ok(table));
}

#[test]
fn the_two_sided_projection_is_kept() {
    let mut fabric = fabric("velvet");
    fabric.toml.insert_str(0, "reweighting = \"both\"\n");
    let fabric = sateen::fabric::Fabric::from_toml(&fabric.toml, "velvet", None).unwrap();
    let table = bake(&fabric, tiny(), Progress::silent()).unwrap().table;
    let read = Table::from_bytes(&table.to_bytes().unwrap()).unwrap();
    assert_eq!(read.reweighting(), sateen::brdf::Reweighting::Both);
    assert_eq!(read, table);
}

#[test]
fn a_bake_is_the_same_on_any_number_of_threads() {
    let bytes_on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| bake_tiny("corduroy")).to_bytes().unwrap()
    };
    let one = bytes_on(1);
    assert!(one == bytes_on(2) && one == bytes_on(5));
}

#[test]
fn every_prefix_is_refused() {
    for length in 0..GOLDEN_2_0.len() {
        let error = refused(&GOLDEN_2_0[..length]);
        assert!(
            matches!(error, Error::Truncated { .. } | Error::NotATable),
            "{length}: {error}"
        );
    }
}

#[test]
fn extra_bytes_are_refused() {
    for extra in [&[0u8][..], &[1; 64], GOLDEN_2_0] {
        let error = refused(&[GOLDEN_2_0, extra].concat());
        assert!(matches!(error, Error::TrailingBytes { .. }), "{error}");
    }
}

#[test]
fn every_flipped_bit_is_noticed() {
    for golden in [GOLDEN_2_0, GOLDEN_2_3] {
        let mut bytes = golden.to_vec();
        for bit in 0..8 * bytes.len() {
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(Table::from_bytes(&bytes).is_err(), "bit {bit}");
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

#[test]
fn foreign_files_and_newer_versions_are_told_apart() {
    assert_eq!(refused(b"wi_x,wi_y,wi_z\n0,0,1\n"), Error::NotATable);
    assert_eq!(refused(b""), Error::NotATable);
    assert_eq!(refused(&[0; 1000]), Error::NotATable);
    for (at, version) in [
        (8, Error::Version { major: 3, minor: 0 }),
        (10, Error::Version { major: 2, minor: 6 }),
    ] {
        let mut newer = GOLDEN_2_0.to_vec();
        newer[at] += if at == 8 { 1 } else { 6 };
        assert_eq!(refused(&newer), version);
    }
}

#[test]
fn sizes_that_no_table_has_ask_for_no_memory() {
    let entry = first_chunk_entry(GOLDEN_2_0);
    let put = |at: usize, value: u64| {
        with_header(GOLDEN_2_0, |bytes| {
            bytes[at..at + 8].copy_from_slice(&value.to_le_bytes())
        })
    };
    assert_eq!(
        refused(&put(entry + 16, u64::MAX)),
        Error::TooLarge { bytes: u64::MAX }
    );
    assert_eq!(
        refused(&put(entry + 16, MAX_DECODED_BYTES)),
        Error::TooLarge {
            bytes: {
                let samples =
                    u64::from_le_bytes(GOLDEN_2_0[entry + 48..entry + 56].try_into().unwrap());
                MAX_DECODED_BYTES + samples
            }
        }
    );
    for stored in [u64::MAX, u64::MAX - 63, 1 << 40] {
        assert!(
            matches!(refused(&put(entry + 8, stored)), Error::Truncated { .. }),
            "{stored}"
        );
    }
    assert!(matches!(refused(&put(entry, 64)), Error::Invalid { .. }));
    assert_eq!(refused(&put(entry + 16, 10)), Error::Decompression);
}

#[test]
fn chunks_that_wrap_around_the_address_space_are_refused() {
    // The first chunk's length reaches to just below 2⁶⁴, and the second begins at 0, where rounding up would wrap to.
    let entry = first_chunk_entry(GOLDEN_2_0);
    let start = u64::from_le_bytes(GOLDEN_2_0[entry..entry + 8].try_into().unwrap());
    let wrapped = with_header(GOLDEN_2_0, |bytes| {
        let stored = u64::MAX - start - 10;
        bytes[entry + 8..entry + 16].copy_from_slice(&stored.to_le_bytes());
        bytes[entry + 32..entry + 40].copy_from_slice(&0u64.to_le_bytes());
        let length = (GOLDEN_2_0.len() as u64).to_le_bytes();
        bytes[entry + 40..entry + 48].copy_from_slice(&length);
    });
    assert!(matches!(refused(&wrapped), Error::Truncated { .. }));
}

#[test]
fn a_fabric_changed_behind_its_text_is_not_baked() {
    let mut changed = fabric("faux-suede");
    changed.threads[1].coverage = 0.5;
    assert!(bake(&changed, tiny(), Progress::silent()).is_err());
}

#[test]
fn every_byte_of_the_header_may_be_anything_without_a_panic() {
    let length = u32::from_le_bytes(GOLDEN_2_0[12..16].try_into().unwrap()) as usize;
    for at in 20..length {
        let flipped = (0..8).map(|bit| GOLDEN_2_0[at] ^ 1 << bit);
        for value in [0u8, 1, 0x7f, 0x80, 0xff].into_iter().chain(flipped) {
            let bytes = with_header(GOLDEN_2_0, |bytes| bytes[at] = value);
            assert_refused_or_light(&format!("byte {at} = {value}"), &bytes);
        }
    }
}

#[test]
fn every_bit_of_a_chunk_may_flip_behind_its_checksum_without_a_panic() {
    for index in 0..2 {
        for at in chunk_range(GOLDEN_2_0, index) {
            for bit in 0..8 {
                let mut bytes = GOLDEN_2_0.to_vec();
                bytes[at] ^= 1 << bit;
                repair_chunk(&mut bytes, index);
                assert_refused_or_light(&format!("bit {bit} of byte {at}"), &bytes);
            }
        }
    }
}

#[test]
fn every_sample_may_be_anything_without_a_panic() {
    let knots = [2, 3, 2, 5];
    let count = grid_bytes(knots) as usize;
    for value in [0x80u8, 0x81, 0xff, 0x00, 0x01, 0x7f] {
        let bytes = table_of_grid(knots, empty(), stored(vec![value; count]));
        assert!(Table::from_bytes(&bytes).is_ok());
        assert_refused_or_light(&format!("samples of {value}"), &bytes);
    }
}

#[test]
fn hostile_files_are_refused() {
    for (name, bytes) in small_hostile_files() {
        assert!(Table::from_bytes(&bytes).is_err(), "{name}");
    }
}

#[test]
fn a_header_as_full_as_may_be_is_read_in_time() {
    // Searching all parts for each took seven times as long.
    let table = Table::from_bytes(&full_header()).unwrap();
    assert_eq!(table.threads().len(), 64);
    assert_eq!(table.threads()[63].tangents().tilts().len(), 4096);
}

#[test]
fn chunks_that_overlap_or_stand_in_each_others_place_are_refused() {
    let knots = [3, 3, 2, 2];
    let bytes = table_of_grid(
        knots,
        stored(b"a = 1\n".to_vec()),
        stored(vec![1; grid_bytes(knots) as usize]),
    );
    assert!(Table::from_bytes(&bytes).is_ok());
    let entry = first_chunk_entry(&bytes);
    let offsets = [entry, entry + 32].map(|at| <[u8; 8]>::try_from(&bytes[at..at + 8]).unwrap());
    let with_offsets = |first: [u8; 8], second: [u8; 8]| {
        with_header(&bytes, |bytes| {
            bytes[entry..entry + 8].copy_from_slice(&first);
            bytes[entry + 32..entry + 40].copy_from_slice(&second);
        })
    };
    let between = (u64::from_le_bytes(offsets[0]) + 1).to_le_bytes();
    for (first, second) in [
        (offsets[0], offsets[0]),
        (offsets[1], offsets[1]),
        (offsets[1], offsets[0]),
        (offsets[0], between),
        (0u64.to_le_bytes(), offsets[1]),
    ] {
        let error = refused(&with_offsets(first, second));
        assert!(
            matches!(
                error,
                Error::Invalid {
                    what: "chunk offset",
                    ..
                }
            ),
            "{error}"
        );
    }
    let swapped = with_header(&bytes, |bytes| {
        let (first, second) = bytes[entry..entry + 64].split_at_mut(32);
        first.swap_with_slice(second);
    });
    assert!(matches!(refused(&swapped), Error::Invalid { .. }));
}

#[test]
fn chunks_with_each_others_contents_are_refused_or_evaluate() {
    let knots = [3, 3, 2, 2];
    let samples = stored(vec![1; grid_bytes(knots) as usize]);
    let text = Chunk {
        decoded_bytes: 6,
        ..stored(b"a = 1\n".to_vec())
    };
    assert!(matches!(
        refused(&table_of_grid(knots, samples.clone(), text)),
        Error::Invalid {
            what: "size of samples",
            ..
        }
    ));
    // Both of the same size: ones are text, too.
    assert_refused_or_light(
        "text as samples",
        &table_of_grid(knots, samples.clone(), samples),
    );
}
