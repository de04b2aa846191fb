//! C and C++ programs find what `sateen.h` declares, and see what Rust sees.
//!
//! Without a compiler or CMake most of this is skipped, and said to be; with `SATEEN_REQUIRE_ALL=1` that is a failure.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;
use std::{env, fs};

use crate::common::skip;
use sateen::lookup::Quantity;
use sateen::math::simd::Level;
use sateen::table::Table;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const HEADER: &str = include_str!("../../src/ffi/sateen.h");
const SOURCES: [&str; 2] = [
    include_str!("../../src/ffi/mod.rs"),
    include_str!("../../src/ffi/status.rs"),
];

fn data(name: &str) -> PathBuf {
    Path::new(ROOT).join("tests/data/tables").join(name)
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("ffi")
}

fn run(command: &mut Command) -> Output {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?}: {error}"));
    assert!(
        output.status.success(),
        "{command:?}\n{}\n{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    output
}

/// Where the library has been installed, built once; `None` if a tool that is needed is missing.
fn installed(tools: &[&str]) -> Option<&'static Path> {
    for tool in tools {
        if Command::new(tool).arg("--version").output().is_err() {
            skip(&format!("{tool} is missing"));
            return None;
        }
    }
    static INSTALLED: OnceLock<PathBuf> = OnceLock::new();
    Some(INSTALLED.get_or_init(|| {
        let prefix = folder().join("installed");
        // Beside what cargo has built for this test, some of which is needed here, too.
        let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().unwrap();
        run(Command::new("bash")
            .arg(Path::new(ROOT).join("scripts/capi.sh"))
            .arg(&prefix)
            .arg("--quick")
            .env("CARGO_TARGET_DIR", target));
        prefix
    }))
}

#[test]
fn the_header_declares_what_there_is() {
    let code: String = HEADER
        .split("/*")
        .map(|part| part.split_once("*/").map_or(part, |(_, code)| code))
        .collect();
    let mut declared: Vec<(String, usize)> = code
        .split(';')
        .filter_map(|declaration| {
            let (head, arguments) = declaration.split_once('(')?;
            let name = head
                .split(|c: char| !(c.is_alphanumeric() || c == '_'))
                .next_back()?;
            let count = match arguments.trim() {
                "void)" => 0,
                arguments => 1 + arguments.matches(',').count(),
            };
            Some((name.to_owned(), count))
        })
        .collect();
    // One function a macro's argument, or with its arguments in the source.
    let [source, status] = SOURCES;
    let mut defined = Vec::new();
    for (at, _) in source.match_indices("extern \"C\" fn sateen_") {
        let rest = &source[at + "extern \"C\" fn ".len()..];
        let (name, rest) = rest.split_once('(').unwrap();
        let (arguments, _) = rest.split_once(')').unwrap();
        defined.push((name.to_owned(), arguments.matches(": ").count()));
    }
    for (macro_name, count) in [("_with", 6), ("_batch", 5), ("_batch_with", 7), ("", 4)] {
        for name in ["sateen_eval", "sateen_eval_cos"] {
            let name = format!("{name}{macro_name}");
            assert!(source.contains(&format!("    {name}")), "{name}");
            defined.push((name, count));
        }
    }
    declared.sort();
    defined.sort();
    assert_eq!(declared, defined);

    let numbers = |text: &str, prefix: &str| -> Vec<(String, String)> {
        let lines = text.lines().map(str::trim);
        let entries = lines.filter_map(|line| line.strip_prefix(prefix)?.split_once(" = "));
        let number = |text: &str| text.chars().take_while(char::is_ascii_digit).collect();
        let entries =
            entries.map(|(name, text)| (name.replace('_', "").to_lowercase(), number(text)));
        entries.collect()
    };
    let (_, variants) = status.split_once("pub enum Status {").unwrap();
    let (variants, _) = variants.split_once('}').unwrap();
    assert_eq!(numbers(HEADER, "SATEEN_"), numbers(variants, ""));
}

/// What `shade` prints of a table.
fn expected(table: &Table, is_batch: bool) -> Vec<[f32; 3]> {
    const PIXELS: usize = 37;
    let arrives = [3.0, 2.9, 2.7];
    let viewer = |pixel: usize| {
        let x = -0.95f32 + 1.9f32 * pixel as f32 / (PIXELS - 1) as f32;
        [x, 0.0, (1.0 - x * x).sqrt()]
    };
    let light = [0.36f32, 0.48, 0.8];
    let mut rho: Vec<[f32; 3]> = (0..PIXELS)
        .map(|pixel| table.eval_cos(light, viewer(pixel)))
        .collect();
    if is_batch {
        let albedos = vec![[0.3, 0.1, 0.02]; table.threads().len()];
        let wi = light.map(|w| vec![w; PIXELS]);
        let wr = [0, 1, 2].map(|k| {
            (0..PIXELS)
                .map(|pixel| viewer(pixel)[k])
                .collect::<Vec<_>>()
        });
        let mut out = [0, 1, 2].map(|_| vec![0.0; PIXELS]);
        table.eval_batch_at(
            Level::detect(),
            &albedos,
            Quantity::Rho,
            wi.each_ref().map(Vec::as_slice),
            wr.each_ref().map(Vec::as_slice),
            out.each_mut().map(Vec::as_mut_slice),
        );
        for (pixel, rho) in rho.iter_mut().enumerate() {
            *rho = [0, 1, 2].map(|k| out[k][pixel]);
        }
    }
    for rho in &mut rho {
        *rho = [0, 1, 2].map(|k| rho[k] * arrives[k]);
    }
    rho
}

