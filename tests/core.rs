//! What an engine has: a table of stored chunks, looked up, without all that bakes.

mod common;

use std::sync::Arc;

use common::{hostile_directions, levels};
use sateen::lookup::Quantity;
use sateen::math::simd::{Kernel, Row, Vector};
use sateen::table::{Error, Table};

/// The table of `silk-crepe-de-chine-3.sateen`, its chunks stored: `tests/table/format.rs` sees to it.
const STORED: &[u8] = include_bytes!("data/tables/silk-crepe-de-chine-3-stored.sateen");
/// ρ of it.
const RHO: &str = include_str!("data/tables/silk-crepe-de-chine-3.txt");

fn stored() -> Table {
    Table::from_bytes(STORED).expect("it is whole")
}

#[test]
fn a_stored_table_has_its_golden_value() {
    let rho = stored().eval_cos([0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]);
    let golden: Vec<f32> = RHO.split_whitespace().map(|x| x.parse().unwrap()).collect();
    assert_eq!(golden.len(), rho.len());
    for (value, expected) in rho.into_iter().zip(golden) {
        assert!((value - expected).abs() <= 1e-5 * expected, "{rho:?}");
    }
}

#[test]
fn a_compressed_table_is_the_same_or_refused_without_zstd() {
    let compressed = include_bytes!("data/tables/silk-crepe-de-chine-3.sateen");
    let expected = if cfg!(feature = "zstd") {
        Ok(stored())
    } else {
        Err(Error::NoZstd)
    };
    assert_eq!(Table::from_bytes(compressed), expected);
}

/// Bytes of which a part begins at a multiple of 64, as a page of a memory map does, or so many bytes beside it.
struct Map {
    memory: Vec<u8>,
    start: usize,
    length: usize,
}

impl Map {
    fn new(bytes: &[u8], beside: usize) -> Self {
        let mut memory = vec![0xff; bytes.len() + 128];
        let start = memory.as_ptr().align_offset(64) + beside;
        memory[start..start + bytes.len()].copy_from_slice(bytes);
        Self {
            memory,
            start,
            length: bytes.len(),
        }
    }
}

impl AsRef<[u8]> for Map {
    fn as_ref(&self) -> &[u8] {
        &self.memory[self.start..][..self.length]
    }
}

fn mapped(bytes: &[u8], beside: usize) -> Result<Table, Error> {
    Table::from_shared(Arc::new(Map::new(bytes, beside)))
}

#[test]
fn a_mapped_table_is_looked_up_where_it_is() {
    let copied = stored();
    let bytes = copied.to_mappable_bytes();
    assert_eq!(bytes, STORED);
    let lent = if cfg!(target_endian = "little") {
        copied.decoded_bytes()
    } else {
        0
    };
    let table = mapped(&bytes, 0).unwrap();
    assert_eq!(table.lent_bytes(), lent);
    assert_eq!(table, copied);
    // It keeps the map, and so does what is made from it.
    let clone = table.clone();
    drop(table);
    assert_eq!(clone.to_mappable_bytes(), bytes);
    let leaked: &'static Map = Box::leak(Box::new(Map::new(&bytes, 0)));
    assert_eq!(
        Table::from_static(leaked.as_ref()).unwrap().lent_bytes(),
        lent
    );
    // What cannot be read in place is copied.
    let beside = mapped(&bytes, 1).unwrap();
    assert_eq!((beside.lent_bytes(), &beside), (0, &copied));
    assert_eq!(Table::from_bytes(&bytes).as_ref(), Ok(&copied));

    let stride = if cfg!(miri) { 16 } else { 1 };
    for wi in hostile_directions().into_iter().step_by(stride) {
        for wr in hostile_directions().into_iter().step_by(stride) {
            let expected = copied.eval_cos(wi, wr).map(f32::to_bits);
            assert_eq!(clone.eval_cos(wi, wr).map(f32::to_bits), expected);
            assert_eq!(beside.eval_cos(wi, wr).map(f32::to_bits), expected);
        }
    }
}

