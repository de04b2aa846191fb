use sateen::{bake::*, chart::Chart, fabric::*, metrics::*, model::Model, table::*};
struct T(Table);
impl Model<f64> for T { fn eval_cos(&self, wi: [f64;3], wr: [f64;3]) -> [f64;3] { self.0.eval_cos(wi.map(|x| x as f32), wr.map(|x| x as f32)).map(f64::from) } }
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let names: Vec<&str> = if a[1] == "all" { LIBRARY.iter().map(|e| e.name).collect() } else { a[1].split(',').collect() };
    let enc = match a[2].as_str() { "f32" => Encoding::F32, "f16" => Encoding::F16, _ => Encoding::SqrtF16 };
    let interp: Vec<Interpolation> = a[3].chars().map(|c| if c == 'c' { Interpolation::Cubic } else { Interpolation::Linear }).collect();
    let n: usize = a[4].parse().unwrap(); let target: f64 = a[5].parse().unwrap();
    for name in names {
        let f = Fabric::from_library(name).unwrap();
        let t0 = std::time::Instant::now();
        let t = bake(&f, &Settings { chart: Chart::Highlight, encoding: enc, interpolation: interp.clone().try_into().unwrap(), max_nodes: n, target_error: target, tolerance: 1e-5 });
        let tb = t0.elapsed().as_secs_f64();
        let t = T(t);
        let e = measure(&f, &t, 20000, 7);
        // time
        let pairs: Vec<_> = protocol_pairs(&f, 20000, 3).iter().map(|p| (p.wi.map(|x| x as f32), p.wr.map(|x| x as f32))).collect();
        let t0 = std::time::Instant::now(); let mut s = 0.0; for (a, b) in &pairs { s += t.0.eval_cos(*a, *b)[0]; }
        let ns = t0.elapsed().as_nanos() as f64 / pairs.len() as f64;
        println!("{name:32} bytes {:8} bake {tb:5.1}s mean {:.5} p50 {:.5} p99 {:.4} p999 {:.3} max {:.2} | grazing mean {:.4} p99 {:.3} | rmse {:.4} bias80 {:.4} ns {ns:.0} {}", t.0.sample_bytes(), e.all.mean, e.all.p50, e.all.p99, e.all.p999, e.all.max, e.grazing.mean, e.grazing.p99, e.rmse_over_mean, e.bias[3].bias, if s > 1e30 {"x"} else {""});
    }
}
