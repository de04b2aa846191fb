//! The value of a grid's splines.
//!
//! Places and weights are computed in lanes. The tiles are then summed pair by pair, since nine loads of 32 bytes, twice, are faster than as
//! many gathers: weights along u₁ are 15-bit integers, so that one instruction multiplies both rows of a tile and adds them, for
//! all coefficients and channels; those along u₂ and u₃ are floats, and those along u₀ are applied in lanes again. All sums
//! of integers are exact.

use crate::brdf::Response;
use crate::math::simd::{Row, Vector};
use crate::math::splat;
use crate::table::{Content, Grid, Place, Rows, TAPS, TILE, WHOLE, decode};

/// The most lanes of a vector.
const LANES: usize = 16;

/// Which tiles `STEP` pairs read, and with which weights.
pub(super) struct Places<const STEP: usize> {
    /// Where the first of the numbers is; of a grid that has not all, how far along u₀ in each tile.
    start: [u32; STEP],
    /// Of a grid that has not all, the first tile.
    tile: [u32; STEP],
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
            tile: [0; STEP],
            rows: [[0; STEP]; 2],
            weights: [[[0.0; STEP]; TAPS]; 3],
            sums: [[0.0; 8]; STEP],
        }
    }

    /// The place of pairs from `at` on, at points of the box. Where pairs were not baked it is that of the nearest that were, and the
    /// result is 1, else 0.
    #[inline(always)]
    pub(super) fn find<V: Vector>(
        &mut self,
        grid: &Grid,
        strides: [u32; 4],
        at: usize,
        u: [V; 4],
    ) -> V {
        let [a0, a1, a2, a3] = &grid.axes;
        let mut places = [
            a0.place(u[0]),
            a1.place(u[1]),
            a2.place(u[2]),
            a3.place(u[3]),
        ];
        let missing = if grid.is_partial() {
            let mut first = [[0; LANES]; 4];
            let mut points = [[0.0; LANES]; 4];
            for axis in 0..4 {
                V::store_index(places[axis].first, &mut first[axis]);
                u[axis].store(&mut points[axis]);
            }
            let missing = settle(grid, &first, &mut points, V::LANES);
            places = [
                a0.place(V::load(&points[0])),
                a1.place(V::load(&points[1])),
                a2.place(V::load(&points[2])),
                a3.place(V::load(&points[3])),
            ];
            V::load(&missing)
        } else {
            V::zero()
        };
        let strides = [
            V::splat_index(strides[0]),
            V::splat_index(strides[1]),
            V::splat_index(strides[2]),
            V::splat_index(strides[3]),
        ];
        let Some(rows) = &grid.rows else {
            self.put(at, start(&places, strides), &places);
            return missing;
        };
        self.put(at, V::times(places[0].first, strides[0]), &places);
        let mut first = [[0; LANES]; 4];
        for (to, place) in first.iter_mut().zip(&places) {
            V::store_index(place.first, to);
        }
        let tiles = self.tile[at..].iter_mut().take(V::LANES);
        for (lane, tile) in tiles.enumerate() {
            *tile = rows.tile([0, 1, 2, 3].map(|axis: usize| first[axis][lane]));
        }
        missing
    }

    /// Places of pairs from `at` on, whose tiles start where they do.
    #[inline(always)]
    pub(super) fn put<V: Vector>(&mut self, at: usize, start: V::Index, places: &[Place<V>; 4]) {
        V::store_index(start, &mut self.start[at..]);
        for (tile, weights) in integers_of_rows(&places[1]).into_iter().enumerate() {
            V::store_index(weights, &mut self.rows[tile][at..]);
        }
        for (axis, place) in [&places[0], &places[2], &places[3]].into_iter().enumerate() {
            for tap in 0..TAPS {
                place.weights[tap].store(&mut self.weights[axis][tap][at..]);
            }
        }
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
            self.sum_pair::<R, C, D>(layout, pair);
        }
    }

    #[inline(always)]
    fn sum_pair<R: Row, const C: usize, const D: usize>(
        &mut self,
        layout: &impl Layout,
        pair: usize,
    ) {
        let weights = [self.rows[0][pair], self.rows[1][pair]];
        let tiles = layout.tiles::<C, D>(self.start[pair], self.tile[pair]);
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

    /// Sums the tiles of one pair, in a grid of four coordinates.
    #[inline(always)]
    pub(super) fn sum_one<R: Row>(&mut self, grid: &Grid, pair: usize) {
        match &grid.rows {
            Some(rows) => self.sum_pair::<R, TAPS, TAPS>(&Part { grid, rows }, pair),
            None => self.sum_pair::<R, TAPS, TAPS>(&All::new(grid), pair),
        }
    }

    /// Where one pair's tiles are, in a grid that has not all.
    #[inline(always)]
    pub(super) fn put_tile(&mut self, rows: &Rows, pair: usize, first: [u32; 4], along: u32) {
        self.tile[pair] = rows.tile(first);
        self.start[pair] = along * first[0];
    }

    /// S and V of pairs from `at` on, whose grids have both, with scales of their own.
    #[inline(always)]
    pub(super) fn both<V: Vector>(&self, at: usize, scale: [V; 2]) -> Response<V> {
        let ([a, b, c, d, e, f], weights) = self.columns::<V>(at);
        Response {
            surface: decoded(scale[0], [a, c, e], weights),
            volume: decoded(scale[1], [b, d, f], weights),
        }
    }

    /// Sums by coefficient and channel, and weights along u₀.
    #[inline(always)]
    fn columns<V: Vector>(&self, at: usize) -> ([V; 6], [V; TAPS]) {
        let along = &self.weights[0];
        let weights = [
            V::load(&along[0][at..]),
            V::load(&along[1][at..]),
            V::load(&along[2][at..]),
        ];
        (V::columns(&self.sums[at..]), weights)
    }

    /// S and V of pairs from `at` on.
    #[inline(always)]
    pub(super) fn response<V: Vector>(&self, grid: &Grid, at: usize) -> Response<V> {
        let [s, v] = grid.integer_scale();
        let [s, v] = [splat(s), splat(v)];
        if grid.content == Content::Both {
            return self.both(at, [s, v]);
        }
        let ([a, b, c, ..], weights) = self.columns::<V>(at);
        let value = decoded(s, [a, b, c], weights);
        match grid.content {
            Content::Volume => Response {
                surface: V::zero(),
                volume: value,
            },
            // Dyed is lit as the surface is: whatever the albedo, which is in it already.
            Content::Both | Content::Surface | Content::Dyed => Response {
                surface: value,
                volume: V::zero(),
            },
        }
    }
}

