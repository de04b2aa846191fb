//! The direct model against the values of an independent float64 implementation (`tests/data/golden_*.csv`).
use sateen::brdf::Reweighting;
use sateen::fabric::Fabric;
use sateen::model::{Components, Rule, Sadeghi};

fn agree(golden: &str, reweighting: Reweighting) {
    let mut rows = 0;
    let mut worst = 0f64;
    for line in golden.lines().skip(1) {
        let (name, values) = line.split_once(',').unwrap();
        let v: Vec<f64> = values.split(',').map(|x| x.parse().unwrap()).collect();
        let mut fabric = Fabric::from_library(name).unwrap();
        fabric.reweighting = reweighting;
        let model = Sadeghi::<f64>::new(&fabric, Rule::REFERENCE);
        let Components { threads, q, rho } = model.components([v[0], v[1], v[2]], [v[3], v[4], v[5]]);
        let part = |name| threads.iter().find(|t| t.name == name);
        let sv = |name| part(name).map_or([0.0; 3], |t| [t.response.surface, t.response.volume, t.projection]);
        let ours: Vec<f64> = [sv("warp"), sv("weft")].concat().into_iter().chain([q]).chain(rho).collect();
        for (k, (a, b)) in ours.iter().zip(&v[6..]).enumerate() {
            let d = (a - b).abs() / (b.abs() + 1e-6);
            if d > 1e-7 { println!("{name} {k} ours {a} golden {b} d {d:e} {line}"); }
            worst = worst.max(d);
        }
        rows += 1;
    }
    println!("{rows} rows, worst {worst:e}");
    assert!(worst < 1e-6);
}

#[test]
fn view() { agree(include_str!("data/golden_view.csv"), Reweighting::View); }
#[test]
fn both() { agree(include_str!("data/golden_both.csv"), Reweighting::Both); }
