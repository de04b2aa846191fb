//! The tool from outside: what it prints, where, and with which exit status.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, Stdio};
use std::sync::OnceLock;
use std::time::{Duration, Instant};

#[cfg(unix)]
use crate::common::process::{signal, wait_for_rest, wait_for_work, wait_until, work_of};
use crate::common::skip;
use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;
use sateen::table::VERSION;
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
    linen-plain                      Linen, plain weave                warp+weft
    silk-crepe-de-chine              Silk crepe de chine               warp+weft
    polyester-satin-charmeuse-front  Polyester satin charmeuse, front  warp+weft
    polyester-satin-charmeuse-back   Polyester satin charmeuse, back   warp+weft
    silk-shot                        Shot silk                         warp+weft
    velvet                           Velvet                            warp+weft
    denim                            Denim                             warp+weft
    polyester-lining                 Polyester lining                  warp+weft
    polka-dot-lining-white           Polka-dot lining, white           warp+weft
    polka-dot-lining-pink            Polka-dot lining, pink            warp+weft
    swimwear-front                   Swimwear, front                   warp+weft
    swimwear-back                    Swimwear, back                    warp+weft
    tshirt-white                     White T-shirt                     warp
    tshirt-black-front               Black T-shirt, front              warp
    tshirt-black-back                Black T-shirt, back               weft
    faux-suede                       Faux suede                        weft
    corduroy                         Corduroy                          warp+weft
    weft-knit                        Weft knit, three directions       left-leg+right-leg+arcs
    weft-knit-curve                  Weft knit, continuous curve       yarn
    warp-knit                        Warp knit                         yarn
    felt                             Felt                              fibres
    velvet-spread                    Velvet, pile directions spread    warp+weft
    ");
    let json = sateen()
        .args(["fabrics", "--json"])
        .assert()
        .success()
        .get_output()
        .stdout
        .clone();
    let json: Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["schema"], "sateen-fabrics/1");
    let fabrics = json["fabrics"].as_array().unwrap();
    assert_eq!(fabrics.len(), 22);
    assert_eq!(fabrics[6]["threads"][1]["gamma_s_deg"], 15.0);
}

