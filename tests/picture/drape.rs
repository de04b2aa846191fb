//! Pictures of cloth that hangs and of meshes: where cloth is seen, how it lies, and what shadows it.

use std::f64::consts::{FRAC_PI_2, PI};
use std::fs;
use std::path::Path;

use assert_cmd::Command;
use glam::{DVec3, Vec2};
use predicates::prelude::PredicateBooleanExt;
use predicates::str::contains;
use sateen::fabric::{Fabric, Lambert};
use sateen::model::{Model, Rule, Sadeghi};
use sateen::progress::Progress;
use sateen::render::{
    Cloth, Cylinder, Drape, Light, Mesh, Picture, Scene, View, curtain, curves, load_mesh, render,
    trousers,
};

const RULE: Rule = Rule::Quadrature(8);

fn direct(name: &str) -> Cloth {
    let fabric = Fabric::from_library(name).unwrap();
    Cloth::direct(Sadeghi::new(&fabric, RULE))
}

fn white() -> Cloth {
    Cloth::other(Box::new(Lambert { albedo: [1.0; 3] }))
}

fn take(scene: &dyn Scene, cloth: &Cloth, lights: &[Light], size: usize) -> Picture {
    let view = View {
        size,
        samples: 4,
        lights,
        repeats: 1.0,
    };
    render(scene, cloth, &view, Progress::silent()).unwrap()
}

fn middle(picture: &Picture) -> [f32; 4] {
    picture.pixels[picture.width * (picture.height / 2) + picture.width / 2]
}

fn drape(mesh: Mesh) -> Drape {
    Drape::new(mesh, 0.0, 0.0, 1.0).unwrap()
}

/// A square that faces the viewer, its warp upwards.
fn square(z: f64, half: f64) -> Mesh {
    Mesh::sheet(2, 2, Vec2::ONE, |u, v| {
        [half * (1.0 - 2.0 * v), half * (2.0 * u - 1.0), z]
    })
}

#[test]
fn no_ray_slips_through_cloth() {
    let light = [Light::of([0.0, 0.0, 1.0])];
    for (name, mesh) in [("curtain", curtain()), ("trousers", trousers())] {
        for turn in [0.0, 0.7, -1.2] {
            let scene = Drape::new(mesh.clone(), turn, 0.12, 1.0).unwrap();
            let picture = take(&scene, &white(), &light, 300);
            let is_bare = |index: usize| picture.pixels[index][3] < 1.0;
            // What is not all cloth is joined to the border.
            let (width, height) = (picture.width, picture.height);
            let mut reached = vec![false; width * height];
            let mut open: Vec<usize> = (0..width * height)
                .filter(|index| {
                    let (x, y) = (index % width, index / width);
                    x == 0 || y == 0 || x == width - 1 || y == height - 1
                })
                .collect();
            while let Some(index) = open.pop() {
                if std::mem::replace(&mut reached[index], true) || !is_bare(index) {
                    continue;
                }
                let (x, y) = ((index % width) as i64, (index / width) as i64);
                let beside = [
                    (1, 0),
                    (-1, 0),
                    (0, 1),
                    (0, -1),
                    (1, 1),
                    (-1, -1),
                    (1, -1),
                    (-1, 1),
                ];
                open.extend(
                    beside
                        .into_iter()
                        .map(|(dx, dy)| (x + dx, y + dy))
                        .filter(|(x, y)| {
                            (0..width as i64).contains(x) && (0..height as i64).contains(y)
                        })
                        .map(|(x, y)| y as usize * width + x as usize),
                );
            }
            let holes = (0..width * height).filter(|index| is_bare(*index) && !reached[*index]);
            assert_eq!(holes.count(), 0, "{name} turned by {turn}");
            // It fills the picture.
            let covered = picture.pixels.iter().filter(|pixel| pixel[3] == 1.0);
            assert!(
                covered.count() > width * height / 5,
                "{name} turned by {turn}"
            );
        }
    }
}

#[test]
fn a_sheet_around_a_cylinder_is_the_cylinder() {
    let cloth = direct("denim");
    let lights = [Light::of(Light::direction_at(0.6, 0.2))];
    // Its warp is along the axis: upwards, as the vertical cylinder has it.
    let mesh = Mesh::sheet(8, 720, Vec2::ONE, |u, v| {
        let angle = FRAC_PI_2 * (1.0 - 2.0 * v);
        [angle.sin(), 2.0 * u - 1.0, angle.cos()]
    });
    let picture = take(&drape(mesh), &cloth, &lights, 400);
    let view = View {
        size: 1,
        samples: 1,
        lights: &lights,
        repeats: 1.0,
    };
    let curves = curves(&cloth, &view, Progress::silent()).unwrap();
    assert_eq!(curves[0].cylinder, Cylinder::Vertical);
    let row = &picture.pixels[picture.width * 200..][..picture.width];
    for point in curves[0]
        .curve
        .0
        .iter()
        .filter(|point| point.x().abs() < 0.9)
    {
        let column = 200.0 + 0.96 * 200.0 * point.x() - 0.5;
        let (left, part) = (column.floor() as usize, column.fract());
        for (k, expected) in point.radiance.into_iter().enumerate() {
            let [a, b] = [left, left + 1].map(|column| f64::from(row[column][k]));
            let found = a + (b - a) * part;
            assert!(
                (found - expected).abs() < 0.01 * expected + 5e-4,
                "{point:?}: {found}"
            );
        }
    }
}

