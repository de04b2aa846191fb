//! Pictures of a scene.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::{DVec3, Vec3, Vec3A};
use rayon::prelude::*;

use super::range::angle;
use super::{Lens, LightPose, LightSource, Object, Placement, Pose, Scene};
use crate::mesh::{Met, Solid};
use crate::progress::{Cancelled, Progress};
use crate::render::{Cloth, Pairs, Picture, offsets};

/// Shadow rays begin this far above the surface, in units of the object's radius: beyond rounding and the steps between triangles and
/// their smooth normals.
const LIFT: f64 = 2e-3;
/// Directions that stand for an environment.
const SKY_SAMPLES: u32 = 64;

/// A scene that pictures can be taken of.
pub struct Stage<'a> {
    scene: &'a Scene,
    bodies: Vec<Body<'a>>,
}

/// An object, and what rays meet of it in its own coordinates.
struct Body<'a> {
    object: &'a Object,
    solid: Solid,
    radius: f64,
}

/// Where a ray meets cloth.
struct Hit {
    object: usize,
    instance: usize,
    met: Met,
    distance: f64,
}

/// What a sample of the picture asks for.
struct Asked {
    /// The pixel of the row.
    pixel: usize,
    object: usize,
    arc: [f64; 2],
    wr: [f32; 3],
    /// wi of everything that lights it, and by what to multiply ρ.
    lights: Vec<([f32; 3], f64)>,
}

impl<'a> Stage<'a> {
    /// What pictures of the scene are taken of.
    pub fn new(scene: &'a Scene) -> Self {
        Self {
            scene,
            bodies: scene.objects.iter().map(Body::new).collect(),
        }
    }

    /// A square picture of `size` rows with `samples` per pixel, with the cloths by their names in the objects; an object whose cloth
    /// is not among them is black. The radiance is Σ π e ρ, e the strengths of lights. It does not depend on the number of workers.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn picture(
        &self,
        pose: &Pose,
        cloths: &BTreeMap<String, Cloth>,
        size: usize,
        samples: u32,
        shadows: bool,
        progress: Progress<'_>,
    ) -> Result<Picture, Cancelled> {
        let offsets = offsets(samples.max(1));
        let steps = progress.steps(size);
        let rows: Vec<Vec<[f32; 4]>> = (0..size)
            .into_par_iter()
            .map(|row| {
                let asked = self.row(pose, size, row, &offsets, shadows);
                let mut sums = vec![[0.0; 4]; size];
                for sample in &asked {
                    sums[sample.pixel][3] += 1.0;
                }
                for (index, body) in self.bodies.iter().enumerate() {
                    let of = |sample: &&Asked| sample.object == index;
                    if let Some(cloth) = cloths.get(&body.object.cloth) {
                        shade(cloth, body.object, asked.iter().filter(of), &mut sums);
                    }
                }
                let share = 1.0 / offsets.len() as f64;
                let mean = |sum: [f64; 4]| sum.map(|sum| (sum * share) as f32);
                steps.advance()?;
                Ok(sums.into_iter().map(mean).collect())
            })
            .collect::<Result<_, Cancelled>>()?;
        Ok(Picture {
            width: size,
            height: size,
            pixels: rows.concat(),
        })
    }

    /// The pairs (wi, wr) that such a picture asks of every cloth.
    pub fn pairs(
        &self,
        pose: &Pose,
        size: usize,
        samples: u32,
    ) -> BTreeMap<String, Vec<[[f32; 3]; 2]>> {
        let offsets = offsets(samples.max(1));
        let mut pairs: BTreeMap<String, Vec<[[f32; 3]; 2]>> = BTreeMap::new();
        for row in 0..size {
            for sample in self.row(pose, size, row, &offsets, false) {
                let cloth = &self.bodies[sample.object].object.cloth;
                let wr = sample.wr;
                let of_lights = sample.lights.iter().map(|(wi, _)| [*wi, wr]);
                pairs.entry(cloth.clone()).or_default().extend(of_lights);
            }
        }
        pairs
    }

    /// What all samples of a row meet.
    fn row(
        &self,
        pose: &Pose,
        size: usize,
        row: usize,
        offsets: &[[f64; 2]],
        shadows: bool,
    ) -> Vec<Asked> {
        let scale = 2.0 / size as f64;
        let mut asked = Vec::new();
        for pixel in 0..size {
            for [dx, dy] in offsets {
                let x = scale * (pixel as f64 + dx) - 1.0;
                let y = 1.0 - scale * (row as f64 + dy);
                asked.extend(self.sample(pose, [x, y], pixel, shadows));
            }
        }
        asked
    }

    /// What is seen at a place of the picture, half the height of which is 1.
    fn sample(&self, pose: &Pose, [x, y]: [f64; 2], pixel: usize, shadows: bool) -> Option<Asked> {
        let camera = &pose.camera;
        let [right, up, back] = camera.axes;
        let (from, to) = match camera.lens {
            Lens::Perspective(fov) => {
                let half = (0.5 * fov).tan();
                let to = half * x * right + half * y * up - back;
                (camera.position, to.normalize())
            }
            Lens::Orthographic(height) => {
                let beside = 0.5 * height * (x * right + y * up);
                (camera.position + beside, -back)
            }
        };
        let hit = self.hit(pose, from, to)?;
        let body = &self.bodies[hit.object];
        let placement = &pose.objects[hit.object][hit.instance];
        let mesh = &body.object.mesh;
        let (corners, weights) = body.solid.weights(mesh, &hit.met);
        // None below 0.
        let weights = weights.max(Vec3::ZERO);
        let weights = weights / weights.element_sum();
        let at = corners
            .iter()
            .zip(weights.to_array())
            .map(|(corner, weight)| f64::from(weight) * mesh.positions[*corner].as_dvec3())
            .sum::<DVec3>();
        let at = placement.point(at);
        let viewer = match camera.lens {
            Lens::Perspective(_) => (camera.position - at).try_normalize()?,
            Lens::Orthographic(_) => back,
        };
        let local = (placement.rotation.inverse() * viewer).as_vec3();
        let place = body.solid.place(mesh, &hit.met, (corners, weights), local);
        let axes = [place.warp, place.weft, place.normal]
            .map(|axis| placement.rotation * DVec3::from(axis));
        let surface = |w: DVec3| axes.map(|axis| axis.dot(w) as f32);
        let wr = surface(viewer);
        let mut lights = Vec::new();
        let is_lit = |to: DVec3, distance: f64| {
            !shadows || {
                let from = at + LIFT * body.radius * placement.scale * axes[2];
                let hit = self.hit(pose, from, to);
                hit.is_none_or(|hit| hit.distance > distance)
            }
        };
        for (light, light_pose) in self.scene.lights.iter().zip(&pose.lights) {
            let power = PI * light.strength;
            match (&light.source, light_pose) {
                (LightSource::Collocated, _) => lights.push((wr, power)),
                (LightSource::Directional(_), LightPose::Directional(to))
                    if is_lit(*to, f64::INFINITY) =>
                {
                    lights.push((surface(*to), power));
                }
                (LightSource::Point { distance, .. }, LightPose::At(place)) => {
                    let way = *place - at;
                    if is_lit(way.normalize_or_zero(), way.length()) {
                        let falloff = distance * distance / way.length_squared();
                        lights.push((surface(way.normalize_or_zero()), power * falloff));
                    }
                }
                (
                    LightSource::Spot {
                        distance,
                        axis,
                        cone: [inner, outer],
                        ..
                    },
                    LightPose::At(place),
                ) => {
                    let way = *place - at;
                    let off = angle(-way, *axis);
                    if off < *outer && is_lit(way.normalize_or_zero(), way.length()) {
                        let share = ((outer - off) / (outer - inner).max(1e-9)).clamp(0.0, 1.0);
                        let falloff = share * distance * distance / way.length_squared();
                        lights.push((surface(way.normalize_or_zero()), power * falloff));
                    }
                }
                (LightSource::Environment(above), _) => {
                    let size = 2.0 * PI * (1.0 - above.sin());
                    let share = light.strength * size / f64::from(SKY_SAMPLES);
                    for to in sky(*above).filter(|to| is_lit(*to, f64::INFINITY)) {
                        lights.push((surface(to), share));
                    }
                }
                _ => {}
            }
        }
        // What is below the surface is not asked for.
        lights.retain(|(wi, _)| wi[2] > 0.0);
        Some(Asked {
            pixel,
            object: hit.object,
            arc: place.arc,
            wr,
            lights,
        })
    }

    /// The nearest cloth along a ray.
    fn hit(&self, pose: &Pose, from: DVec3, to: DVec3) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for (object, body) in self.bodies.iter().enumerate() {
            for (instance, placement) in pose.objects[object].iter().enumerate() {
                let Some(met) = body.hit(placement, from, to) else {
                    continue;
                };
                let point = Vec3::from(met.point).as_dvec3();
                let distance = placement.point(point).distance(from);
                if nearest.as_ref().is_none_or(|hit| distance < hit.distance) {
                    nearest = Some(Hit {
                        object,
                        instance,
                        met,
                        distance,
                    });
                }
            }
        }
        nearest
    }
}

