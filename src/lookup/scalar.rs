//! One pair of directions at a time: the specification of every other path.
use crate::brdf::{Response, Reweighting, ThreadPair};
use crate::table::{Form, Table, ThreadTable};

impl Table {
    /// rho
    pub fn eval_cos(&self, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        if !(wi[2] > 0.0 && wr[2] > 0.0) {
            return [0.0; 3];
        }
        let mut q = self.gap * wr[2];
        let mut rho = [0.0f32; 3];
        for thread in &self.threads {
            let (response, projection) = self.thread_response(thread, wi, wr);
            q += thread.coverage * projection;
            for (rho, albedo) in rho.iter_mut().zip(thread.albedo) {
                *rho += thread.coverage * (response.surface + response.volume * albedo);
            }
        }
        rho.map(|rho| {
            let rho = rho / q;
            if rho.is_finite() { rho } else { 0.0 }
        })
    }

    pub(crate) fn thread_response(&self, thread: &ThreadTable, wi: [f32; 3], wr: [f32; 3]) -> (Response<f32>, f32) {
        let (wi, wr) = (thread.frame.to_thread(wi), thread.frame.to_thread(wr));
        let pair = ThreadPair::new(wi, wr, self.sigma_u);
        let response = match &thread.form {
            Form::Tilt { cos, sin } => pair.response(&thread.optics, *cos, *sin),
            Form::Grid(grid) => {
                let factors = thread.factors.at(&pair, &thread.tangents);
                let mirror = |w: [f32; 3]| if grid.folded && wi[0] + wr[0] < 0.0 { [-w[0], w[1], w[2]] } else { w };
                let u = grid.chart.coordinates(mirror(wi), mirror(wr));
                let [s, v] = grid.interpolate(u);
                Response { surface: s * factors.surface, volume: v * factors.volume }
            }
        };
        let projection = match self.reweighting {
            Reweighting::View => thread.tangents.projection(wr),
            Reweighting::Both => thread.tangents.joint_projection(wi, wr, pair.correlation_psi()),
        };
        (response, projection)
    }
}
