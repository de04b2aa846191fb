//! Cloth as triangles, and where rays meet it.

use glam::{Vec2, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2_from_tris;
use obvhs::ray::{Ray, RayHit};
use obvhs::triangle::Triangle;

use super::{Place, Scene, Seen};

/// Shadow rays begin this far above the surface, in units of half the picture's height: beyond rounding and the steps between
/// triangles and their smooth normals.
const LIFT: f32 = 2e-3;

/// Triangles of a cloth.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// By vertex.
    pub positions: Vec<Vec3>,
    /// Unit normals, by vertex.
    pub normals: Vec<Vec3>,
    /// Along the warp, by vertex: any length, not along the normal.
    pub warps: Vec<Vec3>,
    /// Along warp and weft, by vertex; of images and glTF files u and v.
    pub uvs: Vec<Vec2>,
    /// Indices of vertices.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// A sheet of (columns + 1) × (rows + 1) vertices; `at` gives the position for the shares, 0 to 1, of its length along the warp
    /// and along the weft, which are `size`.
    pub fn sheet(rows: u32, columns: u32, size: Vec2, at: impl Fn(f64, f64) -> [f64; 3]) -> Self {
        const STEP: f64 = 1e-4;
        let mut mesh = Self::default();
        let slope =
            |a: [f64; 3], b: [f64; 3]| Vec3::from([0, 1, 2].map(|k| ((b[k] - a[k]) / STEP) as f32));
        for row in 0..=rows {
            for column in 0..=columns {
                let (u, v) = (
                    f64::from(row) / f64::from(rows),
                    f64::from(column) / f64::from(columns),
                );
                let warp = slope(at(u - 0.5 * STEP, v), at(u + 0.5 * STEP, v));
                let weft = slope(at(u, v - 0.5 * STEP), at(u, v + 0.5 * STEP));
                mesh.positions.push(Vec3::from(at(u, v).map(|x| x as f32)));
                mesh.normals.push(warp.cross(weft).normalize_or(Vec3::Z));
                mesh.warps.push(warp);
                mesh.uvs.push(size * Vec2::new(u as f32, v as f32));
            }
        }
        let vertex = |row: u32, column: u32| row * (columns + 1) + column;
        for row in 0..rows {
            for column in 0..columns {
                let [a, b, c, d] =
                    [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(r, c)| vertex(row + r, column + c));
                mesh.triangles.extend([[a, c, b], [b, c, d]]);
            }
        }
        mesh
    }

    /// How the cloth lies at a point of a triangle, given by its corners and their weights, that is seen from the direction `viewer`
    /// (unit length). `flat` is the normal of the triangle, unit length, to either side.
    pub(crate) fn place(
        &self,
        corners: [usize; 3],
        weights: Vec3,
        flat: Vec3,
        viewer: Vec3,
    ) -> Place {
        let normal = mix(corners.map(|k| self.normals[k]), weights).normalize_or(Vec3::Z);
        let normal = towards_viewer(normal, flat, viewer);
        let warp = mix(corners.map(|k| self.warps[k]), weights);
        let warp = (warp - warp.dot(normal) * normal).normalize_or(normal.any_orthonormal_vector());
        let uv = mix(corners.map(|k| self.uvs[k].extend(0.0)), weights);
        Place {
            warp: doubles(warp),
            weft: doubles(normal.cross(warp)),
            normal: doubles(normal),
            arc: [f64::from(uv.x), f64::from(uv.y)],
        }
    }

    /// Adds another.
    pub fn join(&mut self, other: Self) {
        let offset = self.positions.len() as u32;
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.warps.extend(other.warps);
        self.uvs.extend(other.uvs);
        self.triangles.extend(
            other
                .triangles
                .iter()
                .map(|t| t.map(|index| index + offset)),
        );
    }
}

/// What can be seen of a mesh and lit, in a frame like that of the picture: half its height is 1.
pub struct Drape {
    mesh: Mesh,
    triangles: Vec<Triangle>,
    bvh: Bvh2,
    /// Nothing is nearer to the viewer.
    front: f32,
    /// Width of the picture over its height.
    aspect: f64,
}

