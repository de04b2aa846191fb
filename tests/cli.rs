//! The tool from outside: what it prints, where, and with which exit status.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process};
use std::time::{Duration, Instant};

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

fn sateen() -> Command {
    Command::cargo_bin("sateen").expect("the tool is built")
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn names_in(folder: &Path) -> Vec<String> {
    let name =
        |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
    names.sort();
    names
}

/// Faux suede has single tilts only: it bakes in a moment.
fn bake_suede(folder: &Path) -> PathBuf {
    let path = folder.join("suede.sateen");
    sateen()
        .args(["bake", "faux-suede", "-o"])
        .arg(&path)
        .assert()
        .success();
    path
}

fn pairs(folder: &Path, text: &str) -> PathBuf {
    let path = folder.join("pairs.csv");
    fs::write(&path, text).unwrap();
    path
}

const HEADER: &str = "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z";

#[test]
fn fabrics_lists_the_library() {
    let output = sateen()
        .arg("fabrics")
        .assert()
        .success()
        .get_output()
        .stdout
        .clone();
    insta::assert_snapshot!(String::from_utf8(output).unwrap(), @r"
    linen-plain                      warp+weft   Linen, plain weave
    silk-crepe-de-chine              warp+weft   Silk crepe de chine
    polyester-satin-charmeuse-front  warp+weft   Polyester satin charmeuse, front
    polyester-satin-charmeuse-back   warp+weft   Polyester satin charmeuse, back
    silk-shot                        warp+weft   Shot silk
    velvet                           warp+weft   Velvet
    denim                            warp+weft   Denim
    polyester-lining                 warp+weft   Polyester lining
    polka-dot-lining-white           warp+weft   Polka-dot lining, white
    polka-dot-lining-pink            warp+weft   Polka-dot lining, pink
    swimwear-front                   warp+weft   Swimwear, front
    swimwear-back                    warp+weft   Swimwear, back
    tshirt-white                     warp        White T-shirt
    tshirt-black-front               warp        Black T-shirt, front
    tshirt-black-back                weft        Black T-shirt, back
    faux-suede                       weft        Faux suede
    corduroy                         warp+weft   Corduroy
    ");
    let json = sateen()
        .args(["fabrics", "--json"])
        .assert()
        .success()
        .get_output()
        .stdout
        .clone();
    let json: Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json.as_array().unwrap().len(), 17);
    assert_eq!(json[6]["threads"][1]["gamma_s_deg"], 15.0);
}

#[test]
fn bake_info_and_validate_tell_the_same_story() {
    let folder = folder();
    let path = folder.path().join("new/denim.sateen");
    let bake = sateen()
        .args([
            "bake", "denim", "--preset", "draft", "--json", "-j", "1", "-o",
        ])
        .arg(&path)
        .assert()
        .success();
    let bake: Value = serde_json::from_slice(&bake.get_output().stdout).unwrap();
    assert_eq!(names_in(path.parent().unwrap()), ["denim.sateen"]);

    let info = sateen()
        .arg("info")
        .arg(&path)
        .arg("--json")
        .assert()
        .success();
    let info: Value = serde_json::from_slice(&info.get_output().stdout).unwrap();
    assert_eq!(info["error"], bake[0]["error"]);
    assert_eq!(info["decoded_bytes"], bake[0]["decoded_bytes"]);
    assert_eq!(info["file_bytes"], fs::metadata(&path).unwrap().len());
    assert_eq!(info["settings"]["preset"], "draft");
    assert_eq!(info["threads"][0]["grid"]["axes"][2]["name"], "phi_d");
    sateen()
        .arg("info")
        .arg(&path)
        .assert()
        .success()
        .stdout(contains("[Fecho13] table A.1").and(contains("sqrt-i16")));
    sateen()
        .args(["info", "--toml"])
        .arg(&path)
        .assert()
        .success()
        .stdout(include_str!("../tables/fabrics/denim.toml"));

    let validate = |limit: &str| {
        let mut command = sateen();
        command.arg("validate").arg(&path).args([
            "--pairs",
            "16384",
            "--seed",
            "2013",
            "--json",
            "--max-error",
            limit,
        ]);
        command.assert()
    };
    let measured = validate("5%").success();
    let measured: Value = serde_json::from_slice(&measured.get_output().stdout).unwrap();
    assert_eq!(measured[0]["error"], bake[0]["error"]);
    validate("0.0001")
        .code(3)
        .stderr(contains("exceeds 0.01 %"));
}

#[test]
fn several_fabrics_go_to_a_folder() {
    let folder = folder();
    let file = folder.path().join("thread.toml");
    fs::write(
        &file,
        include_str!("../tables/fabrics/polka-dot-lining.toml")
            .replace("-15, -15, 15, 15", "0, 0, 0, 0")
            .replace("-7, -7, 7, 7", "1, 1, 1, 1"),
    )
    .unwrap();
    let out = folder.path().join("out");
    sateen()
        .args(["bake", "faux-suede"])
        .arg(&file)
        .args(["--variant", "white", "-o"])
        .arg(&out)
        .assert()
        .code(2);
    sateen()
        .args(["bake", "faux-suede"])
        .arg(&file)
        .arg("-o")
        .arg(&out)
        .assert()
        .success();
    assert_eq!(
        names_in(&out),
        ["faux-suede.sateen", "polka-dot-lining-pink.sateen"]
    );
    sateen()
        .args(["bake", "faux-suede", "faux-suede", "-o"])
        .arg(&out)
        .assert()
        .code(2)
        .stderr(contains("two fabrics"));
    let in_the_way = out.join("faux-suede.sateen");
    sateen()
        .args(["bake", "faux-suede", "denim", "-o"])
        .arg(&in_the_way)
        .assert()
        .code(2)
        .stderr(contains("need a folder"));
}

#[test]
fn eval_reproduces_golden_components() {
    let folder = folder();
    let golden = include_str!("data/golden_view.csv");
    let rows = golden
        .lines()
        .filter(|line| line.starts_with("fabric") || line.starts_with("faux-suede,"));
    let path = pairs(folder.path(), &rows.collect::<Vec<_>>().join("\n"));
    let table = bake_suede(folder.path());
    for subject in [Path::new("faux-suede"), &table] {
        let out = folder.path().join("out.csv");
        sateen()
            .arg("eval")
            .arg(subject)
            .arg("--pairs")
            .arg(&path)
            .arg("--components")
            .arg("-o")
            .arg(&out)
            .assert()
            .success();
        let text = fs::read_to_string(&out).unwrap();
        assert_eq!(
            text.lines().next().unwrap().matches("S_warp").count(),
            2,
            "the golden column passes through"
        );
        for line in text.lines().skip(1) {
            let cells: Vec<f64> = line
                .split(',')
                .skip(1)
                .map(|cell| cell.parse().unwrap())
                .collect();
            let (expected, values) = (&cells[6..16], &cells[16..]);
            for (value, expected) in values.iter().zip(expected) {
                assert!(
                    (value - expected).abs() < 1e-4 * expected.abs().max(0.1),
                    "{subject:?}: {line}"
                );
            }
        }
    }
}

#[test]
fn eval_takes_every_evaluator_and_stdin() {
    let folder = folder();
    let table = bake_suede(folder.path());
    let text = format!("name,{HEADER}\na,0,0,1,0,0.6,0.8\nb,0,0,3,0,6,8\nc,0,0,1,0,0.6,-0.8\n");
    let values = |evaluator: &str| {
        let mut command = sateen();
        command
            .arg("eval")
            .arg(&table)
            .args(["--pairs", "-", "--evaluator", evaluator])
            .write_stdin(text.clone());
        let output = command
            .assert()
            .success()
            .stderr(contains("2 directions were not of unit length"))
            .get_output()
            .clone();
        let output = String::from_utf8(output.stdout).unwrap();
        let lines: Vec<String> = output.lines().map(str::to_owned).collect();
        let rho = |line: &str| -> Vec<f64> {
            line.split(',')
                .skip(7)
                .map(|cell| cell.parse().unwrap())
                .collect()
        };
        assert_eq!(lines[0], format!("name,{HEADER},rho_r,rho_g,rho_b"));
        for (unit, long) in rho(&lines[1]).iter().zip(rho(&lines[2])) {
            assert!(
                (unit - long).abs() < 1e-6 * unit,
                "directions are normalized"
            );
        }
        assert_eq!(rho(&lines[3]), [0.0; 3], "nothing is seen from below");
        rho(&lines[1])
    };
    let (table, reference, midpoint) = (values("table"), values("reference"), values("midpoint:4"));
    for channel in 0..3 {
        assert!((table[channel] - reference[channel]).abs() < 1e-5 * reference[channel]);
        // Four equal parts hit the two, one and one parts of its three tilts.
        assert!((midpoint[channel] - reference[channel]).abs() < 1e-5 * reference[channel]);
    }
}

#[test]
fn bad_input_is_explained() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let table = bake_suede(folder.path());
    let bytes = fs::read(&table).unwrap();
    fs::write(at("short.sateen"), &bytes[..bytes.len() - 1]).unwrap();
    fs::write(at("foreign.sateen"), "hello").unwrap();
    let mut flipped = bytes.clone();
    flipped[100] ^= 4;
    fs::write(at("flipped.sateen"), &flipped).unwrap();
    let mut newer = bytes;
    newer[8] = 9;
    fs::write(at("newer.sateen"), &newer).unwrap();
    for (name, message) in [
        ("short.sateen", "truncated"),
        ("foreign.sateen", "not a sateen table"),
        ("flipped.sateen", "checksum of the header"),
        (
            "newer.sateen",
            "format version 9.0, but this sateen reads 2.0",
        ),
        ("missing.sateen", "No such file"),
    ] {
        for verb in ["info", "validate"] {
            sateen()
                .arg(verb)
                .arg(at(name))
                .assert()
                .code(1)
                .stderr(contains(message).and(contains(name)));
        }
    }

    sateen()
        .args(["bake", "dennim"])
        .assert()
        .code(1)
        .stderr(contains("did you mean denim?"));
    sateen()
        .args(["bake", "nothing/here.toml"])
        .assert()
        .code(1)
        .stderr(contains("nothing/here.toml"));
    fs::write(at("broken.toml"), "name = \"x\"\n[[thread]\n").unwrap();
    sateen()
        .arg("bake")
        .arg(at("broken.toml"))
        .assert()
        .code(1)
        .stderr(contains("broken.toml:2: "));

    for (text, message) in [
        (
            "wi_x,wi_y,wi_z,wr_x\n1,0,0,1\n".to_owned(),
            "the columns wr_y, wr_z are missing",
        ),
        (
            format!("{HEADER}\n0,0,1,0,0,1\n0,0,1,0,zero,1\n"),
            "pairs.csv:3: wr_y is \"zero\"",
        ),
        (
            format!("{HEADER}\n0,0,NaN,0,0,1\n"),
            "pairs.csv:2: wi_z is \"NaN\"",
        ),
        (
            format!("{HEADER}\n0,0,1,0,0,0\n"),
            "pairs.csv:2: wr is the zero vector",
        ),
        (format!("{HEADER}\n0,0,1\n"), "cannot read the pairs"),
    ] {
        let path = pairs(folder.path(), &text);
        sateen()
            .args(["eval", "denim", "--pairs"])
            .arg(&path)
            .assert()
            .code(1)
            .stderr(contains(message))
            .stdout("");
    }
    sateen()
        .args(["eval", "denim", "--evaluator", "table", "--pairs", "-"])
        .assert()
        .code(2)
        .stderr(contains("bake it first"));
}

