//! What the tool says of mistakes that are easily made: what is wrong, where, and what to do.

use std::fs;
use std::path::Path;

use assert_cmd::Command;
use predicates::prelude::*;
use predicates::str::contains;
use tempfile::TempDir;

const PAIR: &str = "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z\n0,0,1,0,0,1\n";

/// The tool in a folder of its own, which has some files.
fn sateen(files: &[(&str, &str)], arguments: &str) -> (TempDir, Command) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let mut command = Command::cargo_bin("sateen").expect("the tool is built");
    command
        .current_dir(&folder)
        .args(arguments.split_whitespace());
    (folder, command)
}

/// That a run ends with a code and says all of these.
fn says(files: &[(&str, &str)], arguments: &str, code: i32, words: &[&str]) {
    let (_folder, mut command) = sateen(files, arguments);
    let mut assert = command.assert().code(code);
    for words in words {
        assert = assert.stderr(contains(*words));
    }
}

#[test]
fn headers_of_pairs_are_quoted_with_what_they_seem_to_be() {
    for (header, words) in [
        (PAIR.replace(',', ";"), "separated by semicolons"),
        (PAIR.replace(',', "\t"), "separated by tabs"),
        (PAIR.to_uppercase(), "it has capitals"),
        (format!("# measured\n{PAIR}"), "a comment"),
        (format!("sep=,\n{PAIR}"), "a spreadsheet"),
        ("0,0,1,0,0,1\n".to_owned(), "a pair already"),
        (PAIR.replace(',', "|"), "separated by |"),
        (
            PAIR.replace("wi_", "wo_").replace("wr_", "wi_"),
            "is called wr here",
        ),
        ("x,y,z\n".to_owned(), "name the columns"),
    ] {
        let line = format!("{:?}", header.lines().next().unwrap());
        let files = [("p.csv", &*header)];
        says(&files, "eval faux-suede --pairs p.csv", 1, &[words, &line]);
    }
}

#[test]
fn lines_of_pairs_that_cannot_be_read_are_named() {
    for (line, words) in [
        (
            "0,5,0,1,0,0,1",
            "p.csv:3: it has 7 cells, and the first line 6",
        ),
        (
            "# measured",
            "p.csv:3: it has 1 cells, and the first line 6",
        ),
        ("0,0,1,0,0,1%", "p.csv:3: wr_z is \"1%\""),
    ] {
        let text = format!("{PAIR}{line}\n");
        says(
            &[("p.csv", &*text)],
            "eval faux-suede --pairs p.csv",
            1,
            &[words],
        );
    }
    let (folder, mut command) = sateen(&[], "eval faux-suede --pairs p.csv");
    fs::write(folder.path().join("p.csv"), b"\xff\xfew\0i\0").unwrap();
    let not_text = contains("not UTF-8 text; save it as CSV in UTF-8");
    command.assert().code(1).stderr(not_text);
}

#[test]
fn arguments_of_another_kind_are_told_what_they_are_for() {
    const FABRIC: &str = include_str!("../../tables/fabrics/denim.toml");
    const PATTERN: &str = include_str!("../../tables/patterns/polka-dot-lining.toml");
    let files = [
        ("a.obj", "v 0 0 0\n"),
        ("a.png", ""),
        ("a.csv", PAIR),
        ("a.sateen", ""),
        ("mine.toml", FABRIC),
        ("b.toml", PATTERN),
    ];
    let mesh = "a.obj is a mesh";
    for (arguments, words) in [
        (
            "scene denim",
            [
                "denim is a fabric of the library, not a scene",
                "sateen bake denim",
            ],
        ),
        (
            "scene mine.toml",
            [
                "mine.toml is a fabric, not a scene",
                "`sateen bake mine.toml`",
            ],
        ),
        (
            "scene b.toml",
            ["b.toml is a pattern, not a scene", "`sateen bake b.toml`"],
        ),
        ("scene a.obj", [mesh, "`sateen render mesh a.obj FABRIC"]),
        (
            "render scene a.obj -o b.png",
            [mesh, "`sateen render mesh a.obj FABRIC"],
        ),
        (
            "bake --scene a.sateen -o b/",
            ["a.sateen is a table, not a scene", "sateen info"],
        ),
        (
            "bake a.obj -o b.sateen",
            [mesh, "`sateen render mesh a.obj FABRIC"],
        ),
        (
            "eval a.csv --pairs denim",
            ["a.csv is a CSV file of pairs", "FABRIC --pairs a.csv`"],
        ),
        (
            "render sphere a.png -o b.png",
            ["a.png is a picture", "sateen compare a.png"],
        ),
        (
            "info mine.toml",
            [
                "mine.toml is a TOML file, not a table",
                "sateen bake mine.toml",
            ],
        ),
        (
            "info a.png",
            ["a.png is a picture, not a table", "sateen compare a.png"],
        ),
    ] {
        says(&files, arguments, 2, &words);
    }
}

