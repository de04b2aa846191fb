//! Pictures of a mesh.

use glam::{Vec3, Vec3A};

use super::{Scene, Seen};
use crate::mesh::{Mesh, Solid};

/// Shadow rays begin this far above the surface, in units of half the picture's height: beyond rounding and the steps between
/// triangles and their smooth normals.
const LIFT: f32 = 2e-3;
/// How much of the picture a mesh fills.
const MARGIN: f32 = 0.96;

/// What can be seen of a mesh and lit, in a frame like that of the picture: half its height is 1.
pub struct Drape {
    mesh: Mesh,
    solid: Solid,
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
        if mesh.triangles.is_empty() {
            return None;
        }
        Some(Self {
            solid: Solid::new(&mesh),
            mesh,
            front: scale * half.z + 1.0,
            aspect,
        })
    }
}

impl Scene for Drape {
    fn width(&self, height: usize) -> usize {
        (self.aspect * height as f64).round().max(1.0) as usize
    }

    fn at(&self, x: f64, y: f64) -> Option<Seen> {
        let from = Vec3A::new(x as f32, y as f32, self.front);
        let met = self.solid.hit(from, Vec3A::NEG_Z)?;
        let weights = self.solid.weights(&self.mesh, &met);
        Some(Seen {
            place: self.solid.place(&self.mesh, &met, weights, Vec3::Z),
            position: met.point.to_array().map(f64::from),
        })
    }

    fn is_lit(&self, seen: &Seen, light: [f64; 3]) -> bool {
        let single = |v: [f64; 3]| Vec3A::from(v.map(|x| x as f32));
        let from = single(seen.position) + LIFT * single(seen.place.normal);
        self.solid.hit(from, single(light)).is_none()
    }

    fn span(&self) -> f64 {
        1.0
    }

    fn has_equal_rows(&self) -> bool {
        false
    }
}
