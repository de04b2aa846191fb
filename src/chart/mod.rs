//! Charts: pairs of directions as points of the box \[0, 1\]⁴.
//!
//! Both charts work in the frame of an untilted thread, where a direction has the latitude θ = asin(w·t) and the azimuth
//! φ = atan2(w·s, w·n). With θ_h, θ_d the half sum and half difference of the latitudes, φ_h the half sum of the
//! azimuths and φ_d their difference, three coordinates are shared and normalised so that the box is exactly the pair of
//! upper hemispheres:
//!
//! ```text
//! u₁ = (1 + θ_d / (π/2 − |θ_h|)) / 2       0: wi, 1: wr … the poles of the thread are the faces
//! u₂ = (1 + φ_d / 2(b − φ_h)) / 2          azimuths of ±b are the two faces
//! u₃ = φ_h / b                             the mirror s → −s makes φ_h ≥ 0 and leaves S and V alone
//! ```
//!
//! The box ends at the azimuth b = π/2, the horizon, or at [`Rim::azimuth`] before it, where pairs are evaluated without it.
//!
//! The first coordinate is the sharp one: θ_h in the `thesis` chart, the half vector's ψ in the
//! `highlight` chart.
//!
//! Where a range shrinks to nothing (|θ_h| = 90°: both directions along the thread; φ_h = b: both at the same side's
//! horizon) its coordinate is ½.
//!
//! No angle takes quadrants: θ = 2 atan(x/(1+ρ)) and φ = 2 atan(y/(ρ+z)) with ρ = √(y²+z²), and so ψ. At a pole of the thread, which lies on the horizon, φ is 0 by convention of atan2.
//! S and V grow from 0 in proportion to the height of directions in places of the faces, so that √S has an infinite slope there.
//! Coordinates proportional to the root of that height (in u₁, u₂, u₃ or all of them) were tried and made the mean error 1.1 to 2
//! times as large, since most of a face is no such place; dividing S and V by |wi + wr| made it up to 1.3 times as large.
//!
//! wi = wr is u₁ = u₂ = ½ and the mirror pair has θ_h = 0 and φ_h = 0: grid planes, not singularities.
//!
//! A thread whose direction changes along its curve may lack the mirror; then u₃ spans both signs of φ_h. One that goes in all
//! directions evenly needs three coordinates (`isotropic`), and what only the viewer sees needs two (`view`). What a grid
//! is a function of, of all that, are its [`Coordinates`].

mod coordinates;
pub(crate) mod highlight;
pub(crate) mod isotropic;
mod rim;
mod several;
pub(crate) mod thesis;
pub(crate) mod view;

pub use coordinates::Coordinates;
pub use rim::{Rim, height};
pub(crate) use several::Several;

use core::f64::consts::FRAC_PI_2;

use crate::math::{Lanes, Real, Vec3, norm2};

/// Which chart a table is in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "bake",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[non_exhaustive]
pub enum Chart {
    /// (θ_h, θ_d, φ_d, roll of the pair).
    Thesis,
    /// (ψ of the half vector, θ_d, φ_d, φ_h).
    Highlight,
}

impl Chart {
    /// All charts.
    pub const ALL: [Self; 2] = [Self::Thesis, Self::Highlight];

    /// The coordinates of a pair of unit directions above the surface, given in thread coordinates.
    #[inline(always)]
    pub fn coordinates<R: Lanes>(self, rim: Rim, wi: Vec3<R>, wr: Vec3<R>) -> [R; 4] {
        self.coordinates_and_angles(rim, wi, wr).0
    }

    /// The same, and what they are of.
    #[inline(always)]
    fn coordinates_and_angles<R: Lanes>(
        self,
        rim: Rim,
        wi: Vec3<R>,
        wr: Vec3<R>,
    ) -> ([R; 4], Angles<R>) {
        match self {
            Self::Thesis => thesis::coordinates(rim, wi, wr),
            Self::Highlight => highlight::coordinates(rim, wi, wr),
        }
    }

    /// The pair of directions at a point of the box, with w·s ≥ 0 on average: the inverse of
    /// [`Chart::coordinates`] up to the mirror.
    pub fn directions<R: Real>(self, rim: Rim, u: [R; 4]) -> (Vec3<R>, Vec3<R>) {
        match self {
            Self::Thesis => thesis::directions(rim, u),
            Self::Highlight => highlight::directions(rim, u),
        }
    }
}

/// Latitudes and azimuths of a pair, mirrored to φ_h ≥ 0.
#[derive(Debug, Clone, Copy)]
struct Angles<R> {
    theta_h: R,
    theta_d: R,
    phi_d: R,
    phi_h: R,
    /// −1 if mirrored, else 1.
    side: R,
    /// See [`height`].
    height: R,
}

