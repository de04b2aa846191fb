//! `[[object]]`: a mesh, its cloth and where it is.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3, EulerRot, Vec2};
use serde::Deserialize;
use toml::Spanned;

use super::{MAX_ENTRIES, RangeToml, Reader, named, object};
use crate::fabric::{Fabric, nearest_name};
use crate::mesh::{Mesh, MeshError, MeshFile, Part, curtain, skirt, trousers};
use crate::pattern::{MAX_IMAGE_BYTES, Pattern};
use crate::scene::gltf::refuse_motion;
use crate::scene::{Albedo, Material, Object, Placement, SceneError, Sky};
use crate::text::{Exactly, Kind, MAX_TOML_BYTES, TextError, cut, listed, read_ordinary};

const BUILT_IN: &str = "curtain, trousers, skirt, sphere or square";

#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a section [[object]]")]
pub(super) struct ObjectToml {
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
#[serde(
    deny_unknown_fields,
    expecting = "{ translation, rotation_deg, scale }"
)]
struct InstanceToml {
    translation: Option<Spanned<Exactly<f64, 3>>>,
    rotation_deg: Option<Spanned<Exactly<f64, 3>>>,
    scale: Option<Spanned<f64>>,
}

impl Reader<'_> {
    pub(super) fn objects(
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
            Some(_) => Vec::new(),
            None => self.file("mesh", &raw.mesh)?.1.into_parts(),
        };
        let cloths: Vec<(String, &Spanned<String>, Mesh)> = match &raw.cloth {
            Some(cloth) if raw.materials.is_empty() => {
                let mut whole = built_in.unwrap_or_default();
                for part in parts {
                    whole.join(self.mesh("mesh", &raw.mesh, part)?);
                }
                vec![(name, cloth, whole)]
            }
            None if !raw.materials.is_empty() => {
                self.check_materials(&raw.materials, &parts, mesh)?;
                let mut cloths = Vec::new();
                for part in parts {
                    let material = part.material.clone().unwrap_or_default();
                    let named = raw
                        .materials
                        .iter()
                        .find(|(key, _)| *key.get_ref() == material);
                    if let Some((_, cloth)) = named {
                        let mesh = self.mesh("mesh", &raw.mesh, part)?;
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

    fn instance(&self, raw: &InstanceToml) -> Result<Placement, TextError> {
        let or_zero = |key: &str, value: &Option<Spanned<Exactly<f64, 3>>>| {
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
    pub(super) fn check_materials(
        &self,
        materials: &BTreeMap<Spanned<String>, Spanned<String>>,
        parts: &[Part],
        file: &str,
    ) -> Result<(), TextError> {
        let known: Vec<&str> = parts
            .iter()
            .map(|part| part.material.as_deref().unwrap_or_default())
            .collect();
        for name in materials.keys() {
            if !known.contains(&name.get_ref().as_str()) {
                let message = format!(
                    "materials: {} has no material \"{}\" on a mesh; it has {}",
                    cut(file),
                    cut(name.get_ref()),
                    listed(known.iter().copied())
                );
                return Err(self.error(name.span().start, "materials", message));
            }
        }
        Ok(())
    }

    /// A file of meshes in which nothing moves, and its path.
    pub(super) fn file(
        &self,
        key: &str,
        file: &Spanned<String>,
    ) -> Result<(PathBuf, MeshFile), SceneError> {
        let (name, at) = (file.get_ref(), file.span().start);
        let path = self.folder.join(name);
        if key == "mesh" && path.extension().is_none() {
            let message = format!(
                "mesh: \"{}\" must be {BUILT_IN}, or a file .obj, .gltf or .glb",
                cut(name)
            );
            return Err(self.error(at, key, message).into());
        }
        let extension = path.extension().unwrap_or_default().to_ascii_lowercase();
        if key == "gltf" && extension != "gltf" && extension != "glb" {
            let message = format!("gltf: {} must be a .gltf or .glb file", cut(name));
            return Err(self.error(at, key, message).into());
        }
        let read = MeshFile::read(&path).map_err(|error| self.unusable(key, file, error))?;
        refuse_motion(&path, &read)?;
        Ok((path, read))
    }

    /// The triangles of a part of a file.
    pub(super) fn mesh(
        &self,
        key: &str,
        file: &Spanned<String>,
        part: Part,
    ) -> Result<Mesh, SceneError> {
        part.into_mesh()
            .map_err(|error| self.unusable(key, file, error))
    }

    fn unusable(&self, key: &str, file: &Spanned<String>, source: MeshError) -> SceneError {
        let message = format!("{key}: {} cannot be used", cut(file.get_ref()));
        let place = self.error(file.span().start, key, message).to_string();
        SceneError::Mesh { place, source }
    }

    /// A fabric of the library, or a file beside the scene of a fabric or pattern.
    pub(super) fn material(
        &self,
        key: &str,
        name: &Spanned<String>,
    ) -> Result<Material, SceneError> {
        let (cloth, at) = (name.get_ref(), name.span().start);
        if !cloth.ends_with(".toml") {
            return match Fabric::from_library(cloth) {
                Some(fabric) => Ok(Material::Fabric(Arc::new(fabric))),
                None => {
                    let guess = nearest_name(cloth)
                        .map_or(String::new(), |name| format!("; did you mean {name}?"));
                    let message = format!(
                        "{key}: the library has no fabric \"{}\"{guess} (a file's name ends in .toml)",
                        cut(cloth)
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
        let bytes = read_ordinary(&path, MAX_TOML_BYTES as u64).map_err(unreadable)?;
        let text = String::from_utf8(bytes).map_err(|_| {
            let message = format!("{key}: {cloth} is not text");
            self.error(at, key, message)
        })?;
        let file = path.display().to_string();
        if Kind::of(text.as_bytes()) != Kind::Pattern {
            let fabric = Fabric::from_toml(&text, &file, None)?;
            return Ok(Material::Fabric(Arc::new(fabric)));
        }
        let beside = path.parent().unwrap_or(Path::new(""));
        let files = |name: &str| read_ordinary(&beside.join(name), MAX_IMAGE_BYTES as u64);
        let pattern = Pattern::from_toml(&text, &file, &files)?;
        Ok(Material::Pattern(Arc::new(pattern)))
    }
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
