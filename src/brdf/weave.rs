//! Threads to cloth.

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
    /// numbers, nothing is seen.
    #[inline(always)]
    pub fn rho(&self) -> [R; 3] {
        self.sum.map(|sum| {
            let rho = sum / self.q;
            if rho.is_finite() {
                rho.max(R::zero())
            } else {
                R::zero()
            }
        })
    }
}
