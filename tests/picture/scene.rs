//! Scenes: what their files say, and that everything they can ask of a fabric is foreseen.

use std::collections::BTreeMap;
use std::error::Error;
use std::f64::consts::PI;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::common::{fabric, tiny, tiny_table};
use glam::{DVec3, Vec2};
use sateen::bake::{Request, Scope, bake};
use sateen::fabric::{Fabric, Lambert};
use sateen::model::{Rule, Sadeghi};
use sateen::needs::Needs;
use sateen::progress::Progress;
use sateen::render::{Cloth, Mesh, Missing};
use sateen::scene::{
    Albedo, CameraPath, Lens, LightPose, LightSource, Pose, Scene, SceneError, Stage,
};
use sateen::table::Table;

/// Sides of pictures.
const SIZE: usize = 48;

fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tables/scenes")
        .join(format!("{name}.toml"))
}

fn scene_of(text: &str) -> Result<Scene, SceneError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    fs::write(&path, text).unwrap();
    Scene::load(&path)
}

/// The error and its causes.
fn mistake(text: &str) -> String {
    let error = scene_of(text).unwrap_err();
    let mut message = error.to_string();
    let mut cause = error.source();
    while let Some(error) = cause {
        message += &format!(": {error}");
        cause = error.source();
    }
    message
}

const CAMERA: &str = "[[camera]]\nposition = [0, 0, 5]\ntarget = [0, 0, 0]\nfov_deg = 30\n";
const LIGHT: &str = "[[light]]\nkind = \"directional\"\ndirection = [1, 1, 1]\n";
const OBJECT: &str = "[[object]]\nmesh = \"square\"\ncloth = \"denim\"\n";

fn text(camera: &str, light: &str, object: &str) -> String {
    format!("name = \"a\"\n{camera}{light}{object}")
}

fn needs(scene: &Scene) -> BTreeMap<String, Needs> {
    scene.needs(Progress::silent()).unwrap()
}

/// Pairs that a picture asks for and that are not foreseen, and all that it asks for, by cloth name.
fn unforeseen(scene: &Scene, needs: &BTreeMap<String, Needs>, poses: &[Pose]) -> [usize; 2] {
    let stage = Stage::new(scene);
    let mut counts = [0; 2];
    for pose in poses {
        for (cloth, pairs) in stage.pairs(pose, SIZE, 1) {
            let object = scene.objects.iter().find(|object| object.cloth == cloth);
            for fabric in object.unwrap().material.bakes() {
                let needs = &needs[&fabric.name];
                let is_missing = |[wi, wr]: &&[[f32; 3]; 2]| !needs.contains(*wi, *wr);
                counts[0] += pairs.iter().filter(is_missing).count();
                counts[1] += pairs.len();
            }
        }
    }
    counts
}

fn poses(scene: &Scene, count: u64) -> Vec<Pose> {
    let mut poses = vec![scene.default_pose()];
    poses.extend((0..count).map(|seed| scene.pose(seed)));
    poses
}

