//! Pictures: what the thesis sees on cylinders, and what files hold.

use std::f64::consts::PI;
use std::fs;
use std::io::Cursor;
use std::path::Path;
use std::process::{Command as Process, Stdio};
use std::time::{Duration, Instant};

#[cfg(unix)]
use crate::common::process::{signal, wait_for_work};
use assert_cmd::Command;
use exr::prelude::{AnyChannels, FlatSamples, Layer as ExrLayer, read_all_flat_layers_from_file};
use image::{ImageFormat, ImageReader};
use predicates::prelude::*;
use predicates::str::contains;
use sateen::bake::{Preset, Settings, bake};
use sateen::fabric::{Fabric, Lambert};
use sateen::model::{ModelKind, Rule, Sadeghi, irawan_of};
use sateen::pattern::{Pattern, Transfer};
use sateen::progress::Progress;
use sateen::render::{
    Cloth, Curve, CurvePoint, Cylinder, Display, Layer, Light, Picture, Shape, View, compare,
    curves, render, to_exr,
};
use serde_json::Value;
use tempfile::TempDir;

/// Quadrature errs less than a thousandth.
const RULE: Rule = Rule::Quadrature(8);
/// Least prominence of what counts as a highlight: of the curve's maximum.
const PROMINENCE: f64 = 0.02;

/// The thesis' setup: the light is at the camera.
const VIEW: View<'static> = View {
    size: 96,
    samples: 4,
    lights: &[Light::of([0.0, 0.0, 1.0])],
    repeats: 4.0,
};

fn library(name: &str) -> Fabric {
    Fabric::from_library(name).unwrap()
}

fn direct(fabric: &Fabric) -> Cloth {
    Cloth::direct(Sadeghi::new(fabric, RULE))
}

/// Curves of the vertical, the horizontal and the diagonal cylinder.
fn curves_of(cloth: &Cloth) -> [Curve; 3] {
    let curves = curves(cloth, &VIEW, Progress::silent()).unwrap();
    assert!(curves.iter().map(|curve| curve.cylinder).eq(Cylinder::ALL));
    let curves: Vec<Curve> = curves.into_iter().map(|curve| curve.curve).collect();
    curves.try_into().unwrap()
}

fn light([r, g, b]: [f64; 3]) -> f64 {
    (r + g + b) / 3.0
}

/// Angles of the highlights in degrees.
fn highlights(curve: &Curve) -> Vec<f64> {
    let degrees = |index: usize| curve.0[index].angle.to_degrees();
    let peaks = curve.peaks(PROMINENCE, light);
    peaks.into_iter().map(degrees).collect()
}

/// Light at an angle in degrees.
fn at(curve: &Curve, degrees: f64) -> f64 {
    let nearest = curve.0.iter().min_by(|a, b| {
        let far = |angle: f64| (angle.to_degrees() - degrees).abs();
        far(a.angle).total_cmp(&far(b.angle))
    });
    light(nearest.unwrap().radiance)
}

#[test]
fn peaks_stand_out() {
    let curve = |values: &[f64]| {
        let point = |(angle, value): (usize, &f64)| CurvePoint {
            angle: angle as f64,
            radiance: [*value; 3],
        };
        Curve(values.iter().enumerate().map(point).collect())
    };
    let peaks = |values: &[f64], share: f64| curve(values).peaks(share, light);
    assert_eq!(peaks(&[0.0, 4.0, 1.0, 3.0, 2.0], 0.1), [1, 3]);
    // The lower one stands out by 2.
    assert_eq!(peaks(&[0.0, 4.0, 1.0, 3.0, 2.0], 0.51), [1]);
    // Beyond the ends it is dark, and of a plateau the middle counts.
    assert_eq!(peaks(&[2.0, 1.0, 1.0, 1.0, 3.0], 0.1), [0, 4]);
    assert_eq!(peaks(&[0.0, 1.0, 1.0, 1.0, 0.0], 0.1), [2]);
    assert_eq!(peaks(&[0.0, 0.0], 0.1), [0; 0]);
    assert_eq!(peaks(&[], 0.1), [0; 0]);
}

