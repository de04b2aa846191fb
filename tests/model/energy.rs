//! How much is reflected of what arrives, and fabrics scaled to no more.

use std::f64::consts::{FRAC_1_PI, PI};
use std::fs;

use crate::common::{fabric, tiny};
use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use sateen::bake::{Direct, Provenance, Settings, bake};
use sateen::fabric::Fabric;
use sateen::metrics::{Reflectance, conserving};
use sateen::model::{Model, Rule, Sadeghi};
use sateen::progress::Progress;
use sateen::table::Table;

struct Matt;

impl Model<f64> for Matt {
    fn eval_cos(&self, wi: [f64; 3], _: [f64; 3]) -> [f64; 3] {
        [0.2, 0.9, 0.5].map(|albedo| albedo * FRAC_1_PI * wi[2])
    }
}

#[test]
fn a_matt_surface_reflects_its_albedo_at_every_angle() {
    let reflectance = Reflectance::of(&Matt);
    assert_eq!(reflectance.views.len(), 9);
    for view in &reflectance.views {
        assert!((view.mean - 0.9).abs() < 1e-9 && (view.max - 0.9).abs() < 1e-9);
    }
    assert!(reflectance.conserves_energy());
}

/// ∫ ρ dwi of the brightest channel, at other lights and views than the factor was found with.
fn reflected(fabric: &Fabric, view_deg: f64, azimuth_deg: f64) -> f64 {
    let model = Sadeghi::<f64>::new(fabric, Rule::Quadrature(6));
    let direction = |z: f64, azimuth: f64| {
        let r = (1.0 - z * z).sqrt();
        [r * azimuth.cos(), r * azimuth.sin(), z]
    };
    let wr = direction(view_deg.to_radians().cos(), azimuth_deg.to_radians());
    let (rows, columns) = (70, 180);
    let mut sum = [0.0; 3];
    for row in 0..rows {
        for column in 0..columns {
            let z = (f64::from(row) + 0.5) / f64::from(rows);
            let azimuth = 2.0 * PI * (f64::from(column) + 0.7) / f64::from(columns);
            for (sum, rho) in sum
                .iter_mut()
                .zip(model.eval_cos(direction(z, azimuth), wr))
            {
                *sum += rho * 2.0 * PI / f64::from(rows * columns);
            }
        }
    }
    sum.into_iter().fold(0.0, f64::max)
}

#[test]
fn published_fits_that_reflect_more_than_arrives_are_scaled_to_what_does() {
    let mut scaled = Vec::new();
    for name in [
        "tshirt-white",
        "polyester-lining",
        "swimwear-front",
        "denim",
        "velvet",
    ] {
        let fabric = fabric(name);
        let clamped = conserving(&fabric).unwrap();
        if clamped.rho_scale == 1.0 {
            assert_eq!(clamped, fabric, "{name}");
            continue;
        }
        scaled.push(name);
        for view_deg in [2.0, 37.0, 63.0, 78.0] {
            for azimuth_deg in [0.0, 33.0, 90.0, 171.0] {
                let share = reflected(&clamped, view_deg, azimuth_deg);
                assert!(
                    share < 1.005,
                    "{name} at {view_deg}°, {azimuth_deg}°: {share}"
                );
            }
        }
    }
    assert_eq!(
        scaled,
        ["tshirt-white", "polyester-lining", "swimwear-front"]
    );
}

