//! Fits: what made the data is found again, and the tool says what it found.

use std::fs;

use crate::common::fabric;
use assert_cmd::Command;
use predicates::str::contains;
use sateen::fabric::{Fabric, Irawan, Lambert, Models, OrenNayar, TorranceSparrow};
use sateen::fit::{fit, fit_to};
use sateen::metrics::{Truth, protocol_pairs};
use sateen::model::{ModelKind, Rule, Sadeghi, irawan_of};
use sateen::progress::Progress;

/// What the fit from `start` finds in data that `made` made.
fn found(kind: ModelKind, made: &Models, start: &Models) -> Models {
    let model = kind.prepare::<f64>(made).unwrap().unwrap();
    let pairs = protocol_pairs(&fabric("denim"), 400, 7);
    let data = Truth::of_model(&*model, pairs, Progress::silent()).unwrap();
    fit_to(&data, kind, std::slice::from_ref(start), Progress::silent()).unwrap()
}

fn assert_close(found: &[f64], made: &[f64], tolerance: f64) {
    for (a, b) in found.iter().zip(made) {
        assert!((a - b).abs() <= tolerance * b.abs(), "{found:?} {made:?}");
    }
}

#[test]
fn parameters_are_found_again() {
    let (kind, made) = (ModelKind::Lambert, [0.7, 0.1, 0.3]);
    let of = |albedo| Models {
        lambert: Some(Lambert { albedo }),
        ..Models::default()
    };
    let lambert = found(kind, &of(made), &of([0.2; 3])).lambert.unwrap();
    assert_close(&lambert.albedo, &made, 1e-6);

    let of = |albedo, sigma| Models {
        oren_nayar: Some(OrenNayar { albedo, sigma }),
        ..Models::default()
    };
    let model = found(ModelKind::OrenNayar, &of(made, 0.3), &of([0.2; 3], 0.8));
    let model = model.oren_nayar.unwrap();
    assert_close(&model.albedo, &made, 1e-5);
    assert_close(&[model.sigma], &[0.3], 1e-5);

    let made = TorranceSparrow {
        diffuse: [0.2, 0.1, 0.3],
        specular: [0.8, 0.5, 0.9],
        alpha_x: 0.25,
        alpha_y: 0.5,
        eta: 1.5,
        distribution: Default::default(),
        shadowing: Default::default(),
        fresnel: Default::default(),
    };
    let start = TorranceSparrow {
        diffuse: [0.1; 3],
        specular: [0.5; 3],
        alpha_x: 0.4,
        alpha_y: 0.4,
        ..made
    };
    let of = |model| Models {
        torrance_sparrow: Some(model),
        ..Models::default()
    };
    let model = found(ModelKind::TorranceSparrow, &of(made), &of(start));
    let model = model.torrance_sparrow.unwrap();
    assert_close(&model.diffuse, &made.diffuse, 1e-4);
    assert_close(&model.specular, &made.specular, 1e-4);
    assert_close(&[model.alpha_x, model.alpha_y], &[0.25, 0.5], 1e-4);
}

#[test]
fn a_fit_with_a_lobe_is_no_worse_than_one_without() {
    for name in ["denim", "polyester-lining", "tshirt-white"] {
        let fabric = fabric(name);
        // What the fits are of.
        let reference = Sadeghi::<f64>::new(&fabric, Rule::REFERENCE);
        let pairs = protocol_pairs(&fabric, 1024, 41);
        let data = Truth::of_model(&reference, pairs, Progress::silent()).unwrap();
        let [lambert, torrance_sparrow] =
            [ModelKind::Lambert, ModelKind::TorranceSparrow].map(|kind| {
                let models = fit(&fabric, kind, Progress::silent()).unwrap().models;
                let model = kind.prepare::<f64>(&models).unwrap().unwrap();
                let values = data.values_of(&*model, Progress::silent()).unwrap();
                let residuals = data.relative_residuals(&values);
                residuals.iter().map(|x| x * x).sum::<f64>()
            });
        // No parameter starts quite at the end of its range, so that a lobe of nothing has 1e-8 left.
        assert!(
            torrance_sparrow <= (1.0 + 1e-6) * lambert,
            "{name}: {torrance_sparrow} {lambert}"
        );
    }
}