#[test]
fn patterns_know_how_far_they_repeat() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tables/patterns");
    for (name, period) in [("polka-dot-lining", 0.2), ("corduroy", 0.03)] {
        let text = fs::read_to_string(folder.join(format!("{name}.toml"))).unwrap();
        let files = |path: &str| fs::read(folder.join(path));
        let pattern = Pattern::from_toml(&text, name, &files).unwrap();
        let found = pattern.period().unwrap();
        assert!((found - period).abs() < 1e-12, "{name}: {found}");
        for (u, v) in [(0.01, 0.02), (0.07, 0.16), (0.3, -0.4)] {
            let name = |u: f64, v: f64| pattern.at(u, v).material.name.clone();
            assert_eq!(name(u, v), name(u + found, v));
            assert_eq!(name(u, v), name(u, v + found));
        }
    }
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_a_picture_soon_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mut child = Process::new(env!("CARGO_BIN_EXE_sateen"))
        .args(["render", "sphere", "denim", "--evaluator", "reference"])
        .args(["--size", "4096", "-q", "-o"])
        .arg(folder.path().join("a.png"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    wait_for_work(&mut child, 1.0);
    assert!(child.try_wait().unwrap().is_none());
    signal(&child, "-INT");
    let start = Instant::now();
    assert_eq!(child.wait().unwrap().code(), Some(1));
    assert!(start.elapsed() < Duration::from_secs(5));
    assert_eq!(names_in(&folder), [""; 0]);
}

#[test]
fn lambert_is_a_cosine() {
    let lambert = || {
        Cloth::other(Box::new(Lambert {
            albedo: [1.0, 0.5, 0.25],
        }))
    };
    let light = Light::direction_at(0.5, 0.3);
    let lights = [Light::of(light)];
    let view = View {
        lights: &lights,
        ..VIEW
    };
    for curve in curves(&lambert(), &view, Progress::silent()).unwrap() {
        for point in &curve.curve.0 {
            let normal = [point.angle.sin(), 0.0, point.angle.cos()];
            let cos: f64 = normal.iter().zip(light).map(|(n, l)| n * l).sum();
            let expected = [1.0, 0.5, 0.25].map(|albedo| albedo * cos.max(0.0));
            for (found, expected) in point.radiance.iter().zip(expected) {
                assert!((found - expected).abs() < 1e-6, "{point:?}");
            }
        }
    }
    // Facing the light at the middle, where a pixel is flat.
    let view = View {
        size: 201,
        lights: &[Light::of([0.0, 0.0, 1.0])],
        ..VIEW
    };
    let sphere = render(&Shape::Sphere, &lambert(), &view, Progress::silent()).unwrap();
    let [r, g, b, coverage] = sphere.pixels[201 * 100 + 100];
    assert_eq!(coverage, 1.0);
    assert!((r - 1.0).abs() < 1e-4 && (g - 0.5).abs() < 1e-4 && (b - 0.25).abs() < 1e-4);
    // All of the disc: the mean of the cosine over it is 2/3, and its area π 0.96²/4 of the picture.
    let sum = |k: usize| sphere.pixels.iter().map(|p| f64::from(p[k])).sum::<f64>();
    let pixels = 201.0 * 201.0;
    assert!((sum(3) / pixels - 0.25 * PI * 0.96 * 0.96).abs() < 2e-3);
    assert!((sum(0) / sum(3) - 2.0 / 3.0).abs() < 2e-3);
    // Two neighbouring pixels of the edge are partly covered.
    assert!(sphere.pixels.iter().any(|p| 0.0 < p[3] && p[3] < 1.0));
    assert_eq!(sphere.pixels[0], [0.0; 4]);
}

#[test]
fn slices_of_the_sphere_are_the_cylinders() {
    let cloth = direct(&library("denim"));
    let [vertical, horizontal, diagonal] = curves_of(&cloth);
    // An odd size has pixels whose middle is on the axes, and one sample is there.
    let view = View {
        size: 301,
        samples: 1,
        ..VIEW
    };
    let sphere = render(&Shape::Sphere, &cloth, &view, Progress::silent()).unwrap();
    let pixel = |x: f64, y: f64| {
        let column = (150.5 + 150.5 * 0.96 * x).floor() as usize;
        let row = (150.5 - 150.5 * 0.96 * y).floor() as usize;
        let across = (column as f64 + 0.5 - 150.5) / (150.5 * 0.96);
        let up = (150.5 - row as f64 - 0.5) / (150.5 * 0.96);
        let value = sphere.pixels[301 * row + column];
        let angle = across.hypot(up).asin().to_degrees();
        (light([0, 1, 2].map(|k| f64::from(value[k]))), angle)
    };
    for x in [0.2, 0.5, 0.7, 0.9] {
        let is_near = |(value, angle): (f64, f64), curve: &Curve, sign: f64| {
            let expected = at(curve, sign * angle);
            assert!(
                (value - expected).abs() < 0.02 * expected,
                "{x}: {value} {expected}"
            );
        };
        is_near(pixel(x, 0.0), &horizontal, 1.0);
        is_near(pixel(-x, 0.0), &horizontal, -1.0);
        is_near(pixel(0.0, x), &vertical, -1.0);
        is_near(pixel(0.0, -x), &vertical, 1.0);
        // The warp rises at 45° to the slice that falls to the right.
        let half = x * 0.5_f64.sqrt();
        is_near(pixel(half, -half), &diagonal, 1.0);
    }
}

#[test]
fn a_tint_changes_no_shape() {
    for name in ["linen-plain", "denim", "velvet", "polyester-lining"] {
        let mut fabric = library(name);
        for thread in &mut fabric.threads {
            thread.albedo = [0.6, 0.3, 0.0];
        }
        for curve in curves_of(&direct(&fabric)) {
            for point in &curve.0 {
                // Blue is what the surface of fibres reflects, and none is dyed. The rest has the shape of the volume, twice as
                // high in red as in green.
                let [r, g, b] = point.radiance;
                assert!(b > 0.0 && g > b, "{name}: {point:?}");
                assert!(
                    (r - b - 2.0 * (g - b)).abs() <= 1e-5 * r,
                    "{name}: {point:?}"
                );
            }
        }
    }
}

#[test]
fn the_same_bytes_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    for (shape, name) in [("cylinders", "png"), ("sphere", "png"), ("sphere", "exr")] {
        let written = ["1", "2"].map(|jobs| {
            let path = folder.path().join(format!("{shape}{jobs}.{name}"));
            picture(&[shape, "velvet", "-j", jobs], &path).success();
            let curves = fs::read(path.with_extension("csv")).ok();
            (fs::read(&path).unwrap(), curves)
        });
        assert_eq!(written[0], written[1], "{shape} {name}");
        assert_eq!(written[0].1.is_some(), shape == "cylinders");
    }
}

