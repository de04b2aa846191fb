//! What shaders compute, in Rust.

use crate::brdf::{Response, Reweighting, ThreadPair, ThreadResponse, Weave, without_cosine};
use crate::math::simd::{Single, Vector};
use crate::math::{Vec3, splat};
use crate::table::{Segments, Table, ThreadTable};
use crate::volume::{GridVolume, Volume};

/// How texels are filtered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Filter {
    /// With the weights that the coordinates say.
    Exact,
    /// With weights rounded to multiples of 1/256, as graphics hardware does.
    EightBit,
}

/// A table looked up by its volume.
#[derive(Debug, Clone)]
pub struct Lookup<'a> {
    table: &'a Table,
    volume: &'a Volume,
    filter: Filter,
    /// By grid and axis.
    warps: Vec<[Vec<[f32; 2]>; 4]>,
}

impl<'a> Lookup<'a> {
    /// Of a table by its own volume.
    pub fn new(table: &'a Table, volume: &'a Volume, filter: Filter) -> Self {
        let warps = |grid: &GridVolume| grid.nodes().each_ref().map(|nodes| nodes.warp());
        Self {
            table,
            volume,
            filter,
            warps: volume.grids().iter().map(warps).collect(),
        }
    }

    /// The BRDF \[1/sr\], linear RGB, with the fabric's own albedo.
    pub fn eval(&self, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        without_cosine(self.eval_cos(wi, wr), wi[2])
    }

    /// ρ = BRDF × cosine \[1/sr\], linear RGB, with the fabric's own albedo.
    pub fn eval_cos(&self, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.eval_cos_with(&[], wi, wr)
    }

    /// ρ with other albedos, as [`Table::eval_cos_with`].
    pub fn eval_cos_with(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.weave(albedos, wi, wr, None)
    }

    /// ρ by direct integration: `n` midpoints of equal length along each thread, but for those whose direction changes along their
    /// curve, of which tables hold no tangents.
    ///
    /// The thesis' rule, with the tilts of a thread first and then its segments from the lowest to the highest.
    pub fn direct_cos(&self, wi: [f32; 3], wr: [f32; 3], n: u32) -> [f32; 3] {
        self.weave(&[], wi, wr, Some(n.max(1)))
    }

    fn weave(
        &self,
        albedos: &[[f32; 3]],
        wi: [f32; 3],
        wr: [f32; 3],
        midpoints: Option<u32>,
    ) -> [f32; 3] {
        if !(wi[2] > 0.0 && wr[2] > 0.0) {
            return [0.0; 3];
        }
        let (table, wi, wr) = (self.table, wi.map(Single), wr.map(Single));
        let mut weave = Weave::new(splat(table.gap), wr[2], splat(table.rho_scale));
        let mut grids = self.volume.grids().iter().zip(&self.warps);
        for (index, thread) in table.threads().iter().enumerate() {
            let looked_up = self.thread_response(thread, &mut grids, wi, wr);
            let response = match (midpoints, &thread.segments) {
                (None, _) | (_, Segments::Curve(_)) => looked_up,
                (Some(n), _) => self.direct_response(thread, wi, wr, n),
            };
            let albedo = albedos.get(index).unwrap_or(&thread.albedo);
            weave.add(splat(thread.coverage), albedo.map(Single), &response);
        }
        weave.rho().map(number)
    }

    fn direct_response(
        &self,
        thread: &ThreadTable,
        wi: Vec3<Single>,
        wr: Vec3<Single>,
        n: u32,
    ) -> ThreadResponse<Single> {
        let frame = thread.frame.cast::<Single>();
        let (wi, wr) = (frame.to_thread(wi), frame.to_thread(wr));
        let pair = ThreadPair::new(wi, wr, splat(self.table.sigma_u));
        let optics = thread.optics.cast::<Single>();
        let tilts = thread.tangents().tilts().iter();
        let segments = thread.tangents().segments().iter();
        let mut parts = tilts
            .map(|tilt| (tilt.angle, tilt.angle, tilt.weight))
            .chain(segments.map(|s| (s.from, s.to, s.weight)));
        let (mut low, mut up, mut start, mut end) = (0.0, 0.0, 0.0, 0.0);
        let mut sum = ThreadResponse::zero();
        for k in 0..n {
            let place = (k as f32 + 0.5) / n as f32;
            while place >= end {
                let Some((from, to, weight)) = parts.next() else {
                    break;
                };
                (low, up, start) = (from, to, end);
                end += weight;
            }
            let share = ((place - start) / (end - start)).clamp(0.0, 1.0);
            let (sin, cos) = (low + (up - low) * share).sin_cos();
            let (cos, sin) = (Single(cos), Single(sin));
            let projection = match self.table.reweighting() {
                Reweighting::View => pair.projection(cos, sin),
                Reweighting::Both => pair.visibility(cos, sin),
            };
            let response = ThreadResponse {
                response: pair.response(&optics, cos, sin),
                projection,
            };
            sum = sum.plus(Single(1.0 / n as f32), response);
        }
        sum
    }

