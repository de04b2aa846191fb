//! Which pairs of directions a scene can ask of each fabric.
//!
//! Nothing that can happen is left out: every camera is combined with every light, and nothing hides anything. Triangles that lie
//! alike are one *patch*: a ball of positions, and frames near a mean frame (n₀ normal, t₀ warp, ⟂). Of a patch every light and
//! every place of a camera is a cap of directions in the mean frame, wider by as much as a frame of the patch can be turned from it.
//!
//! **Frames.** A point's normal n is the normalised mix of its triangle's at the corners, its warp the mix W less what is along n. Let
//! the corners' normals be within δ < 90° of n₀. So is n, since that cap is convex. Let W at the corners be at azimuths within ±a of t₀
//! about n₀ (a < 90°) and at |z| ≤ e h, z its height over the plane ⟂ n₀ and h its length in it. Mixed, azimuths stay within ±a and
//! the height within e/cos a. The frame at the point is the mean frame, tilted by at most δ without turning, then turned about n by
//! the azimuth of W in the tilted frame, which is that in the mean frame but for the foreshortening across the tilt's axis, at most
//! asin tan²(δ/2), and for what height adds, at most asin (e tan δ / cos a). No direction moves by more than the sum of tilt and turn:
//!
//! ```text
//! U = δ + a + asin tan²(δ/2) + asin (e tan δ / cos a)
//! ```
//!
//! **Sides.** From behind cloth is the frame turned by 180° about the warp, so that both sides are such patches. A side is seen only
//! if the viewer is above the plane of a triangle; where it then is hardly above that of n, or even below it, the picture tilts n towards
//! the viewer (`Mesh::place`), and δ grows by as much.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use rayon::prelude::*;

use super::pieces::{Piece, angle};
use super::{CameraPath, Lens, LightSource, Object, Placement, Scene, flat_normal};
use crate::needs::{Directions, Needs};
use crate::progress::{Cancelled, Progress};
use crate::render::Mesh;
use crate::render::mesh::GRAZING;

/// What single precision may turn a direction by, radians, amply.
const ROUNDING: f64 = 2e-5;
/// Normals, warps and the position as lights and cameras see it are alike within about this, radians.
const ALIKE: f64 = 0.03;
/// Frames that differ by more, radians, are as good as any.
const WIDEST: f64 = 1.2;
/// For more caps than this, of a microsecond each while they are small, patches and pieces become coarser, …
const MAX_CAPS: f64 = 8e5;
/// … by this factor at a time, …
const COARSER: f64 = 1.4;
/// … up to so many times.
const MAX_COARSENINGS: i32 = 6;
/// The longest piece of a turn, radians.
const TURN: f64 = 0.09;
/// Patches that are joined on one thread.
const RUN: usize = 64;

/// What a scene needs, and of what it was found.
#[derive(Debug, Clone)]
pub struct Analysis {
    /// By fabric.
    pub needs: BTreeMap<String, Needs>,
    /// As [`Scene::objects`] are.
    pub objects: Vec<ObjectNeeds>,
}

/// What was looked at of an object.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectNeeds {
    /// What the scene calls it.
    pub name: String,
    /// The fabrics that it needs tables of.
    pub fabrics: Vec<String>,
    /// Of the mesh …
    pub triangles: usize,
    /// … that lie alike …
    pub patches: usize,
    /// … in that many places and states of a turn.
    pub placements: usize,
    /// Pieces of the places of cameras.
    pub cameras: usize,
    /// Pieces of the places of lights.
    pub lights: usize,
    /// The share of all pairs that this object asks for, 0 to 1.
    pub share: f64,
}

/// Triangles that lie alike.
#[derive(Debug, Clone, Copy)]
struct Patch {
    /// Mean frame: warp, weft, normal.
    axes: [DVec3; 3],
    center: DVec3,
    radius: f64,
    /// δ, a and e of the frames.
    tilt: f64,
    turn: f64,
    height: f64,
    /// The most that a triangle's own plane is tilted from the mean one …
    flat: f64,
    /// … and from the normals at its corners.
    bent: f64,
}

