//! How long does a lookup take, beside the thesis' rule in the same run?

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sateen::bake::{Preset, Settings, bake};
use sateen::fabric::Fabric;
use sateen::metrics::protocol_pairs;
use sateen::model::{Model, Rule, Sadeghi};
use sateen::progress::Progress;

/// More than the caches of a core see of a table at once; in random order.
const PAIRS: usize = 4096;

fn lookup(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("lookup");
    group.throughput(Throughput::Elements(PAIRS as u64));
    for name in ["denim", "polyester-lining", "tshirt-white", "faux-suede"] {
        let fabric = Fabric::from_library(name).expect("a library fabric");
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        let pairs: Vec<_> = protocol_pairs(&fabric, PAIRS, 1)
            .iter()
            .map(|pair| (single(pair.wi), single(pair.wr)))
            .collect();
        let thesis = Sadeghi::<f32>::new(&fabric, Rule::THESIS);
        group.bench_function(BenchmarkId::new(name, "midpoint:50"), |bench| {
            bench.iter(|| {
                pairs
                    .iter()
                    .map(|(wi, wr)| black_box(thesis.eval_cos(*wi, *wr))[0])
                    .sum::<f32>()
            });
        });
        for preset in [Preset::Draft, Preset::Standard] {
            let settings = Settings {
                error_pairs: 16,
                ..preset.settings()
            };
            let table = bake(&fabric, &settings, Progress::silent()).expect("nobody stops it");
            group.bench_function(
                BenchmarkId::new(name, format!("{preset:?}").to_lowercase()),
                |bench| {
                    bench.iter(|| {
                        pairs
                            .iter()
                            .map(|(wi, wr)| black_box(table.eval_cos(*wi, *wr))[0])
                            .sum::<f32>()
                    });
                },
            );
        }
    }
    group.finish();
}

criterion_group!(benches, lookup);
criterion_main!(benches);
