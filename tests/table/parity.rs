//! One algorithm, several instruction sets: all agree with the scalar path, pair by pair.
//!
//! Within one instruction set batches of three pairs and more agree to the last bit: a result does not depend on its neighbours. Instruction
//! sets do not, nor do single pairs and batches: these are within [`LOOKUP`].

use crate::common::hostile::{empty, file, grid, grid_bytes, nodes, stored, thread, with_rim};
use crate::common::{fabric, hostile_directions, levels, tiny_table};
use rayon::prelude::*;
use sateen::bake::{Direct, Settings, bake};
use sateen::brdf::{Optics, ThreadPair};
use sateen::fabric::{Fabric, LIBRARY};
use sateen::lookup::Quantity;
use sateen::math::simd::{Colours, Directions, DoubleKernel, Doubles, Level};
use sateen::metrics::protocol_pairs;
use sateen::model::{Model, Rule, Sadeghi};
use sateen::progress::Progress;
use sateen::table::Table;

/// A difference relative to the value and a thousandth of the mean: at most, and on average.
struct Bound(f64, f64);

/// Between instruction sets, which round differently (found: 5e-5 and 3e-7; of portable vectors and single pairs, 2e-6 and 6e-8). Most is due
/// to weights of 15 bits, which another last bit of a coordinate may round the other way.
const LOOKUP: Bound = Bound(1e-4, 5e-7);
/// Between single precision and double, which narrow lobes at grazing angles magnify (found: 2.7e-4 and 5e-6).
const DIRECT: Bound = Bound(1e-3, 2e-5);

struct Pairs {
    wi: Vec<[f32; 3]>,
    wr: Vec<[f32; 3]>,
}

impl Pairs {
    /// Neither a multiple of 8 nor of 16: the last vector is not full.
    fn protocol(fabric: &Fabric) -> Self {
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        let pairs = protocol_pairs(fabric, 1003, 5);
        Self {
            wi: pairs.iter().map(|pair| single(pair.wi)).collect(),
            wr: pairs.iter().map(|pair| single(pair.wr)).collect(),
        }
    }

    fn hostile() -> Self {
        let all = hostile_directions();
        let (mut wi, mut wr) = (Vec::new(), Vec::new());
        for a in &all {
            for b in &all {
                wi.push(*a);
                wr.push(*b);
            }
        }
        Self { wi, wr }
    }

    /// So many of them, from one on.
    fn part(&self, from: usize, count: usize) -> Self {
        Self {
            wi: self.wi[from..][..count].to_vec(),
            wr: self.wr[from..][..count].to_vec(),
        }
    }

    fn rho(&self, table: &Table, level: Level) -> Vec<[f32; 3]> {
        self.eval(|wi, wr, to| table.eval_batch_at(level, &[], Quantity::Rho, wi, wr, to))
    }