/// Pieces of lights and cameras, as an object in one place sees them.
struct Around<'a> {
    lights: Vec<(&'a LightSource, Vec<Piece>)>,
    viewers: Vec<Piece>,
    /// What positions and frames may be off by.
    moved: Moved,
    placement: Placement,
}

#[derive(Debug, Clone, Copy)]
struct Moved {
    /// The turn about the vertical through the object's origin, radians to either side.
    turn: f64,
    /// Any way, in the object's units.
    sway: f64,
}

impl Scene {
    /// Every pair that can be asked of each fabric, by its name, and perhaps some more.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn needs(&self, progress: Progress<'_>) -> Result<BTreeMap<String, Needs>, Cancelled> {
        Ok(self.analyse(progress)?.needs)
    }

    /// The same, and of what it was found. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn analyse(&self, progress: Progress<'_>) -> Result<Analysis, Cancelled> {
        let mut analysis = Analysis {
            needs: BTreeMap::new(),
            objects: Vec::new(),
        };
        let count = self.objects.len() as f64;
        for (index, object) in self.objects.iter().enumerate() {
            let share = |k: usize| k as f64 / count;
            let part = progress.part(share(index), share(index + 1));
            let (needs, found) = self.needs_of(object, part)?;
            for fabric in &found.fabrics {
                let all = analysis.needs.entry(fabric.clone());
                all.or_insert_with(Needs::none).join(&needs);
            }
            analysis.objects.push(found);
        }
        Ok(analysis)
    }

    fn needs_of(
        &self,
        object: &Object,
        progress: Progress<'_>,
    ) -> Result<(Needs, ObjectNeeds), Cancelled> {
        let (middle, radius) = ball(&object.mesh);
        let mut coarsenings = 0;
        let (around, patches, [cameras, lights]) = loop {
            let detail = COARSER.powi(coarsenings);
            let around = self.around(object, detail);
            // Pieces are near or far as seen from the nearest of the object.
            let mut nearest = f64::INFINITY;
            let mut counts = [0; 2];
            for place in &around {
                counts[0] += place.viewers.len();
                let pieces = place.lights.iter().flat_map(|(_, pieces)| pieces);
                counts[1] += pieces.clone().count();
                let distance = |piece: &Piece| piece.distance(middle, radius + place.moved.sway);
                nearest = pieces
                    .chain(&place.viewers)
                    .map(distance)
                    .fold(nearest, f64::min);
            }
            let patches = patches(&object.mesh, ALIKE * detail, nearest.max(0.05 * radius));
            // Large caps take longer.
            let caps =
                2.0 * detail * detail * patches.len() as f64 * (counts[0] + counts[1]) as f64;
            if caps <= MAX_CAPS || coarsenings == MAX_COARSENINGS {
                break (around, patches, counts);
            }
            // Patches are of two to five dimensions, pieces of two.
            let excess = (caps / MAX_CAPS).ln() / (5.0 * COARSER.ln());
            coarsenings = (coarsenings + (excess as i32).max(1)).min(MAX_COARSENINGS);
        };
        let steps = progress.steps(patches.len().div_ceil(RUN));
        let needs = patches
            .par_chunks(RUN)
            .try_fold(Needs::none, |mut needs, patches| {
                for patch in patches {
                    for place in &around {
                        patch.add(place, &mut needs);
                    }
                }
                steps.advance().map(|()| needs)
            })
            .try_reduce(Needs::none, |mut a, b| {
                a.join(&b);
                Ok(a)
            })?;
        let found = ObjectNeeds {
            name: object.name.clone(),
            fabrics: (object.material.bakes().iter())
                .map(|fabric| fabric.name.clone())
                .collect(),
            triangles: object.mesh.triangles.len(),
            patches: patches.len(),
            placements: around.len(),
            cameras,
            lights,
            share: needs.share(),
        };
        Ok((needs, found))
    }

    /// What the object sees around it in all of its places.
    fn around(&self, object: &Object, detail: f64) -> Vec<Around<'_>> {
        let [from, to] = object.turn;
        let cuts = ((to - from) / (TURN * detail)).ceil().max(1.0);
        let (middle, radius) = ball(&object.mesh);
        let mut all = Vec::new();
        for instance in &object.instances {
            let center = instance.point(middle);
            // Wherever it turns to.
            let reach = object.sway
                + instance.scale * radius
                + if from < to {
                    2.0 * center.distance(instance.translation)
                } else {
                    0.0
                };
            let viewers: Vec<Piece> = self
                .cameras
                .iter()
                .flat_map(|camera| match (&camera.path, camera.lens) {
                    (CameraPath::Within { place, .. }, Lens::Perspective(_)) => {
                        place.pieces(center, reach, detail)
                    }
                    (CameraPath::Within { place, target, .. }, Lens::Orthographic(_)) => {
                        let far = |piece: Piece| {
                            let (axis, radius) = piece.seen_from(*target, 0.0);
                            Piece::Far { axis, radius }
                        };
                        place
                            .pieces(*target, 0.0, detail)
                            .into_iter()
                            .map(far)
                            .collect()
                    }
                    (
                        CameraPath::Orbit {
                            target,
                            distance,
                            sky,
                        },
                        Lens::Perspective(_),
                    ) => sky.around(*target, *distance, detail),
                    (CameraPath::Orbit { sky, .. }, Lens::Orthographic(_)) => sky.far(detail),
                })
                .collect();
            let lights = self.lights.iter().map(|light| {
                let pieces = match &light.source {
                    LightSource::Directional(sky) => sky.far(detail),
                    LightSource::Point { place, .. } | LightSource::Spot { place, .. } => {
                        place.pieces(center, reach, detail)
                    }
                    LightSource::Environment(above) => vec![Piece::Far {
                        axis: DVec3::Y,
                        radius: FRAC_PI_2 - above,
                    }],
                    LightSource::Collocated => Vec::new(),
                };
                (&light.source, pieces)
            });
            let lights: Vec<(&LightSource, Vec<Piece>)> = lights.collect();
            for k in 0..cuts as u32 {
                let half = 0.5 * (to - from) / cuts;
                let turn = from + (2.0 * f64::from(k) + 1.0) * half;
                let placement = instance.moved(turn, DVec3::ZERO);
                let local = |pieces: &[Piece]| -> Vec<Piece> {
                    pieces.iter().map(|piece| piece.local(&placement)).collect()
                };
                all.push(Around {
                    lights: (lights.iter())
                        .map(|(source, pieces)| (*source, local(pieces)))
                        .collect(),
                    viewers: local(&viewers),
                    moved: Moved {
                        turn: half,
                        sway: object.sway / placement.scale,
                    },
                    placement,
                });
            }
        }
        all
    }
}

