//! The Sadeghi microcylinder model by direct integration over the tangents.
//!
//! ```text
//! ρ = Σ a_j (S_j + V_j A_j) / Q                                   [Fecho13] 3.15, 3.16
//! Q = Σ a_j mean_t p_r(t) + (1 − Σ a_j)(wr·n)                              3.26
//! ```
//!
//! S_j and V_j are means over the tangents of thread j ([`crate::brdf`]). With [`Reweighting::Both`], Q's first term is
//! Σ a_j mean_t P(t, wi, wr) instead. Published parameters do not make the model reciprocal or energy conserving.

use super::{Model, adaptive::mean_response};
use crate::brdf::{Optics, Response, Reweighting, TangentCurve, ThreadFrame, ThreadPair};
use crate::fabric::Fabric;
use crate::math::{Real, Vec3};

/// How the means over a thread's tangents are taken.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    /// That many midpoints of equal length along the tangent curve; the thesis takes 50.
    Midpoint(u32),
    /// Adaptive Gauss–Legendre in f64 to a relative tolerance, and Q in closed form.
    Adaptive(f64),
}

impl Rule {
    /// What error is measured against.
    pub const REFERENCE: Self = Self::Adaptive(1e-7);
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
    name: String,
    frame: ThreadFrame<R>,
    coverage: R,
    albedo: [R; 3],
    optics: Optics<R>,
    tangents: Tangents<R>,
}

#[derive(Debug, Clone)]
enum Tangents<R> {
    /// (cos δ, sin δ) of equally weighted tilts.
    Samples(Vec<(R, R)>),
    Adaptive { curve: TangentCurve<R>, exact: TangentCurve<f64>, optics: Optics<f64>, sigma_u: f64, tolerance: f64 },
}

/// What ρ is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Components<R> {
    /// One entry per visible thread, in the fabric's order.
    pub threads: Vec<ThreadComponents<R>>,
    /// Q, the projection of threads and gaps.
    pub q: R,
    /// ρ = BRDF × cosine \[1/sr\].
    pub rho: [R; 3],
}

/// One thread's part.
#[derive(Debug, Clone, PartialEq)]
pub struct ThreadComponents<R> {
    /// The thread's name.
    pub name: String,
    /// S and V.
    pub response: Response<R>,
    /// The mean projection that Q weighs by the thread's coverage.
    pub projection: R,
}

impl<R: Real> Sadeghi<R> {
    /// Prepares the evaluation of `fabric`.
    pub fn new(fabric: &Fabric, rule: Rule) -> Self {
        let threads = fabric.visible_threads().map(|thread| Thread {
            name: thread.name.clone(),
            frame: thread.frame(),
            coverage: R::of(thread.coverage),
            albedo: thread.albedo.map(R::of),
            optics: thread.optics.cast(),
            tangents: match rule {
                Rule::Midpoint(samples) => {
                    let tilts = midpoints(&thread.tangent_offsets, &thread.tangent_lengths, samples.max(1));
                    Tangents::Samples(tilts.map(|delta| (R::of(delta.cos()), R::of(delta.sin()))).collect())
                }
                Rule::Adaptive(tolerance) => Tangents::Adaptive {
                    curve: thread.tangents(),
                    exact: thread.tangents(),
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
        let (q, rho) = self.sum(wi, wr, |thread, response, projection| {
            threads.push(ThreadComponents { name: thread.name.clone(), response, projection });
        });
        Components { threads, q, rho }
    }

    fn sum(&self, wi: Vec3<R>, wr: Vec3<R>, mut each: impl FnMut(&Thread<R>, Response<R>, R)) -> (R, [R; 3]) {
        let above = wi[2] > R::zero() && wr[2] > R::zero();
        let mut q = if above { self.gap * wr[2] } else { R::zero() };
        let mut rho = [R::zero(); 3];
        for thread in &self.threads {
            let (response, projection) =
                if above { self.thread_response(thread, wi, wr) } else { (Response::zero(), R::zero()) };
            each(thread, response, projection);
            q += thread.coverage * projection;
            for (rho, albedo) in rho.iter_mut().zip(thread.albedo) {
                *rho += thread.coverage * (response.surface + response.volume * albedo);
            }
        }
        // Nothing of the fabric faces the viewer: nothing is seen.
        (q, if q > R::zero() { rho.map(|rho| rho / q) } else { [R::zero(); 3] })
    }

    fn thread_response(&self, thread: &Thread<R>, wi: Vec3<R>, wr: Vec3<R>) -> (Response<R>, R) {
        let (wi, wr) = (thread.frame.to_thread(wi), thread.frame.to_thread(wr));
        match &thread.tangents {
            Tangents::Samples(tilts) => {
                let pair = ThreadPair::new(wi, wr, self.sigma_u);
                let weight = R::of(1.0 / tilts.len() as f64);
                let r_r = crate::math::norm2(wr[0], wr[2]);
                let (mut response, mut projection) = (Response::zero(), R::zero());
                for (cos, sin) in tilts {
                    response = response.plus(weight, pair.response(&thread.optics, *cos, *sin));
                    projection += weight
                        * match self.reweighting {
                            Reweighting::View => ((*cos * wr[2] - *sin * wr[0]) / r_r).max(R::zero()),
                            Reweighting::Both => pair.visibility(*cos, *sin),
                        };
                }
                (response, projection)
            }
            Tangents::Adaptive { curve, exact, optics, sigma_u, tolerance } => {
                let double = |w: Vec3<R>| w.map(R::to_double);
                let pair = ThreadPair::new(double(wi), double(wr), *sigma_u);
                let response = mean_response(&pair, optics, exact, *tolerance);
                let projection = match self.reweighting {
                    Reweighting::View => curve.projection(wr),
                    Reweighting::Both => curve.joint_projection(wi, wr, R::of(pair.correlation_psi())),
                };
                (Response { surface: R::of(response.surface), volume: R::of(response.volume) }, projection)
            }
        }
    }
}

impl<R: Real> Model<R> for Sadeghi<R> {
    fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        self.sum(wi, wr, |_, _, _| {}).1
    }
}

/// Tilts at the midpoints of `count` equal parts of a polyline's length.
fn midpoints(offsets: &[f64], lengths: &[f64], count: u32) -> impl Iterator<Item = f64> {
    let total: f64 = lengths.iter().sum();
    (0..count).map(move |k| {
        let mut left = (f64::from(k) + 0.5) / f64::from(count) * total;
        for (ends, length) in offsets.windows(2).zip(lengths) {
            if left < *length {
                return ends[0] + (ends[1] - ends[0]) * left / length;
            }
            left -= length;
        }
        *offsets.last().expect("a validated curve has offsets")
    })
}
