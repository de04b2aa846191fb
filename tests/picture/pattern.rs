//! Patterns: what is where, one table for all albedos, and what is said of mistakes.

use std::fs;
use std::io::{self, Cursor};
use std::path::Path;

use crate::common::fabric;
use assert_cmd::Command;
use image::{DynamicImage, ImageFormat, Rgb, Rgb32FImage, RgbImage};
use predicates::str::contains;
use sateen::model::{Model, Rule, Sadeghi};
use sateen::pattern::{Image, Pattern};

fn shipped(name: &str) -> Pattern {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tables/patterns");
    let file = folder.join(format!("{name}.toml"));
    let text = fs::read_to_string(&file).unwrap();
    Pattern::from_toml(&text, name, &|path| fs::read(folder.join(path))).unwrap()
}

/// A pattern of linings with the given layout, whose images are `image`.
fn pattern(layout: &str, image: &[u8]) -> Result<Pattern, String> {
    let materials = r#"[[material]]
name = "white"
fabric = "polka-dot-lining"
variant = "white"
[[material]]
name = "blue"
fabric = "polka-dot-lining-pink"
albedo.warp = { color = [0, 0, 1] }
[[material]]
name = "denim"
fabric = "denim"
"#;
    let files = |path: &str| match path {
        "image" => Ok(image.to_vec()),
        _ => Err(io::ErrorKind::NotFound.into()),
    };
    let text = if layout.starts_with("[[") {
        format!("name = \"test\"\n\n{materials}{layout}")
    } else {
        format!("name = \"test\"\n{layout}\n{materials}")
    };
    Pattern::from_toml(&text, "test.toml", &files).map_err(|error| error.to_string())
}

fn materials_at(pattern: &Pattern, places: &[[f64; 2]]) -> Vec<String> {
    let at = |[u, v]: &[f64; 2]| pattern.at(*u, *v).material.name.clone();
    places.iter().map(at).collect()
}

