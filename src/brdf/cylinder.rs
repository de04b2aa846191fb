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
//! which are sums of squares: nothing cancels at grazing, along the thread or for opposite directions. p = cos ψ comes from
//! that of the untilted thread, and z = p √(x²+z²). A direction whose tilted z is not positive has m = p = 0, which also
//! removes the poles (cos θ = 0 implies z = 0).
//!
//! Departures: the exit transmittance is taken at the entry angle, (1−F_r)² for F_t F_t', and γ is the standard
//! deviation of a Gaussian of unit area; \[SBDJ13\] leaves both open.

use super::psi::{Ordered, Psi};
use crate::math::{Lanes, Real, Vec3, each, norm2, splat};

/// Optical constants of the cylinders of a thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics<R> {
    /// Refractive index η relative to air, ≥ 1.
    pub eta: R,
    /// η² − 1, which a rounded η near 1 would not give.
    contrast: R,
    /// Isotropic share k_d of volume scattering, 0 to 1.
    pub k_d: R,
    /// Width γ_s of the surface lobe (standard deviation), radians, > 0.
    pub gamma_s: R,
    /// Width γ_v of the volume lobe (standard deviation), radians, > 0.
    pub gamma_v: R,
}

impl Optics<f64> {
    /// The constants of a cylinder, in the ranges of [`limits`](super::limits).
    pub fn new(eta: f64, k_d: f64, gamma_s: f64, gamma_v: f64) -> Self {
        Self {
            eta,
            contrast: (eta - 1.0) * (eta + 1.0),
            k_d,
            gamma_s,
            gamma_v,
        }
    }
}

impl<R: Real> Optics<R> {
    /// The same constants in another precision, or in every lane.
    pub fn cast<T: Lanes>(&self) -> Optics<T> {
        let of = |x: R| T::of(x.to_double());
        Optics {
            eta: of(self.eta),
            contrast: of(self.contrast),
            k_d: of(self.k_d),
            gamma_s: of(self.gamma_s),
            gamma_v: of(self.gamma_v),
        }
    }
}

impl<R: Lanes> Optics<R> {
    /// Those with these numbers.
    #[inline(always)]
    pub(crate) fn of_numbers([contrast, k_d, gamma_s, gamma_v]: [R; 4]) -> Self {
        Self {
            eta: (R::one() + contrast).sqrt(),
            contrast,
            k_d,
            gamma_s,
            gamma_v,
        }
    }
}

