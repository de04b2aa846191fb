//! What glTF files say of cameras and lights.

use std::f64::consts::PI;
use std::path::Path;

use glam::{DMat4, DVec3};

use super::{Camera, CameraPath, Lens, Light, LightSource, Region, SceneError, Sky};
use crate::mesh::{MeshFile, Projection, Punctual};

/// That nothing in the file moves: what does would be left out, unnoticed.
pub(super) fn refuse_motion(path: &Path, file: &MeshFile) -> Result<(), SceneError> {
    let Some(motion) = file.motion() else {
        return Ok(());
    };
    let remedy = "export it in one pose without animation, and say in a scene as TOML how far it moves: turn_deg and sway of an object, ranges of cameras and lights";
    Err(SceneError::Gltf {
        file: path.to_owned(),
        message: format!("{motion}, which is not supported; {remedy}"),
    })
}

/// The cameras of a file.
pub(super) fn cameras(path: &Path, file: &MeshFile) -> Result<Vec<Camera>, SceneError> {
    let cameras = file.cameras().iter().enumerate();
    cameras
        .map(|(count, camera)| {
            let [index, node] = camera.index;
            let lens = match camera.projection {
                Projection::Perspective(fov) => Lens::Perspective(fov.into()),
                Projection::Orthographic(half) => Lens::Orthographic(2.0 * f64::from(half)),
            };
            let is_fine = match lens {
                Lens::Perspective(fov) => fov > 0.0 && fov < PI,
                Lens::Orthographic(height) => height > 0.0 && height.is_finite(),
            };
            if !is_fine {
                return Err(SceneError::Gltf {
                    file: path.to_owned(),
                    message: format!("camera {index} has a yfov or ymag out of range"),
                });
            }
            let position = camera.place.transform_point3(DVec3::ZERO);
            let axis = |axis| axis_of(&camera.place, axis, path, node);
            Ok(Camera {
                name: named(&camera.name, "camera", count),
                lens,
                path: CameraPath::Within {
                    place: Region::point(position),
                    // It looks along −z.
                    target: position + axis(DVec3::NEG_Z)?,
                    up: axis(DVec3::Y)?,
                },
            })
        })
        .collect()
}

/// The lights of a file.
pub(super) fn lights(path: &Path, file: &MeshFile) -> Result<Vec<Light>, SceneError> {
    let lights = file.lights().iter().enumerate();
    lights
        .map(|(count, light)| {
            let [r, g, b] = light.color.map(f64::from);
            let strength = f64::from(light.intensity);
            let is_fine = |x: f64| x >= 0.0 && x.is_finite();
            if ![strength, r, g, b].into_iter().all(is_fine) {
                return Err(SceneError::Gltf {
                    file: path.to_owned(),
                    message: format!(
                        "the light of node {} has an intensity or color that is negative or infinite",
                        light.node
                    ),
                });
            }
            let place = Region::point(light.place.transform_point3(DVec3::ZERO));
            // It shines along −z.
            let shines = axis_of(&light.place, DVec3::NEG_Z, path, light.node)?;
            let source = match light.kind {
                Punctual::Directional => LightSource::Directional(Sky::direction(-shines)),
                Punctual::Point => LightSource::Point {
                    place,
                    distance: 1.0,
                },
                Punctual::Spot(cone) => LightSource::Spot {
                    place,
                    distance: 1.0,
                    axis: shines,
                    cone: cone.map(f64::from),
                },
            };
            Ok(Light {
                name: named(&light.name, "light", count),
                // lx, and cd at a distance of 1; candela and lumens count like watts.
                strength: strength * (r + g + b) / 3.0 / PI,
                source,
            })
        })
        .collect()
}

fn named(name: &Option<String>, kind: &str, count: usize) -> String {
    let name = name.clone();
    name.unwrap_or_else(|| format!("{kind} {}", count + 1))
}

/// A direction of a camera or light in the file's coordinates.
fn axis_of(place: &DMat4, axis: DVec3, path: &Path, node: usize) -> Result<DVec3, SceneError> {
    let axis = place.transform_vector3(axis).try_normalize();
    axis.ok_or_else(|| SceneError::Gltf {
        file: path.to_owned(),
        message: format!("node {node} scales a camera or light to nothing; remove the scale"),
    })
}
