//! Where rays meet triangles.

use std::collections::HashSet;

use glam::{Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

use super::{Mesh, Place, flat_normal};

/// What rays meet of a mesh: its triangles that have an area.
pub(crate) struct Solid {
    triangles: Vec<Triangle>,
    /// Their normals, and which of the mesh's they are.
    flats: Vec<(Vec3, usize)>,
    bvh: Bvh2,
}

/// Where a ray meets a solid.
#[derive(Clone, Copy)]
pub(crate) struct Met {
    triangle: usize,
    pub(crate) point: Vec3A,
}

impl Solid {
    pub(crate) fn new(mesh: &Mesh) -> Self {
        let (mut triangles, mut flats) = (Vec::new(), Vec::new());
        let mut seen = HashSet::new();
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let Some(flat) = flat_normal(mesh, *triangle) else {
                continue;
            };
            let corners = triangle.map(|k| mesh.positions[k as usize]);
            let mut place = corners.map(|corner| corner.to_array().map(f32::to_bits));
            place.sort_unstable();
            // Of triangles in the same place rays meet the first.
            if !seen.insert(place) {
                continue;
            }
            let [v0, v1, v2] = corners.map(Vec3A::from);
            triangles.push(Triangle { v0, v1, v2 });
            flats.push((flat.as_vec3(), index));
        }
        let boxes: Vec<Aabb> = triangles.iter().enumerate().map(bounds).collect();
        let bvh = build_bvh2(
            &boxes,
            BvhBuildParams::medium_build(),
            &mut Default::default(),
        );
        Self {
            triangles,
            flats,
            bvh,
        }
    }

    /// The nearest triangle along a ray.
    pub(crate) fn hit(&self, origin: Vec3A, way: Vec3A) -> Option<Met> {
        if self.triangles.is_empty() {
            return None;
        }
        let mut hit = RayHit::none();
        let triangle = |index: usize| self.bvh.primitive_indices[index] as usize;
        let ray = Ray::new_inf(origin, way);
        let is_hit = self.bvh.ray_traverse(ray, &mut hit, |ray, index| {
            intersect(&self.triangles[triangle(index)], ray)
        });
        is_hit.then(|| Met {
            triangle: triangle(hit.primitive_id as usize),
            point: origin + hit.t * way,
        })
    }

    /// Corners of the mesh's triangle that is met, and their weights, which a little outside of it are below 0.
    pub(crate) fn weights(&self, mesh: &Mesh, met: &Met) -> ([usize; 3], Vec3) {
        let corners = mesh.triangles[self.flats[met.triangle].1].map(|index| index as usize);
        (
            corners,
            barycentric(&self.triangles[met.triangle], met.point),
        )
    }

    /// How the cloth lies there for such corners and weights, seen from the direction `viewer` (unit length).
    pub(crate) fn place(
        &self,
        mesh: &Mesh,
        met: &Met,
        (corners, weights): ([usize; 3], Vec3),
        viewer: Vec3,
    ) -> Place {
        mesh.place(corners, weights, self.flats[met.triangle].0, viewer)
    }
}

/// A box around a triangle: by up to a thousandth larger, each by another share, since among equal ones the builder finds but one pair
/// at a time.
fn bounds((index, triangle): (usize, &Triangle)) -> Aabb {
    const MOST: f32 = 1e-3;
    let mut bounds = triangle.aabb();
    // Odd multiples of an irrational number are spread evenly.
    let share = (index as f64 * 0.618_033_988_749_894_9).fract() as f32;
    bounds.max += MOST * share * (bounds.max - bounds.min);
    bounds
}

/// How far, in weights, a point may be outside of a triangle and meet it: neighbours overlap by that, and no ray slips through.
const EDGE: f32 = 1e-4;

/// How far along a ray the triangle is; infinity if it is not met.
fn intersect(triangle: &Triangle, ray: &Ray) -> f32 {
    let normal = (triangle.v1 - triangle.v0).cross(triangle.v2 - triangle.v0);
    let t = (triangle.v0 - ray.origin).dot(normal) / ray.direction.dot(normal);
    // Not where a ray runs in its plane, either.
    if !(t >= ray.tmin && t <= ray.tmax) {
        return f32::INFINITY;
    }
    let weights = barycentric(triangle, ray.origin + t * ray.direction);
    if weights.min_element() >= -EDGE {
        t
    } else {
        f32::INFINITY
    }
}

/// Weights of a triangle's corners at a point in its plane.
fn barycentric(triangle: &Triangle, point: Vec3A) -> Vec3 {
    let (a, b) = (triangle.v1 - triangle.v0, triangle.v2 - triangle.v0);
    let normal = a.cross(b);
    let area = normal.length_squared();
    let to = point - triangle.v0;
    let v = to.cross(b).dot(normal) / area;
    let w = a.cross(to).dot(normal) / area;
    Vec3::new(1.0 - v - w, v, w)
}
