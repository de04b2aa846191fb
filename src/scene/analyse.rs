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
//! **Bins.** For every bin of directions it is asked whether a light or a camera may be there, by squares of bins first, and so every bin
//! costs no more than its neighbours if whole squares have all or none.
//!
//! **Sides.** From behind cloth is the frame turned by 180° about the warp, so that both sides are such patches. A side is seen only
//! if the viewer is above the plane of a triangle; where it then is hardly above that of n, or even below it, the picture tilts n towards
//! the viewer (`Mesh::place`), and δ grows by as much.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use super::range::{Eye, Place, angle};
use super::{Camera, CameraPath, Lens, LightSource, Object, Placement, Scene};
use crate::mesh::{GRAZING, flat_normal};
use crate::needs::{Cap, Directions, Needs, Overlap, Pyramid};
use crate::progress::{Cancelled, Progress};
use crate::render::Mesh;

/// What single precision may turn a direction by, radians, amply.
const ROUNDING: f64 = 2e-5;
/// Normals, warps and the position as lights and cameras see it are alike within about this, radians …
const ALIKE: f64 = 0.008;
/// … or some times this, until there are no more patches in all places than so many, if nothing moves, and if something does.
const COARSER: f64 = 1.4;
const MAX_PATCHES: [usize; 2] = [500_000, 100_000];
const COARSEST: f64 = 0.3;
/// Frames that differ by more, radians, are as good as any.
const WIDEST: f64 = 1.2;
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
    /// Cameras that look at it.
    pub cameras: usize,
    /// Lights that may light it.
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

/// An object in one place, and what positions and frames may be off by.
struct Around {
    placement: Placement,
    /// The turn about the vertical through the object's origin, radians to either side.
    turn: f64,
    /// Any way.
    sway: f64,
}

/// All lights and viewers.
struct Surroundings<'a> {
    /// None for one at the camera.
    lights: Vec<(&'a LightSource, Option<Place>)>,
    /// Whether there is one at the camera.
    is_collocated: bool,
    viewers: Vec<Place>,
    pyramid: Pyramid,
}

impl Scene {
    /// Every pair that can be asked of each fabric, by its name, and perhaps some more.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn needs(&self, progress: Progress<'_>) -> Result<BTreeMap<String, Needs>, Cancelled> {
        Ok(self.analyse(progress)?.needs)
    }

    /// The same, and of what it was found. The result does not depend on the number of workers.
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
        let around = object.places();
        let surroundings = self.surroundings();
        let places = || {
            let lights = surroundings
                .lights
                .iter()
                .filter_map(|(_, place)| place.as_ref());
            lights.chain(&surroundings.viewers)
        };
        let (middle, radius) = ball(&object.mesh);
        // Positions are alike as seen from the nearest of all places.
        let nearest = around.iter().map(|around| {
            let center = around.placement.point(middle);
            let radius = around.placement.scale * radius + around.sway;
            let distances = places().map(|place| place.distance(center, radius));
            distances.fold(f64::INFINITY, f64::min) / around.placement.scale
        });
        let nearest = nearest.fold(f64::INFINITY, f64::min).max(0.05 * radius);
        let is_still =
            places().all(Place::is_fixed) && around.iter().all(|around| around.is_still());
        let most = MAX_PATCHES[usize::from(!is_still)];
        let mut alike = if is_still {
            ALIKE
        } else {
            ALIKE * COARSER * COARSER
        };
        let patches = loop {
            let patches = patches(&object.mesh, alike, nearest);
            if patches.len() * around.len() <= most || alike > COARSEST {
                break patches;
            }
            alike *= COARSER;
        };
        let steps = progress.steps(patches.len().div_ceil(RUN));
        let needs = patches
            .par_chunks(RUN)
            .try_fold(Needs::none, |mut needs, patches| {
                for patch in patches {
                    for around in &around {
                        patch.add(around, &surroundings, &mut needs);
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
            cameras: self.cameras.len(),
            lights: self.lights.len(),
            share: needs.share(),
        };
        Ok((needs, found))
    }

    fn surroundings(&self) -> Surroundings<'_> {
        let viewer = |camera: &Camera| match (camera.path, camera.lens) {
            (CameraPath::Within { place, .. }, Lens::Perspective(_)) => Place::Near(place),
            (CameraPath::Within { place, target, .. }, Lens::Orthographic(_)) => Place::Along {
                target,
                region: place,
            },
            (
                CameraPath::Orbit {
                    target,
                    distance,
                    sky,
                },
                Lens::Perspective(_),
            ) => Place::around(target, distance, sky),
            (CameraPath::Orbit { sky, .. }, Lens::Orthographic(_)) => Place::far(sky),
        };
        let light = |source: &LightSource| match *source {
            LightSource::Directional(sky) => Some(Place::far(sky)),
            LightSource::Point { place, .. } | LightSource::Spot { place, .. } => {
                Some(Place::Near(place))
            }
            LightSource::Environment(above) => Some(Place::Above(above)),
            LightSource::Collocated => None,
        };
        Surroundings {
            lights: (self.lights.iter())
                .map(|found| (&found.source, light(&found.source)))
                .collect(),
            is_collocated: (self.lights.iter())
                .any(|light| light.source == LightSource::Collocated),
            viewers: self.cameras.iter().map(viewer).collect(),
            pyramid: Pyramid::new(),
        }
    }
}