impl<'a> Body<'a> {
    fn new(object: &'a Object) -> Self {
        let radius = object
            .mesh
            .positions
            .iter()
            .map(|position| position.length());
        Self {
            object,
            solid: Solid::new(&object.mesh),
            radius: f64::from(radius.fold(0.0, f32::max)),
        }
    }

    /// Where a ray of the scene meets it, in its own coordinates.
    fn hit(&self, placement: &Placement, from: DVec3, to: DVec3) -> Option<Met> {
        let origin = Vec3A::from(placement.local(from).as_vec3());
        let way = Vec3A::from((placement.rotation.inverse() * to).as_vec3());
        self.solid.hit(origin, way)
    }
}

/// Adds the radiance of samples of an object to their pixels.
fn shade<'b>(
    cloth: &Cloth,
    object: &Object,
    samples: impl Iterator<Item = &'b Asked>,
    sums: &mut [[f64; 4]],
) {
    let mut pairs = Pairs::new(cloth, object.repeats);
    let mut owners = Vec::new();
    for sample in samples {
        for (wi, factor) in &sample.lights {
            pairs.push(*wi, sample.wr, sample.arc);
            owners.push((sample.pixel, *factor));
        }
    }
    for (channel, rho) in pairs.rho().into_iter().enumerate() {
        for (rho, (pixel, factor)) in rho.into_iter().zip(&owners) {
            sums[*pixel][channel] += factor * f64::from(rho);
        }
    }
}

/// Directions above an elevation, evenly spread.
fn sky(above: f64) -> impl Iterator<Item = DVec3> {
    /// The golden angle.
    const TURN: f64 = 2.399_963_229_728_653;
    (0..SKY_SAMPLES).map(move |k| {
        let share = (f64::from(k) + 0.5) / f64::from(SKY_SAMPLES);
        let height = above.sin() + (1.0 - above.sin()) * share;
        let (sin, cos) = (TURN * f64::from(k)).sin_cos();
        let radius = (1.0 - height * height).max(0.0).sqrt();
        DVec3::new(radius * sin, height, radius * cos)
    })
}
