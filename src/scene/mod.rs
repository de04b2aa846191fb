//! Scenes: what is where, which pairs of directions that can ask of each fabric, and pictures of it.
//!
//! A [`Scene`] is cameras, lights and cloth, each with the range within which it moves. y is up; an azimuth turns from +z to +x, an
//! elevation rises from there, as [`Light::direction_at`](crate::render::Light::direction_at) has it. [`Scene::needs`] finds every pair that they can bring about
//! together; a [`Pose`] is one of the states, and a [`Stage`] takes its picture.

mod analyse;
mod gltf;
mod parse;
mod pose;
mod range;
mod sky;
mod stage;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3};

pub use analyse::{Analysis, ObjectNeeds};
pub use pose::{CameraPose, LightPose, Pose};
pub use stage::Stage;

use crate::fabric::Fabric;
use crate::mesh::{Mesh, MeshError};
use crate::pattern::{Pattern, PatternError};
use crate::render::Light as Sun;
use crate::text::TextError;

/// Cameras, lights and cloth.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The name to call it by.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// At least one.
    pub cameras: Vec<Camera>,
    /// At least one.
    pub lights: Vec<Light>,
    /// At least one.
    pub objects: Vec<Object>,
    /// Materials of glTF files that are no cloth, and so are left out.
    pub left_out: Vec<String>,
}

/// What looks at the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// What the file calls it, or its number.
    pub name: String,
    /// How it projects.
    pub lens: Lens,
    /// Where it may be.
    pub path: CameraPath,
}

/// How a camera projects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// Onto a picture that spans this vertical angle, radians, above 0 and below π.
    Perspective(f64),
    /// Along parallel lines, onto a picture of this height.
    Orthographic(f64),
}

/// Where a camera may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CameraPath {
    /// Anywhere in a box, with its eye on the target.
    Within {
        /// Where it stands.
        place: Region,
        /// Where it looks.
        target: DVec3,
        /// What is up in the picture.
        up: DVec3,
    },
    /// Around the target.
    Orbit {
        /// Where it looks.
        target: DVec3,
        /// From the target, above 0.
        distance: [f64; 2],
        /// The direction from the target to it.
        sky: Sky,
    },
}

/// A box along the axes; often a single point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// Its least corner …
    pub low: DVec3,
    /// … and its greatest.
    pub high: DVec3,
}

/// A range of directions, radians.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sky {
    /// From +z towards +x: from and to, at most a whole turn apart.
    pub azimuth: [f64; 2],
    /// Upwards from the horizon, −π/2 to π/2: from and to.
    pub elevation: [f64; 2],
}

/// What lights the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Light {
    /// What the file calls it, or its number.
    pub name: String,
    /// Its irradiance at normal incidence over π.
    pub strength: f64,
    /// Where it may be.
    pub source: LightSource,
}

/// Where a light may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightSource {
    /// So far away that its direction is the same everywhere, as of the sun.
    Directional(Sky),
    /// A point.
    Point {
        /// Where.
        place: Region,
        /// How far from it the light has its strength, above 0.
        distance: f64,
    },
    /// A point that lights a cone.
    Spot {
        /// Where.
        place: Region,
        /// How far from it the light has its strength, above 0.
        distance: f64,
        /// Unit vector along which it shines.
        axis: DVec3,
        /// Half the angle within which it has its full strength, and that beyond which it has none; radians.
        cone: [f64; 2],
    },
    /// From everywhere above an elevation, radians; its strength is its radiance.
    Environment(f64),
    /// At the camera: of a perspective one the point that it sees from, of an orthographic one the direction; the same at any
    /// distance.
    Collocated,
}

/// Cloth on a mesh.
#[derive(Debug, Clone)]
pub struct Object {
    /// What the file calls it, or its number.
    pub name: String,
    /// Its cloth as the scene's file names it.
    pub cloth: String,
    /// What that is.
    pub material: Material,
    /// Its triangles.
    pub mesh: Arc<Mesh>,
    /// Where it is; at least one.
    pub instances: Vec<Placement>,
    /// How far it turns about the vertical through its origin, radians: from and to.
    pub turn: [f64; 2],
    /// How far it moves from its place in any direction.
    pub sway: f64,
    /// How often a pattern repeats along a length of 1 of the mesh's u and v.
    pub repeats: f64,
    /// Whether it is dyed at run time.
    pub albedo: Albedo,
    /// The relative error that is good enough, as a fraction.
    pub max_error: Option<f64>,
}

/// What covers an object.
#[derive(Debug, Clone)]
pub enum Material {
    /// A fabric.
    Fabric(Arc<Fabric>),
    /// A pattern.
    Pattern(Arc<Pattern>),
}