#[test]
fn a_fit_does_not_replace_the_file_that_it_reads() {
    const FABRIC: &str = include_str!("../../tables/fabrics/denim.toml");
    let (folder, mut command) = sateen(
        &[("mine.toml", FABRIC)],
        "fit lambert mine.toml -o ./mine.toml",
    );
    let words = contains("-o mine.toml is what is read");
    command.assert().code(2).stderr(words);
    let kept = fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    assert_eq!(kept, FABRIC);
}

#[test]
fn values_in_the_place_of_sections_are_told_so() {
    for (text, words) in [
        (
            "mask = \"a.png\"\n[[material]]\n",
            "expected a section [mask]",
        ),
        ("thread = [1]\n", "expected a section [[thread]]"),
        ("lambert = 0.5\n", "expected a section [lambert]"),
    ] {
        let text = format!("name = \"a\"\ntitle = \"A\"\nsource = \"none\"\n{text}");
        let files = [("a.toml", &*text)];
        says(&files, "render sphere a.toml -o a.png", 1, &[words]);
    }
}

#[test]
fn words_in_the_wrong_order_are_understood() {
    for (arguments, words) in [
        (
            "render denim -o a.png",
            &[
                "a fabric of the library",
                "`sateen render sphere denim -o FILE`",
            ][..],
        ),
        (
            "render denim sphere",
            &["`sateen render sphere denim -o FILE`"],
        ),
        (
            "render denim.sateen",
            &["is a table", "`sateen render sphere denim.sateen -o FILE`"],
        ),
        (
            "render denim curtain",
            &["`sateen render curtain denim -o FILE`"],
        ),
        (
            "render shirt.glb denim",
            &["is a mesh", "`sateen render mesh shirt.glb denim -o FILE`"],
        ),
        (
            "render denim mesh shirt.obj",
            &["`sateen render mesh shirt.obj denim -o FILE`"],
        ),
        (
            "render sphere sphere -o a.png",
            &[
                "what cloth lies on",
                "`sateen render sphere FABRIC -o FILE`",
            ],
        ),
        (
            "render shpere denim",
            &["unrecognized subcommand", "'sphere'"],
        ),
        ("denim", &["a verb comes first", "`sateen bake denim`"]),
        ("denim.sateen", &["`sateen info denim.sateen`"]),
        (
            "fit denim lambert",
            &["the model comes first: `sateen fit lambert denim`"],
        ),
        ("fit lambret denim", &["possible values"]),
        ("compare denim.sateen a.png", &["is a table, not a picture"]),
        (
            "compare denim reference",
            &["a fabric of the library, not a picture"],
        ),
    ] {
        says(&[], arguments, 2, words);
    }
}

#[test]
fn what_is_replaced_is_said() {
    let (folder, mut command) = sateen(&[("old.sateen", "x")], "bake faux-suede -o old.sateen");
    let said = command
        .assert()
        .success()
        .stderr("sateen: old.sateen was there, and is replaced\n");
    // One line of what there is to know.
    let said = String::from_utf8(said.get_output().stdout.clone()).unwrap();
    assert_eq!(said.lines().count(), 1, "{said}");
    for words in [
        "old.sateen: no samples, ",
        " in the file, error 0.000 % on average",
        "in closed form",
    ] {
        assert!(said.contains(words), "{said}");
    }
    let verbose = |arguments: &str| {
        let mut command = Command::cargo_bin("sateen").unwrap();
        let words = arguments.split_whitespace();
        command.current_dir(&folder).args(words).assert().success()
    };
    verbose("bake faux-suede -v -o new.sateen")
        .stderr("")
        .stdout(contains("rim, both").and(contains("directional reflectance (bias)")));
}

