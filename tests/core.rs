//! What an engine has: a table of stored chunks, looked up, without `zstd` and all that bakes.

mod common;

use common::hostile_directions;
use sateen::lookup::Quantity;
use sateen::math::simd::{Kernel, Level, Row, Vector};
use sateen::table::{Error, Table};

/// The table of `silk-crepe-de-chine-2.0.sateen`, its chunks stored: `tests/table_format.rs` sees to it.
const STORED: &[u8] = include_bytes!("data/tables/silk-crepe-de-chine-2.0-stored.sateen");
/// ρ of it.
const RHO: &str = include_str!("data/tables/silk-crepe-de-chine-2.0.txt");

fn stored() -> Table {
    Table::from_bytes(STORED).expect("it is whole")
}

fn levels() -> impl Iterator<Item = Level> {
    Level::ALL.into_iter().filter(|level| level.is_available())
}

#[test]
fn a_stored_table_has_its_golden_value() {
    let rho = stored().eval_cos([0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]);
    for (value, expected) in rho.iter().zip(RHO.split_whitespace()) {
        let expected: f32 = expected.parse().unwrap();
        assert!((value - expected).abs() <= 1e-5 * expected, "{rho:?}");
    }
}

#[cfg(not(feature = "zstd"))]
#[test]
fn a_compressed_table_is_refused_without_zstd() {
    let compressed = include_bytes!("data/tables/silk-crepe-de-chine-2.0.sateen");
    assert_eq!(Table::from_bytes(compressed), Err(Error::NoZstd));
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
        println!("level {}", level.name());
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
                assert!(value.is_finite() && value >= 0.0, "{level:?} {wi:?} {wr:?}");
                assert!(
                    (value - expected).abs() <= 1e-4 * (expected + 1e-3),
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
