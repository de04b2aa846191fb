//! Light scattered by one cylinder at one tilt: the integrand of the model.
//!
//! ```text
//! S(δ) = F_r cos(φ_d/2) g(γ_s, θ_h)                        · M P cos θ_i / cos² θ_d     [Fecho13] 3.17, 3.18
//! V(δ) = (1−F_r)² ((1−k_d) g(γ_v, θ_h) + k_d) / (cos θ_i + cos θ_r) · M P cos θ_i / cos² θ_d        3.17, 3.19
//! M    = (1−u(φ_d)) m_i m_r + u(φ_d) min(m_i, m_r),   m = max(cos φ, 0)                             3.20–3.22
//! P    = (1−u(ψ_d)) p_i p_r + u(ψ_d) min(p_i, p_r),   p = max(cos ψ, 0)                             3.23–3.25
//! ```
//!
//! θ = asin x, φ = atan2(y, z) and ψ = atan2(x, z) of a direction in the tilted frame are never formed. With
//! X = x_i + x_r and C = cos θ_i + cos θ_r, the sum of the two points (cos θ, sin θ) on the unit circle gives
//!
//! ```text
//! θ_h = atan2(X, C),      4 cos² θ_d = X² + C²,      2 cos(φ_d/2) = |(cos φ_i, sin φ_i) + (cos φ_r, sin φ_r)|
//! ```
//!
//! which are sums of squares: nothing cancels at grazing, along the thread or for opposite directions. A direction
//! whose tilted z is not positive has m = p = 0, which also removes the poles (cos θ = 0 implies z = 0).
//!
//! Departures: the exit transmittance is taken at the entry angle, (1−F_r)² for F_t F_t', and γ is the standard
//! deviation of a Gaussian of unit area; \[SBDJ13\] leaves both open.

use crate::math::{Lanes, Real, Vec3, norm2};

/// Optical constants of the cylinders of a thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics<R> {
    /// Refractive index η relative to air, ≥ 1.
    pub eta: R,
    /// Isotropic share k_d of volume scattering, 0 to 1.
    pub k_d: R,
    /// Width γ_s of the surface lobe (standard deviation), radians, > 0.
    pub gamma_s: R,
    /// Width γ_v of the volume lobe (standard deviation), radians, > 0.
    pub gamma_v: R,
}

impl<R: Real> Optics<R> {
    /// The same constants in another precision, or in every lane.
    pub fn cast<T: Lanes>(&self) -> Optics<T> {
        let of = |x: R| T::of(x.to_double());
        Optics {
            eta: of(self.eta),
            k_d: of(self.k_d),
            gamma_s: of(self.gamma_s),
            gamma_v: of(self.gamma_v),
        }
    }
}

/// Achromatic response of a thread: multiply `volume` by the albedo and add `surface`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Response<R> {
    /// S, light reflected at the cylinders' surface \[1/sr\].
    pub surface: R,
    /// V, light scattered inside them, for albedo 1 \[1/sr\].
    pub volume: R,
}

impl<R: Lanes> Response<R> {
    /// No light.
    pub fn zero() -> Self {
        Self {
            surface: R::zero(),
            volume: R::zero(),
        }
    }

    /// `self + weight · other`.
    #[inline(always)]
    pub fn plus(self, weight: R, other: Self) -> Self {
        Self {
            surface: self.surface + weight * other.surface,
            volume: self.volume + weight * other.volume,
        }
    }
}

/// Unpolarised reflectance of a smooth dielectric of relative index `eta` ≥ 1 at cosine of incidence `cos` ∈ \[0, 1\].
#[inline(always)]
pub fn fresnel<R: Lanes>(eta: R, cos: R) -> R {
    let sin2 = (R::one() - cos) * (R::one() + cos);
    let cos_t = (R::one() - sin2 / (eta * eta)).max(R::zero()).sqrt();
    // Without an interface nothing is reflected, not even at cos = 0, where the ratio would be 0/0.
    let r_s = (cos - eta * cos_t) / (cos + eta * cos_t).max(R::of(TINY));
    let r_p = (eta * cos - cos_t) / (eta * cos + cos_t).max(R::of(TINY));
    R::of(0.5) * (r_s * r_s + r_p * r_p)
}