/// `sateen render` of few pixels into a file.
fn picture(args: &[&str], path: &Path) -> assert_cmd::assert::Assert {
    Command::cargo_bin("sateen")
        .unwrap()
        .arg("render")
        .args(args)
        .args(["--size", "96", "--samples", "4", "-o"])
        .arg(path)
        .assert()
}

fn names_in(folder: &TempDir) -> Vec<String> {
    let name =
        |entry: std::io::Result<fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> = fs::read_dir(folder.path()).unwrap().map(name).collect();
    names.sort();
    names
}

#[test]
fn a_png_is_srgb_and_says_what_made_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("new/denim.png");
    picture(&["cylinders", "denim", "--exposure", "1"], &path).success();
    let bytes = fs::read(&path).unwrap();
    let reader = png::Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
    let info = reader.info();
    assert!(info.srgb.is_some());
    let note = |keyword: &str| {
        let mut texts = info.utf8_text.iter();
        let chunk = texts.find(|chunk| chunk.keyword == keyword).unwrap();
        chunk.get_text().unwrap()
    };
    assert_eq!(note("fabric"), "denim");
    assert_eq!(note("evaluator"), "quadrature:8");
    assert_eq!(note("light"), "0,0,1");

    let picture = render(
        &Shape::Cylinders,
        &direct(&library("denim")),
        &VIEW,
        Progress::silent(),
    )
    .unwrap();
    let image = ImageReader::with_format(Cursor::new(&bytes), ImageFormat::Png)
        .decode()
        .unwrap()
        .into_rgba8();
    assert_eq!(image.dimensions(), (192, 96));
    for (pixel, [r, g, b, coverage]) in image.pixels().zip(&picture.pixels) {
        assert_eq!(pixel[3], (255.0 * coverage).round() as u8);
        for (shown, radiance) in pixel.0.iter().zip([r, g, b]) {
            let expected = 255.0 * srgb(f64::from(2.0 * radiance / coverage.max(1e-9)));
            assert!((f64::from(*shown) - expected.min(255.0)).abs() < 0.6);
        }
    }

    let csv = fs::read_to_string(path.with_extension("csv")).unwrap();
    let mut lines = csv.lines();
    assert_eq!(lines.next(), Some("cylinder,x,angle_deg,r,g,b"));
    assert!(lines.next().unwrap().starts_with("vertical,-0.99"));
    assert_eq!(csv.lines().count(), 1 + 3 * 719);
    let svg = fs::read_to_string(path.with_extension("svg")).unwrap();
    let svg = roxmltree::Document::parse(&svg).unwrap();
    let lines = svg
        .descendants()
        .filter(|node| node.has_tag_name("polyline"));
    assert!(lines.count() >= 9);
}

