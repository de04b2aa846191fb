//! Bytes that are not a whole and unchanged table are refused, and what is one stays readable.

use crate::common::hostile::{
    Chunk, ZSTD, bomb, chunk_range, empty, first_chunk_entry, full_header, grid_bytes,
    repair_chunk, repair_header, small_hostile_files, stored, table_of_grid, table_of_tilt,
};
use crate::common::{
    assert_light, assert_refused_or_light, bake_tiny, fabric, hostile_directions, tiny,
};
use sateen::bake::{Direct, Provenance, Settings, bake};
use sateen::chart::Chart;
use sateen::model::{Model, Rule, Sadeghi};
use sateen::progress::Progress;
use sateen::table::{Error, MAX_DECODED_BYTES, Table, VERSION};
use std::fs;
use std::path::Path;

/// Silk crepe de chine: tilts, a grid, a thread of one tilt.
const GOLDEN: &[u8] = include_bytes!("../data/tables/silk-crepe-de-chine-3.sateen");
/// The same table, its chunks stored: for readers without zstd (`tests/core.rs`).
const GOLDEN_STORED: &[u8] = include_bytes!("../data/tables/silk-crepe-de-chine-3-stored.sateen");
/// Felt: three axes for its response, one for its projection.
const GOLDEN_FELT: &[u8] = include_bytes!("../data/tables/felt-3.sateen");

/// The pair whose ρ stands beside the golden tables.
const PAIR: [[f64; 3]; 2] = [[0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]];

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
fn golden_tables_stay_readable() {
    let table = Table::from_bytes(GOLDEN).unwrap();
    assert_eq!(table.threads().len(), 2);
    assert_eq!(table.threads()[0].tangents().tilts().len(), 2);
    assert!(table.threads()[0].grid().is_some() && table.threads()[1].grid().is_none());
    assert_evaluates(
        &table,
        include_str!("../data/tables/silk-crepe-de-chine-3.txt"),
    );
    assert_eq!(Table::from_bytes(GOLDEN_STORED).as_ref(), Ok(&table));
    assert_eq!(table.to_mappable_bytes(), GOLDEN_STORED);
    assert_eq!(
        table.to_bytes().map(|bytes| Table::from_bytes(&bytes)),
        Ok(Ok(table))
    );
}

#[test]
fn golden_tables_of_curves_stay_readable() {
    let table = Table::from_bytes(GOLDEN_FELT).unwrap();
    assert!(table.threads()[0].projection_grid().is_some());
    assert_evaluates(&table, include_str!("../data/tables/felt-3.txt"));
    assert_eq!(
        table.to_bytes().map(|bytes| Table::from_bytes(&bytes)),
        Ok(Ok(table))
    );
}

/// The expected ρ as text, of one pair; and that it is nearly right.
fn assert_evaluates(table: &Table, expected: &str) {
    let [wi, wr] = PAIR;
    let single = |w: [f64; 3]| w.map(|x| x as f32);
    let rho = table.eval_cos(single(wi), single(wr));
    let expected: Vec<f32> = expected
        .split_whitespace()
        .map(|number| number.parse().unwrap())
        .collect();
    assert_eq!(expected.len(), rho.len());
    let fabric = Provenance::of(table).unwrap().fabric.parse().unwrap();
    let truth = Sadeghi::<f64>::new(&fabric, Rule::Adaptive(1e-6)).eval_cos(wi, wr);
    for ((value, expected), truth) in rho.iter().zip(&expected).zip(truth) {
        assert!(
            (value - expected).abs() <= 1e-5 * expected,
            "{rho:?} for {expected:?}"
        );
        assert!(
            (f64::from(*expected) - truth).abs() <= 0.1 * truth,
            "{expected:?} for {truth:?}"
        );
    }
}

/// How golden tables are made: to be run by hand, where the format changes.
#[test]
#[ignore = "it writes tests/data/tables"]
fn golden_tables_are_written_anew() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/tables");
    let settings = Settings {
        max_bytes: 4 << 10,
        ..tiny()
    };
    for name in ["silk-crepe-de-chine", "felt"] {
        let table = bake(&fabric(name), &settings, Progress::silent())
            .unwrap()
            .table;
        let write = |end: &str, bytes: &[u8]| {
            fs::write(folder.join(format!("{name}-{VERSION}{end}")), bytes).unwrap();
        };
        write(".sateen", &table.to_bytes().unwrap());
        if name != "felt" {
            write("-stored.sateen", &table.to_mappable_bytes());
        }
        let [wi, wr] = PAIR.map(|w| w.map(|x| x as f32));
        let [r, g, b] = table.eval_cos(wi, wr);
        write(".txt", format!("{r} {g} {b}\n").as_bytes());
    }
    // And those of `tests/data/corrupt` that are tables.
    let corrupt = folder.with_file_name("corrupt");
    let most = Chunk {
        codec: ZSTD,
        decoded_bytes: MAX_DECODED_BYTES,
        stored: bomb(1, Some(MAX_DECODED_BYTES)),
    };
    let longer = Chunk {
        decoded_bytes: 3,
        ..stored(vec![b'#'; 300])
    };
    for (name, metadata) in [
        ("one-block-that-claims-the-most", most),
        ("stored-bytes-beyond-the-decoded", longer),
    ] {
        let path = corrupt.join(format!("{name}.sateen"));
        fs::write(path, table_of_tilt(metadata)).unwrap();
    }
}