#[test]
fn cloth_shadows_what_is_behind_it() {
    // A small square hovers over a large one; light from the right throws its shadow to the left.
    let mut mesh = square(0.0, 1.0);
    mesh.join(square(0.5, 0.25));
    let scene = drape(mesh);
    let light = Light::of(Light::direction_at(PI / 4.0, 0.0));
    let weak = Light {
        direction: [0.0, 0.0, 1.0],
        strength: 0.25,
    };
    let lit = take(&scene, &white(), &[light], 200);
    let both = take(&scene, &white(), &[light, weak], 200);
    let at = |picture: &Picture, x: f64| picture.pixels[100 * 200 + (100.0 + 96.0 * x) as usize][0];
    let cos = (PI / 4.0).cos() as f32;
    for (x, expected) in [(-0.9, cos), (-0.5, 0.0), (0.0, cos), (0.5, cos)] {
        assert!(
            (at(&lit, x) - expected).abs() < 1e-3,
            "{x}: {}",
            at(&lit, x)
        );
        // Lights add up; the weak one is where the viewer is and sees no shadow.
        let expected = expected + 0.25;
        assert!(
            (at(&both, x) - expected).abs() < 1e-3,
            "{x}: {}",
            at(&both, x)
        );
    }
}

#[test]
fn seen_from_behind_cloth_has_its_weft_the_other_way() {
    // Velvet is inclined along its warp, so up and down differ, and from behind they are the same.
    let model = Sadeghi::<f32>::new(&Fabric::from_library("velvet").unwrap(), RULE);
    let direction = DVec3::new(0.3, 0.5, 0.7).normalize();
    let lights = [Light::of(direction.into())];
    let expected = |warp: DVec3, weft: DVec3| {
        let wi = [warp, weft, DVec3::Z].map(|axis| axis.dot(direction) as f32);
        let rho = model.eval_cos(wi, [0.0, 0.0, 1.0]);
        rho.map(|rho| std::f32::consts::PI * rho)
    };
    for (turn, warp, weft) in [(0.0, DVec3::Y, DVec3::NEG_X), (PI, DVec3::Y, DVec3::NEG_X)] {
        let scene = Drape::new(square(0.0, 1.0), turn, 0.0, 1.0).unwrap();
        let [found @ .., _] = middle(&take(&scene, &direct("velvet"), &lights, 9));
        for (found, expected) in found.into_iter().zip(expected(warp, weft)) {
            assert!(
                (found - expected).abs() < 1e-4 * expected,
                "{turn}: {found} {expected}"
            );
        }
    }
}

#[test]
fn a_curtain_keeps_its_length() {
    let mesh = curtain();
    // Of the edges along warp and weft, and the diagonals between.
    let edges = mesh
        .triangles
        .iter()
        .flat_map(|[a, b, c]| [[a, b], [a, c], [b, c]]);
    let mut ratios: Vec<f32> = edges
        .map(|edge| edge.map(|index| *index as usize))
        .map(|[a, b]| {
            mesh.positions[a].distance(mesh.positions[b]) / mesh.uvs[a].distance(mesh.uvs[b])
        })
        .collect();
    ratios.sort_by(f32::total_cmp);
    let at = |share: f64| ratios[(share * (ratios.len() - 1) as f64) as usize];
    let (low, high) = (at(0.01), at(0.99));
    assert!(low > 0.9 && high < 1.1, "{low} to {high}");
}

#[test]
fn hanging_cloth_has_normals_and_warps() {
    for mesh in [curtain(), trousers()] {
        for (normal, warp) in mesh.normals.iter().zip(&mesh.warps) {
            assert!((normal.length() - 1.0).abs() < 1e-5);
            assert!(warp.dot(*normal).abs() < 1e-2 * warp.length());
        }
    }
}

/// A square that faces the viewer, with u to the right unless its coordinates are turned by that many quarters.
fn square_obj(quarters: usize) -> String {
    let corners = ["0 0", "1 0", "1 1", "0 1"];
    let mut text = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n".to_owned();
    for k in 0..4 {
        text += &format!("vt {}\n", corners[(k + 4 - quarters) % 4]);
    }
    text + "f 1/1 2/2 3/3 4/4\n"
}

