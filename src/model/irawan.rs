//! The Irawan–Marschner model of woven yarns, at the scale where segments are too small to be seen.
//!
//! P. Irawan and S. Marschner, *Specular Reflection from Woven Cloth*, ACM Transactions on Graphics 31(1), 2012; \[Fecho13\]
//! 3.2.1, equations 3.4–3.14.
//!
//! ```text
//! f   = k_d/π + Σ_j k_s,j f_j / N,      f_j = a_j/(w_j l_j) ∫ G f_c A_s
//! n   = (sin v, sin u cos v, cos u cos v)                            normal of the yarn; x across, y along, z normal
//! f_c = α + exp(−β wi·wr) / (2π I_0(β))                              forward scattering of a fibre
//! A   = 1/(4π) · cos_i cos_r / (cos_i + cos_r)                       Seeliger's attenuation, cosines to n
//!
//! filament   u = atan(h_y/h_z),  |u| < u_max,    ∫ over v ∈ ±π/2,    G = a (R + a cos v) / (|wi + wr| |(t × h)_x|)
//!            A_s = A (1 − smoothstep((|u| − (1−δ) u_max) / (δ u_max))),  R at min(|u|, (1−δ) u_max)
//! staple     ∫ over u ∈ ±u_max,  where |D| < 1 and |v| < π/2,        G = a (R + a cos v) / (|wi + wr| (n·h) |sin ψ|)
//!            v = atan2(−q, h_x) + acos D,   q = h_y sin u + h_z cos u,
//!            D = (h_y cos u − h_z sin u) / (√(h_x² + q²) tan ψ)
//! ```
//!
//! N is the albedo of the specular part in uniform light for k_s = 1, so that k_s is the share that is reflected.
//!
//! The spine's radius of curvature R is given case by case, for an ellipse, parabola, hyperbola and circle. With
//! r = 1 + κ(1 + cot u_max) and L = l/2 − a sin u_max, a = w/2, all four are
//!
//! ```text
//! R(u) = L/sin u_max · √q(u_max) / q(u)^{3/2},      q(u) = cos² u + r|r| sin² u
//! ```
//!
//! since for the ellipse b r = L √q(u_max)/sin u_max and cos t/cos u = 1/√q(u), where tan t = r tan u, and likewise with
//! hyperbolic functions for r < 0.
//!
//! What is integrated is bounded: |wi + wr| (n·h) = cos_i + cos_r, so that both factors of |wi + wr| can be taken into the
//! cosines of A. Domains are cut where they end (at n·wi = 0 and n·wr = 0 of a filament, at |D| = 1 and |v| = π/2 of a staple
//! yarn, where |sin(u − u_h)| is |sin ψ|/g and |sin ψ|, with g = √(h_y² + h_z²) and u_h = atan2(h_y, h_z); and where light or viewer
//! set on it, which is searched for), and each piece has a Gauss–Legendre rule.

use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::LazyLock;

use super::{Model, are_above, finite, gauss_legendre};
use crate::brdf::ThreadFrame;
use crate::fabric::{Irawan, Yarn};
use crate::math::{Real, Vec3, dot, normalized};

/// Nodes per piece of a domain.
const ORDER: usize = 32;
/// Places per piece at which is looked whether light and viewer are seen, and halvings to find where that changes.
const PROBES: usize = 12;
const HALVINGS: usize = 24;
/// Pairs that N is the mean over: its error is about a hundredth of the spread over pairs.
const PAIRS: u32 = 4096;
/// Points of the circle that I_0 is the mean over. The error vanishes faster than any power while they lie closer than the
/// width 1/√β of the peak.
const CIRCLE: u32 = 512;

static NODES: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| gauss_legendre(ORDER));

/// Yarns that cannot be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SpineError {
    /// Nothing is left of the spine.
    #[error(
        "a segment of length {length} and width {width} has no spine: its length must exceed width · sin u_max = {used}"
    )]
    TooShort {
        /// l.
        length: f64,
        /// w.
        width: f64,
        /// w sin u_max.
        used: f64,
    },
    /// The spine has a corner, or is not a number.
    #[error("the spine curvature κ = {0} must be above -1")]
    Corner(f64),
}

/// The model, prepared.
#[derive(Debug, Clone)]
pub struct IrawanMarschner<R> {
    diffuse: [R; 3],
    yarns: Vec<Segments<R>>,
    normalization: f64,
}