#[test]
fn a_scaled_fabric_is_scaled_by_every_evaluator_and_in_the_file() {
    let fabric = fabric("polyester-lining");
    let clamped = conserving(&fabric).unwrap();
    assert!(
        (0.3..1.0).contains(&clamped.rho_scale),
        "{}",
        clamped.rho_scale
    );
    let (wi, wr) = ([0.48, 0.36, 0.8], [-0.36, 0.48, 0.8]);
    for rule in [Rule::THESIS, Rule::Quadrature(4), Rule::REFERENCE] {
        let of = |fabric| Sadeghi::<f64>::new(fabric, rule).eval_cos(wi, wr);
        for (scaled, plain) in of(&clamped).iter().zip(of(&fabric)) {
            assert!((scaled - clamped.rho_scale * plain).abs() < 1e-9 * plain);
        }
    }
    let settings = Settings {
        direct: Direct::Always,
        ..tiny()
    };
    let [plain, scaled] = [&fabric, &clamped]
        .map(|fabric| bake(fabric, &settings, Progress::silent()).unwrap().table);
    let bytes = scaled.to_bytes().unwrap();
    let scaled = Table::from_bytes(&bytes).unwrap();
    assert_eq!(scaled.rho_scale(), clamped.rho_scale as f32);
    let single = |w: [f64; 3]| w.map(|x| x as f32);
    let values = [&plain, &scaled].map(|table| table.eval_cos(single(wi), single(wr))[0]);
    assert!((values[1] - scaled.rho_scale() * values[0]).abs() < 1e-5 * values[0]);
    for length in 0..bytes.len().min(600) {
        assert!(Table::from_bytes(&bytes[..length]).is_err());
    }
    for bit in 0..8 * 256 {
        let mut bytes = bytes.clone();
        bytes[bit / 8] ^= 1 << (bit % 8);
        assert!(Table::from_bytes(&bytes).is_err(), "bit {bit}");
    }
}

#[test]
fn info_says_what_other_models_of_the_fabric_reflect() {
    let folder = tempfile::tempdir().unwrap();
    let [toml, table] = ["mine.toml", "mine.sateen"].map(|name| folder.path().join(name));
    let text = fabric("faux-suede").to_toml();
    let sections = "\n[lambert]\nalbedo = { color = [0.1, 0.3, 1.2] }\n\n[oren_nayar]\nalbedo = { color = [0.5, 0.3, 0.2] }\nsigma_deg = 0\n";
    fs::write(&toml, text + sections).unwrap();
    let sateen = || Command::cargo_bin("sateen").expect("the tool is built");
    sateen()
        .arg("bake")
        .arg(&toml)
        .args(["--preset", "draft", "-o"])
        .arg(&table)
        .assert()
        .success();
    let info = sateen().arg("info").arg(&table).assert().success();
    info.stdout(
        contains("lambert reflects 0°: 120.0 %")
            .and(contains("at most 120.0 % at 0°, more than arrives"))
            .and(
                contains("oren-nayar reflects 0°: 50.0 %").and(contains("torrance-sparrow").not()),
            ),
    );
    let json = sateen()
        .args(["info", "--json"])
        .arg(&table)
        .output()
        .unwrap()
        .stdout;
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    let models = &json["reflectance_of_models"];
    assert_eq!(models.as_object().unwrap().len(), 2);
    let share = models["lambert"]["views"][4]["mean"].as_f64().unwrap();
    assert!((share - 1.2).abs() < 1e-3, "{share}");
}

#[test]
fn the_tool_warns_of_such_fits_and_scales_them_when_asked() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let sateen = || Command::cargo_bin("sateen").expect("the tool is built");
    let baked = |more: &[&str], name: &str| {
        let mut command = sateen();
        command.args(["bake", "tshirt-white", "--preset", "draft", "-o"]);
        command.arg(path(name)).args(more).assert().success()
    };
    baked(&[], "plain.sateen").stdout(contains("scaled by").not());
    baked(&["--energy", "clamp"], "scaled.sateen").stdout(contains("scaled by 0."));
    baked(&["--energy", "clamp", "--resume"], "scaled.sateen").stderr(contains("is kept"));
    let info = |name: &str| sateen().arg("info").arg(path(name)).assert().success();
    info("plain.sateen").stdout(contains("more than arrives"));
    info("scaled.sateen").stdout(contains("scaled by 0.").and(contains("more than arrives").not()));
    let table = Table::from_bytes(&fs::read(path("scaled.sateen")).unwrap()).unwrap();
    let provenance = Provenance::of(&table).unwrap();
    assert!(provenance.fabric.toml.contains("rho_scale = 0."));
    assert!(provenance.error.all.mean < 1e-2);
}
