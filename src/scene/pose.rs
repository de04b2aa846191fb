//! One state of a scene: where its cameras, lights and objects are.

use std::f64::consts::TAU;

use glam::DVec3;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Camera, CameraPath, Lens, LightSource, Object, Placement, Region, Scene, Sky};

/// A state of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Pose {
    /// What looks.
    pub camera: CameraPose,
    /// As [`Scene::lights`] are.
    pub lights: Vec<LightPose>,
    /// By object and instance.
    pub objects: Vec<Vec<Placement>>,
}

/// A camera at its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraPose {
    /// Where it is.
    pub position: DVec3,
    /// Unit vectors to the right and upwards in the picture, and backwards.
    pub axes: [DVec3; 3],
    /// How it projects.
    pub lens: Lens,
}

/// A light at its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightPose {
    /// In a direction, a unit vector.
    Directional(DVec3),
    /// At a point; of a spot, too.
    At(DVec3),
    /// Of the environment and at the camera there is nothing to say.
    Given,
}

impl Scene {
    /// A state drawn at random, each camera as likely; the same for the same seed.
    pub fn pose(&self, seed: u64) -> Pose {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let camera = (random.random::<f64>() * self.cameras.len() as f64) as usize;
        self.pose_of(
            &self.cameras[camera.min(self.cameras.len() - 1)],
            &mut Some(random),
        )
    }

    /// Everything in the middle of its range, seen by the first camera.
    pub fn default_pose(&self) -> Pose {
        self.pose_of::<ChaCha8Rng>(&self.cameras[0], &mut None)
    }

    fn pose_of<R: Rng>(&self, camera: &Camera, random: &mut Option<R>) -> Pose {
        Pose {
            camera: camera.pose(random),
            lights: self
                .lights
                .iter()
                .map(|light| match &light.source {
                    LightSource::Directional(sky) => LightPose::Directional(sky.draw(random)),
                    LightSource::Point { place, .. } | LightSource::Spot { place, .. } => {
                        LightPose::At(place.draw(random))
                    }
                    LightSource::Environment(_) | LightSource::Collocated => LightPose::Given,
                })
                .collect(),
            objects: self
                .objects
                .iter()
                .map(|object| object.draw(random))
                .collect(),
        }
    }
}

/// A value between two, the middle if nothing is random.
fn between<R: Rng>([from, to]: [f64; 2], random: &mut Option<R>) -> f64 {
    let share = random.as_mut().map_or(0.5, |random| random.random::<f64>());
    from + (to - from) * share
}

impl Camera {
    fn pose<R: Rng>(&self, random: &mut Option<R>) -> CameraPose {
        let (position, target, up) = match &self.path {
            CameraPath::Within { place, target, up } => (place.draw(random), *target, *up),
            CameraPath::Orbit {
                target,
                distance,
                sky,
            } => {
                let position = *target + between(*distance, random) * sky.draw(random);
                (position, *target, DVec3::Y)
            }
        };
        let back = (position - target).normalize_or(DVec3::Z);
        let right = up.cross(back).try_normalize();
        let right = right.unwrap_or_else(|| back.any_orthonormal_vector());
        CameraPose {
            position,
            axes: [right, back.cross(right), back],
            lens: self.lens,
        }
    }
}

impl Sky {
    fn draw<R: Rng>(&self, random: &mut Option<R>) -> DVec3 {
        Self::at(
            between(self.azimuth, random),
            between(self.elevation, random),
        )
    }
}

impl Region {
    fn draw<R: Rng>(&self, random: &mut Option<R>) -> DVec3 {
        let at = [0, 1, 2].map(|k| between([self.low[k], self.high[k]], random));
        DVec3::from(at)
    }
}

impl Object {
    /// All instances in one state.
    fn draw<R: Rng>(&self, random: &mut Option<R>) -> Vec<Placement> {
        let place = |instance: &Placement| {
            let turn = between(self.turn, random);
            let by = match random {
                Some(random) => {
                    let way = Sky::at(
                        TAU * random.random::<f64>(),
                        (2.0 * random.random::<f64>() - 1.0).asin(),
                    );
                    // Evenly over the ball.
                    self.sway * random.random::<f64>().cbrt() * way
                }
                None => DVec3::ZERO,
            };
            instance.moved(turn, by)
        };
        self.instances.iter().map(place).collect()
    }
}
