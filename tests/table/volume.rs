//! Volumes: how far they are from their tables, and what they are made of.

use crate::common::{fabric, tiny, tiny_table};
use sateen::bake::{Request, Scope, bake};
use sateen::metrics::{TableModel, Truth, protocol_pairs};
use sateen::model::Model;
use sateen::needs::{Directions, Needs};
use sateen::progress::Progress;
use sateen::shader::{Filter, Lookup, parameters};
use sateen::table::Table;
use sateen::volume::{Error, MAX_BYTES, Settings, Volume};

fn volume(table: &Table, max_bytes: usize) -> Volume {
    let settings = Settings {
        max_bytes,
        ..Settings::default()
    };
    Volume::new(table, &settings).expect("it fits")
}

struct Shader<'a>(Lookup<'a>);

impl Model<f64> for Shader<'_> {
    fn eval_cos(&self, wi: [f64; 3], wr: [f64; 3]) -> [f64; 3] {
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        self.0.eval_cos(single(wi), single(wr)).map(f64::from)
    }
}

#[test]
fn more_bytes_err_less_and_fit_the_budget() {
    for name in ["denim", "felt"] {
        let table = tiny_table(name);
        let pairs = protocol_pairs(&fabric(name), 2048, 9);
        let truth = Truth::of_model(&TableModel(table), pairs, Progress::silent()).unwrap();
        let mut before = f64::INFINITY;
        for max_bytes in [64 << 10, 1 << 20, 8 << 20] {
            let volume = volume(table, max_bytes);
            assert!(volume.bytes() <= max_bytes);
            assert_eq!(volume.bytes(), volume.to_bytes().len());
            assert!(volume.size().into_iter().all(|side| side <= 2048));
            let values = |filter| {
                let shader = Shader(Lookup::new(table, &volume, filter));
                let values = truth.values_of(&shader, Progress::silent()).unwrap();
                truth.errors_of(&values).all.mean
            };
            let (exact, eight_bit) = (values(Filter::Exact), values(Filter::EightBit));
            assert!(
                exact < before || exact < 2e-3,
                "{name}: {exact} after {before}"
            );
            assert!((eight_bit - exact).abs() < 3e-4, "{name}: {eight_bit}");
            assert!(parameters(table, &volume).len() <= 1024, "16 KiB");
            before = exact;
        }
        assert!(before < 5e-3, "{name}: {before}");
    }
}

#[test]
fn a_volume_does_not_depend_on_the_number_of_threads() {
    let table = tiny_table("weft-knit-curve");
    let of = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.expect("threads").install(|| volume(table, 256 << 10))
    };
    assert_eq!(of(1), of(3));
}

#[test]
fn what_was_baked_of_a_part_of_the_pairs_is_in_its_volume() {
    let fabric = fabric("corduroy");
    let (mut lights, mut viewers) = (Directions::none(), Directions::none());
    lights.add_cap([0.48, -0.36, 0.8], 0.2);
    viewers.add_cap([0.0, 0.6, 0.8], 0.2);
    let mut needs = Needs::none();
    needs.add(&lights, &viewers);
    let scope = Scope {
        needs: Some(&needs),
        fixed_albedo: true,
    };
    let table = bake(
        &fabric,
        Request {
            scope,
            ..tiny().into()
        },
        Progress::silent(),
    )
    .unwrap()
    .table;
    let volume = volume(&table, 1 << 20);
    assert_eq!(table.misses(), 0, "making it asks for nothing");
    let lookup = Lookup::new(&table, &volume, Filter::Exact);
    let single = |w: [f64; 3]| w.map(|x| x as f32);
    let pairs = protocol_pairs(&fabric, 20_000, 3);
    let pairs = pairs.iter().map(|p| (single(p.wi), single(p.wr)));
    let (mut count, mut sum) = (0.0, 0.0);
    for (wi, wr) in pairs.filter(|(wi, wr)| table.is_baked(*wi, *wr)) {
        let (a, b) = (lookup.eval_cos(wi, wr), table.eval_cos(wi, wr));
        sum += f64::from((a[0] - b[0]).abs() / (b[0] + 1e-3));
        count += 1.0;
    }
    assert!(
        count > 50.0 && sum / count < 0.02,
        "{} of {count}",
        sum / count
    );
}

#[test]
fn a_table_without_grids_has_a_volume_of_one_texel() {
    let table = tiny_table("faux-suede");
    let volume = volume(table, 1 << 10);
    assert_eq!((volume.size(), volume.grids().len()), ([1, 1, 1], 0));
    let lookup = Lookup::new(table, &volume, Filter::Exact);
    let (wi, wr) = ([0.0, 0.6, 0.8], [0.28, 0.0, 0.96]);
    for (a, b) in lookup.eval(wi, wr).into_iter().zip(table.eval(wi, wr)) {
        assert!((a - b).abs() <= 1e-5 * b);
    }
    assert_eq!(lookup.eval([0.0, 0.6, -0.8], wr), [0.0; 3]);
}

#[test]
fn budgets_that_cannot_be_met_are_refused() {
    let table = tiny_table("denim");
    let of = |max_bytes| {
        let settings = Settings {
            max_bytes,
            ..Settings::default()
        };
        Volume::new(table, &settings).map(|volume| volume.bytes())
    };
    assert!(matches!(
        of(100),
        Err(Error::TooLittle { allowed: 100, .. })
    ));
    assert!(matches!(of(MAX_BYTES + 1), Err(Error::TooMuch { .. })));
    let shallow = |max_side| {
        let settings = Settings {
            max_side,
            ..Settings::default()
        };
        Volume::new(table, &settings).map(|volume| volume.size())
    };
    assert!(matches!(shallow(2), Err(Error::TooDeep { side: 2, .. })));
    assert!(
        shallow(256)
            .expect("it fits")
            .into_iter()
            .all(|side| side <= 256)
    );
}

#[test]
fn direct_integration_with_many_midpoints_is_the_model() {
    let fabric = fabric("denim");
    let table = tiny_table("denim");
    let volume = volume(table, 64 << 10);
    let lookup = Lookup::new(table, &volume, Filter::Exact);
    let truth = Truth::new(&fabric, 64, 4, Progress::silent()).unwrap();
    let value = |pair: &sateen::metrics::Pair| {
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        lookup
            .direct_cos(single(pair.wi), single(pair.wr), 1000)
            .map(f64::from)
    };
    let values: Vec<_> = truth.pairs().iter().map(value).collect();
    assert!(truth.errors_of(&values).all.p99 < 0.01);
}
