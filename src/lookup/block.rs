//! Some hundred pairs, thread by thread.

use super::Quantity;
use super::grid::Places;
use super::rim::BlendRim;
use crate::brdf::{Response, Reweighting, ThreadPair, ThreadResponse, Weave, without_cosine};
use crate::math::simd::{Directions, Kernel, Level, Row, Vector};
use crate::math::{Vec3, each, splat};
use crate::table::{Energy, Grid, SegmentGrid, Segments, Table, ThreadTable};

/// Up to `N` pairs and what is known of them, a multiple of `STEP`, which is one of all vectors' lanes. What is behind the
/// last pair does not matter.
pub(super) struct Block<const N: usize, const STEP: usize> {
    pub(super) pairs: usize,
    pub(super) wi: Vec3<[f32; N]>,
    pub(super) wr: Vec3<[f32; N]>,
    /// S, V and the projection of a thread, or of the part of it that has been evaluated; the share of its grid in these.
    pub(super) surface: [f32; N],
    pub(super) volume: [f32; N],
    projection: [f32; N],
    pub(super) share: [f32; N],
    /// Above 0 where the table was not baked for a pair, or for the albedos.
    missing: [f32; N],
    /// Of the weave.
    q: [f32; N],
    sum: [[f32; N]; 3],
    places: Places<STEP>,
}

impl<const N: usize, const STEP: usize> Block<N, STEP> {
    pub(super) fn new() -> Self {
        Self {
            pairs: 0,
            wi: [[0.0; N]; 3],
            wr: [[0.0; N]; 3],
            surface: [0.0; N],
            volume: [0.0; N],
            projection: [0.0; N],
            share: [0.0; N],
            missing: [0.0; N],
            q: [0.0; N],
            sum: [[0.0; N]; 3],
            places: Places::new(),
        }
    }

    /// Takes the first pairs of slices, at most `N`, and begins.
    #[inline(always)]
    pub(super) fn load(&mut self, table: &Table, wi: Directions<'_>, wr: Directions<'_>) {
        self.pairs = wi[0].len().min(N);
        for (to, from) in self.wi.iter_mut().zip(wi).chain(self.wr.iter_mut().zip(wr)) {
            to[..self.pairs].copy_from_slice(&from[..self.pairs]);
            let end = self.pairs.next_multiple_of(STEP);
            // Like the last pair: of what is none at all, some machines are slow to compute.
            let last = from[self.pairs - 1];
            to[self.pairs..end].fill(last);
        }
        for (q, cos) in self.q.iter_mut().zip(&self.wr[2]) {
            *q = table.gap * cos;
        }
        self.sum = [[0.0; N]; 3];
        self.missing = [0.0; N];
    }

    #[inline(always)]
    fn wi<V: Vector>(&self, at: usize) -> Vec3<V> {
        load(&self.wi, at)
    }

    #[inline(always)]
    fn wr<V: Vector>(&self, at: usize) -> Vec3<V> {
        load(&self.wr, at)
    }

    /// Which pairs are above the surface.
    #[inline(always)]
    fn above<V: Vector>(&self, at: usize) -> V::Mask {
        let [cos_i, cos_r] = [V::load(&self.wi[2][at..]), V::load(&self.wr[2][at..])];
        V::both(V::zero().lt(cos_i), V::zero().lt(cos_r))
    }