#[test]
fn help_lists_what_the_exit_status_says() {
    let output = sateen()
        .arg("help")
        .assert()
        .success()
        .get_output()
        .stdout
        .clone();
    let help = String::from_utf8(output).unwrap();
    let (_, table) = help.split_once("Exit status:\n").expect("a table");
    let row = |line: &str| line.trim_start().split("  ").next().map(str::to_owned);
    let codes: Vec<String> = table.lines().filter_map(row).collect();
    assert_eq!(codes, ["0", "1", "2", "3"]);
    let folder = folder();
    for (arguments, code) in [
        ("fabrics", 0),
        ("info no-such-table.sateen", 1),
        ("bake", 2),
        ("bake faux-suede --max-error 0 --max-bytes 16KiB", 3),
    ] {
        let mut command = sateen();
        command.current_dir(&folder).args(arguments.split(' '));
        command.assert().code(code);
    }
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
    assert_eq!(bake["schema"], "sateen-bake/1");
    let bake = &bake["tables"][0];
    assert_eq!(names_in(path.parent().unwrap()), ["denim.sateen"]);

    let info = sateen()
        .arg("info")
        .arg(&path)
        .arg("--json")
        .assert()
        .success();
    let info: Value = serde_json::from_slice(&info.get_output().stdout).unwrap();
    assert_eq!(info["schema"], "sateen-info/1");
    assert_eq!(info["error"], bake["error"]);
    assert_eq!(info["decoded_bytes"], bake["decoded_bytes"]);
    assert_eq!(info["file_bytes"], fs::metadata(&path).unwrap().len());
    assert_eq!(info["settings"]["preset"], "draft");
    assert_eq!(info["threads"][0]["grid"]["axes"][2]["name"], "phi_d");
    sateen()
        .arg("info")
        .arg(&path)
        .assert()
        .success()
        .stdout(contains("[Fecho13] table A.1").and(contains("format 3")));
    sateen()
        .args(["info", "--toml"])
        .arg(&path)
        .assert()
        .success()
        .stdout(include_str!("../../tables/fabrics/denim.toml"));

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
    assert_eq!(measured["tables"][0]["error"], bake["error"]);
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
        include_str!("../../tables/fabrics/polka-dot-lining.toml")
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
    let golden = include_str!("../data/golden_view.csv");
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
        assert_eq!(text.lines().count(), 137);
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
            .stderr(contains("normalized 2 directions not of unit length"))
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
    let newer = format!("format version 9, but this sateen reads {VERSION}");
    for (name, message) in [
        ("short.sateen", "cut off after"),
        ("foreign.sateen", "not a sateen table"),
        ("flipped.sateen", "checksum of the header"),
        ("newer.sateen", newer.as_str()),
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
        (
            format!("{HEADER}\n0,0,1\n"),
            "pairs.csv:2: it has 3 cells, and the first line 6",
        ),
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
        &["bake", "denim", "--resume", "--max-error", "1%"],
        &["bake", "denim", "--resume", "--max-bytes", "64KiB"],
        &["bake", "denim", "--resume", "--max-ns", "100"],
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
        "trap '' XFSZ; ulimit -f 1; exec '{}' bake denim --preset draft -o '{}'",
        assert_cmd::cargo::cargo_bin("sateen").display(),
        folder.path().join("denim.sateen").display()
    );
    Command::new("bash")
        .args(["-c", &script])
        .assert()
        .code(1)
        .stderr(contains("cannot write").and(contains("denim.sateen")));
    assert!(names_in(folder.path()).is_empty());
    // A disk of 64 KiB, where one may be mounted: it is gone with its namespace.
    let script = format!(
        "mount -t tmpfs -o size=64k none '{1}' || exit 77
        '{0}' bake denim --preset draft -o '{1}/denim.sateen'; echo status $?; ls -A '{1}'",
        assert_cmd::cargo::cargo_bin("sateen").display(),
        folder.path().display()
    );
    // Root may mount, and who is not root is one in a namespace of users, where there are such.
    let mut full = [&[][..], &["--user", "--map-root-user"]]
        .into_iter()
        .map(|user| {
            Process::new("unshare")
                .args(user)
                .args(["--mount", "bash", "-c", &script])
                .output()
        });
    match full.find_map(|full| full.ok().filter(|full| full.status.success())) {
        Some(full) => {
            let stderr = String::from_utf8_lossy(&full.stderr);
            assert_eq!(String::from_utf8_lossy(&full.stdout), "status 1\n");
            assert!(
                stderr.contains("denim.sateen") && stderr.contains("No space left"),
                "{stderr}"
            );
        }
        None => skip("no disk can be mounted here"),
    }
}

#[cfg(unix)]
#[test]
fn a_read_only_folder_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let folder = folder();
    let read_only = folder.path().join("read-only");
    fs::create_dir(&read_only).unwrap();
    for (path, mode) in [(folder.path(), 0o755), (&read_only, 0o555)] {
        fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    }
    // Root may write everywhere, nobody may not.
    let is_root = fs::write(read_only.join("probe"), "").is_ok();
    let bin = assert_cmd::cargo::cargo_bin("sateen");
    let mut bake = if is_root {
        fs::remove_file(read_only.join("probe")).unwrap();
        // Nobody may not read where the tool was built either.
        let copy = folder.path().join("sateen");
        fs::copy(bin, &copy).unwrap();
        let mut bake = Command::new("setpriv");
        bake.args(["--reuid", "65534", "--regid", "65534", "--clear-groups"])
            .arg(copy);
        bake
    } else {
        Command::new(bin)
    };
    if is_root && Process::new("setpriv").arg("--version").output().is_err() {
        skip("root may write everywhere, and there is no setpriv to be another");
        return;
    }
    bake.args(["bake", "denim", "faux-suede", "--preset", "fine", "-o"])
        .arg(&read_only)
        .assert()
        .code(1)
        .stdout("")
        .stderr(contains("cannot write").and(contains("read-only/denim.sateen")));
    assert!(names_in(&read_only).is_empty());
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
    let (real_folder, link_folder) = (folder.path().join("real"), folder.path().join("link"));
    fs::create_dir(&real_folder).unwrap();
    std::os::unix::fs::symlink(&real_folder, &link_folder).unwrap();
    sateen()
        .args(["bake", "faux-suede", "-o"])
        .arg(&link_folder)
        .assert()
        .success();
    assert!(fs::symlink_metadata(&link_folder).unwrap().is_symlink());
    assert_eq!(names_in(&real_folder), ["faux-suede.sateen"]);

    let dangling = folder.path().join("dangling.sateen");
    std::os::unix::fs::symlink(folder.path().join("nowhere.sateen"), &dangling).unwrap();
    sateen()
        .args(["bake", "faux-suede", "-o"])
        .arg(&dangling)
        .assert()
        .code(1)
        .stderr(contains("dangling.sateen").and(contains("leads nowhere")));
    assert!(fs::symlink_metadata(&dangling).unwrap().is_symlink());

    let plain = folder.path().join("plain");
    fs::write(&plain, "").unwrap();
    assert_eq!(
        fs::metadata(&real).unwrap().permissions().mode(),
        fs::metadata(&plain).unwrap().permissions().mode()
    );
}