#[test]
fn mistakes_are_told_with_file_key_and_remedy() {
    let of_camera = |camera: &str| mistake(&text(camera, LIGHT, OBJECT));
    let of_light = |light: &str| mistake(&text(CAMERA, light, OBJECT));
    let of_object = |object: &str| mistake(&text(CAMERA, LIGHT, object));
    for (message, parts) in [
        (mistake("name = 3"), ["scene.toml:1", "name"]),
        (mistake(&text("", LIGHT, OBJECT)), ["camera", "[[camera]]"]),
        (mistake(&text(CAMERA, "", OBJECT)), ["light", "[[light]]"]),
        (mistake(&text(CAMERA, LIGHT, "")), ["object", "[[object]]"]),
        (
            of_camera("[[camera]]\ntarget = [0, 0, 0]\nfov_deg = 30\n"),
            ["scene.toml:2", "position"],
        ),
        (
            of_camera(&CAMERA.replace("fov_deg = 30", "fov_deg = 300")),
            ["fov_deg = 300.0", "170"],
        ),
        (
            of_camera(&CAMERA.replace("fov_deg = 30", "")),
            ["fov_deg", "height"],
        ),
        (
            of_camera(&CAMERA.replace("fov_deg", "fov")),
            ["scene.toml:5", "fov"],
        ),
        (
            of_camera("[[camera]]\ntarget = [0, 0, 0]\nfov_deg = 30\ndistance = [3, 2]\n"),
            ["scene.toml:5", "distance"],
        ),
        (
            of_camera("[[camera]]\ntarget = [0, 0, 0]\nfov_deg = 30\ndistance = \"far\"\n"),
            ["scene.toml:5", "a number, or a range"],
        ),
        (
            of_light("[[light]]\nkind = \"sun\"\n"),
            ["kind: \"sun\"", "directional"],
        ),
        (
            of_light("[[light]]\nkind = \"collocated\"\ndistance = 2\n"),
            ["distance", "remove"],
        ),
        (
            of_light("[[light]]\nkind = \"spot\"\nposition = [0, 1, 0]\n"),
            ["direction", "needs"],
        ),
        (
            of_light("[[light]]\nkind = \"point\"\n"),
            ["position", "needs"],
        ),
        (
            of_light(&LIGHT.replace("1, 1, 1", "0, 0, 0")),
            ["direction", "not be 0"],
        ),
        (
            of_light(&LIGHT.replace("1, 1, 1", "1, 1, 1, 1")),
            ["scene.toml", "expected 3 values, there are 4"],
        ),
        (
            of_object(&OBJECT.replace("denim", "denmi")),
            ["denmi", "did you mean denim?"],
        ),
        (
            of_object(&OBJECT.replace("denim", "none.toml")),
            ["scene.toml:11", "cannot read"],
        ),
        (
            of_object(&OBJECT.replace("square", "ball")),
            ["ball", "sphere"],
        ),
        (
            of_object(&OBJECT.replace("square", "ball.obj")),
            ["scene.toml:10", "ball.obj"],
        ),
        (
            of_object(&OBJECT.replace("cloth", "fabric")),
            ["scene.toml:11", "fabric"],
        ),
        (
            of_object("[[object]]\nmesh = \"square\"\n"),
            ["cloth", "materials"],
        ),
        (
            of_object(&format!("{OBJECT}max_error = 3\n")),
            ["max_error = 3.0", "between"],
        ),
        (
            of_object(&format!("{OBJECT}albedo = \"red\"\n")),
            ["scene.toml:12", "albedo"],
        ),
        (
            of_object("[[object]]\nmesh = \"square\"\nmaterials = { cuff = \"denim\" }\n"),
            ["cuff", "has no material"],
        ),
    ] {
        for part in parts {
            assert!(message.contains(part), "{part}: {message}");
        }
    }
}

#[test]
fn a_scene_is_read_as_it_is_written() {
    let object = format!("{OBJECT}albedo = \"fixed\"\nmax_error = 0.01\nturn_deg = [-90, 90]\n");
    let scene = scene_of(&text(CAMERA, LIGHT, &object)).unwrap();
    assert_eq!(scene.cameras[0].lens, Lens::Perspective(PI / 6.0));
    let LightSource::Directional(sky) = scene.lights[0].source else {
        panic!("{:?}", scene.lights)
    };
    assert!((sky.azimuth[0] - PI / 4.0).abs() < 1e-12);
    let uses = scene.fabrics();
    let denim = &uses["denim"];
    assert_eq!((denim.albedo, denim.max_error), (Albedo::Fixed, Some(0.01)));
    assert_eq!(denim.objects, ["object 1"]);
    // One object more leaves the albedo open.
    let more = scene_of(&text(CAMERA, LIGHT, &format!("{object}{OBJECT}"))).unwrap();
    assert_eq!(more.fabrics()["denim"].albedo, Albedo::Varies);
    // The same seed is the same pose.
    assert_eq!(scene.pose(3), scene.pose(3));
    assert_ne!(scene.pose(3), scene.pose(4));
}

