//! Files that were once read wrongly: each is refused now, or evaluates to light.

use std::fs;
use std::path::{Path, PathBuf};

use crate::common::assert_refused_or_light;
use sateen::fabric::Fabric;
use sateen::metrics::PairsFile;
use sateen::model::{Model, Rule, Sadeghi};

/// The files of `tests/data/corrupt` with this extension. Their names say what is wrong.
fn files(extension: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/corrupt");
    let entries = fs::read_dir(folder).unwrap();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.retain(|path| path.extension().is_some_and(|found| found == extension));
    paths.sort();
    assert!(!paths.is_empty(), "{extension}: nothing is tested");
    let read = |path: PathBuf| (path.display().to_string(), fs::read(&path).unwrap());
    paths.into_iter().map(read).collect()
}

#[test]
fn corrupt_tables_are_refused_or_evaluate_to_light() {
    for (name, bytes) in files("sateen") {
        assert_refused_or_light(&name, &bytes);
    }
}

#[test]
fn corrupt_fabrics_are_refused_or_evaluate_to_light() {
    for (name, bytes) in files("toml") {
        let Ok(text) = std::str::from_utf8(&bytes) else {
            continue;
        };
        let Ok(fabric) = Fabric::from_toml(text, &name, None) else {
            continue;
        };
        for thread in &fabric.threads {
            let tangents = thread.tangents::<f64>();
            let weights = tangents.tilts().iter().map(|tilt| tilt.weight);
            let mut weights = weights.chain(tangents.segments().iter().map(|s| s.weight));
            let is_share = |weight: f64| (0.0..=1.0).contains(&weight);
            assert!(weights.all(is_share), "{name}: no table holds such weights");
        }
        for rule in [Rule::Midpoint(4), Rule::Quadrature(4), Rule::Adaptive(1e-3)] {
            let (single, double) = (
                Sadeghi::<f32>::new(&fabric, rule),
                Sadeghi::<f64>::new(&fabric, rule),
            );
            for (wi, wr) in [
                ([0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]),
                ([1.0, 0.0, 1e-7], [0.0, -1.0, 1e-20]),
            ] {
                let rho = double.eval_cos(wi, wr);
                let [wi, wr] = [wi, wr].map(|w| w.map(|x| x as f32));
                let plain = single.eval_cos(wi, wr).map(f64::from);
                let fast = single.eval_cos_fast(wi, wr).map(f64::from);
                for rho in [rho, plain, fast].as_flattened() {
                    assert!(
                        rho.is_finite() && *rho >= 0.0,
                        "{name} {rule:?} {wi:?} {wr:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn corrupt_files_of_pairs_are_refused_or_are_unit_vectors() {
    for (name, bytes) in files("csv") {
        let Ok(pairs) = PairsFile::read(&*bytes, &name) else {
            continue;
        };
        for direction in pairs.directions().as_flattened() {
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-12, "{name}: {direction:?}");
        }
    }
}