#[derive(Debug, Clone)]
struct Segments<R> {
    frame: ThreadFrame<R>,
    /// a_j/(w l N) · k_s.
    specular: [R; 3],
    alpha: R,
    beta: R,
    /// 1/(2π I_0(β) exp(−β)).
    phase_scale: R,
    delta: R,
    psi: R,
    u_max: R,
    /// a.
    radius: R,
    /// L √q(u_max) / sin u_max.
    spine: R,
    /// r|r|.
    conic: R,
}

impl<R: Real> IrawanMarschner<R> {
    /// Prepares the evaluation, N included, which takes some milliseconds.
    ///
    /// # Errors
    /// When a yarn has no spine.
    pub fn new(parameters: &Irawan) -> Result<Self, SpineError> {
        let white = Irawan {
            diffuse: [0.0; 3],
            yarns: parameters
                .yarns
                .iter()
                .map(|yarn| Yarn {
                    specular: [1.0; 3],
                    ..*yarn
                })
                .collect(),
        };
        let albedo = IrawanMarschner::<f64>::with_normalization(&white, 1.0)?.specular_albedo();
        let normalization = if albedo > 0.0 { albedo } else { 1.0 };
        Self::with_normalization(parameters, normalization)
    }

    /// The same for an N that is known; 1 leaves the specular part as the integrals give it.
    ///
    /// # Errors
    /// When a yarn has no spine.
    pub fn with_normalization(parameters: &Irawan, normalization: f64) -> Result<Self, SpineError> {
        let yarns = parameters.yarns.iter();
        Ok(Self {
            diffuse: parameters.diffuse.map(R::of),
            yarns: yarns
                .map(|yarn| Segments::new(yarn, normalization))
                .collect::<Result<_, _>>()?,
            normalization,
        })
    }

    /// N, the factor that the specular part is divided by.
    pub fn normalization(&self) -> f64 {
        self.normalization
    }
}

impl IrawanMarschner<f64> {
    /// Albedo of the specular part in uniform light, red, which is π times the mean BRDF over cosine-weighted pairs.
    fn specular_albedo(&self) -> f64 {
        let mean = (1..=PAIRS)
            .map(|index| {
                let [wi, wr] = pair(index);
                self.specular(wi, wr)[0]
            })
            .sum::<f64>()
            / f64::from(PAIRS);
        PI * mean
    }
}

/// Cosine-weighted directions that fill the square of the hemisphere evenly: multiples of powers of the root of x⁵ = x + 1,
/// modulo 1 (M. Roberts, *The Unreasonable Effectiveness of Quasirandom Sequences*, 2018).
fn pair(index: u32) -> [Vec3<f64>; 2] {
    const ROOT: f64 = 1.167_303_978_261_418_7;
    let number = |power: i32| (0.5 + f64::from(index) * ROOT.powi(-power)).fract();
    let direction = |z2: f64, turn: f64| {
        let (sin, cos) = (TAU * turn).sin_cos();
        let r = (1.0 - z2).sqrt();
        [r * cos, r * sin, z2.sqrt()]
    };
    [
        direction(number(1), number(2)),
        direction(number(3), number(4)),
    ]
}

impl<R: Real> IrawanMarschner<R> {
    /// Σ k_s,j f_j / N.
    fn specular(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        let sum = [wi[0] + wr[0], wi[1] + wr[1], wi[2] + wr[2]];
        let mut specular = [R::zero(); 3];
        let Some(h) = normalized(sum) else {
            return specular;
        };
        let length = dot(sum, h);
        // Where light and viewer are opposite to the last bit there is no half vector to speak of.
        if !(R::zero() < length && R::zero() < h[2]) {
            return specular;
        }
        for yarn in &self.yarns {
            let value = finite(yarn.response([wi, wr], h, length));
            for (sum, k_s) in specular.iter_mut().zip(yarn.specular) {
                *sum += k_s * value;
            }
        }
        specular
    }
}