/// The layers of an EXR file.
fn layers_of(path: &Path) -> Vec<ExrLayer<AnyChannels<FlatSamples>>> {
    let image = read_all_flat_layers_from_file(path).unwrap();
    image.layer_data.into_vec()
}

#[test]
fn an_exr_has_linear_layers_and_says_what_made_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let args = [
        "sphere",
        "velvet",
        "--float",
        "--exposure",
        "3",
        "--light-deg",
        "30",
    ];
    picture(&args, &path).success();
    let view = View {
        lights: &[Light::of(Light::direction_at(30_f64.to_radians(), 0.0))],
        ..VIEW
    };
    let cloth = direct(&library("velvet"));
    let expected = render(&Shape::Sphere, &cloth, &view, Progress::silent()).unwrap();
    let layers = layers_of(&path);
    let [layer] = layers.as_slice() else {
        panic!("one layer")
    };
    let name = layer.attributes.layer_name.as_ref().unwrap().to_string();
    assert_eq!(name, "quadrature:8");
    let comments = layer.attributes.comments.as_ref().unwrap().to_string();
    assert!(
        comments.contains("fabric: velvet\n") && comments.contains("light: 0.49999999999999994,0,")
    );
    let channels = &layer.channel_data.list;
    let names: Vec<String> = channels
        .iter()
        .map(|channel| channel.name.to_string())
        .collect();
    assert_eq!(names, ["A", "B", "G", "R"]);
    let red: Vec<f32> = channels[3].sample_data.values_as_f32().collect();
    let found: Vec<f32> = expected.pixels.iter().map(|pixel| pixel[0]).collect();
    assert_eq!(red, found);

    // As halves it is what another reader sees, too.
    picture(&["sphere", "velvet"], &path).success();
    let halves = fs::read(&path).unwrap();
    let image = ImageReader::with_format(Cursor::new(&halves), ImageFormat::OpenExr)
        .decode()
        .unwrap();
    assert_eq!((image.width(), image.height()), (96, 96));
    assert_eq!(names_in(&folder), ["a.exr"]);
}

fn noise(seed: u32) -> Picture {
    let value = |k: u32| (k.wrapping_mul(2_654_435_761).wrapping_add(seed) >> 16) as f32 / 65536.0;
    Picture {
        width: 48,
        height: 32,
        pixels: (0..48 * 32)
            .map(|k| [value(3 * k), value(3 * k + 1), value(3 * k + 2), 1.0])
            .collect(),
    }
}

#[test]
fn a_picture_is_no_different_from_itself() {
    let (a, b) = (noise(1), noise(1 << 30));
    let same = compare(&a, &a, 0.0);
    assert_eq!(
        [
            same.flip_mean,
            same.flip_max,
            same.rmse,
            same.mean_relative_error
        ],
        [0.0; 4]
    );
    let other = compare(&a, &b, 0.0);
    assert!(0.1 < other.flip_mean && other.flip_mean < other.flip_max && other.flip_max <= 1.0);
    assert!(other.rmse > 0.1 && other.mean_relative_error > 0.1);
    assert_eq!(other.factor, 1.0);
    let black = Picture {
        pixels: vec![[0.0, 0.0, 0.0, 1.0]; 48 * 32],
        ..a.clone()
    };
    let white = Picture {
        pixels: vec![[1.0; 4]; 48 * 32],
        ..a
    };
    // The most that FLIP knows.
    assert!(compare(&black, &white, 0.0).flip_mean > 0.9);
    assert_eq!(compare(&black, &black, 0.0).flip_mean, 0.0);
}

