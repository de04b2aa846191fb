//! Lists that are baked in shards, and folders that are checked against them.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use tempfile::TempDir;

const SUEDE: &str = include_str!("../../tables/fabrics/faux-suede.toml");
const NAMES: [&str; 6] = ["a", "b", "c", "d", "e", "f"];

/// A folder with fabrics that bake in a moment, and a list of them.
fn fabrics() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (k, name) in NAMES.iter().enumerate() {
        fabric(folder.path(), name, 15.0 + k as f64);
    }
    fs::write(
        folder.path().join("list.txt"),
        NAMES.join(".toml\n") + ".toml",
    )
    .unwrap();
    folder
}

/// Suede with another name and width.
fn fabric(folder: &Path, name: &str, width: f64) {
    let text = SUEDE.replacen("\"faux-suede\"", &format!("\"{name}\""), 1);
    let text = text.replace("gamma_s_deg = 15", &format!("gamma_s_deg = {width}"));
    fs::write(folder.join(format!("{name}.toml")), text).unwrap();
}

fn sateen(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::cargo_bin("sateen").expect("the tool is built");
    command
        .current_dir(folder)
        .args(arguments.split_whitespace());
    command
}

/// Names and bytes of the tables in a folder.
fn tables(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let read = |name: &&str| {
        let file = format!("{name}.sateen");
        Some((file.clone(), fs::read(folder.join(file)).ok()?))
    };
    NAMES.iter().filter_map(read).collect()
}

/// What `validate --list` finds, as `fabric: verdict`.
fn findings(folder: &Path, code: i32) -> Vec<String> {
    let assert = sateen(folder, "validate out --list list.txt --json -q")
        .assert()
        .code(code);
    let found: Value = serde_json::from_slice(&assert.get_output().stdout).unwrap();
    assert_eq!(found["schema"], "sateen-validate-list/1");
    let word = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_owned();
    let findings = found["findings"].as_array().unwrap().iter();
    findings
        .map(|finding| word(finding, "fabric") + ": " + &word(finding, "verdict"))
        .collect()
}

#[test]
fn shards_make_the_tables_of_one_run_and_each_tells_what_it_made() {
    let folder = fabrics();
    let path = folder.path();
    sateen(path, "bake --list list.txt -j 2 -o one/")
        .assert()
        .success();
    assert_eq!(tables(&path.join("one")).len(), 6);
    for shard in 1..=3 {
        let arguments = format!("bake --list list.txt --shard {shard}/3 -j 1 -o out/");
        let before = tables(&path.join("out")).len();
        let said = format!("shard {shard}/3 has ");
        sateen(path, &arguments)
            .assert()
            .success()
            .stderr(contains(said));
        let made = tables(&path.join("out")).len() - before;
        let manifest =
            fs::read_to_string(path.join(format!("out/manifest-{shard}-of-3.jsonl"))).unwrap();
        let lines: Vec<Value> = manifest
            .lines()
            .map(|line| serde_json::from_str(line).unwrap())
            .collect();
        assert_eq!(lines.len(), 1 + made);
        assert_eq!(lines[0]["schema"], "sateen-manifest/1");
        assert_eq!(
            (&lines[0]["shard"], &lines[0]["fabrics"]),
            (&format!("{shard}/3").into(), &6.into())
        );
        for row in &lines[1..] {
            for key in ["name", "sha256", "preset", "tool", "parameters", "settings"] {
                assert!(row[key].is_string(), "{row}");
            }
            let file = path.join(format!("out/{}.sateen", row["name"].as_str().unwrap()));
            assert_eq!(row["bytes"], fs::metadata(file).unwrap().len());
            assert!(row["error"]["mean"].is_f64() && row["seconds"].is_f64());
        }
    }
    assert!(tables(&path.join("out")) == tables(&path.join("one")));
    assert!(findings(path, 0).is_empty());
    sateen(path, "validate out --list list.txt --measure --pairs 500")
        .assert()
        .success()
        .stdout(contains("6 whole").and(contains("measured now")));
    sateen(path, "validate out --list list.txt --max-error 0")
        .assert()
        .code(3);
}

#[test]
fn what_is_missing_stale_or_damaged_is_found_and_resumed() {
    let folder = fabrics();
    let path = folder.path();
    let bake = "bake --list list.txt --resume -o out";
    sateen(path, bake).assert().success();
    let expected = tables(&path.join("out"));
    let table = |name: &str| path.join(format!("out/{name}.sateen"));
    fs::remove_file(table("a")).unwrap();
    fabric(path, "b", 14.0);
    // Another fabric's table is whole, but not this fabric's.
    fs::copy(table("d"), table("c")).unwrap();
    let manifest = path.join("out/manifest-1-of-1.jsonl");
    let text = fs::read_to_string(&manifest).unwrap();
    // The last line is not whole.
    fs::write(&manifest, &text[..text.len() - 9]).unwrap();
    fs::write(path.join("out/z.sateen"), "").unwrap();
    let said = contains("the last line is not whole").and(contains(
        "1 table of no fabric in the list, such as z.sateen",
    ));
    sateen(path, "validate out --list list.txt")
        .assert()
        .code(3)
        .stderr(said);
    assert_eq!(
        findings(path, 3),
        ["a: missing", "b: stale", "c: damaged", "f: damaged"]
            .map(|found| found.replace("f: damaged", "f: stale"))
    );

    sateen(path, bake)
        .assert()
        .success()
        .stderr(contains("3 baked, 3 kept"));
    assert!(findings(path, 0).is_empty());
    fabric(path, "b", 16.0);
    sateen(path, bake)
        .assert()
        .success()
        .stderr(contains("1 baked, 5 kept"));
    assert!(tables(&path.join("out")) == expected);
    // Tables of a run with other settings do not count.
    sateen(path, "bake --list - --resume --preset draft -o out")
        .write_stdin("d.toml\n")
        .assert()
        .success();
    assert_eq!(findings(path, 3), ["d: stale"]);
}