/// With some of the triangles, spread over the cloth: as good a test, in a fraction of the time.
fn thinned(mut scene: Scene) -> Scene {
    for object in &mut scene.objects {
        let mut mesh = Mesh::clone(&object.mesh);
        let step = mesh.triangles.len().div_ceil(4_000);
        mesh.triangles = mesh.triangles.into_iter().step_by(step).collect();
        object.mesh = mesh.into();
    }
    scene
}

fn everything_is_foreseen(name: &str) -> f64 {
    let scene = thinned(Scene::load(&sample(name)).unwrap());
    let analysis = scene.analyse(Progress::silent()).unwrap();
    let [missing, all] = unforeseen(&scene, &analysis.needs, &poses(&scene, 24));
    assert!(all > 100, "{name}: {all}");
    assert_eq!(missing, 0, "{name}: of {all}");
    let shares = analysis.needs.values().map(Needs::share);
    shares.fold(0.0, f64::max)
}

#[test]
fn everything_is_foreseen_in_a_product_shot() {
    let share = everything_is_foreseen("product-shot");
    assert!(share < 0.25, "{share}");
}

#[test]
fn everything_is_foreseen_by_a_scanner() {
    // Nothing but light from the viewer.
    assert_eq!(everything_is_foreseen("collocated-scanner"), 0.0);
}

#[test]
fn everything_is_foreseen_around_a_character() {
    everything_is_foreseen("character");
}

#[test]
fn everything_is_foreseen_under_the_sun() {
    let share = everything_is_foreseen("sun-path");
    assert!(share < 0.6, "{share}");
}

/// Cloths of a scene from tables of everything and from those of what it needs, and these.
fn tables(scene: &Scene, needs: &BTreeMap<String, Needs>) -> [BTreeMap<String, Arc<Table>>; 2] {
    let (mut full, mut part) = (BTreeMap::new(), BTreeMap::new());
    for (name, used) in scene.fabrics() {
        let scope = Scope {
            needs: Some(&needs[&name]),
            fixed_albedo: false,
        };
        let request = Request {
            scope,
            ..tiny().into()
        };
        let baked = bake(&used.fabric, request, Progress::silent());
        assert_eq!(used.fabric, fabric(&name), "scenes are of the library");
        full.insert(name.clone(), Arc::new(tiny_table(&name).clone()));
        part.insert(name, Arc::new(baked.unwrap().table));
    }
    [full, part]
}

#[test]
fn pictures_with_what_is_needed_are_those_with_everything() {
    for name in [
        "product-shot",
        "collocated-scanner",
        "character",
        "sun-path",
    ] {
        let scene = thinned(Scene::load(&sample(name)).unwrap());
        let needs = needs(&scene);
        let [full, part] = tables(&scene, &needs);
        let stage = Stage::new(&scene);
        let take = |tables: &BTreeMap<String, Arc<Table>>, pose: &Pose| {
            let cloth =
                |table: &Arc<Table>| Cloth::table(Arc::clone(table), Vec::new(), Missing::Nearest);
            let cloths = tables
                .iter()
                .map(|(name, table)| (name.clone(), cloth(table)));
            let cloths = cloths.collect();
            let picture = stage.picture(pose, &cloths, 40, 1, false, Progress::silent());
            picture.unwrap().pixels
        };
        let mut lit = 0;
        for pose in poses(&scene, 12) {
            let [a, b] = [&full, &part].map(|tables| take(tables, &pose));
            lit += a.iter().filter(|pixel| pixel[0] > 0.0).count();
            assert!(a == b, "{name}");
        }
        assert!(lit > 20, "{name}: {lit}");
        let misses = || part.values().map(|table| table.misses()).sum::<usize>();
        assert_eq!(misses(), 0, "{name}");
        // A light that was declared to be elsewhere is noticed.
        if name == "product-shot" {
            for to in [DVec3::NEG_Y, DVec3::Y, DVec3::NEG_X] {
                let mut pose = scene.default_pose();
                pose.lights[1] = LightPose::Directional((to + 0.3 * DVec3::Z).normalize());
                take(&part, &pose);
            }
            assert!(misses() > 0);
        }
    }
}

