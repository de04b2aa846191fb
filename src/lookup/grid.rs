//! The value of a grid's splines.
//!
//! Places and weights are computed in lanes. The tiles are then summed pair by pair, since nine loads of 32 bytes, twice, are faster than as
//! many gathers: weights along u₁ are 15-bit integers, so that one instruction multiplies both rows of a tile and adds them, for
//! all coefficients and channels; those along u₂ and u₃ are floats, and those along u₀ are applied in lanes again. All sums
//! of integers are exact.

use crate::brdf::Response;
use crate::math::simd::{Row, Vector};
use crate::table::{Content, Grid, Place, Rows, TAPS, TILE, UNIT, decode};

/// The most lanes of a vector.
const LANES: usize = 16;

/// The sum of the integer weights of two tiles.
const WHOLE: u32 = 32_767;

/// Which tiles `STEP` pairs read, and with which weights.
pub(super) struct Places<const STEP: usize> {
    /// Where the first of the numbers is, or, of a grid that has not all, that of coefficient 0 …
    start: [u32; STEP],
    /// … and how far from it along u₀.
    along: [u32; STEP],
    /// Two weights each along u₁, of the first tile and of the second.
    rows: [[u32; STEP]; 2],
    /// Along u₀, u₂ and u₃.
    weights: [[[f32; STEP]; TAPS]; 3],
    /// The sums, `[coefficient][channel]`.
    sums: [[f32; 8]; STEP],
}

impl<const STEP: usize> Places<STEP> {
    pub(super) fn new() -> Self {
        Self {
            start: [0; STEP],
            along: [0; STEP],
            rows: [[0; STEP]; 2],
            weights: [[[0.0; STEP]; TAPS]; 3],
            sums: [[0.0; 8]; STEP],
        }
    }

    /// The place of pairs from `at` on, at points of the box. Where pairs were not baked it is that of the nearest that were, and the
    /// result is 1, else 0.
    #[inline(always)]
    pub(super) fn find<V: Vector>(&mut self, grid: &Grid, at: usize, u: [V; 4]) -> V {
        let [a0, a1, a2, a3] = &grid.axes;
        let mut places = [
            a0.place(u[0]),
            a1.place(u[1]),
            a2.place(u[2]),
            a3.place(u[3]),
        ];
        let mut missing = V::zero();
        if grid.is_partial() {
            let mut lanes = Settled {
                first: [[0; LANES]; 4],
                points: [[0.0; LANES]; 4],
                missing: [0.0; LANES],
            };
            for axis in 0..4 {
                V::store_index(places[axis].first, &mut lanes.first[axis]);
                u[axis].store(&mut lanes.points[axis]);
            }
            lanes.settle(grid, V::LANES);
            missing = V::load(&lanes.missing);
            let [u0, u1, u2, u3] = &lanes.points;
            places = [
                a0.place(V::load(u0)),
                a1.place(V::load(u1)),
                a2.place(V::load(u2)),
                a3.place(V::load(u3)),
            ];
        }
        let [p0, p1, p2, p3] = places;
        let along = V::times(p0.first, 2 * grid.content.channels() as u32);
        let tile = V::shift_down::<1>(p1.first);
        match &grid.rows {
            None => {
                let [s1, s2, s3] = grid.strides().map(|stride| stride as u32);
                let start = V::plus(V::times(tile, s1), V::times(p2.first, s2));
                let start = V::plus(V::plus(start, V::times(p3.first, s3)), along);
                V::store_index(start, &mut self.start[at..]);
            }
            Some(rows) => {
                let mut first = [[0; LANES]; 4];
                for (to, place) in first.iter_mut().zip([p0, p1, p2, p3]) {
                    V::store_index(place.first, to);
                }
                for lane in 0..V::LANES {
                    let of_lane = [
                        first[0][lane],
                        first[1][lane],
                        first[2][lane],
                        first[3][lane],
                    ];
                    self.start[at + lane] = rows.tile(of_lane);
                }
                V::store_index(along, &mut self.along[at..]);
            }
        }
        for (tile, weights) in integers_of_rows(&p1).into_iter().enumerate() {
            V::store_index(weights, &mut self.rows[tile][at..]);
        }
        for (axis, place) in [p0, p2, p3].into_iter().enumerate() {
            for tap in 0..TAPS {
                place.weights[tap].store(&mut self.weights[axis][tap][at..]);
            }
        }
        missing
    }

