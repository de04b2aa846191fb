//! What the cloth is wrapped around.
//!
//! **Cylinders.** At x ∈ (−1, 1) across an upright cylinder of radius 1 and axis a = (0, 1, 0), the angle is φ = asin x and
//!
//! ```text
//! n = (sin φ, 0, cos φ)      e = a × n = (cos φ, 0, −sin φ)
//! t = cos β e + sin β a      s = n × t = −sin β e + cos β a
//! ```
//!
//! where β turns the warp: 90° lays it along the axis, 0° around it.
//!
//! **Sphere.** The frame at the pole, which faces the viewer, has its warp to the right; from there it is carried along great circles
//! without turning about the normal:
//!
//! ```text
//! n = (x, y, z)      t = (1 − x²/(1+z), −xy/(1+z), −x)      s = (−xy/(1+z), 1 − y²/(1+z), −y)
//! ```
//!
//! The angle between the warp and the great circle stays the same along it, so every slice through the centre is one cylinder:
//! the horizontal slice that with its warp around, the vertical one that with its warp along.
//!
//! Arc lengths are those of unrolled cloth: (φ, y) turned by β on a cylinder, and on the sphere the distance from the pole and
//! the direction there.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use super::{Place, Scene, Seen};

/// What the cloth is wrapped around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Three upright cylinders side by side: see [`Cylinder::ALL`].
    Cylinders,
    /// One sphere.
    Sphere,
}

/// One of the cylinders, by how the warp lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cylinder {
    /// Along the axis: the weft goes around.
    Vertical,
    /// Around.
    Horizontal,
    /// Rising at 45° to the right.
    Diagonal,
}

impl Cylinder {
    /// All of them, from left to right.
    pub const ALL: [Self; 3] = [Self::Vertical, Self::Horizontal, Self::Diagonal];

    /// What the tool calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vertical => "vertical",
            Self::Horizontal => "horizontal",
            Self::Diagonal => "diagonal",
        }
    }

    /// β, the angle of the warp from around the cylinder towards up, radians.
    fn turn(self) -> f64 {
        match self {
            Self::Vertical => FRAC_PI_2,
            Self::Horizontal => 0.0,
            Self::Diagonal => FRAC_PI_4,
        }
    }

    /// The cloth at an angle from the middle to the right, radians, and a height in units of the radius.
    pub fn at(self, angle: f64, height: f64) -> Place {
        let (sin, cos) = angle.sin_cos();
        // Exactly 0 and 1 where the warp is along the axis or around.
        let (up, around) = match self {
            Self::Vertical => (1.0, 0.0),
            Self::Horizontal => (0.0, 1.0),
            Self::Diagonal => self.turn().sin_cos(),
        };
        Place {
            warp: [around * cos, up, -around * sin],
            weft: [-up * cos, around, up * sin],
            normal: [sin, 0.0, cos],
            arc: [around * angle + up * height, around * height - up * angle],
        }
    }
}

/// From the middle of one cylinder to that of the next; half the height of the picture is 1.
const SPACING: f64 = 4.0 / 3.0;
const CYLINDER_RADIUS: f64 = 0.6;
const SPHERE_RADIUS: f64 = 0.96;

impl Shape {
    /// What the tool calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cylinders => "cylinders",
            Self::Sphere => "sphere",
        }
    }
}

impl Scene for Shape {
    fn width(&self, height: usize) -> usize {
        match self {
            Self::Cylinders => 2 * height,
            Self::Sphere => height,
        }
    }

    fn at(&self, x: f64, y: f64) -> Option<Seen> {
        let place = match self {
            Self::Cylinders => {
                let index = (x / SPACING).round().clamp(-1.0, 1.0);
                let across = (x - index * SPACING) / CYLINDER_RADIUS;
                let cylinder = Cylinder::ALL[(index + 1.0) as usize];
                (across.abs() < 1.0).then(|| cylinder.at(across.asin(), y / CYLINDER_RADIUS))
            }
            Self::Sphere => sphere(x / SPHERE_RADIUS, y / SPHERE_RADIUS),
        }?;
        let radius = match self {
            Self::Cylinders => CYLINDER_RADIUS,
            Self::Sphere => SPHERE_RADIUS,
        };
        let position = [x, y, radius * place.normal[2]];
        Some(Seen { place, position })
    }

    /// Where the light is not behind the surface, it is seen: each is convex and has no others in its light.
    fn is_lit(&self, _: &Seen, _: [f64; 3]) -> bool {
        true
    }

    fn span(&self) -> f64 {
        PI
    }

    fn has_equal_rows(&self) -> bool {
        *self == Self::Cylinders
    }
}

fn sphere(x: f64, y: f64) -> Option<Place> {
    let r2 = x * x + y * y;
    if r2 >= 1.0 {
        return None;
    }
    let z = (1.0 - r2).sqrt();
    let below = 1.0 / (1.0 + z);
    let r = r2.sqrt();
    // θ / sin θ, 1 at the pole.
    let stretch = if r > 0.0 { r.asin() / r } else { 1.0 };
    Some(Place {
        warp: [1.0 - x * x * below, -x * y * below, -x],
        weft: [-x * y * below, 1.0 - y * y * below, -y],
        normal: [x, y, z],
        arc: [x * stretch, y * stretch],
    })
}