impl Patch {
    /// How much any of its frames turns a direction of the mean frame, tilted by `more` radians beside.
    fn uncertainty(&self, more: f64) -> f64 {
        let tilt = self.tilt + more;
        let sum = if tilt < WIDEST && self.turn < WIDEST {
            let foreshortened = (0.5 * tilt).tan().powi(2);
            let raised = self.height * tilt.tan() / self.turn.cos();
            tilt + self.turn + foreshortened.min(1.0).asin() + raised.min(1.0).asin()
        } else {
            PI
        };
        (sum + ROUNDING).min(PI)
    }

    /// Adds what is asked of it in one place of its object.
    fn add(&self, around: &Around<'_>, needs: &mut Needs) {
        let Moved { turn, sway } = around.moved;
        // The object's origin is on the axis about which it turns.
        let reach = self.radius + sway + turn * (self.center.length() + self.radius);
        for side in [1.0, -1.0] {
            let [warp, weft, normal] = self.axes;
            let axes = [warp, side * weft, side * normal];
            let local = |w: DVec3| axes.map(|axis| axis.dot(w));
            // Those well above the surface, and those at whose grazing directions the picture bends normals.
            let mut clear = Directions::none();
            let mut grazing: Vec<(DVec3, f64)> = Vec::new();
            let mut most_bent: f64 = 0.0;
            let plain = self.uncertainty(0.0) + turn;
            let mut is_seen = false;
            for piece in &around.viewers {
                let (axis, radius) = piece.seen_from(self.center, reach);
                let elevation = FRAC_PI_2 - angle(axis, axes[2]);
                // Below the planes of all triangles.
                if elevation + radius + turn + ROUNDING < -self.flat {
                    continue;
                }
                is_seen = true;
                let lowest = elevation - radius - turn - self.tilt - ROUNDING;
                if lowest > f64::from(GRAZING) + 1e-4 {
                    clear.add_cap(local(axis), radius + plain);
                } else {
                    // The part of n across the direction stays, and GRAZING is added along it.
                    let below = (-lowest).clamp(0.0, self.bent);
                    let bent = below + f64::from(GRAZING) / below.cos().max(0.1) + 1e-4;
                    most_bent = most_bent.max(bent);
                    grazing.push((axis, radius));
                }
            }
            if !is_seen {
                continue;
            }
            let bent = self.uncertainty(most_bent) + turn;
            let mut low = Directions::none();
            for (axis, radius) in grazing {
                low.add_cap(local(axis), radius + bent);
            }
            for (viewers, uncertainty) in [(&clear, plain), (&low, bent)] {
                if viewers.is_empty() {
                    continue;
                }
                for (source, pieces) in &around.lights {
                    if matches!(source, LightSource::Collocated) {
                        needs.add_collocated(viewers);
                        continue;
                    }
                    let mut lights = Directions::none();
                    for piece in pieces {
                        if !self.is_in_cone(source, piece, around, reach) {
                            continue;
                        }
                        let (axis, radius) = piece.seen_from(self.center, reach);
                        lights.add_cap(local(axis), radius + uncertainty);
                    }
                    if !lights.is_empty() {
                        needs.add(&lights, viewers);
                    }
                }
            }
        }
    }

