//! The value of a grid's splines.
//!
//! Places in the box are computed for all lanes at once. The coefficients are then summed lane by lane, since a pair's 27
//! rows of contiguous numbers are faster to read than as many gathers: a row is one load, widened to f32, and both
//! channels of all coefficients along the sharp axis are multiplied at once.

use crate::brdf::Response;
use crate::math::simd::{Row, Vector};
use crate::math::{Vec3, splat};
use crate::table::{CHANNELS, Grid, ROW, Samples, TAPS};

/// S and V, or whatever else the grid is of, for pairs in thread coordinates above the surface.
#[inline(always)]
pub(super) fn value<V: Vector, R: Row>(grid: &Grid, wi: Vec3<V>, wr: Vec3<V>) -> Response<V> {
    let u = grid.coordinates.of(wi, wr);
    let [a0, a1, a2, a3] = &grid.axes;
    let first = [
        a0.first(u[0]),
        a1.first(u[1]),
        a2.first(u[2]),
        a3.first(u[3]),
    ];
    let places = Places::<V>::new(grid, u, first);
    let sums = match &grid.samples {
        Samples::F32(samples) => places.sum_over_rank::<R, _>(grid, samples),
        Samples::I16(samples) => places.sum_over_rank::<R, _>(grid, samples),
        Samples::I8(samples) => places.sum_over_rank::<R, _>(grid, samples),
    };
    let unit = grid.encoding.unit();
    let scale = |channel: usize| V::of(f64::from(grid.scale[channel]) / unit);
    Response {
        surface: grid.encoding.decode(scale(0) * V::from_array(sums[0])),
        volume: grid.encoding.decode(scale(1) * V::from_array(sums[1])),
    }
}

/// Which coefficients the lanes read, and with which weights.
struct Places<V: Vector> {
    /// The first coefficient of u₀ … u₃.
    first: [V::IndexArray; 4],
    /// `[axis][tap]`
    weights: [[V::Array; TAPS]; 4],
    /// From one coefficient of u₁, u₂ and u₃ to the next.
    strides: [usize; 3],
}

impl<V: Vector> Places<V> {
    #[inline(always)]
    fn new(grid: &Grid, u: [V; 4], first: [V::Index; 4]) -> Self {
        let first = [
            V::index_to_array(first[0]),
            V::index_to_array(first[1]),
            V::index_to_array(first[2]),
            V::index_to_array(first[3]),
        ];
        let mut weights = [[V::Array::default(); TAPS]; 4];
        for axis in 0..4 {
            let (u, first) = (u[axis].to_array(), &first[axis]);
            for lane in 0..V::LANES {
                let taps = grid.axes[axis].weights(first.as_ref()[lane], u.as_ref()[lane]);
                for tap in 0..TAPS {
                    weights[axis][tap].as_mut()[lane] = taps[tap];
                }
            }
        }
        Self {
            first,
            weights,
            strides: grid.strides(),
        }
    }

    /// Σ of weights and stored numbers, per channel.
    #[inline(always)]
    fn sum_over_rank<R: Row, T: Sample>(&self, grid: &Grid, samples: &[T]) -> [V::Array; CHANNELS] {
        match grid.coordinates.rank() {
            4 => self.sum::<R, T, TAPS, TAPS, TAPS>(samples),
            3 => self.sum::<R, T, TAPS, TAPS, 1>(samples),
            2 => self.sum::<R, T, TAPS, 1, 1>(samples),
            _ => self.sum::<R, T, 1, 1, 1>(samples),
        }
    }

    /// With so many coefficients along u₁, u₂ and u₃.
    #[inline(always)]
    fn sum<R: Row, T: Sample, const B: usize, const C: usize, const D: usize>(
        &self,
        samples: &[T],
    ) -> [V::Array; CHANNELS] {
        let [s1, s2, s3] = self.strides;
        let mut sums = [V::Array::default(); CHANNELS];
        for lane in 0..V::LANES {
            let w = |axis: usize, tap: usize| self.weights[axis][tap].as_ref()[lane];
            let first = |axis: usize| self.first[axis].as_ref()[lane] as usize;
            let start = CHANNELS * first(0) + s1 * first(1) + s2 * first(2) + s3 * first(3);
            let last = start + (B - 1) * s1 + (C - 1) * s2 + (D - 1) * s3;
            let samples = &samples[start..last + ROW];
            let mut total = R::zero();
            for d in 0..D {
                let mut plane = R::zero();
                for c in 0..C {
                    let mut line = R::zero();
                    for b in 0..B {
                        let offset = d * s3 + c * s2 + b * s1;
                        #[expect(
                            unsafe_code,
                            reason = "27 checks per lookup cost as much as the sums"
                        )]
                        // SAFETY: the slice reaches to the end of the row with d = D − 1, c = C − 1, b = B − 1.
                        let row = unsafe { &*samples.as_ptr().add(offset).cast::<[T; ROW]>() };
                        line = T::widen::<R>(row).mul_add(splat(w(1, b)), line);
                    }
                    plane = line.mul_add(splat(w(2, c)), plane);
                }
                total = plane.mul_add(splat(w(3, d)), total);
            }
            let total = total.to_array();
            for (channel, sums) in sums.iter_mut().enumerate() {
                sums.as_mut()[lane] = w(0, 0) * total[channel]
                    + w(0, 1) * total[CHANNELS + channel]
                    + w(0, 2) * total[2 * CHANNELS + channel];
            }
        }
        sums
    }
}

/// A number that rows are stored of.
trait Sample: Copy {
    fn widen<R: Row>(row: &[Self; ROW]) -> R;
}

impl Sample for f32 {
    #[inline(always)]
    fn widen<R: Row>(row: &[Self; ROW]) -> R {
        R::from_array(*row)
    }
}

impl Sample for i16 {
    #[inline(always)]
    fn widen<R: Row>(row: &[Self; ROW]) -> R {
        R::widen_i16(row)
    }
}

impl Sample for i8 {
    #[inline(always)]
    fn widen<R: Row>(row: &[Self; ROW]) -> R {
        R::widen_i8(row)
    }
}
