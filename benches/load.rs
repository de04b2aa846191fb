//! How long does a file take to become a table?

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use sateen::bake::{Preset, Settings, bake};
use sateen::fabric::Fabric;
use sateen::progress::Progress;
use sateen::table::Table;

fn load(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("load");
    let fabric = Fabric::from_library("denim").expect("a library fabric");
    for preset in [Preset::Draft, Preset::Standard] {
        let settings = Settings {
            error_pairs: 16,
            ..preset.settings()
        };
        let table = bake(&fabric, &settings, Progress::silent())
            .expect("nobody stops it")
            .table;
        let file = table.to_bytes().expect("memory suffices");
        group.throughput(Throughput::Bytes(table.decoded_bytes() as u64));
        group.bench_function(
            BenchmarkId::new("denim", format!("{preset:?}").to_lowercase()),
            |bench| {
                bench.iter(|| Table::from_bytes(&file));
            },
        );
    }
    group.finish();
}

criterion_group!(benches, load);
criterion_main!(benches);