/// Far below any cosine that single precision tells from 0.
const TINY: f64 = 1e-30;

/// Gaussian of unit area and standard deviation `sigma` at `x`, g(γ, x).
#[inline(always)]
fn gaussian<R: Lanes>(sigma: R, x: R) -> R {
    let t = x / sigma;
    (R::of(-0.5) * t * t).exp() * R::of(0.398_942_280_401_432_7) / sigma
}

/// u: Gaussian of unit height and standard deviation `sigma`, from the half-angle sine and cosine of the angle.
#[inline(always)]
fn correlation<R: Lanes>(sigma: R, sin_half: R, cos_half: R) -> R {
    let t = R::of(2.0) * sin_half.atan2(cos_half) / sigma;
    (R::of(-0.5) * t * t).exp()
}

/// The blend of independent and fully correlated visibility, 3.22 and 3.25.
#[inline(always)]
pub(super) fn blend<R: Lanes>(u: R, a: R, b: R) -> R {
    (R::one() - u) * a * b + u * a.min(b)
}

/// A pair of directions in the frame of an untilted thread, with what does not change when the thread tilts.
#[derive(Debug, Clone, Copy)]
pub struct ThreadPair<R> {
    wi: Vec3<R>,
    wr: Vec3<R>,
    /// √(x² + z²), the lengths of the directions' projections into the plane of thread and normal.
    r_i: R,
    r_r: R,
    sigma_u: R,
    u_psi: R,
}

impl<R: Lanes> ThreadPair<R> {
    /// Prepares unit directions `wi` and `wr` in thread coordinates; `sigma_u` is the width of u in radians.
    #[inline(always)]
    pub fn new(wi: Vec3<R>, wr: Vec3<R>, sigma_u: R) -> Self {
        let (r_i, r_r) = (norm2(wi[0], wi[2]), norm2(wr[0], wr[2]));
        let (a, b) = ([wi[0] / r_i, wi[2] / r_i], [wr[0] / r_r, wr[2] / r_r]);
        let u_psi = correlation(
            sigma_u,
            norm2(a[0] - b[0], a[1] - b[1]),
            norm2(a[0] + b[0], a[1] + b[1]),
        );
        // Along s the angle ψ is undefined, and nothing is visible.
        let defined = R::both(R::zero().lt(r_i), R::zero().lt(r_r));
        let u_psi = R::select(defined, u_psi, R::zero());
        Self {
            wi,
            wr,
            r_i,
            r_r,
            sigma_u,
            u_psi,
        }
    }

    /// Direction to the light in thread coordinates.
    pub fn wi(&self) -> Vec3<R> {
        self.wi
    }

    /// Direction to the viewer in thread coordinates.
    pub fn wr(&self) -> Vec3<R> {
        self.wr
    }

    /// u(ψ_d), the same at every tilt.
    #[inline(always)]
    pub fn correlation_psi(&self) -> R {
        self.u_psi
    }

    /// P at the tilt with the given cosine and sine, 3.25.
    #[inline(always)]
    pub fn visibility(&self, cos_delta: R, sin_delta: R) -> R {
        let z_i = cos_delta * self.wi[2] - sin_delta * self.wi[0];
        let z_r = cos_delta * self.wr[2] - sin_delta * self.wr[0];
        let visible = R::both(R::zero().lt(z_i), R::zero().lt(z_r));
        let visibility = blend(self.u_psi, z_i / self.r_i, z_r / self.r_r);
        R::select(visible, visibility, R::zero())
    }