    /// Whether a spot, at any place of the piece, may light any of it; true of other lights.
    fn is_in_cone(
        &self,
        source: &LightSource,
        piece: &Piece,
        around: &Around<'_>,
        reach: f64,
    ) -> bool {
        let LightSource::Spot {
            axis,
            cone: [_, outer],
            ..
        } = source
        else {
            return true;
        };
        let (to_light, radius) = piece.seen_from(self.center, reach);
        // The spot's axis is fixed in the scene, so that it turns in the object's coordinates.
        let shines = around.placement.rotation.inverse() * *axis;
        angle(-to_light, shines) <= outer + radius + around.moved.turn + ROUNDING
    }
}

/// A ball around a mesh.
fn ball(mesh: &Mesh) -> (DVec3, f64) {
    let positions = || mesh.positions.iter().map(|position| position.as_dvec3());
    let low = positions().fold(DVec3::INFINITY, DVec3::min);
    let high = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
    if low.x > high.x {
        return (DVec3::ZERO, 0.0);
    }
    (0.5 * (low + high), 0.5 * low.distance(high))
}

/// The triangles of a mesh in patches of those that are alike within about `alike` radians, for lights and cameras at least
/// `distance` away, as well.
fn patches(mesh: &Mesh, alike: f64, distance: f64) -> Vec<Patch> {
    let cell = alike * distance;
    let mut keyed: Vec<(u128, u32)> = mesh
        .triangles
        .par_iter()
        .enumerate()
        .filter_map(|(index, triangle)| {
            flat_normal(mesh, *triangle)?;
            Some((key(mesh, *triangle, alike, cell), index as u32))
        })
        .collect();
    keyed.par_sort_unstable();
    let groups: Vec<&[(u128, u32)]> = keyed.chunk_by(|a, b| a.0 == b.0).collect();
    let patch = |group: &&[(u128, u32)]| {
        let triangles = group
            .iter()
            .map(|(_, index)| mesh.triangles[*index as usize]);
        patch_of(mesh, &triangles.collect::<Vec<_>>())
    };
    groups.par_iter().map(patch).collect()
}

