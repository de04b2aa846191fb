//! Cloth as triangles: from files, as it hangs, and where rays meet it.

mod gltf;
mod hanging;
mod load;
mod obj;
#[cfg(test)]
mod tests;
mod trace;

use glam::{DVec3, Vec2, Vec3};

pub use gltf::{Camera, Light, Projection, Punctual};
pub use hanging::{curtain, skirt, trousers};
pub use load::{MAX_MESH_BYTES, MeshError, MeshFile, Part, load_mesh};
#[cfg(feature = "scene")]
pub(crate) use trace::Met;
pub(crate) use trace::Solid;

/// Triangles of a cloth.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// By vertex.
    pub positions: Vec<Vec3>,
    /// Unit normals, by vertex.
    pub normals: Vec<Vec3>,
    /// Along the warp, by vertex: any length, not along the normal.
    pub warps: Vec<Vec3>,
    /// Whether the weft runs against normal × warp, by vertex: texture coordinates are mirrored there, and a tangent's w is −1. A triangle
    /// is what its first corner is.
    pub mirrored: Vec<bool>,
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
                mesh.mirrored.push(false);
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
        let weft = normal.cross(warp);
        Place {
            warp: doubles(warp),
            weft: doubles(if self.mirrored[corners[0]] {
                -weft
            } else {
                weft
            }),
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
        self.mirrored.extend(other.mirrored);
        self.uvs.extend(other.uvs);
        self.triangles.extend(
            other
                .triangles
                .iter()
                .map(|t| t.map(|index| index + offset)),
        );
    }
}

/// The normal of a triangle, in double precision; `None` where it has no area, and is never met.
pub(crate) fn flat_normal(mesh: &Mesh, triangle: [u32; 3]) -> Option<DVec3> {
    let [a, b, c] = triangle.map(|index| mesh.positions[index as usize].as_dvec3());
    (b - a).cross(c - a).try_normalize()
}

/// A point of the cloth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Unit vector along the warp: x right, y up, z to the viewer.
    pub warp: [f64; 3],
    /// Unit vector along the weft.
    pub weft: [f64; 3],
    /// Unit normal, away from the surface.
    pub normal: [f64; 3],
    /// Where on the unrolled cloth, along warp and weft, in units of the radius.
    pub arc: [f64; 2],
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

fn mix(values: [Vec3; 3], weights: Vec3) -> Vec3 {
    weights.x * values[0] + weights.y * values[1] + weights.z * values[2]
}

fn doubles(v: Vec3) -> [f64; 3] {
    v.to_array().map(f64::from)
}