impl Optics<f32> {
    /// η² − 1, k_d, γ_s and γ_v.
    pub(crate) fn numbers(&self) -> [f32; 4] {
        [self.contrast, self.k_d, self.gamma_s, self.gamma_v]
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

/// What an interface reflects and what it lets through, of unpolarised light: F_r and 1 − F_r.
///
/// For a smooth dielectric with η² − 1 = `contrast` ≥ 0 at cosine of incidence `cos` ∈ \[0, 1\]. With g = √(η² − 1 + cos²),
/// which is η times the cosine inside, the amplitudes (cos − g)/(cos + g) and (η² cos − g)/(η² cos + g) are differences of what
/// is nearly equal where η is near 1, and 1 − F_r of what is nearly equal at grazing. Multiplied out they are
///
/// ```text
/// r_s = −(η²−1) / (cos + g)²,      r_p = (η²−1) ((η²+1) cos² − 1) / (η² cos + g)²
/// F_r = (r_s² + r_p²)/2,           1 − F_r = 2 cos g (1/(cos + g)² + η²/(η² cos + g)²)
/// ```
#[inline(always)]
pub fn fresnel<R: Lanes>(contrast: R, cos: R) -> (R, R) {
    let cos2 = cos * cos;
    let g = (contrast + cos2).sqrt();
    let s = cos + g;
    let p = s + contrast * cos;
    // Without an interface all is let through, but for cos = 0, where the ratios would be 0/0. With one, g² ≥ η² − 1.
    let over_s = R::one() / s.max(R::of(TINY));
    let over_p = R::one() / p.max(R::of(TINY));
    let (c, two) = (contrast, R::of(2.0));
    let r_s = (c * over_s) * over_s;
    let r_p = (c * over_p) * (((c + two) * cos2 - R::one()) * over_p);
    let reflected = R::of(0.5) * (r_s * r_s + r_p * r_p);
    let t_s = (cos * over_s) * (g * over_s);
    let t_p = (cos * over_p) * (g * over_p);
    let entered = two * (t_s + (c + R::one()) * t_p);
    (reflected, entered)
}

/// Far below any cosine that single precision tells from 0.
const TINY: f64 = 1e-30;
/// A direction that rises less than this above a cylinder's horizon sees nothing of it: squares of what is smaller
/// underflow in single precision, and quotients of them are lost.
const UNSEEN: f64 = 1e-18;

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
pub struct ThreadPair<R: Lanes> {
    wi: Vec3<R>,
    wr: Vec3<R>,
    psi_i: Psi<R>,
    psi_r: Psi<R>,
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
        let ((a, r_i), (b, r_r)) = (Psi::of(wi), Psi::of(wr));
        let u_psi = correlation(
            sigma_u,
            norm2(a.sin - b.sin, a.cos - b.cos),
            norm2(a.sin + b.sin, a.cos + b.cos),
        );
        Self {
            wi,
            wr,
            psi_i: a,
            psi_r: b,
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

    /// √(x² + z²) of light and viewer.
    #[inline(always)]
    pub(super) fn radii(&self) -> [R; 2] {
        [self.r_i, self.r_r]
    }

    /// ψ of light and viewer, in order.
    #[inline(always)]
    pub(super) fn order(&self) -> Ordered<R> {
        Ordered::new(self.psi_i, self.psi_r)
    }

    /// u(ψ_d), the same at every tilt.
    #[inline(always)]
    pub fn correlation_psi(&self) -> R {
        self.u_psi
    }

    /// p_r at the tilt with the given cosine and sine, 3.24: what Q weighs a tangent by.
    #[inline(always)]
    pub fn projection(&self, cos_delta: R, sin_delta: R) -> R {
        self.psi_r.facing(cos_delta, sin_delta).max(R::zero())
    }

    /// P at the tilt with the given cosine and sine, 3.25.
    #[inline(always)]
    pub fn visibility(&self, cos_delta: R, sin_delta: R) -> R {
        let p = |psi: Psi<R>| psi.facing(cos_delta, sin_delta).max(R::zero());
        blend(self.u_psi, p(self.psi_i), p(self.psi_r))
    }

    /// S and V of the cylinder tilted by δ, given as cos δ and sin δ.
    #[inline(always)]
    pub fn response(&self, optics: &Optics<R>, cos_delta: R, sin_delta: R) -> Response<R> {
        let h = [self.wi[0] + self.wr[0], self.wi[2] + self.wr[2]];
        let parts = self.scatter(
            optics,
            self.psi_i.facing(cos_delta, sin_delta),
            self.psi_r.facing(cos_delta, sin_delta),
            cos_delta * h[0] + sin_delta * h[1],
        );
        Response {
            surface: parts.surface,
            volume: parts.lobe + parts.isotropic,
        }
    }

    /// What S and V are made of, of the cylinder that has cos ψ_i = `p_i` and cos ψ_r = `p_r` in its own frame, and
    /// X = x_i + x_r = `x_sum`.
    #[inline(always)]
    pub(super) fn scatter(&self, optics: &Optics<R>, p_i: R, p_r: R, x_sum: R) -> Scattered<R> {
        let (z_i, z_r) = (self.r_i * p_i, self.r_r * p_r);
        let visible = R::both(R::of(UNSEEN).lt(z_i), R::of(UNSEEN).lt(z_r));
        let (y_i, y_r) = (self.wi[1], self.wr[1]);
        let (cos_i, cos_r) = (norm2(y_i, z_i), norm2(y_r, z_r));
        let cos_sum = cos_i + cos_r;
        let theta_h = x_sum.atan2(cos_sum);
        let cos2_theta_d = R::of(0.25) * (x_sum * x_sum + cos_sum * cos_sum);

        let (sin_phi_i, m_i) = (y_i / cos_i, z_i / cos_i);
        let (sin_phi_r, m_r) = (y_r / cos_r, z_r / cos_r);
        let half = R::of(0.5);
        let cos_half_phi_d = half * norm2(sin_phi_i + sin_phi_r, m_i + m_r);
        let sin_half_phi_d = half * norm2(sin_phi_i - sin_phi_r, m_i - m_r);
        let u_phi = correlation(self.sigma_u, sin_half_phi_d, cos_half_phi_d);
        let masking = blend(u_phi, m_i, m_r);
        let visibility = blend(self.u_psi, p_i, p_r);
        let common = masking * visibility * cos_i / cos2_theta_d;
        let common = R::select(visible, common, R::zero());

        let (reflected, entered) = fresnel(
            optics.contrast,
            (cos2_theta_d.sqrt() * cos_half_phi_d).min(R::one()),
        );
        let entered = entered * entered;
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

impl<R: Real> ThreadPair<R> {
    /// The same pair in every lane.
    #[inline(always)]
    pub fn splat<L: Lanes>(&self) -> ThreadPair<L> {
        ThreadPair {
            wi: each(self.wi, splat),
            wr: each(self.wr, splat),
            psi_i: self.psi_i.splat(),
            psi_r: self.psi_r.splat(),
            r_i: splat(self.r_i),
            r_r: splat(self.r_r),
            sigma_u: splat(self.sigma_u),
            u_psi: splat(self.u_psi),
        }
    }
}

/// The parts of one cylinder's response.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scattered<R> {
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