/// The frame in the middle of a triangle: normal and warp.
fn frame(mesh: &Mesh, triangle: [u32; 3]) -> [DVec3; 2] {
    let sum = |vectors: &[glam::Vec3]| -> DVec3 {
        let corner = |index: u32| vectors[index as usize].as_dvec3();
        triangle.into_iter().map(corner).sum()
    };
    let normal = sum(&mesh.normals).normalize_or(DVec3::Z);
    let warp = sum(&mesh.warps);
    let warp = (warp - warp.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
    [normal, warp]
}

/// The same for triangles that are alike.
fn key(mesh: &Mesh, triangle: [u32; 3], alike: f64, cell: f64) -> u128 {
    let [normal, warp] = frame(mesh, triangle);
    let corners = triangle.map(|index| index as usize);
    let middle = corners
        .iter()
        .map(|k| mesh.positions[*k].as_dvec3())
        .sum::<DVec3>()
        / 3.0;
    // What differs much within itself is not to widen patches of others.
    let spread = corners
        .iter()
        .map(|k| {
            angle(mesh.normals[*k].as_dvec3(), normal)
                .max(angle_in(normal, warp, mesh.warps[*k].as_dvec3()).abs())
        })
        .fold(0.0, f64::max);
    let class = (spread / (0.5 * alike)).max(1.0).log2().ceil() as u32;
    let mut key = u128::from(class.min(15));
    let mut push = |value: f64, bits: u32| {
        let mask = (1i64 << bits) - 1;
        key = key << bits | u128::from((value.floor() as i64 & mask) as u64);
    };
    for vector in [normal, warp] {
        for value in vector.to_array() {
            push(value / alike, 8);
        }
    }
    for value in middle.to_array() {
        push(value / cell, 24);
    }
    key
}

/// The azimuth of a vector from the warp about the normal.
fn angle_in(normal: DVec3, warp: DVec3, vector: DVec3) -> f64 {
    vector.dot(normal.cross(warp)).atan2(vector.dot(warp))
}

fn patch_of(mesh: &Mesh, triangles: &[[u32; 3]]) -> Patch {
    let frames = || triangles.iter().map(|triangle| frame(mesh, *triangle));
    let normal = frames().map(|[normal, _]| normal).sum::<DVec3>();
    let normal = normal.normalize_or(DVec3::Z);
    let warp = frames().map(|[_, warp]| warp).sum::<DVec3>();
    let warp = (warp - warp.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
    let corners = || triangles.iter().flatten().map(|index| *index as usize);
    let positions = || corners().map(|k| mesh.positions[k].as_dvec3());
    let low = positions().fold(DVec3::INFINITY, DVec3::min);
    let high = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
    let mut patch = Patch {
        axes: [warp, normal.cross(warp), normal],
        center: 0.5 * (low + high),
        radius: 0.0,
        tilt: 0.0,
        turn: 0.0,
        height: 0.0,
        flat: 0.0,
        bent: 0.0,
    };
    patch.radius = positions()
        .map(|p| p.distance(patch.center))
        .fold(0.0, f64::max)
        * (1.0 + 1e-6);
    for k in corners() {
        let (n, w) = (mesh.normals[k].as_dvec3(), mesh.warps[k].as_dvec3());
        patch.tilt = patch.tilt.max(angle(n, normal));
        patch.turn = patch.turn.max(angle_in(normal, warp, w).abs());
        let in_plane = (w - w.dot(normal) * normal).length();
        let height = w.dot(normal).abs() / in_plane;
        // Of no length, or along the normal, it may be any.
        if height.is_finite() {
            patch.height = patch.height.max(height);
        } else {
            patch.turn = PI;
        }
    }
    for triangle in triangles {
        let Some(flat) = flat_normal(mesh, *triangle) else {
            continue;
        };
        let middle = triangle.map(|k| mesh.normals[k as usize].as_dvec3());
        // To the side of the smooth normals, whatever the order of corners.
        let flat = if flat.dot(middle.iter().sum()) < 0.0 {
            -flat
        } else {
            flat
        };
        patch.flat = patch.flat.max(angle(flat, normal));
        for n in middle {
            patch.bent = patch.bent.max(angle(flat, n));
        }
    }
    // Where a triangle's plane stands on its normals, either side of these may be seen.
    if patch.bent > WIDEST || patch.tilt > WIDEST {
        patch.tilt = PI;
        patch.flat = PI;
    }
    patch
}