#[test]
fn tables_of_other_versions_are_refused_and_say_what_to_do() {
    for (version, what_to_do) in [
        // Minor versions were the upper half.
        (
            [1, 0, 0, 0],
            "format version 1, but this sateen reads 3; bake it again",
        ),
        (
            [2, 0, 0, 0],
            "format version 2, but this sateen reads 3; bake it again",
        ),
        (
            [2, 0, 5, 0],
            "format version 2, but this sateen reads 3; bake it again",
        ),
        (
            [4, 0, 0, 0],
            "format version 4, but this sateen reads 3; upgrade sateen",
        ),
    ] {
        let mut other = GOLDEN.to_vec();
        other[8..12].copy_from_slice(&version);
        let error = refused(&other);
        let version = u32::from_le_bytes(version);
        assert_eq!(error, Error::Version { version });
        assert_eq!(error.to_string(), what_to_do);
    }
}

#[test]
fn every_chart_comes_back_from_its_bytes() {
    for chart in Chart::ALL {
        let settings = Settings {
            chart: Some(chart),
            ..tiny()
        };
        let table = bake(&fabric("corduroy"), &settings, Progress::silent())
            .unwrap()
            .table;
        assert_eq!(
            Table::from_bytes(&table.to_bytes().unwrap()),
            Ok(table),
            "{chart:?}"
        );
    }
}

#[test]
fn direct_threads_come_back_from_their_bytes() {
    let settings = Settings {
        direct: Direct::Always,
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
    for length in 0..GOLDEN.len() {
        let error = refused(&GOLDEN[..length]);
        assert!(
            matches!(error, Error::Truncated { .. } | Error::NotATable),
            "{length}: {error}"
        );
    }
}

#[test]
fn extra_bytes_are_refused() {
    for extra in [&[0u8][..], &[1; 64], GOLDEN] {
        let error = refused(&[GOLDEN, extra].concat());
        assert!(matches!(error, Error::TrailingBytes { .. }), "{error}");
    }
}

#[test]
fn every_flipped_bit_is_noticed() {
    for golden in [GOLDEN, GOLDEN_FELT] {
        let mut bytes = golden.to_vec();
        for bit in 0..8 * bytes.len() {
            bytes[bit / 8] ^= 1 << (bit % 8);
            assert!(Table::from_bytes(&bytes).is_err(), "bit {bit}");
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
}

#[test]
fn foreign_files_are_told_apart() {
    assert_eq!(refused(b"wi_x,wi_y,wi_z\n0,0,1\n"), Error::NotATable);
    assert_eq!(refused(b""), Error::NotATable);
    assert_eq!(refused(&[0; 1000]), Error::NotATable);
}

#[test]
fn the_margin_is_zero() {
    for at in [1, 2, 63, 64] {
        let mut bytes = GOLDEN.to_vec();
        let at = bytes.len() - at;
        bytes[at] = 1;
        let error = refused(&bytes);
        assert!(
            matches!(
                error,
                Error::Invalid {
                    what: "padding is not zero",
                    ..
                }
            ),
            "{error}"
        );
    }
}

#[test]
fn sizes_that_no_table_has_ask_for_no_memory() {
    let entry = first_chunk_entry(GOLDEN);
    let put = |at: usize, value: u64| {
        with_header(GOLDEN, |bytes| {
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
                    u64::from_le_bytes(GOLDEN[entry + 48..entry + 56].try_into().unwrap());
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
    let entry = first_chunk_entry(GOLDEN);
    let start = u64::from_le_bytes(GOLDEN[entry..entry + 8].try_into().unwrap());
    let wrapped = with_header(GOLDEN, |bytes| {
        let stored = u64::MAX - start - 10;
        bytes[entry + 8..entry + 16].copy_from_slice(&stored.to_le_bytes());
        bytes[entry + 32..entry + 40].copy_from_slice(&0u64.to_le_bytes());
        let length = (GOLDEN.len() as u64).to_le_bytes();
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
    let length = u32::from_le_bytes(GOLDEN[12..16].try_into().unwrap()) as usize;
    for at in 20..length {
        let flipped = (0..8).map(|bit| GOLDEN[at] ^ 1 << bit);
        for value in [0u8, 1, 0x7f, 0x80, 0xff].into_iter().chain(flipped) {
            let bytes = with_header(GOLDEN, |bytes| bytes[at] = value);
            assert_refused_or_light(&format!("byte {at} = {value}"), &bytes);
        }
    }
}

#[test]
fn every_bit_of_a_chunk_may_flip_behind_its_checksum_without_a_panic() {
    for index in 0..2 {
        for at in chunk_range(GOLDEN, index) {
            for bit in 0..8 {
                let mut bytes = GOLDEN.to_vec();
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
    let count = grid_bytes(knots) as usize / 2;
    let ends = [i16::MIN, i16::MAX];
    for pattern in [
        &[i16::MIN][..],
        &[-i16::MAX],
        &[-1],
        &[0],
        &[1],
        &[i16::MAX],
        &ends,
        &[i16::MIN, i16::MIN, i16::MAX],
        &[i16::MAX, i16::MAX, i16::MIN, i16::MIN, 0],
    ] {
        let samples = pattern.iter().cycle().take(count);
        let samples: Vec<u8> = samples.flat_map(|x| x.to_le_bytes()).collect();
        let bytes = table_of_grid(knots, empty(), stored(samples));
        let table = Table::from_bytes(&bytes).unwrap();
        let name = format!("samples of {pattern:?}");
        assert_refused_or_light(&name, &bytes);
        let directions = hostile_directions();
        let pairs = directions.iter().map(|wi| [*wi, [0.0, 0.6, 0.8]]);
        assert_light(&name, &table, &pairs.collect::<Vec<_>>());
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
            what: "size of tiles",
            ..
        }
    ));
    // Both of the same size: ones are text, too.
    assert_refused_or_light(
        "text as samples",
        &table_of_grid(knots, samples.clone(), samples),
    );
}