#[test]
fn the_tool_explains_bakes_and_proves_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let lamp = text(CAMERA, "[[light]]\nkind = \"collocated\"\n", OBJECT);
    fs::write(path("lamp.toml"), lamp).unwrap();
    let sateen = |args: &[&str]| {
        let mut command = assert_cmd::Command::cargo_bin("sateen").unwrap();
        command.current_dir(folder.path()).args(args).assert()
    };
    let told = sateen(&[
        "scene",
        "lamp.toml",
        "--preset",
        "draft",
        "-o",
        "drawn",
        "--json",
    ])
    .success();
    let told: serde_json::Value = serde_json::from_slice(&told.get_output().stdout).unwrap();
    assert_eq!(told["fabrics"][0]["fabric"], "denim");
    assert_eq!(told["fabrics"][0]["collocated_only"], true);
    let svg = fs::read_to_string(path("drawn/denim.svg")).unwrap();
    roxmltree::Document::parse(&svg).unwrap();
    sateen(&["bake", "denim", "--preset", "draft", "-o", "full/"]).success();
    sateen(&[
        "bake",
        "--scene",
        "lamp.toml",
        "--preset",
        "draft",
        "-o",
        "part/",
    ])
    .success();
    let bytes = |folder: &str| {
        fs::metadata(path(folder).join("denim.sateen"))
            .unwrap()
            .len()
    };
    assert!(bytes("part") < bytes("full") / 10);
    let take = |picture: &[&str]| {
        let fixed = [
            "render",
            "scene",
            "lamp.toml",
            "--size",
            "24",
            "--samples",
            "1",
        ];
        sateen(&[&fixed[..], picture].concat())
    };
    take(&[
        "--tables",
        "full",
        "--against",
        "part",
        "--draws",
        "3",
        "-o",
        "same.png",
    ])
    .success()
    .stdout(predicates::str::contains(
        "0 of 1728 pixels of 3 pictures differ; 0 and 0 pairs",
    ));
    take(&["--record", "asked", "-o", "direct.exr"]).success();
    sateen(&[
        "bake",
        "denim",
        "--needs",
        "asked/denim.needs",
        "--preset",
        "draft",
        "-o",
        "asked.sateen",
    ])
    .success();
    sateen(&["info", "asked.sateen"])
        .success()
        .stdout(predicates::str::contains(
            "baked for  light from the viewer's direction",
        ));
    fs::write(
        path("pairs.csv"),
        "wi_x,wi_y,wi_z,wr_x,wr_y,wr_z\n0,0,1,0,0.6,0.8\n",
    )
    .unwrap();
    let eval = ["eval", "asked.sateen", "--pairs", "pairs.csv"];
    sateen(&eval)
        .success()
        .stderr(predicates::str::contains("1 of 1 pairs were not baked"));
    sateen(&[&eval[..], &["--strict"]].concat())
        .failure()
        .code(1);
    // The same in pictures, of a table and of a pattern.
    let sphere = |subject: &str, more: &[&str]| {
        let fixed = [
            "render",
            "sphere",
            subject,
            "--size",
            "16",
            "--samples",
            "1",
        ];
        sateen(&[&fixed[..], &["--light-deg", "50"], more].concat())
    };
    sphere("asked.sateen", &["-o", "nearest.png"])
        .success()
        .stderr(predicates::str::contains("pairs not baked"));
    sphere("asked.sateen", &["-o", "none.png", "--strict"])
        .failure()
        .code(1);
    sphere("denim", &["-o", "none.png", "--strict"])
        .failure()
        .code(2);
    assert!(!path("none.png").exists());
    let material = |name: &str| format!("[[material]]\nname = \"{name}\"\nfabric = \"denim\"\n");
    let stripes = "[stripes]\nmaterials = [\"a\", \"b\"]\nwidths = [0.1, 0.1]\nacross_deg = 90\n";
    let pattern = format!(
        "name = \"stripes\"\n{}{}{stripes}",
        material("a"),
        material("b")
    );
    fs::write(path("stripes.toml"), pattern).unwrap();
    fs::create_dir(path("stripes")).unwrap();
    fs::copy(path("asked.sateen"), path("stripes/denim.sateen")).unwrap();
    sphere("asked.sateen", &["-o", "magenta.png", "--show-missing"]).success();
    let tables = ["--tables", "stripes", "--show-missing"];
    sphere(
        "stripes.toml",
        &[&["-o", "striped.png"], &tables[..]].concat(),
    )
    .success();
    let pixels = |name: &str| image::open(path(name)).unwrap().to_rgb8().into_raw();
    assert_ne!(pixels("magenta.png"), pixels("nearest.png"));
    assert_eq!(pixels("magenta.png"), pixels("striped.png"));
    sateen(&[
        "record",
        "pairs.csv",
        "asked/denim.needs",
        "-o",
        "more.needs",
    ])
    .success();
    sateen(&[
        "bake",
        "denim",
        "--needs",
        "more.needs",
        "--preset",
        "draft",
        "-o",
        "more.sateen",
    ])
    .success();
    sateen(&["eval", "more.sateen", "--pairs", "pairs.csv", "--strict"]).success();
    sateen(&["bake", "denim", "--needs", "pairs.csv"])
        .failure()
        .code(1);
}

