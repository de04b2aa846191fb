//! Threads to cloth.

use alloc::vec::Vec;

use super::Response;
use crate::math::Real;

/// What one thread contributes to a pair of directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreadResponse<R> {
    /// S and V.
    pub response: Response<R>,
    /// The mean projection that Q weighs by the thread's coverage, 0 to 1.
    pub projection: R,
}

impl<R: Real> ThreadResponse<R> {
    /// Of a thread that is not seen.
    pub fn zero() -> Self {
        Self {
            response: Response::zero(),
            projection: R::zero(),
        }
    }

    /// The same in another precision.
    pub fn cast<T: Real>(&self) -> ThreadResponse<T> {
        let of = |x: R| T::of(x.to_double());
        let response = Response {
            surface: of(self.response.surface),
            volume: of(self.response.volume),
        };
        ThreadResponse {
            response,
            projection: of(self.projection),
        }
    }
}

/// The sum over threads.
///
/// ```text
/// ρ = Σ a_j (S_j + V_j A_j) / Q                                   [Fecho13] 3.15, 3.16
/// Q = Σ a_j mean_t p_r(t) + (1 − Σ a_j)(wr·n)                              3.26
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weave<R> {
    /// Q so far.
    pub q: R,
    sum: [R; 3],
}

impl<R: Real> Weave<R> {
    /// No threads yet: `gap` = 1 − Σa is seen under the cosine `cos_r` = wr·n.
    #[inline(always)]
    pub fn new(gap: R, cos_r: R) -> Self {
        Self {
            q: gap * cos_r,
            sum: [R::zero(); 3],
        }
    }

    /// Adds a thread.
    #[inline(always)]
    pub fn add(&mut self, coverage: R, albedo: [R; 3], thread: &ThreadResponse<R>) {
        self.q += coverage * thread.projection;
        for (sum, albedo) in self.sum.iter_mut().zip(albedo) {
            *sum += coverage * (thread.response.surface + thread.response.volume * albedo);
        }
    }

    /// ρ = BRDF × cosine \[1/sr\]. Where nothing of the cloth faces the viewer (Q = 0), and for directions that are no
    /// numbers, nothing is seen. Never infinite.
    #[inline(always)]
    pub fn rho(&self) -> [R; 3] {
        self.sum.map(|sum| {
            let rho = sum / self.q;
            if self.q > R::zero() && !rho.is_nan() {
                rho.max(R::zero()).min(R::max_value())
            } else {
                R::zero()
            }
        })
    }
}

/// What ρ is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Components<R> {
    /// One entry per visible thread, in the fabric's order.
    pub threads: Vec<ThreadResponse<R>>,
    /// Q, the projection of threads and gaps.
    pub q: R,
    /// ρ = BRDF × cosine \[1/sr\].
    pub rho: [R; 3],
}

impl<R: Real> Components<R> {
    /// The same in another precision.
    pub fn cast<T: Real>(&self) -> Components<T> {
        Components {
            threads: self.threads.iter().map(ThreadResponse::cast).collect(),
            q: T::of(self.q.to_double()),
            rho: self.rho.map(|rho| T::of(rho.to_double())),
        }
    }
}

/// The BRDF \[1/sr\] from ρ and the cosine wi·n: ρ is proportional to neither cosine, so at the last denormals the
/// quotient would be infinite.
#[inline(always)]
pub fn without_cosine<R: Real>(rho: [R; 3], cos_i: R) -> [R; 3] {
    rho.map(|rho| {
        if rho > R::zero() {
            (rho / cos_i).min(R::max_value())
        } else {
            R::zero()
        }
    })
}