/// Where tiles start that begin at places.
#[inline(always)]
pub(super) fn start<V: Vector>(places: &[Place<V>; 4], strides: [V::Index; 4]) -> V::Index {
    let along = V::times(places[0].first, strides[0]);
    let tile = V::times(V::shift_down::<1>(places[1].first), strides[1]);
    let line = V::times(places[2].first, strides[2]);
    let plane = V::times(places[3].first, strides[3]);
    V::plus(V::plus(along, tile), V::plus(line, plane))
}

/// The value of a channel by its sums of tiles, with weights along u₀.
#[inline(always)]
fn decoded<V: Vector>(scale: V, [a, b, c]: [V; TAPS], [w0, w1, w2]: [V; TAPS]) -> V {
    let sum = a.mul_add(w0, b.mul_add(w1, c * w2));
    decode(scale * sum)
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

/// Moves points of pairs that were not baked, of so many lanes, to the nearest that were; 1 in their lanes, else 0. (Not inlined, since it is no
/// part of what most tables take, and has nothing to gain from wide vectors.)
#[inline(never)]
fn settle(
    grid: &Grid,
    first: &[[u32; LANES]; 4],
    points: &mut [[f32; LANES]; 4],
    lanes: usize,
) -> [f32; LANES] {
    let mut missing = [0.0; LANES];
    for lane in 0..lanes {
        let mut point = [0, 1, 2, 3].map(|axis: usize| points[axis][lane]);
        let here = [0, 1, 2, 3].map(|axis: usize| first[axis][lane]);
        if settle_one(grid, here, &mut point) {
            missing[lane] = 1.0;
            for axis in 0..4 {
                points[axis][lane] = point[axis];
            }
        }
    }
    missing
}

/// Moves a point in the cell that begins with these coefficients to the nearest that was baked, and says whether it was not.
pub(super) fn settle_one(grid: &Grid, first: [u32; 4], point: &mut [f32; 4]) -> bool {
    let beside = |axis: usize| {
        let place = grid.axes[axis].integer_knots()[0];
        let place = f32::from(place) / (1u32 << grid.axes[axis].depth()) as f32;
        !((point[axis] - place).abs() <= COLLAPSED)
    };
    let is_missing = grid.collapsed().any(beside);
    let Some(rows) = &grid.rows else {
        return is_missing;
    };
    let (settled, is_elsewhere) = rows.settle(&grid.axes, first);
    if is_elsewhere {
        for axis in 0..4 {
            point[axis] = grid.axes[axis].clamp(settled[axis], point[axis]);
        }
    }
    is_missing || is_elsewhere
}

/// Where tiles are.
trait Layout {
    /// The tiles of a cell from its `start` on: the first and the second along u₁, of the c-th and d-th of C and D
    /// along u₂ and u₃.
    fn tiles<'a, const C: usize, const D: usize>(
        &'a self,
        start: u32,
        tile: u32,
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
        tile: u32,
    ) -> impl Fn(usize, usize, usize) -> &'a [i16; TILE] {
        let [s1, s2, s3] = self.rows.strides();
        let offsets = &self.rows.offsets()[tile as usize..];
        #[inline(always)]
        move |b, c, d| {
            let start = offsets[d * s3 + c * s2 + b * s1] + start as i32;
            // Cells are looked up in tiles that have them.
            self.grid.tiles[start as usize..]
                .first_chunk()
                .expect("the tiles end with padding")
        }
    }
}