#[test]
fn other_lights_and_lenses_are_foreseen() {
    let cameras = [
        CAMERA.replace("fov_deg = 30", "height = 2.5"),
        "[[camera]]\ntarget = [0, 0, 0]\nheight = 2.5\ndistance = 4\nazimuth_deg = [100, 260]\nelevation_deg = [-5, 5]\n".to_owned(),
        CAMERA.replace("fov_deg = 30", "fov_deg = 30\nposition_to = [2, 1, 3]"),
        "[[camera]]\ntarget = [0, 0, 0]\nfov_deg = 60\ndistance = [1.2, 1.3]\nazimuth_deg = [0, 90]\nelevation_deg = 80\n".to_owned(),
    ];
    let lights = [
        "[[light]]\nkind = \"environment\"\nabove_deg = 20\n",
        "[[light]]\nkind = \"point\"\nposition = [1, 1, 1]\nposition_to = [1.5, 1.2, 2]\n",
        "[[light]]\nkind = \"spot\"\nposition = [0, 0, 3]\ndirection = [0.2, 0, -1]\nouter_deg = 12\n",
        "[[light]]\nkind = \"collocated\"\n",
    ];
    let objects = [
        "[[object]]\nmesh = \"sphere\"\ncloth = \"velvet\"\ninstances = [{ rotation_deg = [30, 40, 50], scale = 0.5 }]\nsway = 0.2\n",
        "[[object]]\nmesh = \"square\"\ncloth = \"velvet\"\nturn_deg = [-70, 20]\ninstances = [{ rotation_deg = [0, 20, 10] }]\n",
    ];
    for (k, camera) in cameras.iter().enumerate() {
        for (j, light) in lights.iter().enumerate() {
            let scene = thinned(scene_of(&text(camera, light, objects[k / 2])).unwrap());
            let counts = unforeseen(&scene, &needs(&scene), &poses(&scene, 5));
            assert!(counts[0] == 0 && counts[1] > 0, "{k} {j}: {counts:?}");
        }
    }
}

#[test]
fn a_light_outside_its_range_is_not_foreseen() {
    let scene = thinned(Scene::load(&sample("product-shot")).unwrap());
    let mut pose = scene.default_pose();
    pose.lights[1] = LightPose::Directional(DVec3::new(-0.9, 0.7, 0.3).normalize());
    let [missing, all] = unforeseen(&scene, &needs(&scene), &[pose]);
    assert!(missing > all / 20, "{missing} of {all}");
}

