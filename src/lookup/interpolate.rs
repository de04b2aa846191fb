//! The value of a grid's splines.
//!
//! Places in the box are computed for all lanes at once. The coefficients are then summed lane by lane, since a pair's 27
//! rows of contiguous numbers are faster to read than as many gathers: a row is one load, widened to f32, and both
//! channels of all coefficients along the sharp axis are multiplied at once.

use crate::brdf::Response;
use crate::math::simd::{Row, Vector};
use crate::math::{Vec3, splat};
use crate::table::{CHANNELS, Content, Grid, ROW, Rows, Samples, TAPS};

/// What a grid says of pairs.
pub(super) struct Found<V> {
    /// S and V, or whatever else the grid is of.
    pub(super) response: Response<V>,
    /// 1 where the pair was not baked and this is the nearest that was, else 0.
    pub(super) missing: V,
}

/// The value for pairs in thread coordinates above the surface, which all have one unless the table `is_partial`.
#[inline(always)]
pub(super) fn value<V: Vector, R: Row>(
    grid: &Grid,
    is_partial: bool,
    wi: Vec3<V>,
    wr: Vec3<V>,
) -> Found<V> {
    at::<V, R>(grid, is_partial, grid.coordinates.of(wi, wr))
}

/// The value at points of the box.
#[inline(always)]
pub(super) fn at<V: Vector, R: Row>(grid: &Grid, is_partial: bool, u: [V; 4]) -> Found<V> {
    let [a0, a1, a2, a3] = &grid.axes;
    let first = [
        a0.first(u[0]),
        a1.first(u[1]),
        a2.first(u[2]),
        a3.first(u[3]),
    ];
    let mut places = Places::<V>::new(grid, u, first);
    let missing = if is_partial {
        V::from_array(places.settle(
            grid,
            u.map(
                #[inline(always)]
                |u| u.to_array(),
            ),
        ))
    } else {
        V::zero()
    };
    let sums = match &grid.samples {
        Samples::F32(samples) => places.sum_over_rank::<R, _>(grid, samples),
        Samples::I16(samples) => places.sum_over_rank::<R, _>(grid, samples),
        Samples::I8(samples) => places.sum_over_rank::<R, _>(grid, samples),
    };
    let unit = grid.encoding.unit();
    let decoded = |channel: usize| {
        let scale = V::of(f64::from(grid.scale[channel]) / unit);
        grid.encoding.decode(scale * V::from_array(sums[channel]))
    };
    let [surface, volume] = match grid.content {
        Content::Both => [decoded(0), decoded(1)],
        // Dyed is lit as the surface is: whatever the albedo, which is in it already.
        Content::Surface | Content::Dyed => [decoded(0), V::zero()],
        Content::Volume => [V::zero(), decoded(0)],
    };
    Found {
        response: Response { surface, volume },
        missing,
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

    /// Moves pairs that were not baked to the nearest that were; 1 in their lanes, else 0. (Not inlined, since it is no part of what most
    /// tables take, and has nothing to gain from wide vectors.)
    #[inline(never)]
    fn settle(&mut self, grid: &Grid, u: [V::Array; 4]) -> V::Array {
        let mut missing = V::Array::default();
        for lane in 0..V::LANES {
            let u = u.each_ref().map(|u| u.as_ref()[lane]);
            let first = [0, 1, 2, 3].map(|axis| self.first[axis].as_ref()[lane]);
            let beside = |axis: usize| {
                let place = grid.axes[axis].integer_knots()[0];
                let place = f32::from(place) / (1u32 << grid.axes[axis].depth()) as f32;
                !((u[axis] - place).abs() <= COLLAPSED)
            };
            let mut is_missing = grid.collapsed().any(beside);
            if let Some(rows) = &grid.rows {
                let (settled, is_elsewhere) = rows.settle(first);
                if is_elsewhere {
                    is_missing = true;
                    self.move_to(grid, lane, settled, u);
                }
            }
            missing.as_mut()[lane] = if is_missing { 1.0 } else { 0.0 };
        }
        missing
    }

    #[cold]
    fn move_to(&mut self, grid: &Grid, lane: usize, first: [u32; 4], u: [f32; 4]) {
        for axis in 0..4 {
            self.first[axis].as_mut()[lane] = first[axis];
            let u = grid.axes[axis].clamp(first[axis], u[axis]);
            for (tap, weight) in grid.axes[axis]
                .weights(first[axis], u)
                .into_iter()
                .enumerate()
            {
                self.weights[axis][tap].as_mut()[lane] = weight;
            }
        }
    }

    /// Σ of weights and stored numbers, per channel.
    #[inline(always)]
    fn sum_over_rank<R: Row, T: Sample>(&self, grid: &Grid, samples: &[T]) -> [V::Array; CHANNELS] {
        let channels = grid.content.channels();
        let all = All(self.strides);
        // Parts are rare, and compilers slow: along an axis that is flat they read the same row thrice, twice with weight 0.
        match (&grid.rows, grid.coordinates.rank()) {
            (Some(rows), _) => self.sum::<R, T, TAPS, TAPS, TAPS>(channels, rows, samples),
            (None, rank) if rank == 4 || cfg!(feature = "small") => {
                self.sum::<R, T, TAPS, TAPS, TAPS>(channels, &all, samples)
            }
            (None, 3) => self.sum::<R, T, TAPS, TAPS, 1>(channels, &all, samples),
            (None, 2) => self.sum::<R, T, TAPS, 1, 1>(channels, &all, samples),
            (None, _) => self.sum::<R, T, 1, 1, 1>(channels, &all, samples),
        }
    }

    /// Of so many channels, with so many coefficients along u₁, u₂ and u₃.
    #[inline(always)]
    fn sum<R: Row, T: Sample, const B: usize, const C: usize, const D: usize>(
        &self,
        channels: usize,
        layout: &impl Layout,
        samples: &[T],
    ) -> [V::Array; CHANNELS] {
        let mut sums = [V::Array::default(); CHANNELS];
        for lane in 0..V::LANES {
            let w = |axis: usize, tap: usize| self.weights[axis][tap].as_ref()[lane];
            let first = [0, 1, 2, 3].map(|axis| self.first[axis].as_ref()[lane] as usize);
            let rows = layout.rows::<T, B, C, D>(channels, first, samples);
            let mut total = R::zero();
            for d in 0..D {
                let mut plane = R::zero();
                for c in 0..C {
                    let mut line = R::zero();
                    for b in 0..B {
                        let row = T::widen::<R>(rows(b, c, d));
                        line = row.mul_add(splat(w(1, b)), line);
                    }
                    plane = line.mul_add(splat(w(2, c)), plane);
                }
                total = plane.mul_add(splat(w(3, d)), total);
            }
            let total = total.to_array();
            for (channel, sums) in sums.iter_mut().take(channels).enumerate() {
                sums.as_mut()[lane] = w(0, 0) * total[channel]
                    + w(0, 1) * total[channels + channel]
                    + w(0, 2) * total[2 * channels + channel];
            }
        }
        sums
    }
}

/// How far a pair may be from the place that an axis has collapsed to: some roundings.
const COLLAPSED: f32 = 1e-6;

/// Where among the samples rows are.
trait Layout {
    /// The rows of a cell of so many channels by its first coefficients: from there on as many numbers as are read at once, for the b-th,
    /// c-th and d-th of B, C and D along u₁, u₂ and u₃.
    fn rows<'a, T, const B: usize, const C: usize, const D: usize>(
        &'a self,
        channels: usize,
        first: [usize; 4],
        samples: &'a [T],
    ) -> impl Fn(usize, usize, usize) -> &'a [T; ROW];
}