/// The same in glTF: a square in the plane y = 0 that a node raises, with or without tangents of its own.
fn square_gltf(folder: &Path, tangent: Option<[f32; 4]>) -> std::path::PathBuf {
    let positions: [[f32; 3]; 4] = [
        [-1.0, 0.0, 1.0],
        [1.0, 0.0, 1.0],
        [1.0, 0.0, -1.0],
        [-1.0, 0.0, -1.0],
    ];
    let uvs: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let indices: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let mut bytes: Vec<u8> = Vec::new();
    bytes.extend(positions.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes.extend(uvs.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes.extend(
        [tangent.unwrap_or_default(); 4]
            .iter()
            .flatten()
            .flat_map(|x| x.to_le_bytes()),
    );
    bytes.extend(indices.iter().flat_map(|x| x.to_le_bytes()));
    fs::write(folder.join("square.bin"), &bytes).unwrap();
    let tangents = if tangent.is_some() {
        r#", "TANGENT": 2"#
    } else {
        ""
    };
    // A quarter turn about x takes −z to y.
    let text = format!(
        r#"{{
            "asset": {{ "version": "2.0" }},
            "scene": 0, "scenes": [{{ "nodes": [0] }}],
            "nodes": [{{ "children": [1], "rotation": [0.70710678, 0, 0, 0.70710678] }}, {{ "mesh": 0, "translation": [5, 0, 0] }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "TEXCOORD_0": 1{tangents} }}, "indices": 3 }}] }}],
            "buffers": [{{ "uri": "square.bin", "byteLength": {} }}],
            "bufferViews": [
                {{ "buffer": 0, "byteOffset": 0, "byteLength": 48 }},
                {{ "buffer": 0, "byteOffset": 48, "byteLength": 32 }},
                {{ "buffer": 0, "byteOffset": 80, "byteLength": 64 }},
                {{ "buffer": 0, "byteOffset": 144, "byteLength": 12 }}
            ],
            "accessors": [
                {{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, 0, -1], "max": [1, 0, 1] }},
                {{ "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" }},
                {{ "bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC4" }},
                {{ "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" }}
            ]
        }}"#,
        bytes.len()
    );
    let path = folder.join("square.gltf");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn the_warp_of_a_mesh_runs_along_u_or_its_tangents() {
    let folder = tempfile::tempdir().unwrap();
    let model = Sadeghi::<f32>::new(&Fabric::from_library("velvet").unwrap(), RULE);
    let direction = DVec3::new(0.4, 0.3, 0.8).normalize();
    let lights = [Light::of(direction.into())];
    let is_as = |path: &Path, warp: DVec3| {
        let scene = drape(load_mesh(path).unwrap());
        let [found @ .., coverage] = middle(&take(&scene, &direct("velvet"), &lights, 9));
        assert_eq!(coverage, 1.0);
        let weft = DVec3::Z.cross(warp);
        let wi = [warp, weft, DVec3::Z].map(|axis| axis.dot(direction) as f32);
        let rho = model.eval_cos(wi, [0.0, 0.0, 1.0]);
        for (found, rho) in found.into_iter().zip(rho) {
            let expected = std::f32::consts::PI * rho;
            assert!(
                (found - expected).abs() < 1e-3 * expected,
                "{}: {found} {expected}",
                path.display()
            );
        }
    };
    let obj = folder.path().join("square.obj");
    for (quarters, warp) in [DVec3::X, DVec3::Y, DVec3::NEG_X, DVec3::NEG_Y]
        .into_iter()
        .enumerate()
    {
        fs::write(&obj, square_obj(quarters)).unwrap();
        is_as(&obj, warp);
    }
    is_as(&square_gltf(folder.path(), None), DVec3::X);
    // In the mesh's coordinates −z is what the node turns to y.
    is_as(
        &square_gltf(folder.path(), Some([0.0, 0.0, -1.0, 1.0])),
        DVec3::Y,
    );
}

/// `sateen render` of few pixels into a file.
fn picture(args: &[&str], path: &Path) -> assert_cmd::assert::Assert {
    Command::cargo_bin("sateen")
        .unwrap()
        .arg("render")
        .args(args)
        .args(["--size", "64", "--samples", "4", "-o"])
        .arg(path)
        .assert()
}