#[test]
fn needs_are_the_same_on_any_number_of_threads() {
    let scene = thinned(Scene::load(&sample("product-shot")).unwrap());
    let [one, two] = [1, 2].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap().install(|| needs(&scene))
    });
    assert!(one == two);
}

#[test]
fn a_pattern_needs_all_of_its_fabrics() {
    let pattern = Path::new(env!("CARGO_MANIFEST_DIR")).join("tables/patterns/corduroy.toml");
    let object = OBJECT.replace("denim", pattern.to_str().unwrap());
    let scene = scene_of(&text(CAMERA, LIGHT, &object)).unwrap();
    let needs = needs(&scene);
    let names: Vec<&str> = scene.objects[0]
        .material
        .bakes()
        .iter()
        .map(|fabric| &*fabric.name)
        .collect();
    assert!(names.len() > 1);
    for name in names {
        assert!(!needs[name].is_empty());
    }
    let [missing, all] = unforeseen(&scene, &needs, &poses(&scene, 1));
    assert!(missing == 0 && all > 0, "{missing} of {all}");
}

#[test]
fn a_picture_has_the_radiance_of_its_lights() {
    let white = BTreeMap::from([(
        "denim".to_owned(),
        Cloth::other(Box::new(Lambert { albedo: [1.0; 3] })),
    )]);
    let take = |light: &str, shadows: bool| {
        let scene = scene_of(&text(CAMERA, light, OBJECT)).unwrap();
        let stage = Stage::new(&scene);
        let pose = scene.default_pose();
        let picture = stage
            .picture(&pose, &white, 9, 4, shadows, Progress::silent())
            .unwrap();
        picture.pixels[40]
    };
    let facing = "[[light]]\nkind = \"directional\"\ndirection = [0, 0, 1]\nstrength = 0.5\n";
    let point = "[[light]]\nkind = \"point\"\nposition = [0, 0, 10]\ndistance = 5\n";
    let behind = "[[light]]\nkind = \"directional\"\ndirection = [0, 0, -1]\n";
    let around = "[[light]]\nkind = \"environment\"\nabove_deg = -90\n";
    let camera = "[[light]]\nkind = \"collocated\"\n";
    for (light, expected, tolerance) in [
        (facing, 0.5, 1e-3),
        (point, 0.25, 1e-2),
        (behind, 0.0, 0.0),
        (around, 1.0, 0.1),
        (camera, 1.0, 1e-2),
    ] {
        for shadows in [false, true] {
            let [found @ .., coverage] = take(light, shadows);
            assert_eq!(coverage, 1.0);
            for found in found {
                assert!((found - expected).abs() <= tolerance, "{light}: {found}");
            }
        }
    }
    // From behind, too.
    let scene = Scene::load(&sample("character")).unwrap();
    let rule = Rule::Midpoint(4);
    let cloth = |name: &str| {
        let model = Sadeghi::new(&Fabric::from_library(name).unwrap(), rule);
        (name.to_owned(), Cloth::direct(model))
    };
    let cloths = BTreeMap::from([cloth("denim"), cloth("tshirt-white")]);
    let stage = Stage::new(&scene);
    let picture = stage.picture(
        &scene.default_pose(),
        &cloths,
        SIZE,
        2,
        true,
        Progress::silent(),
    );
    let lit = picture
        .unwrap()
        .pixels
        .iter()
        .filter(|pixel| pixel[0] > 0.01)
        .count();
    assert!(lit > 100, "{lit}");
}

