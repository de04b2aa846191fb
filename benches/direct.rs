//! How long does direct evaluation of a pair take?

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sateen::fabric::Fabric;
use sateen::metrics::protocol_pairs;
use sateen::model::{Model, Rule, Sadeghi};

const PAIRS: usize = 1024;

fn direct(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("direct");
    group.throughput(Throughput::Elements(PAIRS as u64));
    for name in ["denim", "polyester-lining", "tshirt-white"] {
        let fabric = Fabric::from_library(name).expect("a library fabric");
        let pairs = protocol_pairs(&fabric, PAIRS, 1);
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        let singles: Vec<_> = pairs
            .iter()
            .map(|pair| (single(pair.wi), single(pair.wr)))
            .collect();
        for samples in [4, 16, 50] {
            let model = Sadeghi::<f32>::new(&fabric, Rule::Midpoint(samples));
            let id = BenchmarkId::new(format!("{name}/midpoint"), samples);
            group.bench_function(id, |bench| {
                bench.iter(|| {
                    singles
                        .iter()
                        .map(|(wi, wr)| black_box(model.eval_cos(*wi, *wr))[0])
                        .sum::<f32>()
                });
            });
        }
        let model = Sadeghi::<f64>::new(&fabric, Rule::REFERENCE);
        group.bench_function(
            BenchmarkId::new(format!("{name}/reference"), "1e-7"),
            |bench| {
                bench.iter(|| {
                    pairs
                        .iter()
                        .map(|pair| black_box(model.eval_cos(pair.wi, pair.wr))[0])
                        .sum::<f64>()
                });
            },
        );
    }
    group.finish();
}

criterion_group!(benches, direct);
criterion_main!(benches);