#[test]
fn what_is_wrong_with_a_list_is_told_by_line_and_the_rest_is_baked() {
    let folder = fabrics();
    let path = folder.path();
    fs::write(path.join("broken.toml"), "name = 3\n").unwrap();
    fabric(path, "other", 20.0);
    let text = fs::read_to_string(path.join("other.toml")).unwrap();
    fs::write(path.join("other.toml"), text.replace("\"other\"", "\"a\"")).unwrap();
    let list = b"\xef\xbb\xbfa.toml\r\n\r\n  # a comment\r\na.toml\nother.toml\nbroken.toml\n\xff.toml\nvelvte\nno.toml\nb.toml".to_vec();
    fs::write(path.join("odd.txt"), &list).unwrap();
    let mut assert = sateen(path, "bake --list odd.txt -o out/").assert().code(1);
    for words in [
        "odd.txt:4: a is on line 1, too; it is baked once",
        "odd.txt:5: a is left out: the fabric of line 1 has the same name and other parameters",
        "odd.txt:6: broken.toml:1:",
        "odd.txt:7: the line is not UTF-8 text",
        "odd.txt:8: no fabric is called \"velvte\"; did you mean velvet?",
        "odd.txt:9: cannot read no.toml",
        "nothing is done for lines 5, 6, 7, 8, 9",
        "2 baked",
    ] {
        assert = assert.stderr(contains(words));
    }
    assert_eq!(tables(&path.join("out")).len(), 2);
    sateen(path, "validate out --list odd.txt")
        .assert()
        .code(1)
        .stdout(contains("2 whole"));
    // The same from stdin.
    sateen(path, "bake --list - --resume -o out/")
        .write_stdin(list)
        .assert()
        .code(1)
        .stderr(contains("stdin:9:").and(contains("2 kept")));

    sateen(path, "bake --list - -o out/")
        .write_stdin("# nothing\r\n\n")
        .assert()
        .code(1)
        .stderr(contains("stdin: it names no fabric"));
    sateen(path, "bake --list - -o out/")
        .write_stdin(b"\xff\xfea\0\n\0".to_vec())
        .assert()
        .code(1)
        .stderr(contains("save it as UTF-8"));
    sateen(path, "bake --list no.txt")
        .assert()
        .code(1)
        .stderr(contains("cannot read no.txt"));
    sateen(path, "validate new --list list.txt")
        .assert()
        .code(1)
        .stderr(contains("cannot read the folder new"));
    sateen(path, "validate . --list list.txt")
        .assert()
        .code(1)
        .stderr(contains("there is no manifest"));
    for (arguments, words) in [
        ("bake --list list.txt --shard 0/2", "they are 1/2 to 2/2"),
        ("bake --list list.txt --shard 3/2", "they are 1/2 to 2/2"),
        ("bake a.toml --shard 1/2", "name the list with --list FILE"),
        ("bake --list list.txt -o a.sateen", "need a folder"),
        ("bake --list list.txt a.toml", "cannot be used with"),
        ("validate out new --list list.txt", "checks one folder"),
        ("validate out", "out is a folder"),
    ] {
        sateen(path, arguments)
            .assert()
            .code(2)
            .stderr(contains(words));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_ends_a_shard_and_the_others_go_on() {
    let folder = fabrics();
    let path = folder.path();
    let bin = assert_cmd::cargo::cargo_bin("sateen");
    // A file size limit stops a write half way, as a full disk does.
    let script = format!(
        "trap '' XFSZ; ulimit -f 1; exec '{}' bake --list list.txt --shard 1/2 --resume -o out",
        bin.display()
    );
    let said = contains("cannot write out/").and(contains("with --resume"));
    Command::new("bash")
        .current_dir(path)
        .args(["-c", &script])
        .assert()
        .code(1)
        .stderr(said);
    assert!(tables(&path.join("out")).is_empty());
    sateen(path, "bake --list list.txt --shard 2/2 --resume -o out")
        .assert()
        .success();
    assert!(!findings(path, 3).is_empty());
    sateen(path, "bake --list list.txt --shard 1/2 --resume -o out")
        .assert()
        .success();
    assert!(findings(path, 0).is_empty());
}
