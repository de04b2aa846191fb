//! `sateen report` from outside: what it writes, and that all of it says the same.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use sateen::report::Report;
use serde_json::Value;

fn report(arguments: &[&str], folder: &Path) -> assert_cmd::assert::Assert {
    let mut command = Command::cargo_bin("sateen").expect("the tool is built");
    command.arg("report").args(arguments).arg("-o").arg(folder);
    command.assert()
}

/// What a report of two fabrics wrote, by name.
fn quick(jobs: &str) -> BTreeMap<String, String> {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("new/report");
    let arguments = ["faux-suede", "denim", "--quick", "-j", jobs];
    report(&arguments, &target)
        .success()
        .stdout(
            contains("faux-suede: Every tilt has a closed form")
                .and(contains("denim: The draft table is")),
        )
        .stderr(contains("index.html"));
    let files = fs::read_dir(target).unwrap().map(|entry| {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        (name, fs::read_to_string(path).unwrap())
    });
    files.collect()
}

#[test]
fn a_report_is_complete_consistent_and_but_for_times_reproducible() {
    let files = quick("1");
    assert_eq!(
        files.keys().collect::<Vec<_>>(),
        [
            "denim-phi_d-phi_h.svg",
            "denim-psi-theta_d.svg",
            "denim-time.svg",
            "faux-suede-time.svg",
            "index.html",
            "report.csv",
            "report.json",
        ]
    );

    let json: Value = serde_json::from_str(&files["report.json"]).unwrap();
    let report: Report = serde_json::from_str(&files["report.json"]).unwrap();
    assert_eq!(json["schema"], "sateen-report/1");
    assert_eq!((report.pairs, report.seed, report.rounds), (512, 17, 1));
    let mut lines = files["report.csv"].lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let rows = report
        .fabrics
        .iter()
        .zip(json["fabrics"].as_array().unwrap())
        .flat_map(|(fabric, json)| {
            let evaluators = json["evaluators"].as_array().unwrap();
            fabric
                .evaluators
                .iter()
                .zip(evaluators)
                .map(move |pair| (fabric, pair))
        });
    let mut count = 0;
    for (fabric, (evaluator, json)) in rows {
        count += 1;
        let cells = columns
            .iter()
            .copied()
            .zip(lines.next().unwrap().split(','));
        let row: BTreeMap<&str, &str> = cells.collect();
        assert_eq!(row["fabric"], fabric.fabric);
        assert_eq!(row["evaluator"], evaluator.evaluator);
        assert_eq!(row["batch"], evaluator.batch.to_string());
        assert_eq!(row["family"], json["family"]);
        for (column, number) in [
            ("pairs", &json["error"]["all"]["pairs"]),
            ("mean", &json["error"]["all"]["mean"]),
            ("p50", &json["error"]["all"]["p50"]),
            ("p95", &json["error"]["all"]["p95"]),
            ("p99", &json["error"]["all"]["p99"]),
            ("p999", &json["error"]["all"]["p999"]),
            ("max", &json["error"]["all"]["max"]),
            ("grazing_pairs", &json["error"]["grazing"]["pairs"]),
            ("grazing_mean", &json["error"]["grazing"]["mean"]),
            ("grazing_p99", &json["error"]["grazing"]["p99"]),
            ("grazing_max", &json["error"]["grazing"]["max"]),
            ("rim_pairs", &json["error"]["rim"]["pairs"]),
            ("rim_mean", &json["error"]["rim"]["mean"]),
            ("rim_p99", &json["error"]["rim"]["p99"]),
            ("rim_max", &json["error"]["rim"]["max"]),
            ("rim_both_pairs", &json["error"]["rim_both"]["pairs"]),
            ("rim_both_mean", &json["error"]["rim_both"]["mean"]),
            ("rim_both_p99", &json["error"]["rim_both"]["p99"]),
            ("rim_both_max", &json["error"]["rim_both"]["max"]),
            ("rim_last_pairs", &json["error"]["rim_last"]["pairs"]),
            ("rim_last_mean", &json["error"]["rim_last"]["mean"]),
            ("rim_last_p99", &json["error"]["rim_last"]["p99"]),
            ("rim_last_max", &json["error"]["rim_last"]["max"]),
            ("rmse_over_mean", &json["error"]["rmse_over_mean"]),
            ("ns", &json["ns"]),
            ("speedup", &json["speedup"]),
            ("decoded_bytes", &json["decoded_bytes"]),
            ("file_bytes", &json["file_bytes"]),
        ] {
            let (cell, number): (f64, _) = (row[column].parse().unwrap(), number.as_f64().unwrap());
            // The last bit is JSON's reader's.
            assert!(
                (cell - number).abs() <= 1e-15 * number.abs(),
                "{column}: {cell} {number}"
            );
        }
        for (column, scene, number) in [
            ("sphere_flip", "sphere", "flip"),
            ("sphere_error", "sphere", "error"),
            ("cylinders_flip", "cylinders", "flip"),
            ("cylinders_error", "cylinders", "error"),
        ] {
            // Of tables and fits.
            let is_seen = json["family"] == "table" || json["family"] == "fit";
            let number = json["looks"][scene][number].as_f64();
            assert_eq!(number.is_some(), is_seen);
            let cell: Option<f64> = row[column].parse().ok();
            let apart = cell.zip(number).map(|(cell, number)| (cell - number).abs());
            assert_eq!(cell.is_some(), is_seen);
            assert!(apart.is_none_or(|apart| apart < 1e-15), "{column}");
            let is_table = json["family"] == "table";
            assert!(
                number.is_none_or(|x| x >= 0.0 && (x < 0.03 || !is_table)),
                "{column}"
            );
        }
        assert_eq!(row.len(), 36, "every column is looked at");
        // Of a fit how much it reflects, which for the others is what the fabric does.
        let is_fit = json["family"] == "fit";
        let views = json["reflectance"]["views"].as_array();
        assert_eq!(
            views.map(Vec::len),
            is_fit.then_some(9),
            "{}",
            row["evaluator"]
        );
        assert!(evaluator.ns > 0.0 && evaluator.speedup > 0.0);
    }
    assert_eq!(
        (count, lines.next()),
        (38, None),
        "nineteen evaluators per fabric"
    );

    for (name, text) in &files {
        if name.ends_with(".svg") {
            let svg =
                roxmltree::Document::parse(text).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(
                svg.root_element()
                    .has_tag_name(("http://www.w3.org/2000/svg", "svg"))
            );
            assert!(text.contains("prefers-color-scheme:dark"), "{name}");
        }
    }

    let other = quick("2");
    let untimed = |text: &str| {
        let mut report: Report = serde_json::from_str(text).unwrap();
        for evaluator in report
            .fabrics
            .iter_mut()
            .flat_map(|fabric| &mut fabric.evaluators)
        {
            (evaluator.ns, evaluator.speedup) = (0.0, 0.0);
        }
        report
    };
    assert_eq!(
        untimed(&files["report.json"]),
        untimed(&other["report.json"])
    );
    for name in ["denim-phi_d-phi_h.svg", "denim-psi-theta_d.svg"] {
        assert_eq!(files[name], other[name], "{name} shows no times");
    }

    let page = &files["index.html"];
    for fabric in &report.fabrics {
        assert!(page.contains(&format!("<section id=\"{}\">", fabric.fabric)));
        assert!(page.contains(&fabric.summary()));
    }
    assert_eq!(
        page.matches("<svg ").count(),
        4,
        "plots are part of the page"
    );
    let namespace = "xmlns=\"http://www.w3.org/2000/svg\"";
    let own = page.replace(namespace, "");
    for foreign in [
        "http:", "https:", "//", "src=", "url(", "@import", "<link", "<script",
    ] {
        assert!(!own.contains(foreign), "{foreign}");
    }
    let links = own.split("href=\"").skip(1);
    assert!(links.into_iter().all(|link| link.starts_with('#')));
}

#[test]
fn wrong_usage_of_report_is_explained() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("report");
    for (arguments, message) in [
        (&["denim", "--presets", "huge"][..], "huge"),
        (&["denim", "--sizes", "1KiB"], "from 16KiB to 256MiB"),
        (
            &["denim", "--sizes", "1MiB", "--no-sweep"],
            "cannot be used with",
        ),
        (&["denim", "--pairs", "0"], "0 is not in"),
        (
            &["denim", "denim", "--quick"],
            "two fabrics are called denim",
        ),
    ] {
        report(arguments, &target).code(2).stderr(contains(message));
    }
    report(&["dennim"], &target)
        .code(1)
        .stderr(contains("did you mean denim?"));
    assert!(!target.exists(), "nothing was begun");

    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    report(&["faux-suede"], &file)
        .code(2)
        .stderr(contains("needs a folder"));
    report(&["faux-suede"], &file.join("below"))
        .code(1)
        .stderr(contains("cannot make the folder"));
    let mut command = Command::cargo_bin("sateen").unwrap();
    command
        .args(["report", "faux-suede"])
        .assert()
        .code(2)
        .stderr(contains("--output"));
}
