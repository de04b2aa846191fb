//! Points of a grid's box.

use alloc::vec::Vec;

use super::interpolate::at;
use crate::math::simd::{Kernel, Level, Row, Vector};
use crate::table::Grid;

/// √S and √V of a grid at points of its box. Where nothing was baked they are of the nearest that was.
pub(crate) fn roots(grid: &Grid, points: impl ExactSizeIterator<Item = [f32; 4]>) -> Vec<[f32; 2]> {
    let mut roots = Vec::with_capacity(points.len());
    Level::detect().run(Points {
        grid,
        points,
        roots: &mut roots,
    });
    roots
}

struct Points<'a, I> {
    grid: &'a Grid,
    points: I,
    roots: &'a mut Vec<[f32; 2]>,
}

impl<I: Iterator<Item = [f32; 4]>> Kernel for Points<'_, I> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector, R: Row>(mut self) {
        loop {
            let mut u = [V::Array::default(); 4];
            let mut count = 0;
            for point in self.points.by_ref().take(V::LANES) {
                for (u, x) in u.iter_mut().zip(point) {
                    u.as_mut()[count] = x;
                }
                count += 1;
            }
            if count == 0 {
                return;
            }
            let u = [
                V::from_array(u[0]),
                V::from_array(u[1]),
                V::from_array(u[2]),
                V::from_array(u[3]),
            ];
            let response = at::<V, R>(self.grid, self.grid.is_partial(), u).response;
            let surface = response.surface.sqrt().to_array();
            let volume = response.volume.sqrt().to_array();
            let both = surface.as_ref().iter().zip(volume.as_ref());
            self.roots.extend(both.take(count).map(|(s, v)| [*s, *v]));
        }
    }
}