impl<R: Lanes> Angles<R> {
    #[inline(always)]
    fn of(wi: Vec3<R>, wr: Vec3<R>) -> Self {
        let (half, one) = (R::of(0.5), R::one());
        let (rho_i, rho_r) = (norm2(wi[1], wi[2]), norm2(wr[1], wr[2]));
        let [theta_i, theta_r] = quotients([wi[0], wr[0]], [one + rho_i, one + rho_r]);
        let (theta_i, theta_r) = (theta_i.twice_atan(), theta_r.twice_atan());
        let [phi_i, phi_r] = quotients(
            [wi[1], wr[1]],
            [
                (rho_i + wi[2]).max(R::of(TINY)),
                (rho_r + wr[2]).max(R::of(TINY)),
            ],
        );
        let (phi_i, phi_r) = (phi_i.twice_atan(), phi_r.twice_atan());
        let (phi_d, phi_h) = (phi_i - phi_r, half * (phi_i + phi_r));
        let is_mirrored = phi_h.lt(R::zero());
        let phi_d = R::select(is_mirrored, -phi_d, phi_d);
        Self {
            side: R::select(is_mirrored, R::of(-1.0), R::one()),
            height: rim::height_of([wi[2], wr[2]], [rho_i, rho_r]),
            theta_h: half * (theta_i + theta_r),
            theta_d: half * (theta_i - theta_r),
            phi_d,
            phi_h: phi_h.abs(),
        }
    }
}

impl<R: Real> Angles<R> {
    fn directions(&self) -> (Vec3<R>, Vec3<R>) {
        let half = R::of(0.5);
        let direction = |theta: R, phi: R| {
            let (sin_theta, cos_theta) = theta.sin_cos();
            let (sin_phi, cos_phi) = phi.sin_cos();
            // The horizon is in the box and z = cos 90° must not round below it.
            [
                sin_theta,
                cos_theta * sin_phi,
                (cos_theta * cos_phi).max(R::zero()),
            ]
        };
        (
            direction(self.theta_h + self.theta_d, self.phi_h + half * self.phi_d),
            direction(self.theta_h - self.theta_d, self.phi_h - half * self.phi_d),
        )
    }
}

/// Keeps quotients of components of unit vectors finite, in f32 too.
const TINY: f64 = 1e-15;
/// The least range of an angle that counts as one.
const NARROW: f64 = 1e-12;

/// Two quotients by one division.
#[inline(always)]
fn quotients<R: Lanes>([a, b]: [R; 2], [under_a, under_b]: [R; 2]) -> [R; 2] {
    let over = R::one() / (under_a * under_b);
    [a * under_b * over, b * under_a * over]
}

/// A coordinate within \[0, 1\], and 0 instead of NaN.
#[inline(always)]
fn within<R: Lanes>(u: R) -> R {
    u.max(R::zero()).min(R::one())
}

/// An angle within ±π/2 as a coordinate in \[0, 1\].
#[inline(always)]
fn of_quarters<R: Lanes>(angle: R) -> R {
    within(angle.mul_add(R::of(0.5 / FRAC_PI_2), R::of(0.5)))
}

/// The shared coordinates u₁, u₂, u₃ in a box that ends at an azimuth, which comes with what is over it.
#[inline(always)]
fn shared_coordinates<R: Lanes>([azimuth, over]: [R; 2], angles: &Angles<R>) -> [R; 3] {
    let (half, two) = (R::of(0.5), R::of(2.0));
    let range_1 = (R::of(FRAC_PI_2) - angles.theta_h.abs()).max(R::of(NARROW));
    let range_2 = (two * (azimuth - angles.phi_h)).max(R::of(NARROW));
    let [u1, u2] = quotients(
        [half * angles.theta_d, half * angles.phi_d],
        [range_1, range_2],
    );
    [
        within(half + u1),
        within(half + u2),
        (angles.phi_h * over).min(R::one()),
    ]
}

/// θ_d at |θ_h|, then φ_d and φ_h, from the shared coordinates.
fn theta_d<R: Real>(u: [R; 4], theta_h: R) -> R {
    (R::of(2.0) * u[1] - R::one()) * (R::of(FRAC_PI_2) - theta_h.abs())
}

fn phi_d_and_h<R: Real>(rim: Rim, u: [R; 4]) -> (R, R) {
    let azimuth = R::of(rim.azimuth());
    let phi_h = u[3] * azimuth;
    (
        (R::of(2.0) * u[2] - R::one()) * R::of(2.0) * (azimuth - phi_h),
        phi_h,
    )
}

/// Box to pair once θ_h is known.
fn directions_at<R: Real>(rim: Rim, u: [R; 4], theta_h: R) -> (Vec3<R>, Vec3<R>) {
    let (phi_d, phi_h) = phi_d_and_h(rim, u);
    let theta_d = theta_d(u, theta_h);
    Angles {
        theta_h,
        theta_d,
        phi_d,
        phi_h,
        side: R::one(),
        height: R::one(),
    }
    .directions()
}