/// All coefficients, so far apart along u₁, u₂ and u₃.
struct All([usize; 3]);

impl Layout for All {
    #[inline(always)]
    fn rows<'a, T, const B: usize, const C: usize, const D: usize>(
        &'a self,
        channels: usize,
        first: [usize; 4],
        samples: &'a [T],
    ) -> impl Fn(usize, usize, usize) -> &'a [T; ROW] {
        let [s1, s2, s3] = self.0;
        let start = channels * first[0] + s1 * first[1] + s2 * first[2] + s3 * first[3];
        let last = start + (B - 1) * s1 + (C - 1) * s2 + (D - 1) * s3;
        let samples = &samples[start..last + ROW];
        #[inline(always)]
        move |b, c, d| {
            // Known where loops over b, c and d are: nothing is left of it.
            assert!(b < B && c < C && d < D);
            let offset = d * s3 + c * s2 + b * s1;
            debug_assert!(offset + ROW <= samples.len());
            #[expect(unsafe_code, reason = "27 checks per lookup cost as much as the sums")]
            // SAFETY: `samples` have been cut to end with the row of d = D − 1, c = C − 1, b = B − 1, and with b, c and d below B, C and D, as
            // has just been asserted, no row begins after that one. (Nothing wraps around: strides are products of
            // the numbers of coefficients, of which `Table::from_bytes` and bakes have all in memory.)
            unsafe {
                &*samples.as_ptr().add(offset).cast::<[T; ROW]>()
            }
        }
    }
}

impl Layout for Rows {
    #[inline(always)]
    fn rows<'a, T, const B: usize, const C: usize, const D: usize>(
        &'a self,
        channels: usize,
        first: [usize; 4],
        samples: &'a [T],
    ) -> impl Fn(usize, usize, usize) -> &'a [T; ROW] {
        let [s1, s2, s3] = self.strides();
        let last = (B - 1) * s1 + (C - 1) * s2 + (D - 1) * s3;
        let offsets = &self.offsets_from(first)[..=last];
        let along = (channels * first[0]) as i32;
        #[inline(always)]
        move |b, c, d| {
            let start = (offsets[d * s3 + c * s2 + b * s1] + along) as usize;
            // Cells are looked up in rows that have them.
            samples[start..]
                .first_chunk()
                .expect("the samples end with padding")
        }
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