#[test]
fn the_tool_hangs_cloth_and_says_how() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("square.obj");
    fs::write(&mesh, square_obj(0)).unwrap();
    let mesh = mesh.to_str().unwrap();
    let scenes: [&[&str]; 4] = [
        &["curtain", "denim"],
        &["trousers", "denim", "--turn-deg", "30"],
        &[
            "mesh", mesh, "denim", "--light", "0,0,1", "--light", "1,0,1",
        ],
        &["mesh", mesh, "denim", "--light-deg", "0"],
    ];
    for (scene, lights) in scenes.into_iter().zip([3, 3, 2, 1]) {
        // The same on any number of workers.
        let [one, two] = ["1", "2"].map(|jobs| {
            let path = folder.path().join("a.png");
            picture(&[scene, &["-j", jobs]].concat(), &path).success();
            fs::read(&path).unwrap()
        });
        assert_eq!(one, two, "{scene:?}");
        let reader = png::Decoder::new(std::io::Cursor::new(&one))
            .read_info()
            .unwrap();
        assert_eq!((reader.info().width, reader.info().height), (64, 64));
        let texts = &reader.info().utf8_text;
        let light = texts.iter().find(|text| text.keyword == "light").unwrap();
        assert_eq!(light.get_text().unwrap().split(' ').count(), lights);
    }
    let path = folder.path().join("a.png");
    picture(
        &["curtain", "denim", "--compare", "irawan", "midpoint:4"],
        &path,
    )
    .success()
    .stdout(contains("FLIP"));
    picture(&["sphere", "denim", "--turn-deg", "30"], &path)
        .code(2)
        .stderr(contains("--turn-deg"));
}

#[test]
fn patterns_repeat_along_meshes() {
    let pattern = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/tables/patterns/polka-dot-lining.toml"
    );
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("square.obj");
    fs::write(&mesh, square_obj(0)).unwrap();
    let path = folder.path().join("a.png");
    let changes = |repeats: &str| {
        let args = [
            "mesh",
            mesh.to_str().unwrap(),
            pattern,
            "--repeats",
            repeats,
            "--light-deg",
            "0",
        ];
        picture(&args, &path).success();
        let image = image::open(&path).unwrap().into_rgba8();
        let is_pink = |column: u32, row: u32| {
            let pixel = image.get_pixel(column, row);
            u32::from(pixel[1]) * 2 < u32::from(pixel[0])
        };
        // Most of any row.
        let count = |row: u32| {
            let row: Vec<bool> = (4..60).map(|column| is_pink(column, row)).collect();
            row.windows(2).filter(|pair| pair[0] != pair[1]).count()
        };
        (4..60).map(count).max().unwrap()
    };
    let (two, four) = (changes("2"), changes("4"));
    assert!(two >= 2 && four >= two + 2, "{two} {four}");
}

#[test]
fn meshes_that_cannot_be_covered_say_why() {
    let folder = tempfile::tempdir().unwrap();
    let png = folder.path().join("a.png");
    let quad = square_obj(0);
    let broken_gltf = folder.path().join("b.gltf");
    fs::write(&broken_gltf, "{}").unwrap();
    let cases = [
        ("none.obj", None, "cannot read"),
        ("a.stl", Some("solid"), "neither .obj nor .gltf nor .glb"),
        ("a.obj", Some("v 0 0 0\n"), "has no triangles"),
        (
            "b.obj",
            Some("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
            "without texture coordinates",
        ),
        (
            "c.obj",
            Some("v 0 0 0\nvt 0 0\nf 1/1 2/1 3/1\n"),
            "no OBJ file that can be read",
        ),
        (
            "d.obj",
            Some("v 0 0 nan\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n"),
            "is no number",
        ),
        (
            "e.obj",
            Some("v 0 0 0\nv 1e38 0 0\nv -1e38 1e38 0\nvt 0 0\nf 1/1 2/1 3/1\n"),
            "too large",
        ),
        ("b.gltf", Some("{}"), "no glTF file that can be read"),
        (
            "c.glb",
            Some(quad.as_str()),
            "no glTF file that can be read",
        ),
    ];
    for (name, text, message) in cases {
        let path = folder.path().join(name);
        if let Some(text) = text {
            fs::write(&path, text).unwrap();
        }
        picture(&["mesh", path.to_str().unwrap(), "denim"], &png)
            .code(1)
            .stderr(contains(message).and(contains(name)));
    }
    assert!(!png.exists());
}

#[test]
fn triangles_without_area_are_not_seen() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.obj");
    // A point, a line, and a square with all texture coordinates the same: any warp is as good.
    let text = "v 0 0 1\nv 0 0 1\nv 0 0 1\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvt 0 0\n\
                f 1/1 2/1 3/1\nf 1/1 5/1 5/1\nf 4/1 5/1 6/1 7/1\n";
    fs::write(&path, text).unwrap();
    let scene = drape(load_mesh(&path).unwrap());
    let picture = take(&scene, &direct("denim"), &[Light::of([0.0, 0.0, 1.0])], 32);
    assert!(
        picture
            .pixels
            .iter()
            .flatten()
            .all(|x| x.is_finite() && *x >= 0.0)
    );
    assert_eq!(middle(&picture)[3], 1.0);
    assert!(middle(&picture)[0] > 0.0);
}
