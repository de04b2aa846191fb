//! How long does a bake take, its measurement of error not counted?

use criterion::{Criterion, criterion_group, criterion_main};
use sateen::bake::{Preset, Settings, bake};
use sateen::fabric::Fabric;
use sateen::progress::Progress;

fn bakes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("bake");
    group.sample_size(10);
    let settings = Settings {
        error_pairs: 16,
        ..Preset::Draft.settings()
    };
    for name in ["denim", "polyester-lining", "faux-suede"] {
        let fabric = Fabric::from_library(name).expect("a library fabric");
        group.bench_function(name, |bench| {
            bench.iter(|| bake(&fabric, &settings, Progress::silent()))
        });
    }
    group.finish();
}

criterion_group!(benches, bakes);
criterion_main!(benches);