#[test]
fn a_comparison_shows_and_tells() {
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("lining.sateen");
    let fabric = library("polka-dot-lining-white");
    let settings = Settings {
        error_pairs: 1,
        ..Preset::Draft.settings()
    };
    let baked = bake(&fabric, &settings, Progress::silent()).unwrap().table;
    fs::write(&table, baked.to_bytes().unwrap()).unwrap();
    let table = table.to_str().unwrap();

    // A table of white lining, dyed pink.
    let path = folder.path().join("a.exr");
    let args = [
        "sphere",
        "polka-dot-lining-pink",
        "--json",
        "--compare",
        table,
        "quadrature:8",
    ];
    let assert = picture(&args, &path).success();
    let json: Value = serde_json::from_slice(&assert.get_output().stdout).unwrap();
    assert_eq!(json["a"], "table:lining");
    let mean = json["flip"]["mean"].as_f64().unwrap();
    assert!(0.0 < mean && mean < 0.02, "{json}");
    assert!(
        json["mean_relative_error"].as_f64().unwrap() < 0.05,
        "{json}"
    );
    let layers = layers_of(&path);
    let names: Vec<String> = layers
        .iter()
        .map(|layer| layer.attributes.layer_name.as_ref().unwrap().to_string())
        .collect();
    assert_eq!(
        names,
        ["table:lining", "quadrature:8", "difference", "flip"]
    );
    assert_eq!(layers[3].channel_data.list[0].name.to_string(), "Y");

    let path = folder.path().join("a.png");
    picture(
        &[
            "cylinders",
            "denim",
            "--compare",
            "midpoint:4",
            "midpoint:4",
        ],
        &path,
    )
    .success()
    .stdout(contains(
        "FLIP                 mean 0.00000, at most 0.0000",
    ));
    let image = image::open(&path).unwrap();
    assert_eq!((image.width(), image.height()), (4 * 192, 96 + 16));
    picture(&["sphere", "denim", "--compare", table, "reference"], &path)
        .code(1)
        .stderr(contains(
            "is a table of polka-dot-lining-white, which is not the denim",
        ));
}

/// IEC 61966-2-1, as another program would write it.
fn srgb(linear: f64) -> f64 {
    let (slope, gamma, offset): (f64, f64, f64) = (12.92, 2.4, 0.055);
    if linear * slope < 0.04045 {
        linear * slope
    } else {
        (1.0 + offset) * linear.powf(gamma.recip()) - offset
    }
}

/// What an engine saves that draws the same: 8 bits by its own curve, over black.
fn screenshot(picture: &Picture, curve: impl Fn(f64) -> f64, gamma: Option<f32>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let sides = [picture.width, picture.height].map(|side| side as u32);
    let mut encoder = png::Encoder::new(&mut bytes, sides[0], sides[1]);
    encoder.set_color(png::ColorType::Rgb);
    if let Some(gamma) = gamma {
        encoder.set_source_gamma(png::ScaledFloat::new(gamma));
    }
    let pixels = picture.pixels.iter().flat_map(|[r, g, b, _]| {
        [r, g, b].map(|value| (255.0 * curve(f64::from(*value))).round().min(255.0) as u8)
    });
    let mut writer = encoder.write_header().unwrap();
    writer
        .write_image_data(&pixels.collect::<Vec<u8>>())
        .unwrap();
    writer.finish().unwrap();
    bytes
}

