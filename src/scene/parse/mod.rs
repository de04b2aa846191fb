//! TOML text to [`Scene`].

mod cameras;
mod lights;
mod objects;

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use serde::Deserialize;
use toml::Spanned;

use self::cameras::CameraToml;
use self::lights::LightToml;
use self::objects::ObjectToml;
use super::{Albedo, Material, Object, Placement, Region, Scene, SceneError, Sky, gltf};
use crate::fabric::Fabric;
use crate::mesh::{Mesh, MeshFile};
use crate::text::{Exactly, MAX_TOML_BYTES, Source, TextError, read_capped};

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

pub(super) fn load(path: &Path) -> Result<Scene, SceneError> {
    let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
    if extension == "gltf" || extension == "glb" {
        return load_gltf(path);
    }
    let file = path.display().to_string();
    let text = read_capped(path, MAX_TOML_BYTES as u64);
    let text = text.map_err(|source| SceneError::Unreadable {
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

/// The scene that a glTF file is by itself.
fn load_gltf(path: &Path) -> Result<Scene, SceneError> {
    let unusable = |source| SceneError::Mesh {
        place: path.display().to_string(),
        source,
    };
    let file = MeshFile::read(path).map_err(unusable)?;
    gltf::refuse_motion(path, &file)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let mut scene = Scene {
        name: name.clone().into_owned(),
        title: name.into_owned(),
        cameras: gltf::cameras(path, &file)?,
        lights: gltf::lights(path, &file)?,
        objects: Vec::new(),
        left_out: Vec::new(),
    };
    for part in file.into_parts() {
        let name = part.material.clone().unwrap_or_default();
        match Fabric::from_library(&name) {
            Some(fabric) => {
                let material = Material::Fabric(Arc::new(fabric));
                let mesh = part.into_mesh().map_err(unusable)?;
                scene.objects.push(object(&name, &name, material, mesh));
            }
            None => scene.left_out.push(name),
        }
    }
    match complete(&scene) {
        None => Ok(scene),
        Some(missing) => Err(SceneError::Gltf {
            file: path.to_owned(),
            message: format!(
                "{missing}; add it, or write a scene as TOML that names the file under `gltf`"
            ),
        }),
    }
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
    fn error(&self, at: usize, key: &str, message: impl Into<String>) -> TextError {
        self.source.error(at, Some(key), message.into())
    }

    fn scene(&self) -> Result<Scene, SceneError> {
        let text = self.source.text;
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
        if let Some(named) = &raw.gltf {
            let (path, file) = self.file("gltf", named)?;
            scene.cameras = gltf::cameras(&path, &file)?;
            scene.lights = gltf::lights(&path, &file)?;
            let parts = file.into_parts();
            self.check_materials(&raw.materials, &parts, named.get_ref())?;
            for part in parts {
                let name = part.material.clone().unwrap_or_default();
                let cloth = raw.materials.iter().find(|(key, _)| *key.get_ref() == name);
                let (cloth, material) = match cloth {
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
                let mesh = self.mesh("gltf", named, part)?;
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
        value: &Spanned<Exactly<f64, 3>>,
        is_direction: bool,
    ) -> Result<DVec3, TextError> {
        let Exactly(vector) = *value.get_ref();
        let vector = DVec3::from(vector);
        let is_fine = vector.is_finite() && vector.abs().max_element() <= MAX_COORDINATE;
        if is_fine && (!is_direction || vector.length() > 1e-9) {
            return Ok(vector);
        }
        let length = if is_direction { ", and not be 0" } else { "" };
        let message = format!(
            "{key} = {:?} must lie within ±1e9{length}",
            vector.to_array()
        );
        Err(self.error(value.span().start, key, message))
    }

    /// A range whose ends are `valid` and in order.
    fn range(
        &self,
        key: &str,
        value: &Spanned<RangeToml>,
        valid: impl Fn(f64) -> bool,
        must: &str,
    ) -> Result<[f64; 2], TextError> {
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
    ) -> Result<Sky, TextError> {
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
        from: &Spanned<Exactly<f64, 3>>,
        to: Option<&Spanned<Exactly<f64, 3>>>,
    ) -> Result<Region, TextError> {
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
}

fn named(name: Option<&String>, kind: &str, index: usize) -> String {
    name.cloned()
        .unwrap_or_else(|| format!("{kind} {}", index + 1))
}
