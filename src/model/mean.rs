//! The mean of one thread's response over its tangents, to a requested accuracy.
//!
//! Of a straight strand every place where the integrand is not smooth is known, so panels end there:
//!
//! ```text
//! ψ + δ = ±90°            a direction passes behind the thread: P and M end
//! δ = −(ψ_i + ψ_r)/2      min in P changes sides
//! y_i z_r' = ±y_r z_i'    min in M changes sides, where m_i = m_r
//! δ = −ψ_H                the highlight: θ_h = 0, ψ_H = atan2(x_i + x_r, z_i + z_r)
//! ```
//!
//! θ_h grows by K = |H_nt| / (2 cos θ_d) per unit of tilt there, so a lobe of width γ is γ/K wide in δ. Where the direction
//! changes with the tilt, the same places are looked for ([`sweep`](super::sweep)).

use super::adaptive::{Integrand, Piece, ROOM, integrate, reaches};
use super::sweep;
use crate::brdf::{
    Optics, Response, Reweighting, TangentCurve, ThreadFrame, ThreadPair, ThreadResponse,
};
use crate::fabric::{Fabric, Strands, Sweep, Thread};
use crate::math::simd::Doubles;
use crate::math::{Vec3, norm2};

/// A thread's means over its curve, for directions given in the frame that its directions are counted from.
#[derive(Debug, Clone)]
pub struct AdaptiveMean {
    straight: Vec<Straight>,
    sweeps: Vec<Sweep>,
    optics: Optics<f64>,
    sigma_u: f64,
    reweighting: Reweighting,
    /// Relative, of every mean; infinite where a first look is enough.
    pub tolerance: f64,
}

#[derive(Debug, Clone)]
struct Straight {
    frame: ThreadFrame<f64>,
    share: f64,
    tangents: TangentCurve<f64>,
}

impl AdaptiveMean {
    /// Of `strands`, which are `thread`'s or some of them, to a relative `tolerance`.
    pub fn new(fabric: &Fabric, thread: &Thread, strands: &Strands, tolerance: f64) -> Self {
        let straight = strands.straight.iter().map(|strand| Straight {
            frame: ThreadFrame::new(strand.direction),
            share: strand.share,
            tangents: strand.tangents(),
        });
        Self {
            straight: straight.collect(),
            sweeps: strands.sweeps.clone(),
            optics: thread.optics,
            sigma_u: fabric.sigma_u,
            reweighting: fabric.reweighting,
            tolerance,
        }
    }

    /// Response and projection.
    pub fn at(&self, wi: Vec3<f64>, wr: Vec3<f64>) -> ThreadResponse<f64> {
        ThreadResponse {
            response: self.response(wi, wr),
            projection: self.projection(wi, wr),
        }
    }

    /// S and V.
    pub fn response(&self, wi: Vec3<f64>, wr: Vec3<f64>) -> Response<f64> {
        let mut sum = Response::zero();
        for Straight {
            frame,
            share,
            tangents,
        } in &self.straight
        {
            let pair = ThreadPair::new(frame.to_thread(wi), frame.to_thread(wr), self.sigma_u);
            let mean = mean_response(&pair, &self.optics, tangents, self.tolerance);
            sum = sum.plus(*share, mean);
        }
        if self.sweeps.is_empty() {
            return sum;
        }
        let pair = [wi, wr];
        sweep::response(
            sum,
            &self.sweeps,
            pair,
            &self.optics,
            self.sigma_u,
            self.tolerance,
        )
    }

    /// The mean projection that Q weighs by the thread's coverage, 0 to 1.
    pub fn projection(&self, wi: Vec3<f64>, wr: Vec3<f64>) -> f64 {
        let mut sum = 0.0;
        for Straight {
            frame,
            share,
            tangents,
        } in &self.straight
        {
            let (wi, wr) = (frame.to_thread(wi), frame.to_thread(wr));
            sum += share
                * match self.reweighting {
                    Reweighting::View => tangents.projection(wr),
                    Reweighting::Both => {
                        tangents.joint_projection(&ThreadPair::new(wi, wr, self.sigma_u))
                    }
                };
        }
        if self.sweeps.is_empty() {
            return sum;
        }
        let wi = match self.reweighting {
            Reweighting::View => None,
            Reweighting::Both => Some(wi),
        };
        sum + sweep::projection(&self.sweeps, wi, wr, self.sigma_u, self.tolerance)
    }
}

/// S and V of a straight strand for a pair of directions in its frame: the mean of [`ThreadPair::response`] over `tangents`.
///
/// `tolerance` is relative to S and V.
pub fn mean_response(
    pair: &ThreadPair<f64>,
    optics: &Optics<f64>,
    tangents: &TangentCurve<f64>,
    tolerance: f64,
) -> Response<f64> {
    let single = tangents.response_of_tilts(pair, optics);
    let cuts = Cuts::new(pair, optics);
    let pieces = tangents.segments().iter().flat_map(|segment| {
        Piece {
            from: segment.from.max(cuts.visible.0),
            to: segment.to.min(cuts.visible.1),
            density: segment.weight / (segment.to - segment.from),
        }
        .cut(&cuts.kinks)
    });
    integrate(single, pieces, OfTilts { pair, optics }, tolerance)
}

/// S and V by tilt.
struct OfTilts<'a> {
    pair: &'a ThreadPair<f64>,
    optics: &'a Optics<f64>,
}

impl Integrand for OfTilts<'_> {
    #[inline(always)]
    fn at<L: Doubles>(&self, tilts: L) -> Response<L> {
        let (mut cos, mut sin) = ([0.0; ROOM], [0.0; ROOM]);
        tilts.store(&mut sin);
        for k in 0..L::LANES {
            (sin[k], cos[k]) = sin[k].sin_cos();
        }
        let pair = self.pair.splat::<L>();
        pair.response(&self.optics.cast(), L::load(&cos), L::load(&sin))
    }
}

/// Where the integrand's range ends and where it is not smooth, in tilt.
struct Cuts {
    visible: (f64, f64),
    /// In ascending order.
    kinks: Vec<f64>,
}

impl Cuts {
    fn new(pair: &ThreadPair<f64>, optics: &Optics<f64>) -> Self {
        let (wi, wr) = (pair.wi(), pair.wr());
        let (psi_i, psi_r) = (wi[0].atan2(wi[2]), wr[0].atan2(wr[2]));
        let quarter = std::f64::consts::FRAC_PI_2;
        let visible = (-quarter - psi_i.min(psi_r), quarter - psi_i.max(psi_r));

        let mut kinks: Vec<f64> = vec![-0.5 * (psi_i + psi_r)];
        for sign in [1.0, -1.0] {
            let sin = wi[1] * wr[2] - sign * wr[1] * wi[2];
            let cos = wi[1] * wr[0] - sign * wr[1] * wi[0];
            if cos != 0.0 {
                kinks.push((sin / cos).atan());
            }
        }

        let (h_t, h_n) = (wi[0] + wr[0], wi[2] + wr[2]);
        let highlight = -h_t.atan2(h_n);
        let (sin, cos) = highlight.sin_cos();
        // At the highlight x_r = −x_i, so cos θ_d = cos θ_i.
        let z_i = cos * wi[2] - sin * wi[0];
        let slope = (norm2(h_t, h_n) / (2.0 * norm2(wi[1], z_i))).max(1e-3);
        kinks.push(highlight);
        kinks.extend(
            reaches(optics, slope).flat_map(|width| [highlight - width, highlight + width]),
        );
        kinks.retain(|cut| cut.is_finite());
        kinks.sort_by(f64::total_cmp);
        Self { visible, kinks }
    }
}