#[test]
fn what_is_not_a_whole_mapped_table_is_refused() {
    let whole = stored().to_mappable_bytes();
    let stride = if cfg!(miri) { 397 } else { 1 };
    for length in (0..whole.len()).step_by(stride) {
        let error = mapped(&whole[..length], 0).expect_err("a part is no table");
        let expected = matches!(error, Error::Truncated { .. } | Error::NotATable);
        assert!(expected, "{length}: {error}");
    }
    let mut bytes = whole.clone();
    for bit in (0..8 * bytes.len()).step_by(8 * stride + 1) {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(mapped(&bytes, 0).is_err(), "bit {bit}");
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
    bytes.push(0);
    let error = mapped(&bytes, 0).expect_err("a byte is behind it");
    assert!(matches!(error, Error::TrailingBytes { .. }), "{error}");
}

#[test]
fn what_is_not_a_whole_stored_table_is_refused() {
    // An interpreter takes its time.
    let stride = if cfg!(miri) { 397 } else { 1 };
    for length in (0..STORED.len()).step_by(stride) {
        let error = Table::from_bytes(&STORED[..length]).expect_err("a part is no table");
        let expected = matches!(error, Error::Truncated { .. } | Error::NotATable);
        assert!(expected, "{length}: {error}");
    }
    let mut bytes = STORED.to_vec();
    for bit in (0..8 * bytes.len()).step_by(8 * stride + 1) {
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(Table::from_bytes(&bytes).is_err(), "bit {bit}");
        bytes[bit / 8] ^= 1 << (bit % 8);
    }
}

#[test]
fn batches_of_hostile_directions_agree_with_single_lookups() {
    let table = stored();
    let all = hostile_directions();
    let stride = if cfg!(miri) { 16 } else { 1 };
    let some = || all.iter().step_by(stride);
    let pairs: Vec<[[f32; 3]; 2]> = some().flat_map(|wi| some().map(|wr| [*wi, *wr])).collect();
    let slices =
        |which: usize| [0, 1, 2].map(|k| pairs.iter().map(|pair| pair[which][k]).collect());
    let (wi, wr): ([Vec<f32>; 3], [Vec<f32>; 3]) = (slices(0), slices(1));
    for level in levels() {
        let mut rho = [0, 1, 2].map(|_| vec![f32::NAN; pairs.len()]);
        table.eval_batch_at(
            level,
            &[],
            Quantity::Rho,
            wi.each_ref().map(Vec::as_slice),
            wr.each_ref().map(Vec::as_slice),
            rho.each_mut().map(Vec::as_mut_slice),
        );
        for (index, [wi, wr]) in pairs.iter().enumerate() {
            let expected = table.eval_cos(*wi, *wr);
            for (channel, expected) in expected.into_iter().enumerate() {
                let value = rho[channel][index];
                // At the horizon coordinates are quotients of roundings.
                let is_high = wi[2].min(wr[2]) > 1e-3;
                let bound = if is_high { 1e-4 } else { 2e-2 };
                assert!(value.is_finite() && value >= 0.0, "{level:?} {wi:?} {wr:?}");
                assert!(
                    (value - expected).abs() <= bound * (expected + 1e-3),
                    "{level:?} {wi:?} {wr:?}: {value} for {expected}"
                );
            }
        }
    }
}

/// The largest error of an approximation over arguments.
struct Approximation<'a> {
    arguments: &'a [(f32, f32)],
    function: Function,
}

#[derive(Clone, Copy)]
enum Function {
    Atan2,
    Exp,
    Sin,
    Cos,
}

impl Kernel for Approximation<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) -> f64 {
        let mut largest = 0.0f64;
        for (y, x) in self.arguments {
            let (vy, vx) = (V::of(f64::from(*y)), V::of(f64::from(*x)));
            let (y, x) = (f64::from(*y), f64::from(*x));
            let (value, exact, size) = match self.function {
                Function::Atan2 => (vy.atan2(vx), y.atan2(x), 1.0),
                Function::Exp => (vy.exp(), y.exp(), y.exp()),
                Function::Sin => (vy.sin(), y.sin(), 1.0),
                Function::Cos => (vy.cos(), y.cos(), 1.0),
            };
            let value = f64::from(value.to_array().as_ref()[0]);
            largest = largest.max((value - exact).abs() / size);
        }
        largest
    }
}

#[test]
fn approximations_keep_the_errors_that_they_state() {
    let steps = if cfg!(miri) { 50 } else { 200_000 };
    let share = |k: i32| k as f32 / steps as f32;
    let circle: Vec<(f32, f32)> = (0..=steps)
        .map(|k| (std::f32::consts::TAU * share(k)).sin_cos())
        .chain([
            (0.0, 0.0),
            (1.0, 0.0),
            (-1.0, 0.0),
            (0.0, 1.0),
            (1e-30, 1e-30),
        ])
        .collect();
    let line = |from: f32, to: f32| -> Vec<(f32, f32)> {
        (0..=steps)
            .map(|k| (from + (to - from) * share(k), 0.0))
            .collect()
    };
    for (function, arguments, bound) in [
        (Function::Atan2, circle, 3.2e-7),
        (Function::Exp, line(-87.0, 88.0), 3.0e-7),
        (Function::Sin, line(-10.0, 10.0), 2.0e-7),
        (Function::Cos, line(-10.0, 10.0), 4.0e-7),
    ] {
        for level in levels() {
            for single in [false, true] {
                let kernel = Approximation {
                    arguments: &arguments,
                    function,
                };
                let error = if single {
                    level.run_single(kernel)
                } else {
                    level.run(kernel)
                };
                assert!(error <= bound, "{level:?} {single}: {error} > {bound}");
            }
        }
    }
}