/// A square in the plane z = 0 whose tangents point upwards, a camera, and lights of every kind.
fn square_gltf(folder: &Path, material: &str, more: &str) -> PathBuf {
    let positions: [[f32; 3]; 4] = [
        [-1.0, -1.0, 0.0],
        [1.0, -1.0, 0.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
    ];
    let uvs: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let tangents = [[0.0f32, 1.0, 0.0, 1.0]; 4];
    let indices: [u16; 6] = [0, 1, 2, 0, 2, 3];
    let mut bytes: Vec<u8> = Vec::new();
    let floats = positions
        .iter()
        .flatten()
        .chain(uvs.iter().flatten())
        .chain(tangents.iter().flatten());
    bytes.extend(floats.flat_map(|x| x.to_le_bytes()));
    bytes.extend(indices.iter().flat_map(|x| x.to_le_bytes()));
    fs::write(folder.join("square.bin"), &bytes).unwrap();
    let text = format!(
        r#"{{
            "asset": {{ "version": "2.0" }},
            "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": {{ "KHR_lights_punctual": {{ "lights": [
                {{ "type": "directional", "intensity": 3.14159265 }},
                {{ "type": "point", "name": "bulb", "intensity": 2.0 }},
                {{ "type": "spot", "intensity": 1.0, "spot": {{ "innerConeAngle": 0.1, "outerConeAngle": 0.5 }} }}
            ] }} }},
            "scene": 0, "scenes": [{{ "nodes": [0, 1, 2, 3, 4] }}],
            "cameras": [{{ "type": "perspective", "perspective": {{ "yfov": 0.8, "znear": 0.1 }} }}],
            "nodes": [
                {{ "mesh": 0, "translation": [0, 0, 1] }},
                {{ "camera": 0, "name": "front", "translation": [0, 0, 5] }},
                {{ "rotation": [0, 0.70710678, 0, 0.70710678], "extensions": {{ "KHR_lights_punctual": {{ "light": 0 }} }} }},
                {{ "translation": [0, 3, 2], "extensions": {{ "KHR_lights_punctual": {{ "light": 1 }} }} }},
                {{ "translation": [0.5, 0, 4], "extensions": {{ "KHR_lights_punctual": {{ "light": 2 }} }} }}
            ],
            "materials": [{{ "name": "{material}" }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "TEXCOORD_0": 1, "TANGENT": 2 }}, "indices": 3, "material": 0 }}] }}],
            {more}
            "buffers": [{{ "uri": "square.bin", "byteLength": {} }}],
            "bufferViews": [
                {{ "buffer": 0, "byteOffset": 0, "byteLength": 48 }},
                {{ "buffer": 0, "byteOffset": 48, "byteLength": 32 }},
                {{ "buffer": 0, "byteOffset": 80, "byteLength": 64 }},
                {{ "buffer": 0, "byteOffset": 144, "byteLength": 12 }}
            ],
            "accessors": [
                {{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-1, -1, 0], "max": [1, 1, 0] }},
                {{ "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" }},
                {{ "bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC4" }},
                {{ "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" }},
                {{ "bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1] }}
            ]
        }}"#,
        bytes.len()
    );
    let path = folder.join("square.gltf");
    fs::write(&path, text).unwrap();
    path
}

#[test]
fn lights_of_a_gltf_file_have_a_strength() {
    let folder = tempfile::tempdir().unwrap();
    let path = square_gltf(folder.path(), "denim", "");
    let text = fs::read_to_string(&path).unwrap();
    for wrong in ["-2.0", "1e39", "2.0, \"color\": [1, -1, 1]"] {
        fs::write(
            &path,
            text.replace("\"intensity\": 2.0", &format!("\"intensity\": {wrong}")),
        )
        .unwrap();
        let error = Scene::load(&path).unwrap_err().to_string();
        assert!(
            error.contains("the light of node 3 has an intensity or color"),
            "{error}"
        );
    }
}

