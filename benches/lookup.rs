//! How long does a lookup take, one pair at a time and in batches, beside the thesis' rule and placed quadrature in the same
//! run?

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sateen::bake::{Direct, Preset, Request, Scope, Settings, bake};
use sateen::fabric::Fabric;
use sateen::lookup::Quantity;
use sateen::math::simd::Level;
use sateen::metrics::{Pairs, protocol_pairs};
use sateen::model::{Model, Rule, Sadeghi};
use sateen::needs::{Directions, Needs};
use sateen::progress::Progress;

/// More than the caches of a core see of a table at once; in random order.
const PAIRS: usize = 4096;

fn lookup(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("lookup");
    group.throughput(Throughput::Elements(PAIRS as u64));
    for name in ["denim", "polyester-lining", "tshirt-white", "faux-suede"] {
        let fabric = Fabric::from_library(name).expect("a library fabric");
        let pairs = Pairs::new(&protocol_pairs(&fabric, PAIRS, 1));
        let (wi, wr) = (pairs.lights(), pairs.viewers());
        let one_by_one = |eval: &dyn Fn([f32; 3], [f32; 3]) -> [f32; 3]| {
            let at = |k: usize| eval(wi.map(|w| w[k]), wr.map(|w| w[k]))[0];
            (0..PAIRS).map(|k| black_box(at(k))).sum::<f32>()
        };
        let mut rho = [0, 1, 2].map(|_| vec![0.0; PAIRS]);

        let thesis = Sadeghi::<f32>::new(&fabric, Rule::THESIS);
        group.bench_function(BenchmarkId::new(name, "midpoint:50"), |bench| {
            bench.iter(|| one_by_one(&|wi, wr| thesis.eval_cos(wi, wr)));
        });
        let placed = Sadeghi::<f32>::new(&fabric, Rule::Quadrature(4));
        group.bench_function(BenchmarkId::new(name, "quadrature:4 batch"), |bench| {
            bench.iter(|| {
                let rho = rho.each_mut().map(Vec::as_mut_slice);
                placed.eval_cos_batch(wi, wr, rho);
            });
        });
        for preset in [Preset::Draft, Preset::Standard] {
            let settings = Settings {
                error_pairs: 16,
                direct: Direct::Never,
                ..preset.settings()
            };
            let table = bake(&fabric, &settings, Progress::silent())
                .expect("nobody stops it")
                .table;
            let preset = format!("{preset:?}").to_lowercase();
            group.bench_function(BenchmarkId::new(name, &preset), |bench| {
                bench.iter(|| one_by_one(&|wi, wr| table.eval_cos(wi, wr)));
            });
            for level in Level::ALL.into_iter().filter(|level| level.is_available()) {
                let id = BenchmarkId::new(name, format!("{preset} {}", level.name()));
                group.bench_function(id, |bench| {
                    bench.iter(|| {
                        let rho = rho.each_mut().map(Vec::as_mut_slice);
                        table.eval_batch_at(level, &[], Quantity::Rho, wi, wr, rho);
                    });
                });
            }
        }
    }
    group.finish();
}

/// What does it cost that a table is a part of the whole? The same pairs, which both have.
fn part(criterion: &mut Criterion) {
    let fabric = Fabric::from_library("denim").expect("a library fabric");
    let mut steep = Directions::none();
    steep.add_cap([0.0, 0.0, 1.0], 0.7);
    let mut needs = Needs::none();
    needs.add(&steep, &steep);
    let candidates = protocol_pairs(&fabric, 64 * PAIRS, 1);
    let pairs: Vec<_> = candidates
        .into_iter()
        .filter(|pair| needs.contains(pair.wi.map(|x| x as f32), pair.wr.map(|x| x as f32)))
        .take(PAIRS)
        .collect();
    let pairs = Pairs::new(&pairs);
    let (wi, wr) = (pairs.lights(), pairs.viewers());
    let settings = Settings {
        error_pairs: 16,
        direct: Direct::Never,
        ..Preset::Standard.settings()
    };
    let mut group = criterion.benchmark_group("part");
    group.throughput(Throughput::Elements(pairs.count() as u64));
    for (name, needs) in [("whole", None), ("part", Some(&needs))] {
        let scope = Scope {
            needs,
            fixed_albedo: false,
        };
        let table = bake(
            &fabric,
            Request {
                scope,
                ..settings.clone().into()
            },
            Progress::silent(),
        );
        let table = table.expect("nobody stops it").table;
        group.bench_function(BenchmarkId::new("denim", name), |bench| {
            let at = |k: usize| table.eval_cos(wi.map(|w| w[k]), wr.map(|w| w[k]))[0];
            bench.iter(|| (0..pairs.count()).map(|k| black_box(at(k))).sum::<f32>());
        });
        let mut rho = [0, 1, 2].map(|_| vec![0.0; pairs.count()]);
        group.bench_function(BenchmarkId::new("denim batch", name), |bench| {
            bench.iter(|| {
                let rho = rho.each_mut().map(Vec::as_mut_slice);
                table.eval_cos_batch(wi, wr, rho);
            });
        });
        assert_eq!(table.misses(), 0);
    }
    group.finish();
}

criterion_group!(benches, lookup, part);
criterion_main!(benches);