    /// The pair for the same thread turned by the angle with this cosine and sine: its tilt 0 is the former's −angle.
    #[inline(always)]
    pub fn turned(&self, cos: R, sin: R) -> Self {
        let turn = |w: Vec3<R>| [cos * w[0] - sin * w[2], w[1], cos * w[2] + sin * w[0]];
        Self {
            wi: turn(self.wi),
            wr: turn(self.wr),
            ..*self
        }
    }

    /// S and V of the cylinder tilted by δ, given as cos δ and sin δ.
    #[inline(always)]
    pub fn response(&self, optics: &Optics<R>, cos_delta: R, sin_delta: R) -> Response<R> {
        let parts = self.scatter(optics, cos_delta, sin_delta);
        Response {
            surface: parts.surface,
            volume: parts.lobe + parts.isotropic,
        }
    }

    /// What S and V of the cylinder tilted by δ are made of.
    #[inline(always)]
    pub fn scatter(&self, optics: &Optics<R>, cos_delta: R, sin_delta: R) -> Scattered<R> {
        let (c, s) = (cos_delta, sin_delta);
        let (wi, wr) = (self.wi, self.wr);
        let (x_i, y_i, z_i) = (c * wi[0] + s * wi[2], wi[1], c * wi[2] - s * wi[0]);
        let (x_r, y_r, z_r) = (c * wr[0] + s * wr[2], wr[1], c * wr[2] - s * wr[0]);
        let visible = R::both(R::zero().lt(z_i), R::zero().lt(z_r));
        let (cos_i, cos_r) = (norm2(y_i, z_i), norm2(y_r, z_r));
        let (x_sum, cos_sum) = (x_i + x_r, cos_i + cos_r);
        let theta_h = x_sum.atan2(cos_sum);
        let cos2_theta_d = R::of(0.25) * (x_sum * x_sum + cos_sum * cos_sum);

        let (sin_phi_i, m_i) = (y_i / cos_i, z_i / cos_i);
        let (sin_phi_r, m_r) = (y_r / cos_r, z_r / cos_r);
        let half = R::of(0.5);
        let cos_half_phi_d = half * norm2(sin_phi_i + sin_phi_r, m_i + m_r);
        let sin_half_phi_d = half * norm2(sin_phi_i - sin_phi_r, m_i - m_r);
        let u_phi = correlation(self.sigma_u, sin_half_phi_d, cos_half_phi_d);
        let masking = blend(u_phi, m_i, m_r);
        let visibility = blend(self.u_psi, z_i / self.r_i, z_r / self.r_r);
        let common = masking * visibility * cos_i / cos2_theta_d;
        let common = R::select(visible, common, R::zero());

        let reflected = fresnel(
            optics.eta,
            (cos2_theta_d.sqrt() * cos_half_phi_d).min(R::one()),
        );
        let entered = (R::one() - reflected) * (R::one() - reflected);
        let surface_lobe = gaussian(optics.gamma_s, theta_h);
        let volume_lobe = gaussian(optics.gamma_v, theta_h);
        let scattered = R::select(visible, common * entered / cos_sum, R::zero());
        let surface = common * reflected * cos_half_phi_d * surface_lobe;
        Scattered {
            surface: R::select(visible, surface, R::zero()),
            lobe: scattered * (R::one() - optics.k_d) * volume_lobe,
            isotropic: scattered * optics.k_d,
            surface_lobe,
            volume_lobe,
            slope: half * (m_i + m_r),
        }
    }
}

/// The parts of one cylinder's response.
#[derive(Debug, Clone, Copy)]
pub struct Scattered<R> {
    /// S.
    pub surface: R,
    /// The part of V in the volume lobe.
    pub lobe: R,
    /// The isotropic part of V.
    pub isotropic: R,
    /// g(γ_s, θ_h).
    pub surface_lobe: R,
    /// g(γ_v, θ_h).
    pub volume_lobe: R,
    /// dθ_h/dδ = (m_i + m_r)/2, where the cylinder is visible from both directions.
    pub slope: R,
}
