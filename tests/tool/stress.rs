//! `sateen stress` from outside.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use predicates::str::contains;
use serde_json::Value;

fn stress(arguments: &[&str], folder: &Path) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("sateen").expect("the tool is built");
    command
        .arg("stress")
        .args(arguments)
        .arg("-o")
        .arg(folder)
        .assert()
}

fn files(folder: &Path) -> BTreeMap<String, String> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    entries
        .map(|entry| {
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read_to_string(entry.path()).unwrap())
        })
        .collect()
}

#[test]
fn a_stress_report_is_complete_consistent_and_reproducible() {
    let quick = |jobs: &str| {
        let folder = tempfile::tempdir().unwrap();
        let arguments = [
            "tshirt-white",
            "faux-suede",
            "--quick",
            "--pairs",
            "20",
            "-j",
            jobs,
        ];
        stress(&arguments, folder.path())
            .success()
            .stdout(contains("tshirt-white: all 46 cases hold."));
        files(folder.path())
    };
    let written = quick("1");
    assert!(written == quick("2"), "the same on any number of workers");
    let names: Vec<&str> = written.keys().map(String::as_str).collect();
    assert_eq!(names, ["stress.csv", "stress.json"]);

    let json: Value = serde_json::from_str(&written["stress.json"]).unwrap();
    let cases = json["fabrics"][0]["cases"].as_array().unwrap();
    assert_eq!(cases.len(), 10 + 36);
    // One row per case and evaluator, with the same numbers.
    let mut rows = csv::Reader::from_reader(written["stress.csv"].as_bytes());
    let rows: Vec<BTreeMap<String, String>> = rows.deserialize().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 2 * 3 * cases.len());
    for (row, verdict) in rows.iter().zip(
        cases
            .iter()
            .flat_map(|case| case["verdicts"].as_array().unwrap()),
    ) {
        assert_eq!(row["evaluator"], verdict["evaluator"].as_str().unwrap());
        // JSON is read back to the last bit but one.
        let (csv, json) = (
            row["deviation"].parse::<f64>().unwrap(),
            verdict["deviation"]["value"].as_f64().unwrap(),
        );
        assert!((csv - json).abs() <= 1e-14 * json, "{csv} {json}");
        assert_eq!(row["holds"], "true");
    }
    assert_eq!(json["schema"], "sateen-stress/1");
    // The model's own faults are told apart from errors.
    let physics = &json["fabrics"][0]["physics"];
    assert!(physics["reciprocity"]["mean"].as_f64().unwrap() > 0.01);
    assert!(physics["reflectance"]["views"][0]["mean"].as_f64().unwrap() > 1.3);
}

#[test]
fn wrong_usage_of_stress_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    stress(&["denim", "denim", "--quick"], folder.path())
        .code(2)
        .stderr(contains("two fabrics are called denim"));
    stress(&["denin", "--quick"], folder.path())
        .code(1)
        .stderr(contains("did you mean denim?"));
    stress(
        &["denim", "--no-tables", "--presets", "draft"],
        folder.path(),
    )
    .code(2);
}