    /// Adds all threads; `see` sees the block after each, when S, V and the projection are that one's.
    #[inline(always)]
    pub(super) fn weave<V: Vector, R: Row>(
        &mut self,
        level: Level,
        table: &Table,
        albedos: &[[f32; 3]],
        mut see: impl FnMut(&Self),
    ) {
        for (index, thread) in table.threads.iter().enumerate() {
            let albedo = *albedos.get(index).unwrap_or(&thread.albedo);
            if !thread.takes_albedo() && albedo != thread.albedo {
                self.missing = [1.0; N];
            }
            match &thread.segments {
                Segments::None | Segments::Direct(_) => {}
                Segments::Grid(segments) => {
                    let SegmentGrid { grid, rim } = &**segments;
                    stage::<V, R, N, _>(level, LookUp(self, thread, grid));
                    if let Some(nodes) = rim {
                        stage::<V, R, N, _>(level, BlendRim(self, table, thread, nodes));
                    }
                }
                Segments::Curve(curve) => {
                    stage::<V, R, N, _>(level, LookUp(self, thread, &curve.projection));
                    self.projection = self.surface;
                    stage::<V, R, N, _>(level, LookUp(self, thread, &curve.response));
                }
            }
            stage::<V, R, N, _>(level, Add(self, table, thread, albedo));
            see(self);
        }
        if table.energy == Energy::PerView {
            for pair in 0..self.pairs {
                let [x, y, z] = &self.wr;
                let dimming = table.dimming(albedos, [x[pair], y[pair], z[pair]]);
                for sum in &mut self.sum {
                    sum[pair] *= dimming;
                }
            }
        }
    }

    /// All of a thread's part, from what its grids say on.
    #[inline(always)]
    fn of_thread<V: Vector>(
        &self,
        table: &Table,
        thread: &ThreadTable,
        at: usize,
    ) -> ThreadResponse<V> {
        let above = self.above::<V>(at);
        let frame = thread.frame.cast::<V>();
        let (wi, wr) = (frame.to_thread(self.wi(at)), frame.to_thread(self.wr(at)));
        let tangents = &thread.tangents;
        let mut response = match thread.segments {
            Segments::None | Segments::Direct(_) => Response::zero(),
            Segments::Grid(_) | Segments::Curve(_) => self.part(at).response,
        };
        let both = table.reweighting == Reweighting::Both;
        let has_tilts = !tangents.tilts().is_empty();
        let mut projection = V::zero();
        if let Segments::Curve(_) = thread.segments {
            projection = V::load(&self.projection[at..]);
        } else if both || has_tilts || matches!(thread.segments, Segments::Direct(_)) {
            let pair = ThreadPair::new(wi, wr, splat(table.sigma_u));
            let optics = thread.optics.cast::<V>();
            if let Segments::Direct(nodes) = &thread.segments {
                response = nodes.mean_response(&pair, &optics);
            }
            if has_tilts {
                response = response.plus(V::one(), tangents.response_of_tilts(&pair, &optics));
            }
            if both {
                projection = tangents.joint_projection(&pair);
            }
        }
        if !both && !matches!(thread.segments, Segments::Curve(_)) {
            projection = tangents.projection(wr);
        }
        ThreadResponse {
            response: Response {
                surface: where_is(above, response.surface),
                volume: where_is(above, response.volume),
            },
            projection: where_is(above, projection),
        }
    }

    /// What has been evaluated of a thread, of pairs from `at` on.
    #[inline(always)]
    pub(super) fn part<V: Vector>(&self, at: usize) -> ThreadResponse<V> {
        ThreadResponse {
            response: Response {
                surface: V::load(&self.surface[at..]),
                volume: V::load(&self.volume[at..]),
            },
            projection: V::load(&self.projection[at..]),
        }
    }

    #[inline(always)]
    fn woven<V: Vector>(&self, scale: V, at: usize) -> Weave<V> {
        Weave {
            q: V::load(&self.q[at..]),
            scale,
            sum: load(&self.sum, at),
        }
    }

    /// ρ of pairs from `at` on; and Q.
    #[inline(always)]
    pub(super) fn rho<V: Vector>(&self, table: &Table, at: usize) -> (Vec3<V>, V) {
        let above = self.above::<V>(at);
        let weave = self.woven(splat(table.rho_scale), at);
        let [r, g, b] = weave.rho();
        (
            [where_is(above, r), where_is(above, g), where_is(above, b)],
            where_is(above, weave.q),
        )
    }