/// The numbers, by their bits, of the lines that begin with a word.
fn printed(text: &str, word: &str) -> Vec<[u32; 3]> {
    let lines = text.lines().filter(|line| line.starts_with(word));
    let bits = |line: &str| {
        let words: Vec<&str> = line.split_whitespace().collect();
        [3, 5, 7].map(|k| u32::from_str_radix(words[k], 16).unwrap())
    };
    lines.map(bits).collect()
}

#[test]
fn the_examples_shade_what_rust_does_bit_for_bit() {
    let Some(prefix) = installed(&["cmake", "cc", "c++"]) else {
        return;
    };
    let build = folder().join("examples");
    run(Command::new("cmake")
        .args(["-S", &format!("{ROOT}/examples/c"), "-B"])
        .arg(&build)
        .arg(format!("-DCMAKE_PREFIX_PATH={}", prefix.display())));
    run(Command::new("cmake").arg("--build").arg(&build));
    for name in ["silk-crepe-de-chine-3.sateen", "felt-3.sateen"] {
        let table = Table::from_bytes(&fs::read(data(name)).unwrap()).unwrap();
        let bits = |is_batch| -> Vec<[u32; 3]> {
            let rho = expected(&table, is_batch).into_iter();
            rho.map(|rho| rho.map(f32::to_bits)).collect()
        };
        let output = run(Command::new(build.join("shade")).arg(data(name)));
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(printed(&text, "pixel"), bits(false), "{name}");
        assert_eq!(printed(&text, "dyed"), bits(true), "{name}");
        for thread in table.threads() {
            assert!(
                text.contains(&format!("thread {}  ", thread.name())),
                "{text}"
            );
        }

        let output = run(Command::new(build.join("shade_cpp")).arg(data(name)));
        let text = String::from_utf8(output.stdout).unwrap();
        let rows = printed(&text, "pixel");
        assert_eq!(rows.len(), 37);
        let arrives = [3.0, 2.9, 2.7];
        for (row, expected) in rows.iter().zip(bits(false)) {
            let radiance = [0, 1, 2].map(|k| (f32::from_bits(row[k]) * arrives[k]).to_bits());
            assert_eq!(radiance, expected, "{name}");
        }
    }
    let refused = Command::new(build.join("shade_cpp"))
        .arg("no/such.sateen")
        .output();
    let refused = refused.unwrap();
    assert_eq!(refused.status.code(), Some(1));
    let message = String::from_utf8(refused.stderr).unwrap();
    assert_eq!(message, "shade_cpp: no/such.sateen: cannot be opened\n");
}

#[test]
fn bad_arguments_are_refused_under_sanitizers() {
    let Some(prefix) = installed(&["cc", "c++"]) else {
        return;
    };
    let compressed = data("silk-crepe-de-chine-3.sateen");
    let stored = folder().join("stored.sateen");
    let table = Table::from_bytes(&fs::read(&compressed).unwrap()).unwrap();
    fs::write(&stored, table.to_mappable_bytes()).unwrap();
    let program = |compiler: &str, standard: &str, source: &str| {
        let name = Path::new(source).file_name().unwrap().to_string_lossy();
        let program = folder().join(format!("sanitized-{name}"));
        run(Command::new(compiler)
            .args([
                standard,
                "-g",
                "-O1",
                "-Wall",
                "-Wextra",
                "-Wpedantic",
                "-Werror",
            ])
            .args(["-fsanitize=address,undefined", "-fno-sanitize-recover=all"])
            .arg(format!("-I{}", prefix.join("include").display()))
            .arg(Path::new(ROOT).join(source))
            .arg(prefix.join("lib/libsateen.a"))
            .args(["-lm", "-lpthread", "-ldl", "-o"])
            .arg(&program));
        program
    };
    let arguments = program("cc", "-std=c99", "tests/tool/ffi/arguments.c");
    run(Command::new(arguments).args([&stored, &compressed]));
    let shade = program("cc", "-std=c99", "examples/c/shade.c");
    run(Command::new(shade).arg(&compressed));
    let shade = program("c++", "-std=c++17", "examples/c/shade.cpp");
    run(Command::new(shade).arg(&compressed));
}
