//! The frame of a thread in the surface.

use num_traits::Float;

use crate::math::{Lanes, Real, Vec3};

/// Frame of an untilted thread of direction angle α in the surface: t = (cos α, sin α, 0) along the thread,
/// s = n × t sideways, n the surface normal. Warp is α = 0, weft α = 90°.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreadFrame<R> {
    cos: R,
    sin: R,
}

impl<R: Lanes> ThreadFrame<R> {
    /// The frame of a thread whose direction is `angle` radians from the surface's x axis towards y.
    pub fn new(angle: f64) -> Self {
        let (mut sin, mut cos) = Float::sin_cos(angle);
        // Warp and weft are exact: a direction in the plane of a thread stays in it.
        if sin.abs() < 1e-15 {
            sin = 0.0;
        }
        if cos.abs() < 1e-15 {
            cos = 0.0;
        }
        Self {
            cos: R::of(cos),
            sin: R::of(sin),
        }
    }

    /// Surface coordinates to thread coordinates `[w·t, w·s, w·n]`.
    #[inline(always)]
    pub fn to_thread(&self, w: Vec3<R>) -> Vec3<R> {
        [
            w[0] * self.cos + w[1] * self.sin,
            w[1] * self.cos - w[0] * self.sin,
            w[2],
        ]
    }

    /// Thread coordinates to surface coordinates.
    #[inline(always)]
    pub fn to_surface(&self, w: Vec3<R>) -> Vec3<R> {
        [
            w[0] * self.cos - w[1] * self.sin,
            w[1] * self.cos + w[0] * self.sin,
            w[2],
        ]
    }
}

impl<R: Lanes> ThreadFrame<R> {
    /// That with these cosines and sines.
    #[inline(always)]
    pub(crate) fn of_numbers([cos, sin]: [R; 2]) -> Self {
        Self { cos, sin }
    }
}

impl ThreadFrame<f32> {
    /// cos α and sin α.
    pub(crate) fn numbers(&self) -> [f32; 2] {
        [self.cos, self.sin]
    }
}

impl<R: Real> ThreadFrame<R> {
    /// The same frame in another precision, or in every lane.
    #[inline(always)]
    pub fn cast<T: Lanes>(&self) -> ThreadFrame<T> {
        ThreadFrame {
            cos: T::of(self.cos.to_double()),
            sin: T::of(self.sin.to_double()),
        }
    }
}