    fn thread_response<'g>(
        &self,
        thread: &ThreadTable,
        grids: &mut impl Iterator<Item = (&'g GridVolume, &'g [Vec<[f32; 2]>; 4])>,
        wi: Vec3<Single>,
        wr: Vec3<Single>,
    ) -> ThreadResponse<Single> {
        let frame = thread.frame.cast::<Single>();
        let (wi, wr) = (frame.to_thread(wi), frame.to_thread(wr));
        let mut grid = || {
            let (grid, warps) = grids.next().expect("the volume is of another table");
            self.grid(grid, warps, wi, wr)
        };
        let pair = ThreadPair::new(wi, wr, splat(self.table.sigma_u));
        let optics = thread.optics.cast::<Single>();
        let mut response = match &thread.segments {
            Segments::None => Response::zero(),
            Segments::Grid(segments) => {
                let of_grid = grid();
                match &segments.rim {
                    Some(nodes) => {
                        let share = segments.grid.coordinates().share_of_box(wi, wr);
                        Response::zero()
                            .plus(Single(1.0) - share, nodes.mean_response(&pair, &optics))
                            .plus(share, of_grid)
                    }
                    None => of_grid,
                }
            }
            Segments::Direct(nodes) => nodes.mean_response(&pair, &optics),
            Segments::Curve(_) => {
                return ThreadResponse {
                    response: grid(),
                    projection: grid().surface,
                };
            }
        };
        let tangents = thread.tangents();
        response = response.plus(Single(1.0), tangents.response_of_tilts(&pair, &optics));
        ThreadResponse {
            response,
            projection: match self.table.reweighting() {
                Reweighting::View => tangents.projection(wr),
                Reweighting::Both => tangents.joint_projection(&pair),
            },
        }
    }

    /// S and V of a grid.
    fn grid(
        &self,
        grid: &GridVolume,
        warps: &[Vec<[f32; 2]>; 4],
        wi: Vec3<Single>,
        wr: Vec3<Single>,
    ) -> Response<Single> {
        let u = grid.coordinates.of(wi, wr).map(number);
        let counts = grid.nodes.each_ref().map(|nodes| nodes.count() as f32);
        let t = [0, 1, 2, 3].map(|axis| warp(&warps[axis], u[axis], counts[axis] - 1.0));
        let slab = t[3].floor().min(counts[3] - 2.0).max(0.0);
        let [width, height, depth] = self.volume.size().map(|side| side as f32);
        let z = grid.first_slab as f32 + counts[2] * slab + t[2];
        let [r, g, b, a] = self.sample([
            (t[0] + 0.5) / width,
            (t[1] + 0.5) / height,
            (z + 0.5) / depth,
        ]);
        let share = t[3] - slab;
        let roots = [r + (b - r) * share, g + (a - g) * share];
        let [surface, volume] = [0, 1].map(|k| Single(grid.scale[k] * roots[k] * roots[k]));
        Response { surface, volume }
    }

    /// The volume at these coordinates: what a texture unit does.
    fn sample(&self, uvw: [f32; 3]) -> [f32; 4] {
        let size = self.volume.size();
        let mut places = [(0, 0, 0.0); 3];
        for axis in 0..3 {
            let x = uvw[axis] * size[axis] as f32 - 0.5;
            let mut weight = x - x.floor();
            if self.filter == Filter::EightBit {
                weight = (256.0 * weight).round() / 256.0;
            }
            let at = |x: f32| x.clamp(0.0, (size[axis] - 1) as f32) as usize;
            places[axis] = (at(x.floor()), at(x.floor() + 1.0), weight);
        }
        let mut sum = [0.0; 4];
        for corner in 0..8 {
            let mut weight = 1.0;
            let place = [0, 1, 2].map(|axis| {
                let (low, high, share) = places[axis];
                let is_high = corner >> axis & 1 == 1;
                weight *= if is_high { share } else { 1.0 - share };
                if is_high { high } else { low }
            });
            if weight > 0.0 {
                let texel = self.volume.texel(place[0], place[1], place[2]);
                for (sum, x) in sum.iter_mut().zip(texel) {
                    *sum += weight * x;
                }
            }
        }
        sum
    }
}

/// u in nodes, up to `last`.
fn warp(pieces: &[[f32; 2]], u: f32, last: f32) -> f32 {
    let count = pieces.len() as f32;
    let piece = (u * count).min(count - 1.0).max(0.0) as usize;
    let [a, b] = pieces[piece];
    (a + b * u).min(last).max(0.0)
}

fn number(x: Single) -> f32 {
    x.to_array()[0]
}