impl<R: Real> Segments<R> {
    fn new(yarn: &Yarn, normalization: f64) -> Result<Self, SpineError> {
        let &Yarn {
            u_max,
            kappa,
            width,
            length,
            ..
        } = yarn;
        let half_spine = yarn.half_spine();
        if !(half_spine > 0.0) {
            return Err(SpineError::TooShort {
                length,
                width,
                used: width * u_max.sin(),
            });
        }
        let (sin, cos) = u_max.sin_cos();
        let r = 1.0 + kappa * (1.0 + cos / sin);
        let conic = r * r.abs();
        let q = cos * cos + conic * sin * sin;
        if !(kappa > -1.0 && q > 0.0) {
            return Err(SpineError::Corner(kappa));
        }
        let weight = yarn.coverage / (width * length * normalization);
        Ok(Self {
            frame: ThreadFrame::new(yarn.direction),
            specular: yarn.specular.map(|k_s| R::of(k_s * weight)),
            alpha: R::of(yarn.alpha),
            beta: R::of(yarn.beta),
            phase_scale: R::of(1.0 / (TAU * scaled_bessel_i0(yarn.beta))),
            delta: R::of(yarn.delta),
            psi: R::of(yarn.psi),
            u_max: R::of(u_max),
            radius: R::of(0.5 * width),
            spine: R::of(half_spine * q.sqrt() / sin),
            conic: R::of(conic),
        })
    }

    /// ∫ G f_c A_s of a segment.
    fn response(&self, pair: [Vec3<R>; 2], h: Vec3<R>, length: R) -> R {
        // Across, along, normal; the directions already over |wi + wr|.
        let to_yarn = |w: Vec3<R>| {
            let [along, side, normal] = self.frame.to_thread(w);
            [-side, along, normal]
        };
        let phase = self.phase(dot(pair[0], pair[1]));
        let pair = pair.map(|w| to_yarn(w).map(|x| x / length));
        let h = to_yarn(h);
        let integral = if self.psi == R::zero() {
            self.filament(pair, h)
        } else {
            self.staple(pair, h)
        };
        R::of(0.25 / PI) * self.radius * phase * integral
    }

    /// f_c, in a form whose exponent is never above 0.
    fn phase(&self, cos: R) -> R {
        self.alpha + self.phase_scale * (self.beta * (-cos - R::one()).min(R::zero())).exp()
    }

    /// R(u).
    fn radius_of_curvature(&self, sin: R, cos: R) -> R {
        let q = cos * cos + self.conic * sin * sin;
        self.spine / (q * q.sqrt())
    }

    /// ∫ over v, but for the factor a f_c/4π.
    fn filament(&self, pair: [Vec3<R>; 2], h: Vec3<R>) -> R {
        let u = h[1].atan2(h[2]);
        let size = u.abs();
        if !(size < self.u_max) {
            return R::zero();
        }
        let kept = (R::one() - self.delta) * self.u_max;
        let beyond = (size - kept).max(R::zero()) / (self.delta * self.u_max).max(R::EPSILON);
        let smooth = R::one() - beyond * beyond * (R::of(3.0) - R::of(2.0) * beyond);
        let (sin, cos) = size.min(kept).sin_cos();
        let curvature = self.radius_of_curvature(sin, cos);

        let (sin_u, cos_u) = u.sin_cos();
        let half_turn = R::of(FRAC_PI_2);
        let (mut from, mut to) = (-half_turn, half_turn);
        // In the plane of v the normal is (sin v, cos v).
        let in_plane = |w: Vec3<R>| [w[0], w[1] * sin_u + w[2] * cos_u];
        let pair = pair.map(in_plane);
        for [x, z] in pair {
            let towards = x.atan2(z);
            from = from.max(towards - half_turn);
            to = to.min(towards + half_turn);
        }
        let (middle, half) = (R::of(0.5) * (from + to), R::of(0.5) * (to - from));
        if !(R::zero() < half) {
            return R::zero();
        }
        let mut sum = R::zero();
        for [node, weight] in NODES.iter() {
            let (sin_v, cos_v) = (middle + half * R::of(*node)).sin_cos();
            let [cos_i, cos_r] = pair.map(|[x, z]| x * sin_v + z * cos_v);
            if R::zero() < cos_i && R::zero() < cos_r {
                let shape = curvature + self.radius * cos_v;
                sum += R::of(*weight) * shape * (cos_i * (cos_r / (cos_i + cos_r)));
            }
        }
        // (t × h)_x
        let across = cos_u * h[2] + sin_u * h[1];
        sum * half * smooth.max(R::zero()) / across
    }