    /// ρ or the BRDF of pairs from `at` on.
    #[inline(always)]
    pub(super) fn value<V: Vector>(&self, table: &Table, quantity: Quantity, at: usize) -> Vec3<V> {
        let (rho, _) = self.rho::<V>(table, at);
        match quantity {
            Quantity::Brdf => without_cosine(rho, V::load(&self.wi[2][at..])),
            Quantity::Rho => rho,
        }
    }

    /// Above 0 for pairs from `at` on, above the surface, that the table was not baked for.
    #[inline(always)]
    pub(super) fn missing<V: Vector>(&self, at: usize) -> V {
        let missing = V::load(&self.missing[at..]);
        where_is(self.above::<V>(at), missing)
    }
}

/// Runs a stage; in debug builds by a function of its own, since without optimization one of all stages takes megabytes of stack.
#[inline(always)]
fn stage<V: Vector, R: Row, const N: usize, K: Kernel>(level: Level, stage: K) -> K::Output {
    if !cfg!(debug_assertions) {
        stage.run::<V, R>()
    } else if N == 1 {
        level.run_single(stage)
    } else {
        level.run(stage)
    }
}

/// S and V of a grid.
struct LookUp<'a, const N: usize, const STEP: usize>(
    &'a mut Block<N, STEP>,
    &'a ThreadTable,
    &'a Grid,
);

impl<const N: usize, const STEP: usize> Kernel for LookUp<'_, N, STEP> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) {
        let Self(block, thread, grid) = self;
        let frame = thread.frame.cast::<V>();
        let rim = grid.coordinates.rim();
        let strides = grid.all_strides();
        let mut from = 0;
        while from < block.pairs {
            let pairs = STEP.min(block.pairs - from);
            let mut at = 0;
            while at < pairs {
                let wi = frame.to_thread(block.wi(from + at));
                let wr = frame.to_thread(block.wr(from + at));
                let (u, share) = grid.coordinates.with_share(wi, wr);
                let mut missing = block.places.find(grid, strides, at, u);
                if !rim.is_none() {
                    share.store(&mut block.share[from + at..]);
                    missing = V::select(V::zero().lt(share), missing, V::zero());
                }
                if grid.is_partial() {
                    let before = V::load(&block.missing[from + at..]);
                    (before + missing).store(&mut block.missing[from + at..]);
                }
                at += V::LANES;
            }
            block.places.sum::<R>(grid, pairs);
            at = 0;
            while at < pairs {
                let response = block.places.response::<V>(grid, at);
                response.surface.store(&mut block.surface[from + at..]);
                response.volume.store(&mut block.volume[from + at..]);
                at += V::LANES;
            }
            from += STEP;
        }
    }
}

/// Adds a thread, from what its grids say on.
struct Add<'a, const N: usize, const STEP: usize>(
    &'a mut Block<N, STEP>,
    &'a Table,
    &'a ThreadTable,
    [f32; 3],
);

impl<const N: usize, const STEP: usize> Kernel for Add<'_, N, STEP> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) {
        let Self(block, table, thread, albedo) = self;
        let mut at = 0;
        while at < block.pairs {
            let part = block.of_thread::<V>(table, thread, at);
            part.response.surface.store(&mut block.surface[at..]);
            part.response.volume.store(&mut block.volume[at..]);
            part.projection.store(&mut block.projection[at..]);
            let mut weave = block.woven(V::one(), at);
            weave.add(splat(thread.coverage), each(albedo, splat), &part);
            weave.q.store(&mut block.q[at..]);
            for (to, sum) in block.sum.iter_mut().zip(weave.sum) {
                sum.store(&mut to[at..]);
            }
            at += V::LANES;
        }
    }
}

#[inline(always)]
fn load<V: Vector, const N: usize>([x, y, z]: &Vec3<[f32; N]>, at: usize) -> Vec3<V> {
    [V::load(&x[at..]), V::load(&y[at..]), V::load(&z[at..])]
}

/// A number where a mask is, else 0.
#[inline(always)]
fn where_is<V: Vector>(mask: V::Mask, x: V) -> V {
    V::select(mask, x, V::zero())
}