/// Time from a signal to the end that the tool promises, whatever it is at.
const END: Duration = Duration::from_secs(1);

/// The tool at work, with nobody who listens.
fn start(arguments: &[&str], output: &Path) -> Child {
    Process::new(assert_cmd::cargo::cargo_bin("sateen"))
        .args(arguments)
        .args(["-q", "-o"])
        .arg(output)
        .stderr(Stdio::null())
        .stdout(Stdio::null())
        .spawn()
        .unwrap()
}

/// Sends a signal and waits for the end, which comes in time.
#[cfg(unix)]
fn end(child: &mut Child, name: &str) -> Option<i32> {
    signal(child, name);
    let start = Instant::now();
    let status = child.wait().unwrap();
    assert!(start.elapsed() < END, "{name}: {:?}", start.elapsed());
    status.code()
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_bake_soon_and_leaves_nothing_half_written() {
    for (signal, code) in [("-INT", Some(1)), ("-TERM", Some(1)), ("-KILL", None)] {
        let folder = folder();
        let arguments = ["bake", "faux-suede", "denim", "--preset", "fine"];
        let mut bake = start(&arguments, folder.path());
        let suede = folder.path().join("faux-suede.sateen");
        wait_until("the first table", || suede.exists());
        assert!(
            bake.try_wait().unwrap().is_none(),
            "the second table takes minutes"
        );
        assert_eq!(end(&mut bake, signal), code);
        assert_eq!(names_in(folder.path()), ["faux-suede.sateen"], "{signal}");
        sateen().arg("info").arg(&suede).assert().success();
    }
}

/// Two threads of 1024 segments each: a single integral takes a millisecond.
fn many_segments(folder: &Path) -> String {
    let offsets: Vec<String> = (0..=1024)
        .map(|k| format!("{:.4}", 35.0 * (f64::from(k) * 0.37).sin()))
        .collect();
    let lengths = vec!["1"; 1024].join(", ");
    let mut text = include_str!("../../tables/fabrics/denim.toml").to_owned();
    for key in ["tangent_offsets_deg", "tangent_lengths"] {
        let list = if key == "tangent_lengths" {
            lengths.clone()
        } else {
            offsets.join(", ")
        };
        let line = |line: &str| {
            if line.starts_with(key) {
                format!("{key} = [{list}]\n")
            } else {
                format!("{line}\n")
            }
        };
        text = text.lines().map(line).collect();
    }
    let path = folder.join("many.toml");
    fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

#[cfg(unix)]
#[test]
fn whatever_a_verb_is_at_an_interrupt_ends_it_within_a_second() {
    let folder = folder();
    let many = many_segments(folder.path());
    let direct = ["bake", &many, "--preset", "draft", "--direct", "always"];
    let mut row = String::new();
    for k in 1..=300_000 {
        row += &format!("0.{k},0.3,0.8,0.1,0.{k},0.7\n");
    }
    let csv = pairs(folder.path(), &format!("{HEADER}\n{row}"));
    let csv = csv.to_str().unwrap();
    // Moments in seconds of processor time.
    for (arguments, moments) in [
        // At its start, planning, and choosing tilts.
        (
            &["bake", &many, "--preset", "fine"][..],
            &[0.3, 0.9, 3.0][..],
        ),
        // Choosing tilts, and measuring.
        (&direct, &[0.3, 1.5, 4.0]),
        (&["report", &many], &[0.3, 1.5]),
        (&["report", "denim"], &[2.5]),
        (&["eval", &many, "--pairs", csv], &[0.3, 2.0]),
        (
            &[
                "eval",
                "denim",
                "--evaluator",
                "midpoint:5000",
                "--pairs",
                csv,
            ],
            &[1.5],
        ),
    ] {
        for moment in moments {
            let output = folder.path().join("output");
            let mut child = start(arguments, &output);
            wait_for_work(&mut child, *moment);
            assert!(child.try_wait().unwrap().is_none(), "{arguments:?}");
            let code = end(&mut child, "-INT");
            assert_eq!(code, Some(1), "{arguments:?}");
            if output.is_dir() {
                assert!(names_in(&output).is_empty(), "{arguments:?}");
                fs::remove_dir(&output).unwrap();
            }
            let names = ["many.toml", "pairs.csv"];
            assert_eq!(names_in(folder.path()), names, "{arguments:?}");
        }
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_bake_of_hundreds_of_workers_within_a_second() {
    let folder = folder();
    let arguments = ["bake", "denim", "--preset", "fine"];
    for signal in ["-INT", "-TERM"] {
        for (jobs, variable) in [(&["-j", "1024"][..], None), (&[], Some("1024"))] {
            let mut command = Process::new(assert_cmd::cargo::cargo_bin("sateen"));
            command.args(arguments).args(jobs);
            command.arg("-o").arg(folder.path().join("denim.sateen"));
            if let Some(workers) = variable {
                command.env("RAYON_NUM_THREADS", workers);
            }
            let mut bake = command.spawn().unwrap();
            wait_for_work(&mut bake, 1.0);
            assert!(bake.try_wait().unwrap().is_none(), "it takes minutes");
            assert_eq!(end(&mut bake, signal), Some(1), "{signal} {jobs:?}");
            assert!(names_in(folder.path()).is_empty());
        }
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_what_nobody_reads() {
    let folder = folder();
    let table = bake_suede(folder.path());
    let csv = pairs(
        folder.path(),
        &format!("{HEADER}\n{}", "0,0,1,0,0.6,0.8\n".repeat(20_000)),
    );
    let mut eval = Process::new(assert_cmd::cargo::cargo_bin("sateen"))
        .arg("eval")
        .arg(table)
        .arg("--pairs")
        .arg(csv)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    // Pipes are full after 64 KiB.
    wait_for_rest(&mut eval);
    assert!(eval.try_wait().unwrap().is_none(), "it waits for a reader");
    assert_eq!(end(&mut eval, "-TERM"), Some(1));
}

/// Bakes four fabrics within seconds, directly and from grids.
const SOME: [&str; 7] = [
    "bake",
    "faux-suede",
    "velvet",
    "tshirt-white",
    "silk-crepe-de-chine",
    "--preset",
    "draft",
];

/// Names and bytes of files.
type Contents = Vec<(String, Vec<u8>)>;

/// All that is in a folder.
fn contents(folder: &Path) -> Contents {
    let read = |name: String| (name.clone(), fs::read(folder.join(name)).unwrap());
    names_in(folder).into_iter().map(read).collect()
}

/// What [`SOME`] bakes alone, and how many seconds of processor time it takes, by one bake for all tests.
#[cfg(unix)]
fn undisturbed() -> &'static (Contents, f64) {
    static UNDISTURBED: OnceLock<(Contents, f64)> = OnceLock::new();
    UNDISTURBED.get_or_init(|| {
        let folder = folder();
        let mut bake = start(&SOME, folder.path());
        let work = work_of(&mut bake);
        assert!(bake.wait().unwrap().success());
        let tables = contents(folder.path());
        assert_eq!(tables.len(), 4);
        (tables, work)
    })
}

#[cfg(unix)]
#[test]
fn a_killed_bake_leaves_whole_tables_and_is_resumed() {
    use std::os::unix::fs::MetadataExt;
    let folder = folder();
    let killed = folder.path().join("killed");
    let (expected, whole) = undisturbed();

    let arguments = [&SOME[..], &["--resume"]].concat();
    for share in [0.01, 0.3, 0.02, 0.5, 0.1, 0.05, 0.2, 0.4] {
        let mut bake = start(&arguments, &killed);
        wait_for_work(&mut bake, share * whole);
        let _ = bake.kill();
        bake.wait().unwrap();
        for (name, bytes) in contents(&killed) {
            let is_temporary = name.starts_with(".sateen-") && name.ends_with(".tmp");
            assert!(is_temporary || expected.contains(&(name, bytes)));
        }
    }

    // A table is missing and one is damaged, whatever the kills have done.
    assert!(start(&arguments, &killed).wait().unwrap().success());
    fs::remove_file(killed.join("velvet.sateen")).unwrap();
    let damaged = killed.join("faux-suede.sateen");
    let length = fs::metadata(&damaged).unwrap().len();
    fs::File::options()
        .write(true)
        .open(&damaged)
        .unwrap()
        .set_len(length - 1)
        .unwrap();
    let identity = |name: &str| {
        let found = fs::metadata(killed.join(name)).unwrap();
        (found.ino(), found.mtime(), found.mtime_nsec())
    };
    let whole = ["silk-crepe-de-chine.sateen", "tshirt-white.sateen"];
    let before = whole.map(identity);
    let resumed = sateen()
        .args(&arguments)
        .arg("--json")
        .arg("-o")
        .arg(&killed)
        .assert()
        .success()
        .stderr(
            contains("tshirt-white.sateen is kept")
                .and(contains("silk-crepe-de-chine.sateen is kept"))
                .and(contains("velvet").not())
                .and(contains("faux-suede.sateen was there, and is replaced")),
        );
    assert_eq!(whole.map(identity), before, "they are left alone");
    assert!(contents(&killed) == *expected, "and nothing else is there");
    let resumed: Value = serde_json::from_slice(&resumed.get_output().stdout).unwrap();
    let resumed = &resumed["tables"];
    let kept: Vec<bool> = resumed
        .as_array()
        .unwrap()
        .iter()
        .map(|result| result["kept"].as_bool().unwrap())
        .collect();
    assert_eq!(kept, [false, false, true, true]);
    assert_eq!(resumed[2]["path"], killed.join(whole[1]).to_str().unwrap());
    assert_eq!(resumed[2]["error"]["all"]["pairs"], 16_384);
}

#[test]
fn only_a_table_of_the_same_fabric_and_settings_is_kept() {
    let folder = folder();
    let file = folder.path().join("suede.toml");
    let text = include_str!("../../tables/fabrics/faux-suede.toml");
    fs::write(&file, text).unwrap();
    let table = folder.path().join("table.sateen");
    let kept = |arguments: &[&str]| {
        let bake = sateen()
            .args(["bake", "--resume", "--json", "-o"])
            .arg(&table)
            .args(arguments)
            .assert()
            .success();
        let results: Value = serde_json::from_slice(&bake.get_output().stdout).unwrap();
        results["tables"][0]["kept"].as_bool().unwrap()
    };
    let path = file.to_str().unwrap();
    assert!(!kept(&["faux-suede"]), "there is none");
    assert!(kept(&["faux-suede"]));
    assert!(kept(&[path]), "it is the library's text");
    assert!(!kept(&["faux-suede", "--preset", "draft"]));
    assert!(!kept(&[
        "faux-suede",
        "--preset",
        "draft",
        "--chart",
        "thesis"
    ]));
    assert!(!kept(&[path]));
    fs::write(&file, format!("{text}# another text\n")).unwrap();
    assert!(!kept(&[path]));
    fs::write(&table, "not a table").unwrap();
    assert!(!kept(&[path]));
    assert!(kept(&[path]));
}

#[test]
fn leftovers_of_the_dead_are_removed_and_those_of_the_living_are_not() {
    let folder = folder();
    let dead = folder.path().join(".sateen-dead.tmp");
    let living = folder.path().join(".sateen-living.tmp");
    fs::write(&dead, "half a table").unwrap();
    let file = fs::File::create(&living).unwrap();
    file.lock().unwrap();
    bake_suede(folder.path());
    assert_eq!(
        names_in(folder.path()),
        [".sateen-living.tmp", "suede.sateen"]
    );
    drop(file);
    bake_suede(folder.path());
    assert_eq!(names_in(folder.path()), ["suede.sateen"]);
}

#[cfg(unix)]
#[test]
fn two_bakes_at_once_into_one_folder_do_not_disturb_each_other() {
    let folder = folder();
    let shared = folder.path().join("shared");
    let (alone, _) = undisturbed();
    let resume = [&SOME[..], &["--resume"]].concat();
    for arguments in [&SOME[..], &resume] {
        let mut bakes = [(); 2].map(|()| start(arguments, &shared));
        for bake in &mut bakes {
            assert!(bake.wait().unwrap().success());
        }
        assert!(contents(&shared) == *alone);
        fs::remove_dir_all(&shared).unwrap();
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
        all["tables"][0].clone()
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