#[test]
fn wrong_usage_exits_with_2() {
    for args in [
        &["bake"][..],
        &["frobnicate"],
        &["bake", "denim", "--preset", "huge"],
        &["bake", "--all", "denim"],
        &["eval", "denim", "--pairs", "-", "--evaluator", "midpoint:0"],
        &["validate"],
    ] {
        sateen().args(args).assert().code(2);
    }
}

#[test]
fn outputs_that_cannot_be_written_are_found_out_at_once() {
    let folder = folder();
    let file = folder.path().join("file");
    fs::write(&file, "").unwrap();
    let start = Instant::now();
    sateen()
        .args(["bake", "denim", "--preset", "fine", "-o"])
        .arg(file.join("x.sateen"))
        .assert()
        .code(1)
        .stderr(contains("file"));
    assert!(start.elapsed() < Duration::from_secs(20), "before the work");
    assert_eq!(names_in(folder.path()), ["file"]);
    sateen()
        .args(["eval", "denim", "--pairs", "-", "-o"])
        .arg(folder.path())
        .assert()
        .code(1)
        .stderr(contains("it is a folder"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_nothing_behind() {
    sateen()
        .args(["bake", "faux-suede", "-o", "/dev/full"])
        .assert()
        .code(1)
        .stderr(contains("No space left on device"));
    // A file size limit stops a write half way, as a full disk does.
    let folder = folder();
    let script = format!(
        "trap '' XFSZ; ulimit -f 1; exec '{}' bake silk-crepe-de-chine --preset draft -o '{}'",
        assert_cmd::cargo::cargo_bin("sateen").display(),
        folder.path().join("silk.sateen").display()
    );
    Command::new("bash")
        .args(["-c", &script])
        .assert()
        .code(1)
        .stderr(contains("cannot write").and(contains("silk.sateen")));
    assert!(names_in(folder.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn output_goes_through_a_link_and_keeps_ordinary_permissions() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let (real, link) = (
        folder.path().join("real.sateen"),
        folder.path().join("link.sateen"),
    );
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    sateen()
        .args(["bake", "faux-suede", "-o"])
        .arg(&link)
        .assert()
        .success();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(fs::read(&real).unwrap().starts_with(b"\x89SATEEN\n"));
    let plain = folder.path().join("plain");
    fs::write(&plain, "").unwrap();
    assert_eq!(
        fs::metadata(&real).unwrap().permissions().mode(),
        fs::metadata(&plain).unwrap().permissions().mode()
    );
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_bake_soon_and_leaves_nothing_half_written() {
    for signal in ["-INT", "-TERM", "-KILL"] {
        let folder = folder();
        let mut bake: Child = Process::new(assert_cmd::cargo::cargo_bin("sateen"))
            .args([
                "bake",
                "faux-suede",
                "denim",
                "--preset",
                "fine",
                "-q",
                "-o",
            ])
            .arg(folder.path())
            .stderr(std::process::Stdio::null())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        let suede = folder.path().join("faux-suede.sateen");
        let start = Instant::now();
        while !suede.exists() {
            assert!(
                start.elapsed() < Duration::from_secs(60),
                "the first table takes a moment"
            );
            std::thread::sleep(Duration::from_millis(20));
        }
        std::thread::sleep(Duration::from_millis(300));
        assert!(
            bake.try_wait().unwrap().is_none(),
            "the second table takes minutes"
        );
        Process::new("kill")
            .args([signal, &bake.id().to_string()])
            .status()
            .unwrap();
        let start = Instant::now();
        let status = bake.wait().unwrap();
        assert!(start.elapsed() < Duration::from_secs(5), "{signal}");
        assert_eq!(
            status.code(),
            if signal == "-KILL" { None } else { Some(1) }
        );
        assert_eq!(names_in(folder.path()), ["faux-suede.sateen"], "{signal}");
        sateen().arg("info").arg(&suede).assert().success();
    }
}

#[test]
fn a_reader_that_has_seen_enough_changes_no_exit_status() {
    let folder = folder();
    let table = bake_suede(folder.path());
    let bin = assert_cmd::cargo::cargo_bin("sateen");
    let script = format!(
        "set -o pipefail; '{0}' bake faux-suede tshirt-white --preset draft -o '{1}/out/' | true; exit ${{PIPESTATUS[0]}}",
        bin.display(),
        folder.path().display()
    );
    Command::new("bash")
        .args(["-c", &script])
        .assert()
        .success();
    assert_eq!(
        names_in(&folder.path().join("out")),
        ["faux-suede.sateen", "tshirt-white.sateen"]
    );
    let script = format!(
        "'{}' eval '{}' --pairs nowhere.csv 2>/dev/full; exit $?",
        bin.display(),
        table.display()
    );
    Command::new("bash").args(["-c", &script]).assert().code(1);
}

#[test]
fn fabrics_and_tables_may_come_through_pipes() {
    let folder = folder();
    let table = bake_suede(folder.path());
    let pairs = pairs(folder.path(), &format!("{HEADER}\n0,0,1,0,0.6,0.8\n"));
    for subject in [Path::new("tables/fabrics/faux-suede.toml"), &table] {
        let script = format!(
            "'{}' eval <(cat '{}') --pairs '{}'",
            assert_cmd::cargo::cargo_bin("sateen").display(),
            subject.display(),
            pairs.display()
        );
        Command::new("bash")
            .args(["-c", &script])
            .assert()
            .success()
            .stdout(contains("rho_r"));
    }
    sateen()
        .args(["info", "/dev/zero"])
        .assert()
        .code(1)
        .stderr(contains("more than"));
}

#[test]
fn limits_choose_the_cheapest_table_that_keeps_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("table.sateen");
    let bake = |arguments: &[&str]| {
        sateen()
            .args(["bake", "--json", "-o"])
            .arg(&path)
            .args(arguments)
            .assert()
    };
    let result = |arguments: &[&str], code: i32| -> Value {
        let assert = bake(arguments).code(code);
        let all: Value = serde_json::from_slice(&assert.get_output().stdout).unwrap();
        all[0].clone()
    };
    let mean = |result: &Value| result["error"]["all"]["mean"].as_f64().unwrap();

    // One segment and wide lobes: nothing beats a few tilts.
    let direct = result(&["tshirt-white", "--max-error", "0.5%"], 0);
    assert!(mean(&direct) <= 0.005);
    assert_eq!(direct["decoded_bytes"], 0);
    assert_eq!(direct["choices"][0]["grid"], false);
    assert!(path.exists());

    // Unless one wants a grid.
    let grid = result(
        &["tshirt-white", "--preset", "draft", "--direct", "never"],
        0,
    );
    assert!(grid["decoded_bytes"].as_u64().unwrap() > 0);
    assert_eq!(grid["choices"][0]["grid"], true);

    // Three segments: a grid is cheaper than tilts in each.
    let grid = result(
        &["denim", "--max-error", "1.5%", "--max-bytes", "512KiB"],
        0,
    );
    assert!(mean(&grid) <= 0.015);
    assert!(grid["decoded_bytes"].as_u64().unwrap() <= 512 << 10);
    assert_eq!(grid["choices"][0]["grid"], true);

    // Nothing is so exact or so fast: the nearest miss is told, and nothing written.
    fs::remove_file(&path).unwrap();
    for impossible in [
        &[
            "tshirt-white",
            "--max-error",
            "1e-9%",
            "--max-bytes",
            "16KiB",
        ][..],
        &["tshirt-white", "--max-ns", "0.001"],
    ] {
        let miss = result(impossible, 3);
        assert_eq!(
            (&miss["within"], &miss["path"]),
            (&Value::Bool(false), &Value::Null)
        );
        assert!(!path.exists());
    }
    bake(&["denim", "--max-error", "1%", "--preset", "draft"]).code(2);
    bake(&["denim", "--max-ns", "0"]).code(2);
}