/// Whether a table must leave the albedos open.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Deserialize)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Albedo {
    /// Albedos stay those of the fabric.
    Fixed,
    /// Albedos may change.
    #[default]
    Varies,
}

/// Scaled, then turned, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Above 0.
    pub scale: f64,
    /// Of unit length.
    pub rotation: DQuat,
    /// Where its origin is.
    pub translation: DVec3,
}

/// A fabric that a scene needs, and what for.
#[derive(Debug, Clone)]
pub struct FabricUse {
    /// Its parameters.
    pub fabric: Fabric,
    /// Fixed if all cloth of it is.
    pub albedo: Albedo,
    /// The least that any of its cloth asks for.
    pub max_error: Option<f64>,
    /// Names of objects.
    pub objects: Vec<String>,
}

/// Why there is no scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The text of the scene, or of a fabric that it names.
    #[error(transparent)]
    Text(#[from] TextError),
    /// A pattern that it names.
    #[error(transparent)]
    Pattern(#[from] PatternError),
    /// A mesh that it names.
    #[error("{place}")]
    Mesh {
        /// File, line and key that name it.
        place: String,
        /// Why.
        source: MeshError,
    },
    /// The scene, or a file that it names, cannot be read.
    #[error("{place}: cannot read {}", file.display())]
    Unreadable {
        /// File, line and key that name it.
        place: String,
        /// Which.
        file: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A glTF file that is no scene.
    #[error("{}: {message}", file.display())]
    Gltf {
        /// Which.
        file: PathBuf,
        /// What is wrong and what would be right.
        message: String,
    },
}

impl Scene {
    /// Reads a scene from TOML, or from glTF whose materials are named like fabrics of the library. What it names is looked for
    /// beside it.
    ///
    /// # Errors
    /// [`SceneError`] says what is wrong.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        parse::load(path)
    }

    /// The fabrics that it needs tables of, by name.
    pub fn fabrics(&self) -> BTreeMap<String, FabricUse> {
        let mut uses: BTreeMap<String, FabricUse> = BTreeMap::new();
        for object in &self.objects {
            for fabric in object.material.bakes() {
                let found = uses
                    .entry(fabric.name.clone())
                    .or_insert_with(|| FabricUse {
                        fabric: fabric.clone(),
                        albedo: Albedo::Fixed,
                        max_error: object.max_error,
                        objects: Vec::new(),
                    });
                if object.albedo == Albedo::Varies {
                    found.albedo = Albedo::Varies;
                }
                found.max_error = match (found.max_error, object.max_error) {
                    (Some(a), Some(b)) => Some(a.min(b)),
                    (a, b) => a.or(b),
                };
                found.objects.push(object.name.clone());
            }
        }
        uses
    }
}

impl Material {
    /// The fabrics that it needs tables of.
    pub fn bakes(&self) -> Vec<&Fabric> {
        match self {
            Self::Fabric(fabric) => vec![fabric],
            Self::Pattern(pattern) => pattern.bakes().collect(),
        }
    }
}

impl Region {
    /// A single point.
    pub fn point(at: DVec3) -> Self {
        Self { low: at, high: at }
    }
}

impl Sky {
    /// A single direction, of any length above 0.
    pub fn direction(to: DVec3) -> Self {
        let azimuth = to.x.atan2(to.z);
        let elevation = to.y.atan2(to.x.hypot(to.z));
        Self {
            azimuth: [azimuth; 2],
            elevation: [elevation; 2],
        }
    }

    /// The direction at that azimuth and elevation.
    fn at(azimuth: f64, elevation: f64) -> DVec3 {
        DVec3::from(Sun::direction_at(azimuth, elevation))
    }
}

impl Placement {
    /// At the origin, as it is.
    pub const IDENTITY: Self = Self {
        scale: 1.0,
        rotation: DQuat::IDENTITY,
        translation: DVec3::ZERO,
    };

    /// A point of the object in the scene.
    pub fn point(&self, at: DVec3) -> DVec3 {
        self.translation + self.rotation * (self.scale * at)
    }

    /// A point of the scene in the object's coordinates.
    fn local(&self, at: DVec3) -> DVec3 {
        self.rotation.inverse() * (at - self.translation) / self.scale
    }

    /// Turned about the vertical through its origin by radians, and moved.
    pub fn moved(&self, turn: f64, by: DVec3) -> Self {
        Self {
            scale: self.scale,
            rotation: DQuat::from_rotation_y(turn) * self.rotation,
            translation: self.translation + by,
        }
    }
}