#[test]
fn a_perfect_screenshot_is_the_same_picture_in_either_curve() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let cloth = direct(&library("denim"));
    let rendered = render(&Shape::Sphere, &cloth, &VIEW, Progress::silent()).unwrap();
    let power = |linear: f64| linear.powf(1.0 / 2.2);
    fs::write(at("srgb.png"), screenshot(&rendered, srgb, None)).unwrap();
    fs::write(
        at("power.png"),
        screenshot(&rendered, power, Some(1.0 / 2.2)),
    )
    .unwrap();
    fs::write(at("wrong.png"), screenshot(&rendered, power, None)).unwrap();
    fs::write(at("linear.png"), screenshot(&rendered, |x| x, Some(1.0))).unwrap();
    for (name, curve) in [("render.png", "srgb"), ("thesis.png", "2.2")] {
        let of = [
            "sphere",
            "denim",
            "--evaluator",
            "quadrature:8",
            "--transfer",
            curve,
        ];
        picture(&of, &at(name)).success();
    }
    let bytes = fs::read(at("thesis.png")).unwrap();
    let reader = png::Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
    let info = reader.info();
    assert!(info.srgb.is_none());
    assert_eq!(info.gama_chunk.unwrap().into_scaled(), 45_455);

    let found = |picture: &str, truth: &str| -> [f64; 2] {
        let mut command = Command::cargo_bin("sateen").unwrap();
        let [picture, truth] = [at(picture), at(truth)];
        let files = [
            "compare".as_ref(),
            picture.as_path(),
            &truth,
            "--json".as_ref(),
        ];
        let said = command.args(files).assert().success();
        let json: serde_json::Value = serde_json::from_slice(&said.get_output().stdout).unwrap();
        [&json["flip"]["mean"], &json["rmse"]].map(|x| x.as_f64().unwrap())
    };
    // Pixels at the edge are covered in part: their 8 bits are of other numbers, the picture's not multiplied by alpha.
    let [flip, rmse] = found("srgb.png", "render.png");
    assert!(flip < 1e-3 && rmse < 1e-3, "{flip} {rmse}");
    let [flip, rmse] = found("power.png", "thesis.png");
    assert!(flip < 1e-3 && rmse < 1e-3, "{flip} {rmse}");
    // Curves that differ round differently, above all in the dark, of which FLIP sees more.
    for (a, b) in [("power.png", "render.png"), ("linear.png", "render.png")] {
        let [_, rmse] = found(a, b);
        assert!(rmse < 2e-3, "{a} {b}: {rmse}");
    }
    let [_, rmse] = found("wrong.png", "render.png");
    assert!(rmse > 2e-3, "{rmse}");
}

#[test]
fn curves_are_undone_exactly() {
    for transfer in [Transfer::Srgb, Transfer::Power(2.2), Transfer::LINEAR] {
        for step in 0..=1000 {
            let x = f64::from(step) / 1000.0;
            assert!(
                (transfer.linear(transfer.shown(x)) - x).abs() < 1e-6,
                "{transfer:?} {x}"
            );
            assert!((Transfer::Srgb.shown(x) - srgb(x)).abs() < 1e-6);
        }
    }
}

#[test]
fn files_are_compared_as_the_pictures_that_they_hold() {
    let folder = tempfile::tempdir().unwrap();
    let [png, exr, other] = ["a.png", "a.exr", "b.png"].map(|name| folder.path().join(name));
    let cloth = direct(&library("denim"));
    let rendered = render(&Shape::Sphere, &cloth, &VIEW, Progress::silent()).unwrap();
    let shown = Display::of(&rendered, 0.0, Transfer::Srgb);
    fs::write(&png, shown.to_png(&[]).unwrap()).unwrap();
    // What was shown is read back, to the bit.
    let read = Picture::from_bytes(&fs::read(&png).unwrap()).unwrap();
    assert_eq!(Display::of(&read, 0.0, Transfer::Srgb), shown);

    picture(&["sphere", "denim", "--evaluator", "quadrature:8"], &exr).success();
    picture(&["sphere", "denim", "--light-deg", "20"], &other).success();
    let compared = |args: &[&Path]| {
        let mut command = Command::cargo_bin("sateen").unwrap();
        command.arg("compare").args(args).assert()
    };
    let flip = |a: &Path, b: &Path| -> f64 {
        let assert = compared(&[a, b, Path::new("--json")]).success();
        let json: Value = serde_json::from_slice(&assert.get_output().stdout).unwrap();
        json["flip"]["mean"].as_f64().unwrap()
    };
    assert_eq!(flip(&png, &png), 0.0);
    // The PNG lacks what eight bits cannot hold.
    assert!(flip(&png, &exr) < 3e-3, "{}", flip(&png, &exr));
    assert!(flip(&other, &exr) > 0.05);

    let limit = [&other, &png, Path::new("--max-flip"), Path::new("0.01")];
    compared(&limit).code(3).stdout(contains("FLIP"));
    let small = folder.path().join("small.png");
    Command::cargo_bin("sateen")
        .unwrap()
        .args(["render", "sphere", "denim", "--size", "8", "-o"])
        .arg(&small)
        .assert()
        .success();
    compared(&[&small, &png])
        .code(1)
        .stderr(contains("8 × 8 pixels").and(contains("of the same size")));
    let none = folder.path().join("none.png");
    fs::write(&none, "no picture").unwrap();
    compared(&[&none, &png])
        .code(1)
        .stderr(contains("none.png").and(contains("neither PNG nor EXR")));
}