#[test]
fn irawans_colours_are_found_again_from_near_by() {
    let made = irawan_of(&fabric("denim"));
    let mut made = Irawan {
        diffuse: [0.02, 0.03, 0.01],
        ..made
    };
    for yarn in &mut made.yarns {
        yarn.specular = [0.5, 0.3, 0.2];
    }
    let mut start = made.clone();
    start.diffuse = [0.1; 3];
    for yarn in &mut start.yarns {
        yarn.specular = [0.4; 3];
        yarn.beta = 5.0;
    }
    let of = |model| Models {
        irawan: Some(model),
        ..Models::default()
    };
    let irawan = found(ModelKind::Irawan, &of(made.clone()), &of(start))
        .irawan
        .unwrap();
    for (yarn, made) in irawan.yarns.iter().zip(&made.yarns) {
        assert_close(&yarn.specular, &made.specular, 0.02);
        assert_close(&[yarn.beta, yarn.u_max], &[made.beta, made.u_max], 0.02);
    }
}

#[test]
fn denim_is_as_far_from_the_other_models_as_this() {
    // A Lambertian denim is a special Oren–Nayar one, and no model can beat what it contains by being worse.
    let denim = fabric("denim");
    let mean = |kind| {
        fit(&denim, kind, Progress::silent())
            .unwrap()
            .error
            .all
            .mean
    };
    let [lambert, oren_nayar] = [ModelKind::Lambert, ModelKind::OrenNayar].map(mean);
    assert!(oren_nayar <= lambert + 1e-3, "{lambert} {oren_nayar}");
    assert!((0.01..10.0).contains(&oren_nayar), "{oren_nayar}");
}

fn sateen(arguments: &[&str]) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("sateen").expect("the tool is built");
    command.args(arguments).assert()
}

const PAIRS: &str = "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z\n0.6,0,0.8,0,0,1\n0,0,1,0,0,-1\n";

#[test]
fn a_fit_goes_into_the_file_and_from_there_into_eval() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (pairs, fitted) = (path("pairs.csv"), path("denim.toml"));
    fs::write(&pairs, PAIRS).unwrap();
    sateen(&["fit", "oren-nayar", "denim"])
        .success()
        .stdout(predicates::str::starts_with(
            "[oren_nayar]\nalbedo = { color = [",
        ))
        .stderr(contains("oren-nayar of denim: relative error"));
    let told = sateen(&["fit", "lambert", "denim", "--json"]).success();
    let told: serde_json::Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
    assert_eq!(told["schema"], "sateen-fit/1");
    assert_eq!(
        told["parameters"]["lambert"]["albedo"]["color"]
            .as_array()
            .unwrap()
            .len(),
        3
    );
    assert!(told["error"]["all"]["mean"].as_f64().unwrap() > 0.1);
    sateen(&["fit", "lambert", "denim", "-o", &fitted])
        .success()
        .stdout("");
    let fabric = Fabric::from_toml(&fs::read_to_string(&fitted).unwrap(), &fitted, None).unwrap();
    let albedo = fabric.models.lambert.unwrap().albedo;
    let output = sateen(&["eval", &fitted, "--pairs", &pairs, "--model", "lambert"]).success();
    let text = String::from_utf8(output.get_output().stdout.clone()).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].ends_with(",rho_r,rho_g,rho_b"), "{text}");
    let red: f64 = lines[1].split(',').nth(6).unwrap().parse().unwrap();
    assert!(
        (red - 0.8 * albedo[0] / std::f64::consts::PI).abs() < 1e-12,
        "{text}"
    );
    assert!(lines[2].ends_with(",0.0,0.0,0.0"), "{text}");

    // Irawan's needs no section, the others say what does it.
    sateen(&["eval", "denim", "--pairs", &pairs, "--model", "irawan"]).success();
    sateen(&[
        "eval",
        &fitted,
        "--pairs",
        &pairs,
        "--model",
        "torrance-sparrow",
    ])
    .code(1)
    .stderr(contains(
        "has no section [torrance_sparrow]; `sateen fit torrance-sparrow",
    ));
    for flags in [["--components", "--quiet"], ["--evaluator", "midpoint:50"]] {
        let arguments = ["eval", &fitted, "--pairs", &pairs, "--model", "lambert"];
        sateen(&[&arguments[..], &flags].concat())
            .code(2)
            .stderr(contains(flags[0]));
    }
    sateen(&["fit", "phong", "denim"])
        .code(2)
        .stderr(contains("oren-nayar"));
}

#[test]
fn reports_list_the_fits() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().to_str().unwrap();
    sateen(&["report", "faux-suede", "--quick", "-o", target]).success();
    let csv = fs::read_to_string(folder.path().join("report.csv")).unwrap();
    for name in ["fit:lambert", "fit:oren-nayar", "fit:torrance-sparrow"] {
        assert!(csv.contains(&format!(",{name},fit,")), "{csv}");
    }
}
