//! What glTF files say of cameras and lights.

use std::f64::consts::PI;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use glam::{DMat4, DVec3, Mat4};
use gltf::animation::Property;
use gltf::camera::Projection;
use gltf::khr_lights_punctual::Kind;

use super::{Camera, CameraPath, Lens, Light, LightSource, Region, SceneError, Sky};
use crate::render::MAX_MESH_BYTES;

/// Cameras and lights of a file.
pub(super) struct Document {
    pub(super) cameras: Vec<Camera>,
    pub(super) lights: Vec<Light>,
}

impl Document {
    /// Reads a file of which nothing moves.
    pub(super) fn read(path: &Path) -> Result<Self, SceneError> {
        let document = open(path)?;
        check_still(path, &document)?;
        let (mut cameras, mut lights) = (Vec::new(), Vec::new());
        let scene = document
            .default_scene()
            .or_else(|| document.scenes().next());
        let mut open: Vec<(gltf::Node<'_>, DMat4)> = scene
            .iter()
            .flat_map(|scene| scene.nodes())
            .map(|node| (node, DMat4::IDENTITY))
            .collect();
        while let Some((node, parent)) = open.pop() {
            let own = Mat4::from_cols_array_2d(&node.transform().matrix());
            let place = parent * own.as_dmat4();
            open.extend(node.children().map(|child| (child, place)));
            let position = place.transform_point3(DVec3::ZERO);
            let axis = |axis: DVec3| place.transform_vector3(axis).try_normalize();
            let name = |own: Option<&str>, kind: &str, count: usize| {
                let name = own.or(node.name()).map(str::to_owned);
                name.unwrap_or_else(|| format!("{kind} {}", count + 1))
            };
            let flat = || SceneError::Gltf {
                file: path.to_owned(),
                message: format!(
                    "node {} scales a camera or light to nothing; remove the scale",
                    node.index()
                ),
            };
            if let Some(camera) = node.camera() {
                let lens = match camera.projection() {
                    Projection::Perspective(lens) => Lens::Perspective(lens.yfov().into()),
                    Projection::Orthographic(lens) => {
                        Lens::Orthographic(2.0 * f64::from(lens.ymag()))
                    }
                };
                let is_fine = match lens {
                    Lens::Perspective(fov) => fov > 0.0 && fov < PI,
                    Lens::Orthographic(height) => height > 0.0 && height.is_finite(),
                };
                if !is_fine {
                    return Err(SceneError::Gltf {
                        file: path.to_owned(),
                        message: format!(
                            "camera {} has a yfov or ymag out of range",
                            camera.index()
                        ),
                    });
                }
                cameras.push(Camera {
                    name: name(camera.name(), "camera", cameras.len()),
                    lens,
                    path: CameraPath::Within {
                        place: Region::point(position),
                        // It looks along −z.
                        target: position + axis(DVec3::NEG_Z).ok_or_else(flat)?,
                        up: axis(DVec3::Y).ok_or_else(flat)?,
                    },
                });
            }
            if let Some(light) = node.light() {
                let [r, g, b] = light.color().map(f64::from);
                let place = Region::point(position);
                // It shines along −z.
                let shines = axis(DVec3::NEG_Z).ok_or_else(flat)?;
                let source = match light.kind() {
                    Kind::Directional => LightSource::Directional(Sky::direction(-shines)),
                    Kind::Point => LightSource::Point {
                        place,
                        distance: 1.0,
                    },
                    Kind::Spot {
                        inner_cone_angle,
                        outer_cone_angle,
                    } => LightSource::Spot {
                        place,
                        distance: 1.0,
                        axis: shines,
                        cone: [inner_cone_angle, outer_cone_angle].map(f64::from),
                    },
                };
                lights.push(Light {
                    name: name(light.name(), "light", lights.len()),
                    // lx, and cd at a distance of 1; candela and lumens count like watts.
                    strength: (f64::from(light.intensity()) * (r + g + b) / 3.0 / PI).max(0.0),
                    source,
                });
            }
        }
        Ok(Self { cameras, lights })
    }
}

/// That nothing in the file moves: what does would be left out, unnoticed.
pub(super) fn refuse_animation(path: &Path) -> Result<(), SceneError> {
    check_still(path, &open(path)?)
}

fn check_still(path: &Path, document: &gltf::Document) -> Result<(), SceneError> {
    let wrong = |message: String| SceneError::Gltf {
        file: path.to_owned(),
        message,
    };
    let remedy = "export it in one pose without animation, and say in a scene as TOML how far it moves: turn_deg and sway of an object, ranges of cameras and lights";
    for animation in document.animations() {
        if let Some(channel) = animation.channels().next() {
            let target = channel.target();
            let what = match target.property() {
                Property::Translation => "moves",
                Property::Rotation => "turns",
                Property::Scale => "scales",
                Property::MorphTargetWeights => "morphs",
            };
            let node = target.node();
            let name = node.name().unwrap_or_default();
            let message = format!(
                "an animation {what} node {} \"{name}\", which is not looked at; {remedy}",
                node.index()
            );
            return Err(wrong(message));
        }
    }
    if document.skins().next().is_some() {
        let message = format!("it has a skin, which is not looked at; {remedy}");
        return Err(wrong(message));
    }
    Ok(())
}

fn open(path: &Path) -> Result<gltf::Document, SceneError> {
    let unreadable = |source| SceneError::Unreadable {
        place: "glTF".to_owned(),
        file: path.to_owned(),
        source,
    };
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(MAX_MESH_BYTES + 1).read_to_end(&mut bytes))
        .map_err(unreadable)?;
    let document = gltf::Gltf::from_slice(&bytes).map_err(|error| SceneError::Gltf {
        file: path.to_owned(),
        message: format!("it is no glTF file that can be read: {error}"),
    })?;
    Ok(document.document)
}
