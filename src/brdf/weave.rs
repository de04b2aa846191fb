//! Threads to cloth.

use alloc::vec::Vec;

use super::Response;
use crate::math::{Lanes, Real, each};

/// What one thread contributes to a pair of directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ThreadResponse<R> {
    /// S and V.
    pub response: Response<R>,
    /// The mean projection that Q weighs by the thread's coverage, 0 to 1.
    pub projection: R,
}

impl<R: Lanes> ThreadResponse<R> {
    /// Of a thread that is not seen.
    #[inline(always)]
    pub fn zero() -> Self {
        Self {
            response: Response::zero(),
            projection: R::zero(),
        }
    }

    /// `self + weight · other`.
    #[inline(always)]
    pub fn plus(self, weight: R, other: Self) -> Self {
        Self {
            response: self.response.plus(weight, other.response),
            projection: self.projection + weight * other.projection,
        }
    }
}

impl<R> ThreadResponse<R> {
    /// The same with every number made another.
    pub fn map<T>(self, of: impl Fn(R) -> T) -> ThreadResponse<T> {
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
/// ρ = c Σ a_j (S_j + V_j A_j) / Q                                 [Fecho13] 3.15, 3.16
/// Q = Σ a_j mean_t p_r(t) + (1 − Σ a_j)(wr·n)                              3.26
/// ```
///
/// c is 1, or less where a fabric's parameters reflect more than arrives and shall not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weave<R> {
    /// Q so far.
    pub(crate) q: R,
    /// What ρ is multiplied by.
    pub(crate) scale: R,
    /// Σ a_j (S_j + V_j A_j) so far.
    pub(crate) sum: [R; 3],
}

impl<R: Lanes> Weave<R> {
    /// No threads yet: `gap` = 1 − Σa is seen under the cosine `cos_r` = wr·n, and ρ is scaled by `scale`.
    #[cfg(any(feature = "bake", feature = "shader"))]
    #[inline(always)]
    pub(crate) fn new(gap: R, cos_r: R, scale: R) -> Self {
        Self {
            q: gap * cos_r,
            scale,
            sum: [R::zero(); 3],
        }
    }

    /// Adds a thread.
    #[inline(always)]
    pub(crate) fn add(&mut self, coverage: R, albedo: [R; 3], thread: &ThreadResponse<R>) {
        self.q += coverage * thread.projection;
        for (sum, albedo) in self.sum.iter_mut().zip(albedo) {
            *sum += coverage * (thread.response.surface + thread.response.volume * albedo);
        }
    }

    /// ρ = BRDF × cosine \[1/sr\]. Where nothing of the cloth faces the viewer (Q = 0), and for directions that are no
    /// numbers, nothing is seen. Never infinite.
    #[inline(always)]
    pub(crate) fn rho(&self) -> [R; 3] {
        let seen = R::zero().lt(self.q);
        // max before min: it replaces NaN by 0.
        each(
            self.sum,
            #[inline(always)]
            |sum| {
                let rho = (self.scale * sum / self.q).max(R::zero()).min(R::of(MOST));
                R::select(seen, rho, R::zero())
            },
        )
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
            threads: self
                .threads
                .iter()
                .map(|thread| thread.map(|x| T::of(x.to_double())))
                .collect(),
            q: T::of(self.q.to_double()),
            rho: self.rho.map(|rho| T::of(rho.to_double())),
        }
    }
}

/// The BRDF \[1/sr\] from ρ and the cosine wi·n: ρ is proportional to neither cosine, so at the last denormals the
/// quotient would be infinite.
#[inline(always)]
pub(crate) fn without_cosine<R: Lanes>(rho: [R; 3], cos_i: R) -> [R; 3] {
    each(
        rho,
        #[inline(always)]
        |rho| {
            let brdf = (rho / cos_i).min(R::of(MOST));
            R::select(R::zero().lt(rho), brdf, R::zero())
        },
    )
}

/// The largest finite f32.
const MOST: f64 = f32::MAX as f64;