    /// ∫ over u, but for the factor a f_c/4π.
    fn staple(&self, pair: [Vec3<R>; 2], h: Vec3<R>) -> R {
        let (sin_psi, cos_psi) = self.psi.sin_cos();
        let (twist, cot_psi) = (sin_psi.abs(), cos_psi / sin_psi);
        let u_h = h[1].atan2(h[2]);
        let sine = (twist / (h[1] * h[1] + h[2] * h[2]).sqrt()).min(R::one());
        let last = sine.atan2((R::one() - sine * sine).max(R::zero()).sqrt());
        let (half_turn, psi) = (R::of(PI), self.psi.abs());
        let within = |u: R| (u_h + u).max(-self.u_max).min(self.u_max);
        let mut ends = [
            -self.u_max,
            within(last - half_turn),
            within(psi - half_turn),
            within(-last),
            within(-psi),
            within(psi),
            within(last),
            within(half_turn - psi),
            within(half_turn - last),
            self.u_max,
        ];
        ends.sort_by(|a, b| a.to_double().total_cmp(&b.to_double()));

        // The lower cosine towards light and viewer, and the integrand.
        let at = |u: R| {
            let (sin_u, cos_u) = u.sin_cos();
            let q = h[1] * sin_u + h[2] * cos_u;
            let size = (h[0] * h[0] + q * q).sqrt();
            let d = (h[1] * cos_u - h[2] * sin_u) * cot_psi / size;
            if !(d.abs() < R::one()) {
                return None;
            }
            // v is acos D less the angle of (h_x, q).
            let e = (R::one() - d * d).sqrt();
            let sin_v = (e * h[0] - d * q) / size;
            let cos_v = (d * h[0] + e * q) / size;
            let normal = [sin_v, sin_u * cos_v, cos_u * cos_v];
            let [cos_i, cos_r] = pair.map(|w| dot(w, normal));
            if !(R::zero() < cos_v) {
                return None;
            }
            let lower = cos_i.min(cos_r);
            if !(R::zero() < lower) {
                return Some((lower, R::zero()));
            }
            let shape = self.radius_of_curvature(sin_u, cos_u) + self.radius * cos_v;
            let both = cos_i + cos_r;
            Some((lower, shape * (cos_i / both) * (cos_r / both)))
        };
        let mut sum = R::zero();
        for piece in ends.windows(2) {
            let (middle, half) = middle_and_half(piece[0], piece[1]);
            if !(R::zero() < half) || at(middle).is_none() {
                continue;
            }
            let is_seen = |u: R| at(u).is_some_and(|(lower, _)| R::zero() < lower);
            let mut seen_over = |from: R, to: R| {
                if is_seen(middle_and_half(from, to).0) {
                    sum += over(from, to, &at);
                }
            };
            // Cut where light or viewer sets, too, which is where the integrand bends.
            let mut from = piece[0];
            for probe in 1..=PROBES {
                let (before, here) = (place(piece, probe - 1), place(piece, probe));
                if is_seen(before) != is_seen(here) {
                    let cut = turn_between(before, here, &is_seen);
                    seen_over(from, cut);
                    from = cut;
                }
            }
            seen_over(from, piece[1]);
        }
        sum / twist
    }
}

fn middle_and_half<R: Real>(from: R, to: R) -> (R, R) {
    (R::of(0.5) * (from + to), R::of(0.5) * (to - from))
}

/// One of the places in a piece, from just inside one end to just inside the other.
fn place<R: Real>(piece: &[R], probe: usize) -> R {
    let share = (probe as f64 / PROBES as f64).clamp(1e-4, 1.0 - 1e-4);
    piece[0] + R::of(share) * (piece[1] - piece[0])
}

/// Where what holds at one end ceases to hold on the way to the other.
fn turn_between<R: Real>(mut from: R, mut to: R, holds: &impl Fn(R) -> bool) -> R {
    let begins = holds(from);
    for _ in 0..HALVINGS {
        let (middle, _) = middle_and_half(from, to);
        if holds(middle) == begins {
            from = middle;
        } else {
            to = middle;
        }
    }
    to
}

/// ∫ between two ends, at which v may have a root (where |D| = 1): u = middle + half sin τ.
fn over<R: Real>(from: R, to: R, at: &impl Fn(R) -> Option<(R, R)>) -> R {
    let (middle, half) = middle_and_half(from, to);
    let mut sum = R::zero();
    for [node, weight] in SINES.iter() {
        if let Some((_, value)) = at(middle + half * R::of(*node)) {
            sum += R::of(*weight) * half * value;
        }
    }
    sum
}

