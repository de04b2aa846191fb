//! Points of a grid's box.

use alloc::vec::Vec;

use super::grid::Places;
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
        const STEP: usize = 16;
        let mut places = Places::<STEP>::new();
        let strides = self.grid.all_strides();
        loop {
            let mut u = [[0.0; STEP]; 4];
            let mut count = 0;
            for point in self.points.by_ref().take(STEP) {
                for (u, x) in u.iter_mut().zip(point) {
                    u[count] = x;
                }
                count += 1;
            }
            if count == 0 {
                return;
            }
            for at in (0..STEP).step_by(V::LANES) {
                let u = [
                    V::load(&u[0][at..]),
                    V::load(&u[1][at..]),
                    V::load(&u[2][at..]),
                    V::load(&u[3][at..]),
                ];
                places.find(self.grid, strides, at, u);
            }
            places.sum::<R>(self.grid, count);
            let mut roots = [[0.0; STEP]; 2];
            for at in (0..STEP).step_by(V::LANES) {
                let response = places.response::<V>(self.grid, at);
                response.surface.sqrt().store(&mut roots[0][at..]);
                response.volume.sqrt().store(&mut roots[1][at..]);
            }
            let roots = roots[0].into_iter().zip(roots[1]);
            self.roots.extend(roots.take(count).map(|(s, v)| [s, v]));
        }
    }
}
