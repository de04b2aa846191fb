//! The Sadeghi microcylinder model by direct integration over the tangents.
//!
//! S_j and V_j are means over the tangents of thread j of the closed forms in [`crate::brdf`], which also has their sum
//! over threads ([`Weave`]). Published parameters make the model neither reciprocal nor energy conserving.

use super::{Model, adaptive::mean_response};
use crate::brdf::{
    Components, Optics, Response, Reweighting, TangentCurve, ThreadFrame, ThreadPair,
    ThreadResponse, Weave,
};
use crate::fabric::Fabric;
use crate::math::{Real, Vec3, norm2};

/// How the means over a thread's tangents are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// That many midpoints of equal length along the tangent curve, for Q too; the thesis takes 50.
    Midpoint(u32),
    /// Adaptive Gauss–Legendre in f64 to a relative tolerance, and Q in closed form.
    Adaptive(f64),
}

impl Rule {
    /// What error is measured against.
    pub const REFERENCE: Self = Self::Adaptive(1e-7);
    /// The rule of the thesis, what time is measured against.
    pub const THESIS: Self = Self::Midpoint(50);
}

/// The model with a fabric's parameters and a rule of integration.
#[derive(Debug, Clone)]
pub struct Sadeghi<R> {
    threads: Vec<Thread<R>>,
    gap: R,
    sigma_u: R,
    reweighting: Reweighting,
}

#[derive(Debug, Clone)]
struct Thread<R> {
    frame: ThreadFrame<R>,
    coverage: R,
    albedo: [R; 3],
    optics: Optics<R>,
    tangents: Tangents<R>,
}

#[derive(Debug, Clone)]
enum Tangents<R> {
    /// (cos δ, sin δ) of equally weighted tilts.
    Midpoints(Vec<(R, R)>),
    Adaptive {
        curve: TangentCurve<f64>,
        optics: Optics<f64>,
        sigma_u: f64,
        tolerance: f64,
    },
}

impl<R: Real> Sadeghi<R> {
    /// Prepares the evaluation of `fabric`.
    pub fn new(fabric: &Fabric, rule: Rule) -> Self {
        let threads = fabric.visible_threads().map(|thread| Thread {
            frame: thread.frame(),
            coverage: R::of(thread.coverage),
            albedo: thread.albedo.map(R::of),
            optics: thread.optics.cast(),
            tangents: match rule {
                Rule::Midpoint(samples) => {
                    let tilts = thread.midpoints(samples.max(1));
                    Tangents::Midpoints(
                        tilts
                            .map(|delta| (R::of(delta.cos()), R::of(delta.sin())))
                            .collect(),
                    )
                }
                Rule::Adaptive(tolerance) => Tangents::Adaptive {
                    curve: thread.tangents(),
                    optics: thread.optics,
                    sigma_u: fabric.sigma_u,
                    tolerance,
                },
            },
        });
        Self {
            threads: threads.collect(),
            gap: R::of(fabric.gap()),
            sigma_u: R::of(fabric.sigma_u),
            reweighting: fabric.reweighting,
        }
    }

    /// S, V and the projection of every visible thread, Q, and ρ; all zero when either direction is not above the
    /// surface.
    pub fn components(&self, wi: Vec3<R>, wr: Vec3<R>) -> Components<R> {
        let mut threads = Vec::with_capacity(self.threads.len());
        let weave = self.weave(wi, wr, |thread| threads.push(thread));
        Components {
            threads,
            q: weave.q,
            rho: weave.rho(),
        }
    }

    fn weave(&self, wi: Vec3<R>, wr: Vec3<R>, mut each: impl FnMut(ThreadResponse<R>)) -> Weave<R> {
        let above = wi[2] > R::zero() && wr[2] > R::zero();
        let mut weave = Weave::new(self.gap, if above { wr[2] } else { R::zero() });
        for thread in &self.threads {
            let response = if above {
                self.thread_response(thread, wi, wr)
            } else {
                ThreadResponse::zero()
            };
            weave.add(thread.coverage, thread.albedo, &response);
            each(response);
        }
        weave
    }

    fn thread_response(&self, thread: &Thread<R>, wi: Vec3<R>, wr: Vec3<R>) -> ThreadResponse<R> {
        let (wi, wr) = (thread.frame.to_thread(wi), thread.frame.to_thread(wr));
        match &thread.tangents {
            Tangents::Midpoints(tilts) => {
                let pair = ThreadPair::new(wi, wr, self.sigma_u);
                let weight = R::one() / R::of(tilts.len() as f64);
                let r_r = norm2(wr[0], wr[2]);
                let mut sum = ThreadResponse::zero();
                for (cos, sin) in tilts {
                    sum.response = sum
                        .response
                        .plus(weight, pair.response(&thread.optics, *cos, *sin));
                    sum.projection += weight
                        * match self.reweighting {
                            Reweighting::View => {
                                ((*cos * wr[2] - *sin * wr[0]) / r_r).max(R::zero())
                            }
                            Reweighting::Both => pair.visibility(*cos, *sin),
                        };
                }
                sum
            }
            Tangents::Adaptive {
                curve,
                optics,
                sigma_u,
                tolerance,
            } => {
                let (wi, wr) = (wi.map(R::to_double), wr.map(R::to_double));
                let pair = ThreadPair::new(wi, wr, *sigma_u);
                let Response { surface, volume } = mean_response(&pair, optics, curve, *tolerance);
                let projection = match self.reweighting {
                    Reweighting::View => curve.projection(wr),
                    Reweighting::Both => curve.joint_projection(wi, wr, pair.correlation_psi()),
                };
                ThreadResponse {
                    response: Response {
                        surface: R::of(surface),
                        volume: R::of(volume),
                    },
                    projection: R::of(projection),
                }
            }
        }
    }
}

impl<R: Real> Model<R> for Sadeghi<R> {
    fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        self.weave(wi, wr, |_| {}).rho()
    }
}
