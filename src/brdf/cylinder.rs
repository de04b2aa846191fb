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
//! 4 cos² θ_d = X² + C²,      θ_h = 2 atan(X/(C + 2 cos θ_d)),      2 cos(φ_d/2) = |(cos φ_i, sin φ_i) + (cos φ_r, sin φ_r)|
//! ```
//!
//! which are sums of squares: nothing cancels at grazing, along the thread or for opposite directions. p = cos ψ comes from
//! that of the untilted thread, and z = p √(x²+z²). A direction whose tilted z is not positive has m = p = 0, which also
//! removes the poles (cos θ = 0 implies z = 0).
//!
//! Departures: the exit transmittance is taken at the entry angle, (1−F_r)² for F_t F_t', and γ is the standard
//! deviation of a Gaussian of unit area; \[SBDJ13\] leaves both open.

use super::psi::{Ordered, Psi};
use crate::math::{Lanes, Real, Vec3, each, norm2, splat, square2};

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
    /// 1/γ_s and 1/γ_v.
    over_gamma: [R; 2],
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
            over_gamma: [1.0 / gamma_s, 1.0 / gamma_v],
        }
    }
}

impl<R: Real> Optics<R> {
    /// The same constants in another precision, or in every lane.
    #[inline(always)]
    pub fn cast<T: Lanes>(&self) -> Optics<T> {
        let of = |x: R| T::of(x.to_double());
        Optics {
            eta: of(self.eta),
            contrast: of(self.contrast),
            k_d: of(self.k_d),
            gamma_s: of(self.gamma_s),
            gamma_v: of(self.gamma_v),
            over_gamma: [of(self.over_gamma[0]), of(self.over_gamma[1])],
        }
    }
}

impl<R: Lanes> Optics<R> {
    /// Those with these numbers.
    #[inline(always)]
    pub(crate) fn of_numbers([contrast, k_d, gamma_s, gamma_v]: [R; 4]) -> Self {
        let one = R::one();
        Self {
            eta: (one + contrast).sqrt(),
            contrast,
            k_d,
            gamma_s,
            gamma_v,
            over_gamma: [one / gamma_s, one / gamma_v],
        }
    }