fn encoded(image: DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

#[test]
fn layouts_repeat_over_the_whole_plane() {
    let dots = r#"dots = { background = "white", dots = "blue", spacing = [1, 2], radius = 0.45, staggered = true }"#;
    let dots = pattern(dots, &[]).unwrap();
    let places = [
        [0.0, 0.0],
        [0.4, 0.2],
        [0.5, 0.4],
        [0.5, 2.0],
        [0.0, 2.0],
        [-7.0, 400.0],
        [0.0, -2.0],
        [0.5, -2.4],
    ];
    let expected = [
        "blue", "blue", "white", "blue", "white", "blue", "white", "blue",
    ];
    assert_eq!(materials_at(&dots, &places), expected);

    let stripes = r#"stripes = { materials = ["white", "blue", "denim"], widths = [1, 0.5, 0.5], across_deg = 90 }"#;
    let stripes = pattern(stripes, &[]).unwrap();
    let places = [
        [9.0, 0.5],
        [-9.0, 1.2],
        [0.0, 1.9],
        [3.0, 2.5],
        [0.0, -0.1],
        [0.0, -1.5],
    ];
    let expected = ["white", "blue", "denim", "white", "denim", "white"];
    assert_eq!(materials_at(&stripes, &places), expected);

    let checks = r#"checks = { materials = ["white", "denim"], size = [1, 2] }"#;
    let checks = pattern(checks, &[]).unwrap();
    let places = [
        [0.5, 1.0],
        [1.5, 1.0],
        [1.5, 3.0],
        [0.5, -1.0],
        [-0.5, -1.0],
        [f64::NAN, f64::INFINITY],
    ];
    let expected = ["white", "denim", "white", "denim", "white", "white"];
    assert_eq!(materials_at(&checks, &places), expected);
}

#[test]
fn masks_choose_materials_and_images_dye_threads() {
    // Dark, middle and bright from left to right above, bright below.
    let mut mask = RgbImage::from_pixel(3, 2, Rgb([255; 3]));
    mask.put_pixel(0, 0, Rgb([0; 3]));
    mask.put_pixel(1, 0, Rgb([128; 3]));
    let mask = encoded(mask.into(), ImageFormat::Png);
    let layout =
        r#"mask = { image = "image", materials = ["white", "blue", "denim"], size = [3, 2] }"#;
    let masked = pattern(layout, &mask).unwrap();
    let places = [[0.5, 1.5], [1.5, 1.5], [2.5, 1.5], [0.5, 0.5], [3.5, -0.5]];
    let expected = ["white", "blue", "denim", "denim", "white"];
    assert_eq!(materials_at(&masked, &places), expected);

    let layout = r#"albedo = { image = "image", material = "denim", size = [1, 1], scale = 0.5, threads = ["weft"] }"#;
    let stored = encoded(
        RgbImage::from_pixel(2, 2, Rgb([255, 188, 0])).into(),
        ImageFormat::Png,
    );
    let linear = Rgb32FImage::from_pixel(2, 2, Rgb([2.0, 0.25, 0.0]));
    let linear = encoded(linear.into(), ImageFormat::OpenExr);
    let denim = fabric("denim");
    for (bytes, dyed) in [(stored, [0.5, 0.251_5, 0.0]), (linear, [1.0, 0.125, 0.0])] {
        let pattern = pattern(layout, &bytes).unwrap();
        let place = pattern.at(0.3, 17.8);
        assert_eq!(
            place.albedos[0],
            denim.threads[0].albedo.map(|x| x as f32),
            "the warp is not dyed"
        );
        for (albedo, dyed) in place.albedos[1].iter().zip(dyed) {
            assert!((albedo - dyed).abs() < 1e-3, "{:?}", place.albedos);
        }
    }
}

#[test]
fn one_table_serves_every_albedo() {
    let dots = shipped("polka-dot-lining");
    assert_eq!(dots.bakes().len(), 1);
    assert_eq!(shipped("corduroy").bakes().len(), 2);
    assert_eq!(pattern("", &[]).unwrap().bakes().len(), 2);

    let model = Sadeghi::<f64>::new(dots.bakes().next().unwrap(), Rule::REFERENCE);
    let (wi, wr) = ([0.48, 0.36, 0.8], [0.0, 0.6, 0.8]);
    for (u, v, name) in [
        (0.0, 0.0, "polka-dot-lining-pink"),
        (0.05, 0.0, "polka-dot-lining-white"),
    ] {
        let albedos: Vec<[f64; 3]> = dots
            .at(u, v)
            .albedos
            .iter()
            .map(|a| a.map(f64::from))
            .collect();
        let own = Sadeghi::<f64>::new(&fabric(name), Rule::REFERENCE).eval_cos(wi, wr);
        for (dyed, own) in model.eval_cos_with(&albedos, wi, wr).iter().zip(own) {
            assert!((dyed - own).abs() < 1e-6 * own, "{name}");
        }
    }
}

#[test]
fn an_exr_shows_what_is_inside_of_its_display_window() {
    use exr::prelude::{IntegerBounds, SpecificChannels, WritableImage};
    let at = |x: i32, y: i32| {
        let layer = exr::prelude::Layer::new(
            (2, 2),
            exr::prelude::LayerAttributes::named("mask"),
            exr::prelude::Encoding::UNCOMPRESSED,
            SpecificChannels::rgb(|_| (1f32, 1f32, 1f32)),
        );
        let mut image = exr::prelude::Image::from_layer(layer);
        image.layer_data.attributes.layer_position = exr::prelude::Vec2(x, y);
        image.attributes.display_window = IntegerBounds::from_dimensions((4, 4));
        let mut bytes = Cursor::new(Vec::new());
        image.write().to_buffered(&mut bytes).unwrap();
        bytes.into_inner()
    };
    let mask = |bytes: &[u8]| {
        let layout = r#"mask = { image = "image", materials = ["white", "blue"], size = [1, 1] }"#;
        pattern(layout, bytes)
    };
    assert!(mask(&at(1, 1)).is_ok() && mask(&at(-1, 3)).is_ok());
    for outside in [at(4, 0), at(0, -2), at(-2, 1)] {
        let error = mask(&outside).unwrap_err();
        assert!(
            error.contains("its data window lies outside of its display window"),
            "{error}"
        );
    }
}

#[test]
fn mistakes_are_named_with_their_line() {
    let small = encoded(RgbImage::new(1, 1).into(), ImageFormat::Png);
    for (layout, message) in [
        (
            r#"dots = { background = "white", dots = "red", spacing = [1, 1], radius = 0.5 }"#,
            "test.toml:2: no material is called \"red\"",
        ),
        (
            r#"dots = { background = "white", dots = "blue", spacing = [1, 1], radius = 0.6 }"#,
            "test.toml:2: radius = 0.6 must be above 0 and at most 0.5, half the spacing",
        ),
        (
            r#"stripes = { materials = ["white"], widths = [1, 1], across_deg = 0 }"#,
            "test.toml:2: widths: 1 materials (1 to 4096) need as many widths, there are 2",
        ),
        (
            r#"stripes = { materials = ["white"], widths = [0], across_deg = 0 }"#,
            "test.toml:2: widths = 0.0 must lie between 1e-9 and 1e9",
        ),
        (
            r#"checks = { materials = ["white", "blue"], size = [1, nan] }"#,
            "test.toml:2: size = NaN must lie between 1e-9 and 1e9",
        ),
        (
            r#"checks = { materials = ["white", "blue", "denim"], size = [1, 1] }"#,
            "expected 2 values, there are 3",
        ),
        (
            r#"checks = { materials = ["white", "blue"], size = [1, 1, 1] }"#,
            "expected 2 values, there are 3",
        ),
        (
            r#"checks = { materials = ["white"], size = [1, 1] }"#,
            "test.toml:2",
        ),
        (
            r#"mask = { image = "lost.png", materials = ["white"], size = [1, 1] }"#,
            "test.toml:2: image: cannot read lost.png",
        ),
        (
            r#"mask = { image = "image", materials = [], size = [1, 1] }"#,
            "test.toml:2: materials: a mask chooses among at least one",
        ),
        (
            r#"albedo = { image = "image", material = "denim", size = [1, 1], threads = ["pile"] }"#,
            "test.toml:2: threads: denim has no visible thread \"pile\"",
        ),
        (
            r#"albedo = { image = "image", material = "denim", size = [1, 1], scale = -1 }"#,
            "test.toml:2: scale = -1.0 must lie between 0 and 1000",
        ),
        (r#"dot = 1"#, "test.toml:2"),
        (
            "[[material]]\nname = \"denim\"\nfabric = \"denim\"",
            "test.toml:15: name: two materials are called \"denim\"",
        ),
        (
            "[[material]]\nname = \"x\"\nfabric = \"denym\"",
            "test.toml:16: fabric: the library has no \"denym\"",
        ),
        (
            "[[material]]\nname = \"x\"\nfabric = \"denim\"\nalbedo.pile = { color = [1, 1, 1] }",
            "test.toml:17: albedo: denim has no visible thread \"pile\"",
        ),
        (
            "checks = { materials = [\"white\", \"blue\"], size = [1, 1] }\ndots = { background = \"white\", dots = \"blue\", spacing = [1, 1], radius = 0.5 }",
            "a pattern has one of dots, stripes, checks, mask and albedo",
        ),
    ] {
        let error = pattern(layout, &small).expect_err(layout);
        assert!(error.contains(message), "{layout}\n{error}\n{message}");
    }
    for bytes in [&b"P6 1 1 255 abc"[..], &[], &small[..20]] {
        let layout = r#"mask = { image = "image", materials = ["white"], size = [1, 1] }"#;
        let error = pattern(layout, bytes).unwrap_err();
        assert!(
            error.contains("test.toml:2: image: cannot read image: "),
            "{error}"
        );
        assert!(Image::from_bytes(bytes).is_err());
    }
}

#[test]
fn the_tool_bakes_and_evaluates_patterns() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let dots = Path::new(env!("CARGO_MANIFEST_DIR")).join("tables/patterns/polka-dot-lining.toml");
    fs::write(
        path("pairs.csv"),
        "u,v,wi_x,wi_y,wi_z,wr_x,wr_y,wr_z\n0,0,0,0.6,0.8,0.6,0,0.8\n0.05,0,0,0.6,0.8,0.6,0,0.8\n",
    )
    .unwrap();
    let sateen = || Command::cargo_bin("sateen").expect("the tool is built");
    let eval = |more: &[&str]| {
        let pairs = path("pairs.csv");
        let mut command = sateen();
        command
            .arg("eval")
            .arg(&dots)
            .arg("--pairs")
            .arg(pairs)
            .args(more);
        command.assert()
    };
    let reds = |assert: assert_cmd::assert::Assert| -> Vec<f64> {
        let output = assert.success().get_output().stdout.clone();
        let mut rows = csv::Reader::from_reader(&output[..]);
        let red = rows
            .headers()
            .unwrap()
            .iter()
            .position(|name| name == "rho_r")
            .unwrap();
        rows.records()
            .map(|row| row.unwrap()[red].parse().unwrap())
            .collect()
    };
    let truth = reds(eval(&[]));
    for (value, name) in truth.iter().zip(["pink", "white"]) {
        let model = Sadeghi::<f64>::new(
            &fabric(&format!("polka-dot-lining-{name}")),
            Rule::REFERENCE,
        );
        let own = model.eval_cos([0.0, 0.6, 0.8], [0.6, 0.0, 0.8])[0];
        assert!((value - own).abs() < 1e-6 * own, "{name}: {value} {own}");
    }

    let tables = path("tables/");
    sateen()
        .arg("bake")
        .arg(&dots)
        .args(["--preset", "draft", "-o"])
        .arg(&tables)
        .assert()
        .success();
    assert_eq!(
        fs::read_dir(&tables).unwrap().count(),
        1,
        "one table for both albedos"
    );
    let folder_of_tables = tables.to_str().unwrap();
    for (value, truth) in reds(eval(&["--tables", folder_of_tables]))
        .iter()
        .zip(&truth)
    {
        assert!((value - truth).abs() < 0.05 * truth, "{value} {truth}");
    }

    eval(&["--evaluator", "table"])
        .code(2)
        .stderr(contains("needs --tables DIR"));
    eval(&["--components"])
        .code(2)
        .stderr(contains("--components is for one fabric"));
    eval(&["--variant", "pink"])
        .code(2)
        .stderr(contains("materials have a variant each"));
    let white = fabric("tshirt-white");
    fs::write(
        path("other.toml"),
        white.toml.replace("tshirt-white", "polka-dot-lining-white"),
    )
    .unwrap();
    let stray = path("tables/polka-dot-lining-white.sateen");
    sateen()
        .arg("bake")
        .arg(path("other.toml"))
        .args(["--preset", "draft", "-o"])
        .arg(stray)
        .assert()
        .success();
    eval(&["--tables", folder_of_tables])
        .code(1)
        .stderr(contains("bake the pattern again"));
    fs::write(
        path("pairs.csv"),
        "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z\n0,0,1,0,0,1\n",
    )
    .unwrap();
    eval(&[])
        .code(1)
        .stderr(contains("columns u, v are missing"));
}
