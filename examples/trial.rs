use sateen::{bake::*, fabric::*, metrics::*, progress::*, table::*};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let names: Vec<&str> = if a[1] == "all" { LIBRARY.iter().map(|e| e.name).collect() } else { a[1].split(',').collect() };
    let mut set = match a[2].as_str() { "draft" => Preset::Draft, "fine" => Preset::Fine, _ => Preset::Standard }.settings();
    if let Some(e) = a.get(3) { set.encoding = match e.as_str() { "f32" => Encoding::F32, "f16" => Encoding::F16, _ => Encoding::SqrtF16 }; }
    for name in names {
        let f = Fabric::from_library(name).unwrap();
        let t0 = std::time::Instant::now();
        let t = bake(&f, &set, Progress::silent()).unwrap();
        let tb = t0.elapsed().as_secs_f64();
        let bytes = t.to_bytes().unwrap();
        let t0 = std::time::Instant::now();
        let u = Table::from_bytes(&bytes).unwrap();
        let load = t0.elapsed().as_secs_f64() * 1e3;
        assert!(u == t);
        let e = Provenance::of(&t).unwrap().error;
        let pairs: Vec<_> = protocol_pairs(&f, 20000, 3).iter().map(|p| (p.wi.map(|x| x as f32), p.wr.map(|x| x as f32))).collect();
        let t0 = std::time::Instant::now(); let mut s = 0.0; for (a, b) in &pairs { s += t.eval_cos(*a, *b)[0]; }
        let ns = t0.elapsed().as_nanos() as f64 / pairs.len() as f64;
        println!("{name:32} bytes {:8} file {:8} bake {tb:5.1}s load {load:.1} ms mean {:.5} p50 {:.5} p99 {:.4} p999 {:.3} max {:.2} | grazing mean {:.4} p99 {:.3} | rmse {:.4} bias80 {:.4} ns {ns:.0} {}", t.decoded_bytes(), bytes.len(), e.all.mean, e.all.p50, e.all.p99, e.all.p999, e.all.max, e.grazing.mean, e.grazing.p99, e.rmse_over_mean, e.bias[3].bias, if s > 1e30 {"x"} else {""});
    }
}
