//! One pair of directions at a time.
//!
//! From a pair to a number: into the thread's frame; single tilts by their closed form; for the segments the pair's place
//! in the chart, four-dimensional interpolation of S/F_S and V/F_V there, times F; then the sum over threads.

use crate::brdf::{Response, Reweighting, ThreadPair, ThreadResponse, Weave};
use crate::table::{Table, ThreadTable};

/// Evaluation never fails, allocates or panics, and is never negative or NaN: directions that are not above the surface,
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
        let rho = self.eval_cos_with(albedos, wi, wr);
        // ρ is proportional to neither cosine, so at the last denormals the quotient may overflow.
        rho.map(|rho| {
            if rho > 0.0 {
                (rho / wi[2]).min(f32::MAX)
            } else {
                0.0
            }
        })
    }

    /// ρ with other albedos, linear RGB, one per thread in the order of [`Table::threads`]; where `albedos` ends, the
    /// fabric's own go on.
    pub fn eval_cos_with(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        if !(wi[2] > 0.0 && wr[2] > 0.0) {
            return [0.0; 3];
        }
        let mut weave = Weave::new(self.gap, wr[2]);
        for (index, thread) in self.threads.iter().enumerate() {
            let albedo = albedos.get(index).unwrap_or(&thread.albedo);
            weave.add(thread.coverage, *albedo, &self.response(thread, wi, wr));
        }
        weave.rho()
    }

    /// S, V and the projection of every thread, in the order of [`Table::threads`], and Q.
    pub fn components(
        &self,
        wi: [f32; 3],
        wr: [f32; 3],
    ) -> (impl Iterator<Item = ThreadResponse<f32>>, f32) {
        let above = wi[2] > 0.0 && wr[2] > 0.0;
        let response = move |thread: &ThreadTable| {
            if above {
                self.response(thread, wi, wr)
            } else {
                ThreadResponse::zero()
            }
        };
        let mut weave = Weave::new(self.gap, if above { wr[2] } else { 0.0 });
        for thread in &self.threads {
            weave.add(thread.coverage, [0.0; 3], &response(thread));
        }
        (self.threads.iter().map(response), weave.q)
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