/// sin τ of the nodes τ on ±π/2, and their weights times cos τ.
static SINES: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| {
    let substituted = |[node, weight]: &[f64; 2]| {
        let (sin, cos) = (FRAC_PI_2 * node).sin_cos();
        [sin, weight * FRAC_PI_2 * cos]
    };
    NODES.iter().map(substituted).collect()
});

/// I_0(β) exp(−β), the mean of exp(β (cos t − 1)) over the circle.
fn scaled_bessel_i0(beta: f64) -> f64 {
    let angle = |k: u32| TAU * (f64::from(k) + 0.5) / f64::from(CIRCLE);
    let value = |k: u32| (beta * (angle(k).cos() - 1.0)).exp();
    (0..CIRCLE).map(value).sum::<f64>() / f64::from(CIRCLE)
}

impl<R: Real> Model<R> for IrawanMarschner<R> {
    fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        if !are_above(wi, wr) {
            return [R::zero(); 3];
        }
        let specular = self.specular(wi, wr);
        let diffuse = self.diffuse.map(|k_d| R::of(1.0 / PI) * k_d);
        [0, 1, 2].map(|c| finite(finite(diffuse[c] + specular[c]) * wi[2]))
    }
}

/// A fabric of Irawan's, without colours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IrawanPreset {
    /// The name to call it by.
    pub name: &'static str,
    /// α, β, δ.
    scattering: [f64; 3],
    /// Areas of warp and weft.
    areas: [f64; 2],
    /// ψ, u_max (degrees), κ, w, l of warp and weft.
    yarns: [[f64; 5]; 2],
}

impl IrawanPreset {
    /// The parameters, with k_d = 0 and k_s = 1.
    pub fn parameters(&self) -> Irawan {
        let [alpha, beta, delta] = self.scattering;
        let total: f64 = self.areas.iter().sum();
        let yarns = [0.0, FRAC_PI_2].into_iter().zip(self.areas).zip(self.yarns);
        let yarn = |((direction, area), numbers): ((f64, f64), [f64; 5])| {
            let [psi_deg, u_max_deg, kappa, width, length] = numbers;
            Yarn {
                direction,
                coverage: area / total,
                specular: [1.0; 3],
                alpha,
                beta,
                delta,
                psi: psi_deg.to_radians(),
                u_max: u_max_deg.to_radians(),
                kappa,
                width,
                length,
            }
        };
        Irawan {
            diffuse: [0.0; 3],
            yarns: yarns.map(yarn).collect(),
        }
    }
}

/// The six fabrics of Irawan's own code, as its public ports have them. The weft of the cotton twill has no spine: w sin u_max > l.
pub const IRAWAN_PRESETS: &[IrawanPreset] = &[
    IrawanPreset {
        name: "denim",
        scattering: [0.01, 4.0, 0.0],
        areas: [5.0, 1.0],
        yarns: [[-30.0, 12.0, 0.0, 1.0, 5.0], [-30.0, 38.0, 0.0, 1.0, 1.0]],
    },
    IrawanPreset {
        name: "silk-shantung",
        scattering: [0.02, 1.5, 0.5],
        areas: [8.0, 16.0],
        yarns: [[0.0, 50.0, -0.5, 2.0, 4.0], [0.0, 23.0, -0.3, 4.0, 4.0]],
    },
    IrawanPreset {
        name: "silk-charmeuse",
        scattering: [0.02, 7.3, 0.5],
        areas: [9.0, 1.0],
        yarns: [[0.0, 40.0, 2.0, 1.0, 9.0], [0.0, 60.0, 0.0, 1.0, 1.0]],
    },
    IrawanPreset {
        name: "cotton-twill",
        scattering: [0.01, 4.0, 0.0],
        areas: [6.0, 2.0],
        yarns: [[-30.0, 24.0, 0.0, 1.0, 6.0], [-30.0, 36.0, 0.0, 2.0, 1.0]],
    },
    IrawanPreset {
        name: "wool-gabardine",
        scattering: [0.01, 4.0, 0.0],
        areas: [12.0, 6.0],
        yarns: [[30.0, 30.0, 0.0, 2.0, 6.0], [30.0, 30.0, 0.0, 3.0, 2.0]],
    },
    IrawanPreset {
        name: "polyester-lining",
        scattering: [0.015, 4.0, 0.5],
        areas: [1.0, 1.0],
        yarns: [[0.0, 22.0, -0.7, 1.0, 1.0], [0.0, 16.0, -0.7, 1.0, 1.0]],
    },
];