    /// Sums the tiles of the first pairs, so many.
    #[inline(always)]
    pub(super) fn sum<R: Row>(&mut self, grid: &Grid, pairs: usize) {
        // Partial grids are rare, and compilers slow.
        match (&grid.rows, grid.coordinates.rank()) {
            (Some(rows), _) => self.sum_in::<R, TAPS, TAPS>(&Part { grid, rows }, pairs),
            (None, rank) if rank == 4 || cfg!(feature = "small") => {
                self.sum_in::<R, TAPS, TAPS>(&All::new(grid), pairs);
            }
            (None, 3) => self.sum_in::<R, TAPS, 1>(&All::new(grid), pairs),
            (None, _) => self.sum_in::<R, 1, 1>(&All::new(grid), pairs),
        }
    }

    /// With so many coefficients along u₂ and u₃.
    #[inline(always)]
    fn sum_in<R: Row, const C: usize, const D: usize>(
        &mut self,
        layout: &impl Layout,
        pairs: usize,
    ) {
        for pair in 0..pairs.min(STEP) {
            let weights = [self.rows[0][pair], self.rows[1][pair]];
            let tiles = layout.tiles::<C, D>(self.start[pair], self.along[pair]);
            let mut total = R::zero();
            for d in 0..D {
                let mut plane = R::zero();
                for c in 0..C {
                    let line = R::sum_tiles([tiles(0, c, d), tiles(1, c, d)], weights);
                    plane = line.mul_add(splat(self.weights[1][c][pair]), plane);
                }
                total = plane.mul_add(splat(self.weights[2][d][pair]), total);
            }
            self.sums[pair] = total.to_array();
        }
    }

    /// S and V of pairs from `at` on.
    #[inline(always)]
    pub(super) fn response<V: Vector>(&self, grid: &Grid, at: usize) -> Response<V> {
        let [a, b, c, d, e, f] = V::columns(&self.sums[at..]);
        let along = &self.weights[0];
        let weights = [
            V::load(&along[0][at..]),
            V::load(&along[1][at..]),
            V::load(&along[2][at..]),
        ];
        let [s, v] = grid.scale;
        let zero = V::zero();
        match grid.content {
            Content::Both => Response {
                surface: decoded(s, [a, c, e], weights),
                volume: decoded(v, [b, d, f], weights),
            },
            // Dyed is lit as the surface is: whatever the albedo, which is in it already.
            Content::Surface | Content::Dyed => Response {
                surface: decoded(s, [a, b, c], weights),
                volume: zero,
            },
            Content::Volume => Response {
                surface: zero,
                volume: decoded(s, [a, b, c], weights),
            },
        }
    }
}

/// The value of a channel by its sums of tiles, with weights along u₀.
#[inline(always)]
fn decoded<V: Vector>(scale: f32, [a, b, c]: [V; TAPS], [w0, w1, w2]: [V; TAPS]) -> V {
    let sum = a.mul_add(w0, b.mul_add(w1, c * w2));
    decode(V::of(f64::from(scale) / (UNIT * f64::from(WHOLE))) * sum)
}

/// The weights along u₁ as integers: those of the first tile's rows, and of the second's.
#[inline(always)]
fn integers_of_rows<V: Vector>(place: &Place<V>) -> [V::Index; 2] {
    let whole = V::of(f64::from(WHOLE));
    let first = (place.weights[0] * whole).to_index();
    let last = (place.weights[2] * whole).to_index();
    let middle = V::minus(V::minus(V::splat_index(WHOLE), first), last);
    let upper = V::shift_up::<16>(middle);
    // From an even row on: 0 1 | 2 –, from an odd one: – 0 | 1 2.
    [
        V::by_parity(place.first, V::or(first, upper), V::shift_up::<16>(first)),
        V::by_parity(place.first, last, V::or(middle, V::shift_up::<16>(last))),
    ]
}

/// How far a pair may be from the place that an axis has collapsed to: some roundings.
const COLLAPSED: f32 = 1e-6;

/// Points and first coefficients of some pairs, by axis.
struct Settled {
    first: [[u32; LANES]; 4],
    points: [[f32; LANES]; 4],
    /// 1 where a pair was not baked, else 0.
    missing: [f32; LANES],
}