#[test]
fn long_names_are_cut_and_files_named_once() {
    let long = "x".repeat(300);
    let (_folder, mut command) = sateen(&[], &format!("bake {long}"));
    let said = command.assert().code(1);
    let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
    assert!(said.len() < 200 && said.contains("xxx…"), "{said}");
    let scene =
        "name = \"s\"\n[[camera]]\ntarget = [0, 0, 0]\nposition = [0, 0, 3]\nfov_deg = 900\n";
    let (_folder, mut command) = sateen(&[("s.toml", scene)], "scene s.toml");
    let said = command.assert().code(1);
    let said = String::from_utf8(said.get_output().stderr.clone()).unwrap();
    assert_eq!(said.matches("s.toml").count(), 1, "{said}");
}

#[test]
fn widths_are_what_documents_say() {
    let text = include_str!("../../tables/fabrics/faux-suede.toml");
    let wide = |degrees: &str| {
        let lines = text.lines().map(|line| match line.split_once(" = ") {
            Some(("gamma_s_deg", _)) => format!("gamma_s_deg = {degrees}"),
            _ => line.to_owned(),
        });
        lines.collect::<Vec<String>>().join("\n")
    };
    says(
        &[("f.toml", &wide("1001"))],
        "bake f.toml",
        1,
        &["between 0.001 and 1000 degrees"],
    );
    says(
        &[("f.toml", &wide("1000"))],
        "bake f.toml --preset draft",
        0,
        &[],
    );
}

#[test]
fn clipped_pixels_are_counted() {
    let words = "brighter than white, and clipped; lower --exposure";
    let render = "render sphere tshirt-white --size 32 --samples 1 -o a.png";
    says(&[], &format!("{render} --exposure 8"), 0, &[words]);
    let (_folder, mut command) = sateen(&[], &format!("{render} --exposure -8"));
    command.assert().success().stderr("");
}

#[test]
fn pairs_below_the_surface_are_counted() {
    let csv = PAIR.to_owned() + "0,0,-1,0,0,1\n0,0,1,0,0.6,-0.8\n";
    let words = ["2 of 3 pairs have a direction below the surface"];
    says(
        &[("p.csv", &csv)],
        "eval faux-suede --pairs p.csv",
        0,
        &words,
    );
}

#[test]
fn columns_that_are_there_twice_are_told() {
    let csv = PAIR
        .replace("wr_z\n", "wr_z,rho_r\n")
        .replace("1\n", "1,1\n");
    let words = ["has a column rho_r already"];
    says(
        &[("p.csv", &csv)],
        "eval faux-suede --pairs p.csv",
        0,
        &words,
    );
}

#[test]
fn what_is_read_is_not_replaced() {
    for arguments in [
        "eval faux-suede --pairs p.csv -o p.csv",
        "eval faux-suede --pairs p.csv -o ./p.csv",
        "record p.csv -o p.csv",
    ] {
        let (folder, mut command) = sateen(&[("p.csv", PAIR)], arguments);
        command.assert().code(2).stderr(contains("is what is read"));
        let kept = fs::read_to_string(folder.path().join("p.csv")).unwrap();
        assert_eq!(kept, PAIR);
    }
}

#[test]
fn control_characters_do_not_reach_the_terminal() {
    let csv = PAIR.replace("\n0,", "\n\u{1b}[31m,");
    let (_folder, mut command) = sateen(&[("p.csv", &csv)], "eval faux-suede --pairs p.csv");
    let assert = command.assert().code(1).stderr(contains("u{1b}"));
    assert.stderr(contains("\u{1b}").not());
}

#[test]
fn a_share_without_a_percent_sign_is_below_a_tenth() {
    for verb in ["bake faux-suede -o a.sateen", "validate a.sateen"] {
        let words = ["0.5% or 50%"];
        says(&[], &format!("{verb} --max-error 0.5"), 2, &words);
    }
}

#[test]
fn sizes_may_be_decimal_and_have_fractions() {
    let export = "export a.sateen --format ktx2 -o a.ktx2 --max-bytes";
    for size in ["8MB", "1.5MiB", "64MiB"] {
        // The table is not there; the size is fine.
        says(
            &[],
            &format!("{export} {size}"),
            1,
            &["cannot read a.sateen"],
        );
    }
    for size in ["65MiB", "8GB"] {
        says(
            &[],
            &format!("{export} {size}"),
            2,
            &["from 16KiB to 64MiB"],
        );
    }
}

#[test]
fn what_an_argument_seems_to_be_is_told() {
    let scene = "[[camera]]\n";
    says(&[], "info denim", 2, &["not a table", "sateen bake denim"]);
    says(
        &[("s.toml", scene)],
        "bake s.toml",
        2,
        &["is a scene", "--scene s.toml"],
    );
    says(&[], "bake denim -o denim.png", 2, &["ends in .sateen"]);
}