    fn eval(&self, batch: impl Fn(Directions<'_>, Directions<'_>, Colours<'_>)) -> Vec<[f32; 3]> {
        let slices =
            |w: &[[f32; 3]]| [0, 1, 2].map(|k| w.iter().map(|w| w[k]).collect::<Vec<f32>>());
        let (wi, wr) = (slices(&self.wi), slices(&self.wr));
        let mut rho = [0, 1, 2].map(|_| vec![f32::NAN; self.wi.len()]);
        let [r, g, b] = &mut rho;
        batch(
            wi.each_ref().map(Vec::as_slice),
            wr.each_ref().map(Vec::as_slice),
            [r, g, b],
        );
        (0..self.wi.len())
            .map(|k| rho.each_ref().map(|channel| channel[k]))
            .collect()
    }

    fn assert_close(
        &self,
        what: &str,
        values: &[[f32; 3]],
        expected: &[[f32; 3]],
        Bound(most, mean_most): Bound,
    ) {
        let flat = |values: &[[f32; 3]]| {
            values
                .iter()
                .flatten()
                .map(|x| f64::from(*x))
                .collect::<Vec<f64>>()
        };
        let (values, expected) = (flat(values), flat(expected));
        let mean = expected.iter().sum::<f64>() / expected.len() as f64;
        let differences: Vec<f64> = values
            .iter()
            .zip(&expected)
            .map(|(a, b)| (a - b).abs() / (b + 1e-3 * mean))
            .collect();
        let largest = differences.iter().copied().fold(0.0, f64::max);
        let average = differences.iter().sum::<f64>() / differences.len() as f64;
        assert!(
            largest <= most && average <= mean_most,
            "{what}: {largest} at most, {average} on average"
        );
    }
}

#[test]
fn batches_of_every_fabric_agree_with_single_lookups() {
    let levels = levels();
    let tables: Vec<_> = LIBRARY
        .iter()
        .map(|entry| (entry, tiny_table(entry.name)))
        .collect();
    tables.into_par_iter().for_each(|(entry, table)| {
        let pairs = Pairs::protocol(&entry.load());
        let one_by_one = |eval: &dyn Fn([f32; 3], [f32; 3]) -> [f32; 3]| -> Vec<[f32; 3]> {
            pairs
                .wi
                .iter()
                .zip(&pairs.wr)
                .map(|(wi, wr)| eval(*wi, *wr))
                .collect()
        };
        let rho = one_by_one(&|wi, wr| table.eval_cos(wi, wr));
        let brdf = one_by_one(&|wi, wr| table.eval(wi, wr));
        let dyed = one_by_one(&|wi, wr| table.eval_cos_with(&[[0.9, 0.5, 0.1]], wi, wr));
        for level in levels.iter().copied() {
            let at = |quantity, albedos: &[[f32; 3]]| {
                pairs.eval(|wi, wr, to| table.eval_batch_at(level, albedos, quantity, wi, wr, to))
            };
            let name = format!("{} {}", entry.name, level.name());
            pairs.assert_close(&name, &at(Quantity::Rho, &[]), &rho, LOOKUP);
            pairs.assert_close(&name, &at(Quantity::Brdf, &[]), &brdf, LOOKUP);
            pairs.assert_close(&name, &at(Quantity::Rho, &[[0.9, 0.5, 0.1]]), &dyed, LOOKUP);
        }
    });
}

/// Tables of every kind: grids of all coordinates, tilts, segments that are evaluated directly, and a rim.
fn tables_of_all_kinds() -> Vec<(String, Table)> {
    let names = [
        "denim",
        "silk-crepe-de-chine",
        "corduroy",
        "felt",
        "weft-knit-curve",
    ];
    let mut tables: Vec<(String, Table)> = names
        .into_iter()
        .map(|name| (name.to_owned(), tiny_table(name).clone()))
        .collect();
    let settings = Settings {
        direct: Direct::Always,
        ..crate::common::tiny()
    };
    let direct = bake(&fabric("velvet"), &settings, Progress::silent());
    tables.push(("velvet, directly".to_owned(), direct.unwrap().table));
    for hundredths in [1, 20, 50] {
        let nodes = nodes(&[[-0.57, 1.0], [0.57, 1.0]]);
        let knots = [5, 4, 3, 4];
        let grid = with_rim(hundredths, &nodes, &grid(knots));
        let numbers = vec![64; grid_bytes(knots) as usize];
        let threads = [thread(0.9, &[[0.1, 0.4]], &[[-0.2, 0.3, 0.6]], &grid)];
        let table = Table::from_bytes(&file(&threads, &[empty(), stored(numbers)])).unwrap();
        assert!(table.threads()[0].rim().is_some());
        tables.push((format!("a rim of {hundredths}"), table));
    }
    tables
}

#[test]
fn a_result_does_not_depend_on_its_neighbours_nor_on_how_many_they_are() {
    let mut pairs = Pairs::protocol(&fabric("denim"));
    let hostile = Pairs::hostile();
    // Among each other, so that blocks have some of both.
    for (k, (wi, wr)) in hostile.wi.iter().zip(&hostile.wr).step_by(53).enumerate() {
        pairs.wi.insert(3 * k, *wi);
        pairs.wr.insert(3 * k, *wr);
    }
    let count = pairs.wi.len();
    for (name, table) in tables_of_all_kinds() {
        for level in levels() {
            let all = pairs.rho(&table, level);
            let bits = |values: &[[f32; 3]]| -> Vec<[u32; 3]> {
                values.iter().map(|rho| rho.map(f32::to_bits)).collect()
            };
            let all = bits(&all);
            for length in (3..=70).chain(255..=259).chain([513]) {
                for from in [0, 5, 301, count - length] {
                    let part = bits(&pairs.part(from, length).rho(&table, level));
                    assert_eq!(
                        part,
                        all[from..][..length],
                        "{name} {level:?}: {length} from {from}"
                    );
                }
            }
            // One pair or two are evaluated one by one, by parts of threads instead of pairs side by side.
            let alone: Vec<[f32; 3]> = (0..count)
                .map(|k| pairs.part(k, 1).rho(&table, level)[0])
                .collect();
            for k in 1..count {
                let two = bits(&pairs.part(k - 1, 2).rho(&table, level));
                assert_eq!(two, bits(&alone[k - 1..=k]), "{name} {level:?}: {k}");
            }
        }
    }
}

#[test]
fn instruction_sets_agree() {
    let pairs = Pairs::protocol(&fabric("denim"));
    for (name, table) in tables_of_all_kinds() {
        let portable = pairs.rho(&table, Level::Portable);
        for level in levels() {
            let values = pairs.rho(&table, level);
            let bound = if table.threads()[0].grid().is_some() && !name.contains("rim") {
                LOOKUP
            } else {
                DIRECT
            };
            let name = format!("{name} {}", level.name());
            pairs.assert_close(&name, &values, &portable, bound);
        }
    }
}

#[test]
fn direct_batches_agree_with_double_precision() {
    for name in [
        "denim",
        "velvet",
        "polyester-lining",
        "corduroy",
        "faux-suede",
    ] {
        let fabric = fabric(name);
        let pairs = Pairs::protocol(&fabric);
        for rule in [Rule::Midpoint(5), Rule::Quadrature(1), Rule::Quadrature(4)] {
            let exact = Sadeghi::<f64>::new(&fabric, rule);
            let fast = Sadeghi::<f32>::new(&fabric, rule);
            let directions = pairs.wi.iter().zip(&pairs.wr);
            let expected: Vec<[f32; 3]> = directions
                .clone()
                .map(|(wi, wr)| {
                    exact
                        .eval_cos(wi.map(f64::from), wr.map(f64::from))
                        .map(|x| x as f32)
                })
                .collect();
            let single: Vec<[f32; 3]> = directions
                .map(|(wi, wr)| fast.eval_cos_fast(*wi, *wr))
                .collect();
            pairs.assert_close(
                &format!("{name} {rule:?} single"),
                &single,
                &expected,
                DIRECT,
            );
            for level in levels() {
                let values = pairs.eval(|wi, wr, to| fast.eval_cos_batch_at(level, wi, wr, to));
                pairs.assert_close(
                    &format!("{name} {rule:?} {}", level.name()),
                    &values,
                    &expected,
                    DIRECT,
                );
            }
        }
    }
}

#[test]
fn a_table_without_grids_is_the_quadrature_that_it_names() {
    let fabric = fabric("tshirt-white");
    let settings = Settings {
        direct: Direct::Always,
        ..crate::common::tiny()
    };
    let table = bake(&fabric, &settings, Progress::silent()).unwrap().table;
    let nodes = table.threads()[0].direct_nodes().unwrap();
    let quadrature = Sadeghi::<f32>::new(&fabric, Rule::Quadrature(nodes as u32));
    let pairs = Pairs::protocol(&fabric);
    let lookups = pairs.eval(|wi, wr, to| table.eval_cos_batch(wi, wr, to));
    let direct = pairs.eval(|wi, wr, to| quadrature.eval_cos_batch(wi, wr, to));
    pairs.assert_close("tshirt-white", &lookups, &direct, LOOKUP);
}

#[test]
fn batches_of_hostile_directions_are_finite_and_dark_below_the_surface() {
    let pairs = Pairs::hostile();
    for name in ["denim", "velvet", "silk-crepe-de-chine"] {
        let table = tiny_table(name);
        let quadrature = Sadeghi::<f32>::new(&fabric(name), Rule::Quadrature(3));
        for level in levels() {
            let results = [
                pairs
                    .eval(|wi, wr, to| table.eval_batch_at(level, &[], Quantity::Brdf, wi, wr, to)),
                pairs.eval(|wi, wr, to| quadrature.eval_cos_batch_at(level, wi, wr, to)),
            ];
            for values in results {
                for (k, value) in values.iter().enumerate() {
                    let (wi, wr) = (pairs.wi[k], pairs.wr[k]);
                    let above = wi[2] > 0.0 && wr[2] > 0.0;
                    let right = |x: &f32| x.is_finite() && *x >= 0.0 && (above || *x == 0.0);
                    assert!(
                        value.iter().all(right),
                        "{name} {level:?} {wi:?} {wr:?}: {value:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn no_pairs_are_a_batch_and_unequal_slices_are_not() {
    let table = tiny_table("denim");
    table.eval_cos_batch([&[]; 3], [&[]; 3], [&mut [], &mut [], &mut []]);
    let unequal = std::panic::catch_unwind(|| {
        table.eval_cos_batch([&[0.0]; 3], [&[]; 3], [&mut [0.0], &mut [0.0], &mut [0.0]]);
    });
    assert!(unequal.is_err());
}

/// S and V of a pair at tilts side by side, as their bits.
struct AtTilts<'a>(&'a ThreadPair<f64>, &'a Optics<f64>, [f64; 7]);

impl DoubleKernel for AtTilts<'_> {
    type Output = [[u64; 2]; 7];

    #[inline(always)]
    fn run<L: Doubles>(self) -> Self::Output {
        let Self(pair, optics, tilts) = self;
        let mut bits = [[0; 2]; 7];
        for first in (0..tilts.len()).step_by(L::LANES) {
            let tilts = L::load(&tilts[first..]);
            let (mut surface, mut volume) = ([0.0; 7], [0.0; 7]);
            let response = pair
                .splat::<L>()
                .response(&optics.cast(), tilts.cos(), tilts.sin());
            response.surface.store(&mut surface);
            response.volume.store(&mut volume);
            for k in 0..L::LANES {
                bits[first + k] = [surface[k].to_bits(), volume[k].to_bits()];
            }
        }
        bits
    }
}

#[test]
fn doubles_are_the_same_to_the_last_bit_with_any_instructions() {
    for fabric in LIBRARY.iter().map(|entry| entry.load()) {
        let Some(thread) = fabric.visible_threads().next() else {
            continue;
        };
        for (k, pair) in protocol_pairs(&fabric, 500, 9).iter().enumerate() {
            let pair = ThreadPair::new(pair.wi, pair.wr, fabric.sigma_u);
            // All around, in uneven steps.
            let tilts = [0, 1, 2, 3, 4, 5, 6].map(|n| (7 * k + n) as f64 * 0.618 - 3.1);
            let [portable, widest] = [Level::Portable, Level::detect()]
                .map(|level| level.run_doubles(AtTilts(&pair, &thread.optics, tilts)));
            assert_eq!(portable, widest, "{}", fabric.name);
        }
    }
}