impl Settled {
    /// Moves the points of pairs that were not baked to the nearest that were. (Not inlined, since it is no part of what most tables take;
    /// so it must not be of vectors.)
    #[inline(never)]
    fn settle(&mut self, grid: &Grid, lanes: usize) {
        for lane in 0..lanes {
            let point = [0, 1, 2, 3].map(|axis: usize| self.points[axis][lane]);
            let here = [0, 1, 2, 3].map(|axis: usize| self.first[axis][lane]);
            let beside = |axis: usize| {
                let place = grid.axes[axis].integer_knots()[0];
                let place = f32::from(place) / (1u32 << grid.axes[axis].depth()) as f32;
                !((point[axis] - place).abs() <= COLLAPSED)
            };
            let mut is_missing = grid.collapsed().any(beside);
            if let Some(rows) = &grid.rows {
                let (settled, is_elsewhere) = rows.settle(&grid.axes, here);
                if is_elsewhere {
                    is_missing = true;
                    for axis in 0..4 {
                        self.points[axis][lane] = grid.axes[axis].clamp(settled[axis], point[axis]);
                    }
                }
            }
            self.missing[lane] = if is_missing { 1.0 } else { 0.0 };
        }
    }
}

/// Where tiles are.
trait Layout {
    /// The tiles of a cell that begins at a `start`, from `along` on: the first and the second along u₁, of the c-th and d-th of C and D
    /// along u₂ and u₃.
    fn tiles<'a, const C: usize, const D: usize>(
        &'a self,
        start: u32,
        along: u32,
    ) -> impl Fn(usize, usize, usize) -> &'a [i16; TILE];
}

/// All coefficients.
struct All<'a> {
    tiles: &'a [i16],
    strides: [usize; 3],
}

impl<'a> All<'a> {
    #[inline(always)]
    fn new(grid: &'a Grid) -> Self {
        Self {
            tiles: &grid.tiles,
            strides: grid.strides(),
        }
    }
}

impl Layout for All<'_> {
    #[inline(always)]
    fn tiles<'a, const C: usize, const D: usize>(
        &'a self,
        start: u32,
        _: u32,
    ) -> impl Fn(usize, usize, usize) -> &'a [i16; TILE] {
        let [s1, s2, s3] = self.strides;
        let last = s1 + (C - 1) * s2 + (D - 1) * s3;
        let tiles = &self.tiles[start as usize..start as usize + last + TILE];
        #[inline(always)]
        move |b, c, d| {
            // Known where loops over b, c and d are: nothing is left of it.
            assert!(b < 2 && c < C && d < D);
            let offset = d * s3 + c * s2 + b * s1;
            debug_assert!(offset + TILE <= tiles.len());
            #[expect(unsafe_code, reason = "18 checks per lookup cost as much as the sums")]
            // SAFETY: `tiles` have been cut to end with the tile of d = D − 1, c = C − 1, b = 1, and with b, c and d below 2, C and D, as
            // has just been asserted, no tile begins after that one. (Nothing wraps around: strides are products of
            // the numbers of coefficients, of which `Table::from_bytes` and bakes have all in memory.)
            unsafe {
                &*tiles.as_ptr().add(offset).cast::<[i16; TILE]>()
            }
        }
    }
}

/// A part of the coefficients.
struct Part<'a> {
    grid: &'a Grid,
    rows: &'a Rows,
}

impl Layout for Part<'_> {
    #[inline(always)]
    fn tiles<'a, const C: usize, const D: usize>(
        &'a self,
        start: u32,
        along: u32,
    ) -> impl Fn(usize, usize, usize) -> &'a [i16; TILE] {
        let [s1, s2, s3] = self.rows.strides();
        let offsets = &self.rows.offsets()[start as usize..];
        #[inline(always)]
        move |b, c, d| {
            let start = offsets[d * s3 + c * s2 + b * s1] + along as i32;
            // Cells are looked up in tiles that have them.
            self.grid.tiles[start as usize..]
                .first_chunk()
                .expect("the tiles end with padding")
        }
    }
}

/// The same number in every lane.
#[inline(always)]
fn splat<V: Vector>(x: f32) -> V {
    V::of(f64::from(x))
}