#[test]
fn patterns_show_their_repeats() {
    let pattern = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tables/patterns/polka-dot-lining.toml"
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    // White and pink have different ratios of green to red; along the middle row of the vertical cylinder they take turns.
    let changes = |repeats: &str| {
        picture(&["cylinders", pattern, "--repeats", repeats], &path).success();
        let image = image::open(&path).unwrap().into_rgba8();
        let is_pink = |row: u32| {
            let pixel = image.get_pixel(96, row);
            u32::from(pixel[1]) * 2 < u32::from(pixel[0])
        };
        let rows: Vec<bool> = (0..96).map(is_pink).collect();
        rows.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    let (two, four) = (changes("2"), changes("4"));
    assert!(two > 2 && four > two + 2, "{two} {four}");
}

#[test]
fn mistakes_say_what_to_do_and_leave_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let png = folder.path().join("a.png");
    let pattern = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tables/patterns/polka-dot-lining.toml"
    );
    let cases: [(&[&str], i32, &str); 14] = [
        (&["cube", "denim"], 2, "unrecognized subcommand"),
        (&["sphere", "denin"], 1, "did you mean denim?"),
        (&["sphere", "denim", "--float"], 2, "--float is for EXR"),
        (&["sphere", "denim", "--json"], 2, "--compare"),
        (
            &["sphere", "denim", "--evaluator", "table"],
            2,
            "bake it first",
        ),
        (
            &["sphere", "denim", "--model", "lambert"],
            1,
            "`sateen fit lambert denim -o FILE`",
        ),
        (
            &[
                "sphere",
                "denim",
                "--model",
                "irawan",
                "--evaluator",
                "midpoint:4",
            ],
            2,
            "--evaluator is for --model sadeghi",
        ),
        (&["sphere", "denim", "--light", "0,0,0"], 2, "three numbers"),
        (&["sphere", "denim", "--light-deg", "x"], 2, "degrees"),
        (
            &["sphere", "denim", "--light", "0,0,1", "--light-deg", "3"],
            2,
            "cannot be used with",
        ),
        (&["sphere", "denim", "--repeats", "0"], 2, "repeats"),
        (
            &["sphere", "denim", "--compare", "midpoint:4", "best"],
            2,
            "quadrature:N",
        ),
        (
            &["sphere", pattern, "--evaluator", "table"],
            2,
            "--tables DIR",
        ),
        (
            &["sphere", pattern, "--compare", "irawan", "reference"],
            2,
            "is a pattern",
        ),
    ];
    for (args, code, message) in cases {
        picture(args, &png).code(code).stderr(contains(message));
    }
    let jpeg = folder.path().join("a.jpg");
    picture(&["sphere", "denim"], &jpeg)
        .code(2)
        .stderr(contains("ends in .png or .exr"));
    picture(&["sphere", "denim"], folder.path())
        .code(2)
        .stderr(contains("ends in .png or .exr"));
    assert_eq!(names_in(&folder), [""; 0]);
}

#[test]
fn an_empty_picture_is_an_error() {
    let none = Picture {
        width: 0,
        height: 0,
        pixels: Vec::new(),
    };
    assert!(Display::of(&none, 0.0, Transfer::Srgb).to_png(&[]).is_err());
    assert!(to_exr(&[Layer::of("none", &none)], 0, false).is_err());
}

#[test]
fn light_comes_from_where_it_is_said_to() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let brightest = |args: &[&str]| {
        picture(
            &[&["sphere", "tshirt-white", "--float"], args].concat(),
            &path,
        )
        .success();
        let image = image::open(&path).unwrap().into_rgba32f();
        let sum = |weight: fn(f64, f64) -> f64| {
            let pixels = image.enumerate_pixels();
            pixels
                .map(|(x, y, p)| f64::from(p[0]) * weight(f64::from(x) - 47.5, 47.5 - f64::from(y)))
                .sum::<f64>()
        };
        let all = sum(|_, _| 1.0);
        [sum(|x, _| x) / all, sum(|_, y| y) / all]
    };
    let [x, y] = brightest(&[]);
    assert!(x.abs() < 1.0 && y.abs() < 1.0);
    let [x, y] = brightest(&["--light-deg", "40"]);
    assert!(x > 3.0 && y.abs() < 1.0, "{x} {y}");
    let [x, y] = brightest(&["--light-elevation-deg", "-40"]);
    assert!(x.abs() < 1.0 && y < -3.0, "{x} {y}");
    let [x, y] = brightest(&["--light", "-1,1,1"]);
    assert!(x < -3.0 && y > 3.0, "{x} {y}");
}

