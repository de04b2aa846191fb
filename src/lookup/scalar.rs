//! One pair of directions at a time.
//!
//! From a pair to a number: into the thread's frame; single tilts by their closed form; for the segments the pair's place
//! in the chart, four-dimensional interpolation of S/F_S and V/F_V there, times F; then the sum over threads.

use alloc::vec::Vec;

use crate::brdf::{
    Components, Response, Reweighting, ThreadPair, ThreadResponse, Weave, without_cosine,
};
use crate::table::{Table, ThreadTable};

/// Evaluation never fails, allocates (but for [`Table::components`]) or panics, and is never negative or NaN: directions that are not above the surface,
/// and those that are no numbers, give zero. Directions are unit vectors in the surface frame (x warp, y weft, z
/// normal); `wi` points to the light and `wr` to the viewer.
impl Table {
    /// The BRDF \[1/sr\], linear RGB, with the fabric's own albedo.
    pub fn eval(&self, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.eval_with(&[], wi, wr)
    }

    /// ρ = BRDF × cosine \[1/sr\], linear RGB, with the fabric's own albedo.
    pub fn eval_cos(&self, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.eval_cos_with(&[], wi, wr)
    }

    /// The BRDF with other albedos: see [`Table::eval_cos_with`].
    pub fn eval_with(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        without_cosine(self.eval_cos_with(albedos, wi, wr), wi[2])
    }

    /// ρ with other albedos, linear RGB, one per thread in the order of [`Table::threads`]; where `albedos` ends, the
    /// fabric's own go on.
    pub fn eval_cos_with(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.weave(albedos, wi, wr, |_| {}).rho()
    }

    /// S, V and the projection of every thread, Q, and ρ with the fabric's own albedo.
    pub fn components(&self, wi: [f32; 3], wr: [f32; 3]) -> Components<f32> {
        let mut threads = Vec::with_capacity(self.threads.len());
        let weave = self.weave(&[], wi, wr, |thread| threads.push(thread));
        Components {
            threads,
            q: weave.q,
            rho: weave.rho(),
        }
    }

    #[inline]
    fn weave(
        &self,
        albedos: &[[f32; 3]],
        wi: [f32; 3],
        wr: [f32; 3],
        mut each: impl FnMut(ThreadResponse<f32>),
    ) -> Weave<f32> {
        let above = wi[2] > 0.0 && wr[2] > 0.0;
        let mut weave = Weave::new(self.gap, if above { wr[2] } else { 0.0 });
        for (index, thread) in self.threads.iter().enumerate() {
            let albedo = albedos.get(index).unwrap_or(&thread.albedo);
            let response = if above {
                self.response(thread, wi, wr)
            } else {
                ThreadResponse::zero()
            };
            weave.add(thread.coverage, *albedo, &response);
            each(response);
        }
        weave
    }

    #[inline]
    fn response(&self, thread: &ThreadTable, wi: [f32; 3], wr: [f32; 3]) -> ThreadResponse<f32> {
        let (wi, wr) = (thread.frame.to_thread(wi), thread.frame.to_thread(wr));
        let pair = ThreadPair::new(wi, wr, self.sigma_u);
        let mut response = Response::zero();
        for tilt in thread.tangents.tilts() {
            response = response.plus(
                tilt.weight,
                pair.response(&thread.optics, tilt.cos, tilt.sin),
            );
        }
        if let Some(grid) = &thread.grid {
            let factors = thread.factors.at(&pair, &thread.tangents);
            let [surface, volume] = grid.ratios(wi, wr);
            let product = Response {
                surface: surface * factors.surface,
                volume: volume * factors.volume,
            };
            response = response.plus(1.0, product);
        }
        let projection = match self.reweighting {
            Reweighting::View => thread.tangents.projection(wr),
            Reweighting::Both => thread
                .tangents
                .joint_projection(wi, wr, pair.correlation_psi()),
        };
        ThreadResponse {
            response,
            projection,
        }
    }
}
