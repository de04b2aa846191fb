//! Bytes that are not a whole and unchanged table are refused, and old tables stay readable.

mod common;

use common::{fabric, tiny, tiny_table};
use sateen::bake::{Provenance, bake};
use sateen::chart::Chart;
use sateen::progress::Progress;
use sateen::table::{Encoding, Error, MAX_DECODED_BYTES, Table};

/// A table of silk crepe de chine as format 2.0 wrote it: tilts, a grid, a thread of one tilt.
const GOLDEN_2_0: &[u8] = include_bytes!("data/tables/silk-crepe-de-chine-2.0.sateen");
/// Format 1.0 was never released.
const GOLDEN_1_0: &[u8] = include_bytes!("data/tables/silk-crepe-de-chine-1.0.sateen");

fn refused(bytes: &[u8]) -> Error {
    Table::from_bytes(bytes).expect_err("these bytes are no table")
}

/// Changes the header and makes its checksum right again.
fn with_header(bytes: &[u8], change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    change(&mut bytes);
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let crc = crc32fast::hash(&bytes[20..length]);
    bytes[16..20].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Where the entry of the first chunk (the metadata) begins: entries end the header, before its padding.
fn first_chunk_entry(bytes: &[u8]) -> usize {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    // Its first field is its own offset: the header's length, the first aligned place.
    let wanted = (length as u64).to_le_bytes();
    (20..length - 8)
        .rev()
        .find(|at| bytes[*at..*at + 8] == wanted)
        .unwrap()
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
    let rho = table.eval_cos([0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]);
    let expected = include_str!("data/tables/silk-crepe-de-chine-2.0.txt");
    let expected: Vec<f32> = expected
        .split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect();
    for (value, expected) in rho.iter().zip(&expected) {
        assert!(
            (value - expected).abs() <= 1e-5 * expected,
            "{rho:?} for {expected:?}"
        );
    }
    assert_eq!(
        table.to_bytes().map(|bytes| Table::from_bytes(&bytes)),
        Ok(Ok(table))
    );
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
            let table = bake(&fabric("corduroy"), &settings, Progress::silent()).unwrap();
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
    let table = bake(&fabric("denim"), &settings, Progress::silent()).unwrap();
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
    let table = bake(&fabric, &tiny(), Progress::silent()).unwrap();
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
        pool.install(|| tiny_table("corduroy")).to_bytes().unwrap()
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
    let mut bytes = GOLDEN_2_0.to_vec();
    for bit in 0..8 * bytes.len() {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(Table::from_bytes(&bytes).is_err(), "bit {bit}");
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn foreign_files_and_newer_versions_are_told_apart() {
    assert_eq!(refused(b"wi_x,wi_y,wi_z\n0,0,1\n"), Error::NotATable);
    assert_eq!(refused(b""), Error::NotATable);
    assert_eq!(refused(&[0; 1000]), Error::NotATable);
    for (at, version) in [
        (8, Error::Version { major: 3, minor: 0 }),
        (10, Error::Version { major: 2, minor: 1 }),
    ] {
        let mut newer = GOLDEN_2_0.to_vec();
        newer[at] += 1;
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
    assert!(bake(&changed, &tiny(), Progress::silent()).is_err());
}

#[test]
fn every_byte_of_the_header_may_be_anything_without_a_panic() {
    let length = u32::from_le_bytes(GOLDEN_2_0[12..16].try_into().unwrap()) as usize;
    for at in 20..length {
        for value in [0u8, 1, 0x7f, 0x80, 0xff] {
            if let Ok(table) =
                Table::from_bytes(&with_header(GOLDEN_2_0, |bytes| bytes[at] = value))
            {
                let rho = table.eval_cos([0.6, 0.0, 0.8], [0.0, 0.6, 0.8]);
                assert!(
                    rho.iter().all(|rho| rho.is_finite() && *rho >= 0.0),
                    "byte {at} = {value}: {rho:?}"
                );
            }
        }
    }
}