#[test]
fn satin_has_three_highlights_in_front_and_four_behind() {
    let horizontal = |name: &str| {
        let [_, horizontal, _] = curves_of(&direct(&library(name)));
        highlights(&horizontal)
    };
    let near = |found: Vec<f64>, expected: &[f64]| {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1.0, "{found} {expected}");
        }
    };
    // At the tilts of the warp's single tilts and flat parts.
    near(
        horizontal("polyester-satin-charmeuse-front"),
        &[-32.0, 0.0, 32.0],
    );
    near(
        horizontal("polyester-satin-charmeuse-back"),
        &[-30.0, -5.0, 5.0, 30.0],
    );
}

#[test]
fn velvet_is_brighter_on_one_side() {
    let [vertical, horizontal, _] = curves_of(&direct(&library("velvet")));
    let ratio = |curve: &Curve| at(curve, -70.0) / at(curve, 70.0);
    // The warp is inclined one way, the weft both ways.
    assert!(ratio(&horizontal) > 20.0);
    assert!((ratio(&vertical) - 1.0).abs() < 1e-3);
}

#[test]
fn pink_lining_is_bright_at_grazing_but_for_the_diagonal() {
    let [vertical, horizontal, diagonal] = curves_of(&direct(&library("polka-dot-lining-pink")));
    for curve in [&vertical, &horizontal] {
        let grazing = highlights(curve)
            .into_iter()
            .filter(|angle| angle.abs() > 60.0);
        assert_eq!(grazing.count(), 2);
        assert!(at(curve, 70.0) > 15.0 * at(&diagonal, 70.0));
    }
    assert_eq!(highlights(&diagonal).len(), 2);
}

#[test]
fn black_cotton_gleams_at_the_very_edge_where_its_thread_wraps() {
    let [vertical, horizontal, _] = curves_of(&direct(&library("tshirt-black-front")));
    let found = highlights(&horizontal);
    assert!(
        found.len() == 3 && found[0] < -89.0 && found[2] > 89.0,
        "{found:?}"
    );
    assert!(at(&horizontal, 89.0) < 0.6 * at(&horizontal, 0.0));
    assert_eq!(highlights(&vertical).len(), 1);
}

#[test]
fn silk_gleams_faintly_at_grazing_where_its_weft_wraps() {
    let [vertical, ..] = curves_of(&direct(&library("silk-crepe-de-chine")));
    let angles = |peaks: Vec<usize>| -> Vec<i64> {
        let degrees = |index: usize| vertical.0[index].angle.to_degrees();
        peaks
            .into_iter()
            .map(|index| degrees(index).round() as i64)
            .collect()
    };
    // White on yellow silk: a fifth of the most blue, but two thirds of a hundredth of the most light.
    assert_eq!(angles(vertical.peaks(0.2, |[_, _, b]| b)), [-79, 0, 79]);
    assert_eq!(angles(vertical.peaks(0.006, light)), [-69, 0, 69]);
    assert_eq!(angles(vertical.peaks(PROMINENCE, light)), [0]);
}

#[test]
fn irawan_has_at_most_two_highlights_along_and_across() {
    for name in [
        "linen-plain",
        "silk-crepe-de-chine",
        "polyester-satin-charmeuse-front",
        "polyester-satin-charmeuse-back",
        "silk-shot",
        "velvet",
    ] {
        let fabric = library(name);
        let mut models = fabric.models.clone();
        models.irawan = Some(irawan_of(&fabric));
        let model = ModelKind::Irawan.prepare(&models).unwrap().unwrap();
        let [vertical, horizontal, diagonal] = curves_of(&Cloth::other(model));
        for curve in [&vertical, &horizontal] {
            let highlights = highlights(curve);
            assert!(highlights.len() <= 2, "{name}: {highlights:?}");
        }
        // There two of one yarn and one of the other may add up.
        assert!(highlights(&diagonal).len() <= 3, "{name}");
    }
}