#[test]
fn doubtful_parameters_are_told_by_bake() {
    let fabric = |albedo: &str, gamma: f64| {
        format!(
            "name = \"f\"\ntitle = \"F\"\nsource = \"none\"\n[[thread]]\nname = \"warp\"\ndirection_deg = 0\ncoverage = 1\nalbedo = {albedo}\neta = 1.4\nk_d = 0.1\n\
             gamma_s_deg = {gamma}\ngamma_v_deg = {gamma}\ntangent_offsets_deg = [0, 0]\ntangent_lengths = [1]\n"
        )
    };
    for (albedo, gamma, words) in [
        (
            "[200, 100, 0.5]",
            10.0,
            &["albedo of warp is up to 200", "times what arrives"][..],
        ),
        (
            "{ color = [1, 1, 1], scale = 0.5 }",
            0.2,
            &["degrees, not radians"],
        ),
        ("0.5", 10.0, &[]),
    ] {
        let text = fabric(albedo, gamma);
        let files = [("f.toml", &*text)];
        says(&files, "bake f.toml --preset draft -o f.sateen", 0, words);
    }
    let text = fabric("0.5", 10.0);
    let (_folder, mut command) = sateen(
        &[("f.toml", &text)],
        "bake f.toml --preset draft -o f.sateen",
    );
    command.assert().success().stderr("");
    let text = include_str!("../../tables/fabrics/tshirt-white.toml");
    let text = text.replace("direction_deg = 0", "direction_deg = 1.5708");
    let files = [("f.toml", &*text)];
    let words = ["1.5708°; direction_deg is degrees, not radians"];
    says(&files, "bake f.toml --preset draft -o f.sateen", 0, &words);
}

#[test]
fn a_pattern_and_a_scene_have_a_folder_of_tables() {
    let pattern =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("tables/patterns/polka-dot-lining.toml");
    let (folder, mut command) = sateen(&[], "bake --preset draft -o out");
    command.arg(pattern).assert().success();
    let names = fs::read_dir(folder.path().join("out")).expect("a folder");
    assert!(names.count() > 0);
}

#[test]
fn files_beside_a_picture_are_not_replaced_unless_they_are_its_own() {
    let render = "render cylinders faux-suede --size 16 -o satin.png";
    let files = [("satin.csv", PAIR)];
    let (folder, mut command) = sateen(&files, render);
    command
        .assert()
        .code(1)
        .stderr(contains("satin.csv would be replaced"));
    assert_eq!(
        fs::read_to_string(folder.path().join("satin.csv")).unwrap(),
        PAIR
    );
    fs::remove_file(folder.path().join("satin.csv")).unwrap();
    for _ in 0..2 {
        let mut command = Command::cargo_bin("sateen").unwrap();
        command.current_dir(&folder).args(render.split(' '));
        command
            .assert()
            .success()
            .stderr(contains("satin.csv and satin.svg"));
    }
}

#[cfg(unix)]
#[test]
fn output_may_be_the_standard_one_by_its_name() {
    for output in ["-", "/dev/stdout"] {
        let arguments = format!("eval faux-suede --pairs p.csv -o {output}");
        let (_folder, mut command) = sateen(&[("p.csv", PAIR)], &arguments);
        command.assert().success().stdout(contains("rho_r"));
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_stdout_is_an_error_and_one_that_leads_nowhere_is_none() {
    let tool = assert_cmd::cargo::cargo_bin("sateen");
    for (to, code) in [
        (">&-", 1),
        (">/dev/null", 0),
        ("<&- >/dev/null", 0),
        ("| true", 0),
    ] {
        let line = format!("{} fabrics {to}", tool.display());
        let output = std::process::Command::new("sh")
            .args(["-c", &line])
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{to}: {said}");
        assert_eq!(
            said.contains("stdout: it is closed"),
            code == 1,
            "{to}: {said}"
        );
    }
}

#[test]
fn workers_of_the_environment_are_bounded_like_those_of_the_flag() {
    // The flag wins.
    for arguments in [
        "bake faux-suede -j 1 -o a.sateen",
        "bake faux-suede -o a.sateen",
    ] {
        let (_folder, mut command) = sateen(&[], arguments);
        command.env("RAYON_NUM_THREADS", "1000").assert().success();
    }
    let (_folder, mut command) = sateen(&[], "fabrics");
    command.env("RAYON_NUM_THREADS", "100000");
    command
        .assert()
        .code(2)
        .stderr(contains("RAYON_NUM_THREADS=100000"));
}
