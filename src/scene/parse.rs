//! TOML text to [`Scene`].

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3, EulerRot, Vec2};
use serde::Deserialize;
use toml::Spanned;

use super::gltf::{self, Document};
use super::{
    Albedo, Camera, CameraPath, Lens, Light, LightSource, Material, Object, Placement, Region,
    Scene, SceneError, Sky,
};
use crate::fabric::source::Source;
use crate::fabric::{Fabric, FabricError, MAX_TOML_BYTES, nearest_name};
use crate::pattern::{MAX_IMAGE_BYTES, Pattern};
use crate::render::{Mesh, Part, curtain, load_parts, skirt, trousers};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneToml {
    name: Spanned<String>,
    #[serde(default)]
    title: String,
    gltf: Option<Spanned<String>>,
    #[serde(default)]
    materials: BTreeMap<Spanned<String>, Spanned<String>>,
    #[serde(default)]
    camera: Vec<Spanned<CameraToml>>,
    #[serde(default)]
    light: Vec<Spanned<LightToml>>,
    #[serde(default)]
    object: Vec<Spanned<ObjectToml>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CameraToml {
    name: Option<String>,
    target: Spanned<[f64; 3]>,
    position: Option<Spanned<[f64; 3]>>,
    position_to: Option<Spanned<[f64; 3]>>,
    up: Option<Spanned<[f64; 3]>>,
    distance: Option<Spanned<RangeToml>>,
    azimuth_deg: Option<Spanned<RangeToml>>,
    elevation_deg: Option<Spanned<RangeToml>>,
    fov_deg: Option<Spanned<f64>>,
    height: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LightToml {
    name: Option<String>,
    kind: Spanned<String>,
    strength: Option<Spanned<f64>>,
    direction: Option<Spanned<[f64; 3]>>,
    azimuth_deg: Option<Spanned<RangeToml>>,
    elevation_deg: Option<Spanned<RangeToml>>,
    position: Option<Spanned<[f64; 3]>>,
    position_to: Option<Spanned<[f64; 3]>>,
    distance: Option<Spanned<f64>>,
    inner_deg: Option<Spanned<f64>>,
    outer_deg: Option<Spanned<f64>>,
    above_deg: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectToml {
    name: Option<String>,
    mesh: Spanned<String>,
    cloth: Option<Spanned<String>>,
    #[serde(default)]
    materials: BTreeMap<Spanned<String>, Spanned<String>>,
    #[serde(default)]
    instances: Vec<InstanceToml>,
    turn_deg: Option<Spanned<RangeToml>>,
    sway: Option<Spanned<f64>>,
    repeats: Option<Spanned<f64>>,
    #[serde(default)]
    albedo: Albedo,
    max_error: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InstanceToml {
    translation: Option<Spanned<[f64; 3]>>,
    rotation_deg: Option<Spanned<[f64; 3]>>,
    scale: Option<Spanned<f64>>,
}

/// A number, or from where to where.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "expected a number, or a range as [from, to]")]
enum RangeToml {
    One(f64),
    Range([f64; 2]),
}

/// More than any scene has; keeps hostile files cheap.
const MAX_ENTRIES: usize = 4096;
const MAX_COORDINATE: f64 = 1e9;
const LENGTHS: std::ops::RangeInclusive<f64> = 1e-9..=1e9;
const MUST_BE_LENGTH: &str = "lie between 1e-9 and 1e9";
const BUILT_IN: &str = "curtain, trousers, skirt, sphere or square";

pub(super) fn load(path: &Path) -> Result<Scene, SceneError> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if extension == "gltf" || extension == "glb" {
        let document = Document::read(path)?;
        let place = path.display().to_string();
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let mut scene = Scene {
            name: name.clone().into_owned(),
            title: name.into_owned(),
            cameras: document.cameras,
            lights: document.lights,
            objects: Vec::new(),
            left_out: Vec::new(),
        };
        let parts = load_parts(path).map_err(|source| SceneError::Mesh { place, source })?;
        for Part { material, mesh } in parts {
            let name = material.unwrap_or_default();
            match Fabric::from_library(&name) {
                Some(fabric) => {
                    let material = Material::Fabric(Arc::new(fabric));
                    scene.objects.push(object(&name, &name, material, mesh));
                }
                None => scene.left_out.push(name),
            }
        }
        let wrong = |message: &str| SceneError::Gltf {
            file: path.to_owned(),
            message: message.to_owned(),
        };
        return match complete(&scene) {
            None => Ok(scene),
            Some(missing) => Err(wrong(&format!(
                "{missing}; add it, or write a scene as TOML that names the file under `gltf`"
            ))),
        };
    }
    let file = path.display().to_string();
    let text = read(path, MAX_TOML_BYTES as u64 + 1).map_err(|source| SceneError::Unreadable {
        place: "scene".to_owned(),
        file: path.to_owned(),
        source,
    })?;
    let not_text = || Source {
        file: &file,
        text: "",
    };
    let text = String::from_utf8(text)
        .map_err(|_| not_text().error(0, None, "it is not text".to_owned()))?;
    let reader = Reader {
        source: Source {
            file: &file,
            text: &text,
        },
        folder: path.parent().unwrap_or(Path::new("")),
    };
    reader.scene()
}

/// What a scene lacks.
fn complete(scene: &Scene) -> Option<&'static str> {
    if scene.objects.is_empty() {
        Some("it has no mesh whose material is named like a fabric of the library")
    } else if scene.cameras.is_empty() {
        Some("it has no camera")
    } else if scene.lights.is_empty() {
        Some("it has no light")
    } else {
        None
    }
}

fn read(path: &Path, most: u64) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(most).read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// An object in one place, that does not move.
fn object(name: &str, cloth: &str, material: Material, mesh: Mesh) -> Object {
    Object {
        name: name.to_owned(),
        cloth: cloth.to_owned(),
        material,
        mesh: Arc::new(mesh),
        instances: vec![Placement::IDENTITY],
        turn: [0.0; 2],
        sway: 0.0,
        repeats: 1.0,
        albedo: Albedo::default(),
        max_error: None,
    }
}

/// A scene's text, and where what it names is.
struct Reader<'a> {
    source: Source<'a>,
    folder: &'a Path,
}

impl Reader<'_> {
    fn error(&self, at: usize, key: &str, message: impl Into<String>) -> FabricError {
        self.source.error(at, Some(key), message.into())
    }

    fn scene(&self) -> Result<Scene, SceneError> {
        let text = self.source.text;
        if text.len() > MAX_TOML_BYTES {
            let message = format!("it has more than the {MAX_TOML_BYTES} bytes of any scene");
            return Err(self.source.error(0, None, message).into());
        }
        let raw: SceneToml =
            toml::from_str(text).map_err(|error| self.source.syntax_error(&error))?;
        let name = self
            .source
            .name("name", raw.name.get_ref(), raw.name.span().start)?;
        for (key, count) in [
            ("camera", raw.camera.len()),
            ("light", raw.light.len()),
            ("object", raw.object.len()),
        ] {
            if count > MAX_ENTRIES {
                let message = format!("{key}: {count} are more than any scene has ({MAX_ENTRIES})");
                return Err(self.error(0, key, message).into());
            }
        }
        let mut scene = Scene {
            title: if raw.title.is_empty() {
                name.clone()
            } else {
                raw.title
            },
            name,
            cameras: Vec::new(),
            lights: Vec::new(),
            objects: Vec::new(),
            left_out: Vec::new(),
        };
        if let Some(file) = &raw.gltf {
            let (path, parts) = self.parts("gltf", file)?;
            let document = Document::read(&path)?;
            scene.cameras = document.cameras;
            scene.lights = document.lights;
            self.check_materials(&raw.materials, &parts, file.get_ref())?;
            for Part { material, mesh } in parts {
                let name = material.unwrap_or_default();
                let named = raw.materials.iter().find(|(key, _)| *key.get_ref() == name);
                let (cloth, material) = match named {
                    Some((_, cloth)) => {
                        (cloth.get_ref().clone(), self.material("materials", cloth)?)
                    }
                    None => match Fabric::from_library(&name) {
                        Some(fabric) => (name.clone(), Material::Fabric(Arc::new(fabric))),
                        None => {
                            scene.left_out.push(name);
                            continue;
                        }
                    },
                };
                scene.objects.push(object(&name, &cloth, material, mesh));
            }
        } else if let Some((key, _)) = raw.materials.first_key_value() {
            let message = "materials: these are of the file under `gltf`, which is not given; an object has materials of its own";
            return Err(self.error(key.span().start, "materials", message).into());
        }
        // What the text has takes the place of what the glTF file has.
        if !raw.camera.is_empty() {
            let cameras = raw.camera.iter().enumerate();
            scene.cameras = cameras
                .map(|(index, raw)| self.camera(index, raw))
                .collect::<Result<_, _>>()?;
        }
        if !raw.light.is_empty() {
            let lights = raw.light.iter().enumerate();
            scene.lights = lights
                .map(|(index, raw)| self.light(index, raw))
                .collect::<Result<_, _>>()?;
        }
        for (index, raw) in raw.object.iter().enumerate() {
            self.objects(index, raw, &mut scene.objects)?;
        }
        for (key, is_missing, message) in [
            (
                "camera",
                scene.cameras.is_empty(),
                "camera: a scene needs one, under [[camera]]",
            ),
            (
                "light",
                scene.lights.is_empty(),
                "light: a scene needs one, under [[light]]",
            ),
            (
                "object",
                scene.objects.is_empty(),
                "object: a scene needs one with cloth, under [[object]]",
            ),
        ] {
            if is_missing {
                return Err(self.error(0, key, message).into());
            }
        }
        let mut known: BTreeMap<&str, &Fabric> = BTreeMap::new();
        for fabric in scene
            .objects
            .iter()
            .flat_map(|object| object.material.bakes())
        {
            if !known
                .entry(&fabric.name)
                .or_insert(fabric)
                .is_dyed_like(fabric)
            {
                let message = format!(
                    "cloth: two fabrics that differ are called \"{}\"; rename one of them",
                    fabric.name
                );
                return Err(self.error(0, "cloth", message).into());
            }
        }
        Ok(scene)
    }

    /// A vector, which must be longer than 0 if it is a direction.
    fn vector(
        &self,
        key: &str,
        value: &Spanned<[f64; 3]>,
        is_direction: bool,
    ) -> Result<DVec3, FabricError> {
        let vector = DVec3::from(*value.get_ref());
        let is_fine = vector.is_finite() && vector.abs().max_element() <= MAX_COORDINATE;
        if is_fine && (!is_direction || vector.length() > 1e-9) {
            return Ok(vector);
        }
        let length = if is_direction { ", and not be 0" } else { "" };
        let message = format!("{key} = {:?} must lie within ±1e9{length}", value.get_ref());
        Err(self.error(value.span().start, key, message))
    }

    /// A range whose ends are `valid` and in order.
    fn range(
        &self,
        key: &str,
        value: &Spanned<RangeToml>,
        valid: impl Fn(f64) -> bool,
        must: &str,
    ) -> Result<[f64; 2], FabricError> {
        let range = match *value.get_ref() {
            RangeToml::One(x) => [x; 2],
            RangeToml::Range(range) => range,
        };
        let at = value.span().start;
        if let Some(x) = range.into_iter().find(|x| !(x.is_finite() && valid(*x))) {
            return Err(self.error(at, key, format!("{key} = {x:?} must {must}")));
        }
        if range[0] > range[1] {
            let message = format!("{key} = {range:?} must not end before it begins");
            return Err(self.error(at, key, message));
        }
        Ok(range)
    }

    fn sky(
        &self,
        azimuth: Option<&Spanned<RangeToml>>,
        elevation: Option<&Spanned<RangeToml>>,
    ) -> Result<Sky, FabricError> {
        let azimuth = match azimuth {
            None => [0.0; 2],
            Some(value) => {
                let within = |x: f64| x.abs() <= 720.0;
                let range = self.range("azimuth_deg", value, within, "lie between -720 and 720")?;
                if range[1] - range[0] > 360.0 {
                    let message = format!("azimuth_deg = {range:?} must not span more than 360");
                    return Err(self.error(value.span().start, "azimuth_deg", message));
                }
                range
            }
        };
        let elevation = match elevation {
            None => [0.0; 2],
            Some(value) => {
                let within = |x: f64| x.abs() <= 90.0;
                self.range("elevation_deg", value, within, "lie between -90 and 90")?
            }
        };
        Ok(Sky {
            azimuth: azimuth.map(f64::to_radians),
            elevation: elevation.map(f64::to_radians),
        })
    }

    /// The box between two corners, or a point.
    fn region(
        &self,
        from: &Spanned<[f64; 3]>,
        to: Option<&Spanned<[f64; 3]>>,
    ) -> Result<Region, FabricError> {
        let from = self.vector("position", from, false)?;
        let to = match to {
            Some(to) => self.vector("position_to", to, false)?,
            None => from,
        };
        Ok(Region {
            low: from.min(to),
            high: from.max(to),
        })
    }

    fn camera(&self, index: usize, entry: &Spanned<CameraToml>) -> Result<Camera, SceneError> {
        let (raw, at) = (entry.get_ref(), entry.span().start);
        let target = self.vector("target", &raw.target, false)?;
        let lens = match (&raw.fov_deg, &raw.height) {
            (Some(fov), None) => {
                let valid = |x: f64| (0.01..=170.0).contains(&x);
                let fov = self
                    .source
                    .number("fov_deg", fov, valid, "lie between 0.01 and 170")?;
                Lens::Perspective(fov.to_radians())
            }
            (None, Some(height)) => {
                let valid = |x: f64| LENGTHS.contains(&x);
                Lens::Orthographic(
                    self.source
                        .number("height", height, valid, MUST_BE_LENGTH)?,
                )
            }
            _ => {
                let message =
                    "camera: it needs either fov_deg (perspective) or height (orthographic)";
                return Err(self.error(at, "camera", message).into());
            }
        };
        let path = match (&raw.position, &raw.distance) {
            (Some(position), None) => {
                if raw.azimuth_deg.is_some() || raw.elevation_deg.is_some() {
                    let message = "camera: azimuth_deg and elevation_deg are of one that orbits, which has a distance instead of a position";
                    return Err(self.error(at, "camera", message).into());
                }
                let place = self.region(position, raw.position_to.as_ref())?;
                let up = match &raw.up {
                    Some(up) => self.vector("up", up, true)?,
                    None => DVec3::Y,
                };
                if place.low == place.high && place.low == target {
                    let message = "target: it must not be the camera's position";
                    return Err(self
                        .error(raw.target.span().start, "target", message)
                        .into());
                }
                CameraPath::Within { place, target, up }
            }
            (None, Some(distance)) => {
                if raw.position_to.is_some() || raw.up.is_some() {
                    let message = "camera: position_to and up are of one that has a position, not of one that orbits";
                    return Err(self.error(at, "camera", message).into());
                }
                CameraPath::Orbit {
                    target,
                    distance: self.range(
                        "distance",
                        distance,
                        |x| LENGTHS.contains(&x),
                        MUST_BE_LENGTH,
                    )?,
                    sky: self.sky(raw.azimuth_deg.as_ref(), raw.elevation_deg.as_ref())?,
                }
            }
            _ => {
                let message = "camera: it needs either a position, or a distance from the target that it orbits";
                return Err(self.error(at, "camera", message).into());
            }
        };
        Ok(Camera {
            name: named(raw.name.as_ref(), "camera", index),
            lens,
            path,
        })
    }

    fn light(&self, index: usize, entry: &Spanned<LightToml>) -> Result<Light, SceneError> {
        let (raw, at) = (entry.get_ref(), entry.span().start);
        let kind = raw.kind.get_ref().as_str();
        // What each kind takes, besides name and strength.
        let taken: &[&str] = match kind {
            "directional" => &["direction", "azimuth_deg", "elevation_deg"],
            "point" => &["position", "position_to", "distance"],
            "spot" => &[
                "position",
                "position_to",
                "distance",
                "direction",
                "inner_deg",
                "outer_deg",
            ],
            "environment" => &["above_deg"],
            "collocated" => &[],
            _ => {
                let message = format!(
                    "kind: \"{kind}\" must be directional, point, spot, environment or collocated"
                );
                return Err(self.error(raw.kind.span().start, "kind", message).into());
            }
        };
        let given = [
            ("direction", raw.direction.is_some()),
            ("azimuth_deg", raw.azimuth_deg.is_some()),
            ("elevation_deg", raw.elevation_deg.is_some()),
            ("position", raw.position.is_some()),
            ("position_to", raw.position_to.is_some()),
            ("distance", raw.distance.is_some()),
            ("inner_deg", raw.inner_deg.is_some()),
            ("outer_deg", raw.outer_deg.is_some()),
            ("above_deg", raw.above_deg.is_some()),
        ];
        for (key, is_given) in given {
            if is_given && !taken.contains(&key) {
                let message = format!("{key}: a light of kind \"{kind}\" has none; remove it");
                return Err(self.error(at, key, message).into());
            }
        }
        let missing = |key: &str, what: &str| {
            let message = format!("{key}: a light of kind \"{kind}\" needs {what}");
            self.error(at, key, message)
        };
        let strength = match &raw.strength {
            Some(strength) => {
                let valid = |x: f64| (0.0..=1e9).contains(&x);
                self.source
                    .number("strength", strength, valid, "lie between 0 and 1e9")?
            }
            None => 1.0,
        };
        let degrees = |key: &str, value: &Spanned<f64>, [low, high]: [f64; 2]| {
            let valid = |x: f64| (low..=high).contains(&x);
            let must = format!("lie between {low} and {high}");
            let degrees = self.source.number(key, value, valid, &must);
            degrees.map(f64::to_radians)
        };
        let distance = match &raw.distance {
            Some(distance) => {
                let valid = |x: f64| LENGTHS.contains(&x);
                self.source
                    .number("distance", distance, valid, MUST_BE_LENGTH)?
            }
            None => 1.0,
        };
        let place = || {
            let position = raw.position.as_ref();
            let position = position.ok_or_else(|| missing("position", "a position"))?;
            self.region(position, raw.position_to.as_ref())
        };
        let source = match kind {
            "directional" => match (&raw.direction, &raw.elevation_deg) {
                (Some(direction), None) if raw.azimuth_deg.is_none() => LightSource::Directional(
                    Sky::direction(self.vector("direction", direction, true)?),
                ),
                (None, Some(elevation)) => {
                    LightSource::Directional(self.sky(raw.azimuth_deg.as_ref(), Some(elevation))?)
                }
                _ => {
                    let what = "either a direction towards it, or azimuth_deg and elevation_deg";
                    return Err(missing("direction", what).into());
                }
            },
            "point" => LightSource::Point {
                place: place()?,
                distance,
            },
            "spot" => {
                let direction = raw.direction.as_ref();
                let direction = direction
                    .ok_or_else(|| missing("direction", "a direction in which it shines"))?;
                let outer = raw.outer_deg.as_ref();
                let outer =
                    outer.ok_or_else(|| missing("outer_deg", "the half angle of its cone"))?;
                let outer = degrees("outer_deg", outer, [0.01, 90.0])?;
                let inner = match &raw.inner_deg {
                    Some(inner) => degrees("inner_deg", inner, [0.0, outer.to_degrees()])?,
                    None => 0.8 * outer,
                };
                LightSource::Spot {
                    place: place()?,
                    distance,
                    axis: self.vector("direction", direction, true)?.normalize(),
                    cone: [inner, outer],
                }
            }
            "environment" => LightSource::Environment(match &raw.above_deg {
                Some(above) => degrees("above_deg", above, [-90.0, 89.0])?,
                None => -0.25 * TAU,
            }),
            _ => LightSource::Collocated,
        };
        Ok(Light {
            name: named(raw.name.as_ref(), "light", index),
            strength,
            source,
        })
    }

    fn objects(
        &self,
        index: usize,
        entry: &Spanned<ObjectToml>,
        objects: &mut Vec<Object>,
    ) -> Result<(), SceneError> {
        let (raw, at) = (entry.get_ref(), entry.span().start);
        let name = named(raw.name.as_ref(), "object", index);
        let mesh = raw.mesh.get_ref();
        let built_in = match mesh.as_str() {
            "curtain" => Some(curtain()),
            "trousers" => Some(trousers()),
            "skirt" => Some(skirt()),
            "sphere" => Some(sphere()),
            "square" => Some(square()),
            _ => None,
        };
        let parts = match built_in {
            Some(mesh) => vec![Part {
                material: None,
                mesh,
            }],
            None => self.parts("mesh", &raw.mesh)?.1,
        };
        let cloths: Vec<(String, &Spanned<String>, Mesh)> = match &raw.cloth {
            Some(cloth) if raw.materials.is_empty() => {
                let mut whole = Mesh::default();
                for part in parts {
                    whole.join(part.mesh);
                }
                vec![(name, cloth, whole)]
            }
            None if !raw.materials.is_empty() => {
                self.check_materials(&raw.materials, &parts, mesh)?;
                let mut cloths = Vec::new();
                for Part { material, mesh } in parts {
                    let material = material.unwrap_or_default();
                    let named = raw
                        .materials
                        .iter()
                        .find(|(key, _)| *key.get_ref() == material);
                    if let Some((_, cloth)) = named {
                        cloths.push((format!("{name} {material}"), cloth, mesh));
                    }
                }
                cloths
            }
            _ => {
                let message = "cloth: an object needs either a cloth, or materials of its file with a cloth for each";
                return Err(self.error(at, "cloth", message).into());
            }
        };
        let instances = raw.instances.iter().map(|raw| self.instance(raw));
        let mut instances: Vec<Placement> = instances.collect::<Result<_, _>>()?;
        if instances.is_empty() {
            instances.push(Placement::IDENTITY);
        }
        if instances.len() > MAX_ENTRIES {
            let message = format!("instances: more than any scene has ({MAX_ENTRIES})");
            return Err(self.error(at, "instances", message).into());
        }
        let turn = match &raw.turn_deg {
            Some(turn) => {
                let within = |x: f64| x.abs() <= 360.0;
                self.range("turn_deg", turn, within, "lie between -360 and 360")?
                    .map(f64::to_radians)
            }
            None => [0.0; 2],
        };
        let number = |key: &str, value: &Option<Spanned<f64>>, range: [f64; 2], default: f64| {
            let valid = |x: f64| (range[0]..=range[1]).contains(&x);
            let must = format!("lie between {} and {}", range[0], range[1]);
            let value = value.as_ref();
            value.map_or(Ok(default), |x| self.source.number(key, x, valid, &must))
        };
        let sway = number("sway", &raw.sway, [0.0, 1e9], 0.0)?;
        let repeats = number("repeats", &raw.repeats, [1e-9, 1e9], 1.0)?;
        let max_error = match &raw.max_error {
            Some(_) => Some(number("max_error", &raw.max_error, [1e-6, 1.0], 0.0)?),
            None => None,
        };
        for (name, cloth, mesh) in cloths {
            objects.push(Object {
                instances: instances.clone(),
                turn,
                sway,
                repeats,
                albedo: raw.albedo,
                max_error,
                ..object(&name, cloth.get_ref(), self.material("cloth", cloth)?, mesh)
            });
        }
        Ok(())
    }

    fn instance(&self, raw: &InstanceToml) -> Result<Placement, FabricError> {
        let or_zero = |key: &str, value: &Option<Spanned<[f64; 3]>>| {
            let value = value.as_ref();
            value.map_or(Ok(DVec3::ZERO), |value| self.vector(key, value, false))
        };
        let [x, y, z] = or_zero("rotation_deg", &raw.rotation_deg)?
            .to_array()
            .map(f64::to_radians);
        let valid = |x: f64| (1e-6..=1e6).contains(&x);
        let scale = raw.scale.as_ref();
        Ok(Placement {
            scale: scale.map_or(Ok(1.0), |scale| {
                self.source
                    .number("scale", scale, valid, "lie between 1e-6 and 1e6")
            })?,
            // About x, then y, then z, the scene's axes.
            rotation: DQuat::from_euler(EulerRot::ZYX, z, y, x),
            translation: or_zero("translation", &raw.translation)?,
        })
    }

    /// That every material that is named is in the file.
    fn check_materials(
        &self,
        materials: &BTreeMap<Spanned<String>, Spanned<String>>,
        parts: &[Part],
        file: &str,
    ) -> Result<(), FabricError> {
        let known: Vec<&str> = parts
            .iter()
            .map(|part| part.material.as_deref().unwrap_or_default())
            .collect();
        for name in materials.keys() {
            if !known.contains(&name.get_ref().as_str()) {
                let message = format!(
                    "materials: {file} has no material \"{}\" on a mesh; it has {known:?}",
                    name.get_ref()
                );
                return Err(self.error(name.span().start, "materials", message));
            }
        }
        Ok(())
    }

    /// The meshes of a file by their materials, and its path.
    fn parts(&self, key: &str, file: &Spanned<String>) -> Result<(PathBuf, Vec<Part>), SceneError> {
        let (name, at) = (file.get_ref(), file.span().start);
        let path = self.folder.join(name);
        let place = |message: String| self.error(at, key, message).to_string();
        if key == "mesh" && path.extension().is_none() {
            let message =
                format!("mesh: \"{name}\" must be {BUILT_IN}, or a file .obj, .gltf or .glb");
            return Err(self.error(at, key, message).into());
        }
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if extension == "gltf" || extension == "glb" {
            gltf::refuse_animation(&path)?;
        } else if key == "gltf" {
            let message = format!("gltf: {name} must be a .gltf or .glb file");
            return Err(self.error(at, key, message).into());
        }
        let parts = load_parts(&path).map_err(|source| SceneError::Mesh {
            place: place(format!("{key}: {name} cannot be used")),
            source,
        })?;
        Ok((path, parts))
    }

    /// A fabric of the library, or a file beside the scene of a fabric or pattern.
    fn material(&self, key: &str, name: &Spanned<String>) -> Result<Material, SceneError> {
        let (cloth, at) = (name.get_ref(), name.span().start);
        if !cloth.ends_with(".toml") {
            return match Fabric::from_library(cloth) {
                Some(fabric) => Ok(Material::Fabric(Arc::new(fabric))),
                None => {
                    let guess = nearest_name(cloth)
                        .map_or(String::new(), |name| format!("; did you mean {name}?"));
                    let message = format!(
                        "{key}: the library has no fabric \"{cloth}\"{guess} (a file's name ends in .toml)"
                    );
                    Err(self.error(at, key, message).into())
                }
            };
        }
        let path = self.folder.join(cloth);
        let unreadable = |source: std::io::Error| SceneError::Unreadable {
            place: self.error(at, key, key.to_owned()).to_string(),
            file: path.clone(),
            source,
        };
        let bytes = read(&path, MAX_TOML_BYTES as u64 + 1).map_err(unreadable)?;
        let text = String::from_utf8(bytes).map_err(|_| {
            let message = format!("{key}: {cloth} is not text");
            self.error(at, key, message)
        })?;
        let file = path.display().to_string();
        // A pattern has materials, a fabric has threads.
        let is_pattern =
            toml::from_str::<toml::Table>(&text).is_ok_and(|table| table.contains_key("material"));
        if !is_pattern {
            let fabric = Fabric::from_toml(&text, &file, None)?;
            return Ok(Material::Fabric(Arc::new(fabric)));
        }
        let beside = path.parent().unwrap_or(Path::new(""));
        let files = |name: &str| read(&beside.join(name), MAX_IMAGE_BYTES as u64 + 1);
        let pattern = Pattern::from_toml(&text, &file, &files)?;
        Ok(Material::Pattern(Arc::new(pattern)))
    }
}

fn named(name: Option<&String>, kind: &str, index: usize) -> String {
    name.cloned()
        .unwrap_or_else(|| format!("{kind} {}", index + 1))
}

/// A square in the plane z = 0 from −1 to 1, its warp upwards.
fn square() -> Mesh {
    Mesh::sheet(8, 8, Vec2::splat(2.0), |u, v| {
        [1.0 - 2.0 * v, 2.0 * u - 1.0, 0.0]
    })
}

/// A sphere of radius 1, its warp along meridians; a little is open around the poles.
fn sphere() -> Mesh {
    const OPEN: f64 = 0.02;
    Mesh::sheet(128, 256, Vec2::new(PI as f32, TAU as f32), |u, v| {
        let elevation = (0.5 - OPEN / TAU) * TAU * (u - 0.5);
        let azimuth = -TAU * v;
        Sky::at(azimuth, elevation).to_array()
    })
}