#[test]
fn a_gltf_file_is_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Scene::load(&square_gltf(folder.path(), "denim", "")).unwrap();
    assert_eq!(scene.objects[0].cloth, "denim");
    assert_eq!(scene.cameras[0].name, "front");
    assert!(matches!(scene.cameras[0].lens, Lens::Perspective(fov) if (fov - 0.8).abs() < 1e-6));
    let CameraPath::Within { place, target, up } = scene.cameras[0].path else {
        panic!("{:?}", scene.cameras)
    };
    assert_eq!(
        (place.low, target, up),
        (5.0 * DVec3::Z, 4.0 * DVec3::Z, DVec3::Y)
    );
    let light = |name: &str| {
        scene
            .lights
            .iter()
            .find(|light| light.name == name)
            .unwrap()
    };
    assert!((light("bulb").strength - 2.0 / PI).abs() < 1e-6);
    assert_eq!(scene.lights.len(), 3);
    let sky = scene.lights.iter().find_map(|light| match light.source {
        LightSource::Directional(sky) => Some((sky, light.strength)),
        _ => None,
    });
    // Turned by 90° about y it shines along −x, so that it is towards +x: azimuth 90°.
    let (sky, strength) = sky.unwrap();
    assert!((sky.azimuth[0] - PI / 2.0).abs() < 1e-6 && (strength - 1.0).abs() < 1e-6);
    assert!(scene.lights.iter().any(|light| matches!(
        light.source,
        LightSource::Spot { axis, cone, .. } if axis == DVec3::NEG_Z && (cone[1] - 0.5).abs() < 1e-6
    )));
    let needs = needs(&scene);
    let poses = [scene.default_pose()];
    let [missing, all] = unforeseen(&scene, &needs, &poses);
    assert!(missing == 0 && all > 0, "{missing} of {all}");
    // The warp is upwards, so the bulb above is along it.
    let pairs = &Stage::new(&scene).pairs(&poses[0], 9, 1)["denim"];
    assert!(pairs.iter().any(|[wi, _]| wi[0] > 0.8 && wi[1].abs() < 0.3));
}

#[test]
fn a_scene_takes_what_it_does_not_say_from_gltf() {
    let folder = tempfile::tempdir().unwrap();
    let path = square_gltf(folder.path(), "Jeans", "");
    let error = Scene::load(&path).unwrap_err().to_string();
    assert!(error.contains("named like a fabric"), "{error}");
    let toml = folder.path().join("scene.toml");
    let text = "name = \"a\"\ngltf = \"square.gltf\"\nmaterials = { Jeans = \"denim\" }\n";
    fs::write(&toml, format!("{text}{LIGHT}")).unwrap();
    let scene = Scene::load(&toml).unwrap();
    assert_eq!((scene.lights.len(), scene.cameras.len()), (1, 1));
    assert_eq!(scene.objects[0].cloth, "denim");
    fs::write(&toml, text.replace("Jeans", "Jeens")).unwrap();
    let error = Scene::load(&toml).unwrap_err().to_string();
    assert!(
        error.contains("scene.toml:3") && error.contains("Jeans"),
        "{error}"
    );
    // What moves is refused.
    let animation = r#""animations": [{
        "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        "samplers": [{ "input": 4, "output": 0 }]
    }],"#;
    square_gltf(folder.path(), "denim", animation);
    let error = Scene::load(&path).unwrap_err().to_string();
    assert!(
        error.contains("moves node 0") && error.contains("turn_deg"),
        "{error}"
    );
}

/// Hills of about that many triangles.
fn hills(triangles: u32) -> Mesh {
    let side = f64::from(triangles / 2).sqrt() as u32;
    Mesh::sheet(side, side, Vec2::ONE, |u, v| {
        let height = 0.05 * ((23.0 * u + 3.0 * v).sin() + (31.0 * v).cos() * (17.0 * u * v).sin());
        [2.0 * u - 1.0, 2.0 * height, 1.0 - 2.0 * v]
    })
}

/// Run by hand, in the release profile: `cargo test --release --test picture -- --ignored --nocapture`.
#[test]
#[ignore = "it measures time"]
fn a_million_triangles_take_seconds() {
    let mut scene = Scene::load(&sample("character")).unwrap();
    scene.objects.truncate(1);
    let object = &mut scene.objects[0];
    object.mesh = hills(1_000_000).into();
    object.instances.truncate(1);
    for turn in [0.0, 0.14] {
        scene.objects[0].turn = [-turn, turn];
        let start = std::time::Instant::now();
        let analysis = scene.analyse(Progress::silent()).unwrap();
        println!("{:?} {:?}", start.elapsed(), analysis.objects);
    }
}