impl Drape {
    /// The mesh turned about the vertical by `azimuth` and then tilted towards the viewer by `elevation` (radians), moved and
    /// scaled into a picture of that `aspect` of width to height. `None` if there is no triangle.
    pub fn new(mut mesh: Mesh, azimuth: f64, elevation: f64, aspect: f64) -> Option<Self> {
        let turn = glam::Mat3::from_rotation_x(elevation as f32)
            * glam::Mat3::from_rotation_y(-azimuth as f32);
        for vectors in [&mut mesh.positions, &mut mesh.normals, &mut mesh.warps] {
            for vector in vectors {
                *vector = turn * *vector;
            }
        }
        let low = mesh.positions.iter().copied().reduce(Vec3::min)?;
        let high = mesh.positions.iter().copied().reduce(Vec3::max)?;
        let (middle, half) = (0.5 * low + 0.5 * high, 0.5 * high - 0.5 * low);
        let scale = MARGIN
            * (aspect as f32 / half.x.max(f32::MIN_POSITIVE))
                .min(1.0 / half.y.max(f32::MIN_POSITIVE));
        for position in &mut mesh.positions {
            *position = scale * (*position - middle);
        }
        let corner = |index: u32| Vec3A::from(mesh.positions[index as usize]);
        let triangles: Vec<Triangle> = mesh
            .triangles
            .iter()
            .map(|[a, b, c]| Triangle {
                v0: corner(*a),
                v1: corner(*b),
                v2: corner(*c),
            })
            .collect();
        if triangles.is_empty() {
            return None;
        }
        let bvh = build_bvh2_from_tris(
            &triangles,
            BvhBuildParams::medium_build(),
            &mut Default::default(),
        );
        Some(Self {
            mesh,
            front: scale * half.z + 1.0,
            triangles,
            bvh,
            aspect,
        })
    }

    /// The nearest triangle along a ray, and how far.
    fn hit(&self, ray: Ray) -> Option<(usize, f32)> {
        let mut hit = RayHit::none();
        let triangle = |index: usize| self.bvh.primitive_indices[index] as usize;
        let is_hit = self.bvh.ray_traverse(ray, &mut hit, |ray, index| {
            intersect(&self.triangles[triangle(index)], ray)
        });
        is_hit.then(|| (triangle(hit.primitive_id as usize), hit.t))
    }
}

impl Scene for Drape {
    fn width(&self, height: usize) -> usize {
        (self.aspect * height as f64).round().max(1.0) as usize
    }

    fn at(&self, x: f64, y: f64) -> Option<Seen> {
        let from = Vec3A::new(x as f32, y as f32, self.front);
        let ray = Ray::new_inf(from, Vec3A::NEG_Z);
        let (index, distance) = self.hit(ray)?;
        let corners = self.mesh.triangles[index].map(|index| index as usize);
        let position = from + distance * Vec3A::NEG_Z;
        let weights = barycentric(&self.triangles[index], position);
        let flat = Vec3::from(self.triangles[index].compute_normal());
        Some(Seen {
            place: self.mesh.place(corners, weights, flat, Vec3::Z),
            position: doubles(position.into()),
        })
    }

    fn is_lit(&self, seen: &Seen, light: [f64; 3]) -> bool {
        let single = |v: [f64; 3]| Vec3A::from(v.map(|x| x as f32));
        let from = single(seen.position) + LIFT * single(seen.place.normal);
        self.hit(Ray::new_inf(from, single(light))).is_none()
    }

    fn span(&self) -> f64 {
        1.0
    }

    fn has_equal_rows(&self) -> bool {
        false
    }
}

/// How much of the picture a mesh fills.
const MARGIN: f32 = 0.96;
/// How far, in weights, a point may be outside of a triangle and meet it: neighbours overlap by that, and no ray slips through.
const EDGE: f32 = 1e-4;

/// How far along a ray the triangle is; infinity if it is not met.
pub(crate) fn intersect(triangle: &Triangle, ray: &Ray) -> f32 {
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
pub(crate) fn barycentric(triangle: &Triangle, point: Vec3A) -> Vec3 {
    let (a, b) = (triangle.v1 - triangle.v0, triangle.v2 - triangle.v0);
    let normal = a.cross(b);
    let area = normal.length_squared();
    let to = point - triangle.v0;
    let v = to.cross(b).dot(normal) / area;
    let w = a.cross(to).dot(normal) / area;
    Vec3::new(1.0 - v - w, v, w)
}

/// The least cosine between a smooth normal and the direction to the viewer where the triangle is seen.
pub(crate) const GRAZING: f32 = 1e-2;

/// The normal that is seen. From behind, cloth is the same with its weft the other way; whether it is seen from behind the
/// triangle says, since near an outline a smooth normal may look away where the triangle does not.
fn towards_viewer(normal: Vec3, flat: Vec3, viewer: Vec3) -> Vec3 {
    let is_behind = (flat.dot(viewer) < 0.0) == (flat.dot(normal) > 0.0);
    let normal = if is_behind { -normal } else { normal };
    let towards = normal.dot(viewer);
    if towards < GRAZING {
        (normal - towards * viewer + GRAZING * viewer).normalize()
    } else {
        normal
    }
}

pub(crate) fn mix(values: [Vec3; 3], weights: Vec3) -> Vec3 {
    weights.x * values[0] + weights.y * values[1] + weights.z * values[2]
}

fn doubles(v: Vec3) -> [f64; 3] {
    v.to_array().map(f64::from)
}