    /// 1/γ_s and 1/γ_v.
    #[inline(always)]
    pub(super) fn over_gamma(&self) -> [R; 2] {
        self.over_gamma
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
    #[inline(always)]
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
    let g = (contrast + cos2).max(R::of(UNSEEN * UNSEEN));
    let g = g.sqrt_and_reciprocal().0;
    let s = cos + g;
    let p = s + contrast * cos;
    // Without an interface all is let through, but for cos = 0, where the ratios would be 0/0. With one, g² ≥ η² − 1.
    let (s, p) = (s.max(R::of(UNSEEN)), p.max(R::of(UNSEEN)));
    let over = (s * p).reciprocal();
    let (over_s, over_p) = (p * over, s * over);
    let (c, two) = (contrast, R::of(2.0));
    let r_s = (c * over_s) * over_s;
    let r_p = (c * over_p) * (((c + two) * cos2 - R::one()) * over_p);
    let reflected = R::of(0.5) * (r_s * r_s + r_p * r_p);
    let t_s = (cos * over_s) * (g * over_s);
    let t_p = (cos * over_p) * (g * over_p);
    let entered = two * (t_s + (c + R::one()) * t_p);
    (reflected, entered)
}

/// A direction that rises less than this above a cylinder's horizon sees nothing of it: squares of what is smaller
/// underflow in single precision, and quotients of them are lost.
const UNSEEN: f64 = 1e-18;

/// The exponent where Gaussians end: what is darker matters nowhere, and products of it are numbers that processors are slow with.
const DARK: f64 = -60.0;

/// Gaussian of unit area and standard deviation 1/`over_sigma` at `x`, g(γ, x).
#[inline(always)]
fn gaussian<R: Lanes>(over_sigma: R, x: R) -> R {
    let t = x * over_sigma;
    let exponent = (R::of(-0.5) * t * t).max(R::of(DARK));
    exponent.exp() * R::of(0.398_942_280_401_432_7) * over_sigma
}

/// u: Gaussian of unit height and standard deviation 1/`over_sigma` of an angle within ±180°, from its sine and the cosine of half of
/// it. (Near 180° the quotient is one of small numbers, where u is none.)
#[inline(always)]
fn correlation<R: Lanes>(over_sigma: R, sin: R, cos_half: R) -> R {
    let one = R::one();
    let under = R::of(2.0) * cos_half * (one + cos_half);
    let quarter_tangent = (sin.abs() * under.max(R::of(UNSEEN)).reciprocal()).min(one);
    let t = R::of(2.0) * quarter_tangent.twice_atan() * over_sigma;
    (R::of(-0.5) * t * t).max(R::of(DARK)).exp()
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
    /// 1/σ of u.
    over_sigma_u: R,
    u_psi: R,
}

impl<R: Lanes> ThreadPair<R> {
    /// Prepares unit directions `wi` and `wr` in thread coordinates; `sigma_u` is the width of u in radians.
    #[inline(always)]
    pub fn new(wi: Vec3<R>, wr: Vec3<R>, sigma_u: R) -> Self {
        let ((a, r_i), (b, r_r)) = (Psi::of(wi), Psi::of(wr));
        let over_sigma_u = R::one() / sigma_u;
        let u_psi = correlation(
            over_sigma_u,
            a.sin * b.cos - a.cos * b.sin,
            R::of(0.5) * norm2(a.sin + b.sin, a.cos + b.cos),
        );
        Self {
            wi,
            wr,
            psi_i: a,
            psi_r: b,
            r_i,
            r_r,
            over_sigma_u,
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
        blend(
            self.u_psi,
            self.psi_i.facing(cos_delta, sin_delta).max(R::zero()),
            self.psi_r.facing(cos_delta, sin_delta).max(R::zero()),
        )
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
        let (half, least) = (R::of(0.5), R::of(UNSEEN * UNSEEN));
        let (cos_i, over_i) = square2(y_i, z_i).max(least).sqrt_and_reciprocal();
        let (cos_r, over_r) = square2(y_r, z_r).max(least).sqrt_and_reciprocal();
        let cos_sum = cos_i + cos_r;
        let (cos_theta_d_2, over_theta_d_2) = square2(x_sum, cos_sum).sqrt_and_reciprocal();
        // tan(θ_h/2) = X/(C + √(X²+C²)).
        let beyond = cos_sum + cos_theta_d_2;
        let over = (beyond * cos_sum).reciprocal();
        let (theta_h, over_sum) = ((x_sum * cos_sum * over).twice_atan(), beyond * over);

        let (sin_phi_i, m_i) = (y_i * over_i, z_i * over_i);
        let (sin_phi_r, m_r) = (y_r * over_r, z_r * over_r);
        let facing = square2(sin_phi_i + sin_phi_r, m_i + m_r).max(least);
        let cos_half_phi_d = half * facing.sqrt_and_reciprocal().0;
        let sin_phi_d = sin_phi_i * m_r - m_i * sin_phi_r;
        let u_phi = correlation(self.over_sigma_u, sin_phi_d, cos_half_phi_d);
        let masking = blend(u_phi, m_i, m_r);
        let visibility = blend(self.u_psi, p_i, p_r);
        let over_theta_d = R::of(2.0) * over_theta_d_2;
        let common = masking * visibility * cos_i * (over_theta_d * over_theta_d);
        let common = R::select(visible, common, R::zero());

        let (reflected, entered) = fresnel(
            optics.contrast,
            (half * cos_theta_d_2 * cos_half_phi_d).min(R::one()),
        );
        let entered = entered * entered;
        let surface_lobe = gaussian(optics.over_gamma[0], theta_h);
        let volume_lobe = gaussian(optics.over_gamma[1], theta_h);
        let scattered = R::select(visible, common * entered * over_sum, R::zero());
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
            over_sigma_u: splat(self.over_sigma_u),
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