impl Object {
    /// All of its places, a range of turns in pieces.
    fn places(&self) -> Vec<Around> {
        let [from, to] = self.turn;
        let cuts = ((to - from) / TURN).ceil().max(1.0);
        let half = 0.5 * (to - from) / cuts;
        let turned = |instance: &Placement, k: u32| Around {
            placement: instance.moved(from + (2.0 * f64::from(k) + 1.0) * half, DVec3::ZERO),
            turn: half,
            sway: self.sway,
        };
        let instances = self.instances.iter();
        let all = instances.flat_map(|instance| (0..cuts as u32).map(move |k| turned(instance, k)));
        all.collect()
    }
}

impl Around {
    fn is_still(&self) -> bool {
        self.turn == 0.0 && self.sway == 0.0
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
    fn add(&self, around: &Around, surroundings: &Surroundings<'_>, needs: &mut Needs) {
        let Around {
            placement,
            turn,
            sway,
        } = around;
        let eye = Eye {
            center: placement.point(self.center),
            // The object's origin is on the axis about which it turns.
            radius: placement.scale * (self.radius + turn * (self.center.length() + self.radius))
                + sway,
        };
        let plain = self.uncertainty(0.0) + turn;
        // Where a viewer is below a smooth normal's horizon, or hardly above it, the picture tilts the normal until it is above by
        // GRAZING: the part of n across the direction stays.
        let tilted = self.bent + f64::from(GRAZING) / self.bent.cos().max(0.1) + 1e-4;
        let bent = self.uncertainty(tilted) + turn;
        for side in [1.0, -1.0] {
            let [warp, weft, normal] = self.axes.map(|axis| placement.rotation * axis);
            let axes = [warp, side * weft, side * normal];
            let scene = |[x, y, z]: [f64; 3]| x * axes[0] + y * axes[1] + z * axes[2];
            // Whether a viewer whose place is known is seen from this side, and whether n is tilted for it.
            let seen = |place: &Place, is_low: bool| {
                place.direction(eye).is_none_or(|(to, stray)| {
                    let elevation = to.dot(axes[2]).clamp(-1.0, 1.0).asin();
                    let stray = stray + turn + ROUNDING;
                    elevation + stray >= -self.flat
                        && !(is_low && elevation - stray - self.tilt > f64::from(GRAZING) + 1e-3)
                })
            };
            // Those beside what is known.
            let viewers = |slack: f64, is_low: bool, known: &Directions| {
                let all = surroundings.viewers.iter();
                let all: Vec<&Place> = all.filter(|place| seen(place, is_low)).collect();
                if all.is_empty() {
                    return Directions::none();
                }
                surroundings.pyramid.find(known, &|cap: &Cap| {
                    let elevation = || cap.axis[2].min(1.0).asin() - cap.radius;
                    if is_low && elevation() > f64::from(GRAZING) + 1e-3 {
                        return Overlap::None;
                    }
                    let to = scene(cap.axis);
                    let mut found = Overlap::None;
                    for place in &all {
                        match place.overlap(eye, to, cap.radius, slack) {
                            // The lower part alone is wanted.
                            Overlap::All if !is_low => return Overlap::All,
                            Overlap::None => {}
                            _ => found = Overlap::Some,
                        }
                    }
                    found
                })
            };
            for (slack, is_low) in [(plain, false), (bent, true)] {
                let mut lights = Directions::none();
                for (source, place) in &surroundings.lights {
                    let Some(place) = place.as_ref().filter(|_| self.is_in_cone(source, eye))
                    else {
                        continue;
                    };
                    lights.join(&surroundings.pyramid.find(&lights, &|cap: &Cap| {
                        place.overlap(eye, scene(cap.axis), cap.radius, slack)
                    }));
                }
                let known = needs.viewers_of_all(&lights, surroundings.is_collocated);
                let viewers = viewers(slack, is_low, &known);
                needs.add(&lights, &viewers);
                if surroundings.is_collocated {
                    needs.add_collocated(&viewers);
                }
            }
        }
    }

    /// Whether a spot, anywhere it may be, may light any of it; true of other lights.
    fn is_in_cone(&self, source: &LightSource, eye: Eye) -> bool {
        let LightSource::Spot {
            place,
            axis,
            cone: [_, outer],
            ..
        } = source
        else {
            return true;
        };
        let middle = 0.5 * (place.low + place.high);
        let reach = eye.radius + 0.5 * place.low.distance(place.high);
        let to = eye.center - middle;
        reach >= to.length() || angle(to, *axis) <= outer + (reach / to.length()).asin() + ROUNDING
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

/// A triangle, or a part of one: corners' positions, normals and warps of any length, and the unit normal of its plane.
#[derive(Clone, Copy)]
struct Facet {
    positions: [DVec3; 3],
    normals: [DVec3; 3],
    warps: [DVec3; 3],
    flat: DVec3,
    mirrored: bool,
}

/// A facet is quartered at most so many times.
const MAX_CUTS: u32 = 3;

impl Facet {
    fn of(mesh: &Mesh, triangle: [u32; 3]) -> Option<Self> {
        let corners = |vectors: &[glam::Vec3]| triangle.map(|k| vectors[k as usize].as_dvec3());
        let facet = Self {
            positions: corners(&mesh.positions),
            normals: corners(&mesh.normals),
            warps: corners(&mesh.warps),
            flat: flat_normal(mesh, triangle)?,
            mirrored: mesh.mirrored[triangle[0] as usize],
        };
        // To the side of the smooth normals, whatever the order of corners.
        let is_turned = facet.flat.dot(facet.normals.iter().sum()) < 0.0;
        Some(Self {
            flat: if is_turned { -facet.flat } else { facet.flat },
            ..facet
        })
    }

    /// The frame in its middle: normal and warp.
    fn frame(&self) -> [DVec3; 2] {
        let normal = self.normals.iter().sum::<DVec3>().normalize_or(DVec3::Z);
        let warp = self.warps.iter().sum::<DVec3>();
        let warp = (warp - warp.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
        [normal, warp]
    }

    /// How far frames at its corners are turned from that.
    fn spread(&self) -> f64 {
        let [normal, warp] = self.frame();
        let of_normals = self.normals.map(|n| angle(n, normal));
        let of_warps = self.warps.map(|w| angle_in(normal, warp, w).abs());
        of_normals.into_iter().chain(of_warps).fold(0.0, f64::max)
    }

    /// Parts whose frames are alike. Mixes within a part are mixes of those at its corners.
    fn cut(&self, alike: f64, cuts: u32, into: &mut Vec<Self>) {
        if cuts == 0 || self.spread() <= alike {
            into.push(*self);
            return;
        }
        let middles = |[a, b, c]: [DVec3; 3]| [0.5 * (b + c), 0.5 * (c + a), 0.5 * (a + b)];
        let (p, n, w) = (
            middles(self.positions),
            middles(self.normals),
            middles(self.warps),
        );
        for k in 0..3 {
            // The corner k and the middles of its sides.
            let part = |corners: [DVec3; 3], middles: [DVec3; 3]| {
                [corners[k], middles[(k + 2) % 3], middles[(k + 1) % 3]]
            };
            let part = Self {
                positions: part(self.positions, p),
                normals: part(self.normals, n),
                warps: part(self.warps, w),
                ..*self
            };
            part.cut(alike, cuts - 1, into);
        }
        let middle = Self {
            positions: p,
            normals: n,
            warps: w,
            ..*self
        };
        middle.cut(alike, cuts - 1, into);
    }

    /// The same for facets that are alike.
    fn key(&self, alike: f64, cell: f64) -> u128 {
        let [normal, warp] = self.frame();
        let middle = self.positions.iter().sum::<DVec3>() / 3.0;
        // What differs much within itself is not to widen patches of others.
        let class = (self.spread() / (0.5 * alike)).max(1.0).log2().ceil() as u32;
        let mut key = u128::from(class.min(15)) << 1 | u128::from(self.mirrored);
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
}

/// The triangles of a mesh in patches of those that are alike within about `alike` radians, for lights and cameras at least
/// `distance` away, as well.
fn patches(mesh: &Mesh, alike: f64, distance: f64) -> Vec<Patch> {
    let cell = alike * distance;
    let facets: Vec<Facet> = mesh
        .triangles
        .par_iter()
        .flat_map_iter(|triangle| {
            let mut parts = Vec::new();
            if let Some(facet) = Facet::of(mesh, *triangle) {
                facet.cut(alike, MAX_CUTS, &mut parts);
            }
            parts
        })
        .collect();
    let keys = facets.par_iter().map(|facet| facet.key(alike, cell));
    let mut keyed: Vec<(u128, usize)> = keys.enumerate().map(|(k, key)| (key, k)).collect();
    keyed.par_sort_unstable();
    let groups: Vec<&[(u128, usize)]> = keyed.chunk_by(|a, b| a.0 == b.0).collect();
    let patch = |group: &&[(u128, usize)]| {
        let facets = group.iter().map(|(_, index)| facets[*index]);
        patch_of(&facets.collect::<Vec<_>>())
    };
    let patches: Vec<Patch> = groups.par_iter().map(patch).collect();
    patches.iter().flat_map(Patch::turned).collect()
}

/// Warps that spread more than this, radians, as about the pole of a sphere, are taken apart …
const SPREAD: f64 = 0.4;
/// … into so many.
const TURNS: u32 = 64;

impl Patch {
    /// The patch, or copies that together have all azimuths of the warp.
    fn turned(&self) -> Vec<Self> {
        if self.turn <= SPREAD || self.tilt > SPREAD {
            return vec![*self];
        }
        let [warp, weft, normal] = self.axes;
        let turned = |k: u32| {
            let (sin, cos) = (2.0 * PI * f64::from(k) / f64::from(TURNS)).sin_cos();
            Self {
                axes: [cos * warp + sin * weft, cos * weft - sin * warp, normal],
                // The azimuth in the frame itself, wherever heights may have moved it.
                turn: PI / f64::from(TURNS),
                height: 0.0,
                ..*self
            }
        };
        (0..TURNS).map(turned).collect()
    }
}

/// The azimuth of a vector from the warp about the normal.
fn angle_in(normal: DVec3, warp: DVec3, vector: DVec3) -> f64 {
    vector.dot(normal.cross(warp)).atan2(vector.dot(warp))
}

fn patch_of(facets: &[Facet]) -> Patch {
    let normal = facets.iter().map(|facet| facet.frame()[0]).sum::<DVec3>();
    let normal = normal.normalize_or(DVec3::Z);
    let warp = facets.iter().map(|facet| facet.frame()[1]).sum::<DVec3>();
    let warp = (warp - warp.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
    // Facets that are alike are mirrored alike.
    let mirrored = facets.first().is_some_and(|facet| facet.mirrored);
    let weft = normal.cross(warp);
    let positions = || facets.iter().flat_map(|facet| facet.positions);
    let low = positions().fold(DVec3::INFINITY, DVec3::min);
    let high = positions().fold(DVec3::NEG_INFINITY, DVec3::max);
    let mut patch = Patch {
        axes: [warp, if mirrored { -weft } else { weft }, normal],
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
    for facet in facets {
        for (n, w) in facet.normals.into_iter().zip(facet.warps) {
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
            patch.bent = patch.bent.max(angle(facet.flat, n));
        }
        patch.flat = patch.flat.max(angle(facet.flat, normal));
    }
    // Where a triangle's plane stands on its normals, either side of these may be seen.
    if patch.bent > WIDEST || patch.tilt > WIDEST {
        patch.flat = PI;
    }
    patch
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{curtain, skirt};

    #[test]
    fn patches_of_cloth_that_hangs_are_known_well() {
        for (name, mesh) in [("curtain", curtain()), ("skirt", skirt())] {
            let patches = patches(&mesh, 0.05, 1.0);
            let vague = patches
                .iter()
                .filter(|patch| patch.uncertainty(patch.bent) > 1.0);
            assert_eq!(vague.count(), 0, "{name}");
        }
    }
}
