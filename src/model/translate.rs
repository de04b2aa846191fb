//! Irawan–Marschner parameters of a fabric of threads, by table 4.1 of \[Fecho13\].
//!
//! ```text
//! α = 0.01      β = 4 if γ_s > 10°, else 8      w = 1      l_j = a_j / min a
//! staple: ψ = 35°, δ = 0      filament: ψ = 0, δ = 0.1
//! u_max = largest |tangent offset|      κ: the spine closest to the tangent curve
//! k_d = Σ a_j k_d,j A_j      k_s,j = 1 − k_d,j, times A_j where η is low
//! ```
//!
//! The table is a starting point, from which the thesis goes on by hand. What it leaves open:
//!
//! - A fabric is of staple yarns if even its narrowest lobe is wider than γ_s = 10°: spun fibres scatter, filaments shine.
//! - Low is an η below 1.4, as silk's 1.345.
//! - A spine's tangents are told by the share of the cloth's length that lies below an inclination, which for all conics is
//!   ½ + ½ √q(u_max)/sin u_max · sin u/√q(u), q as in [`IrawanMarschner`](super::IrawanMarschner). The closest spine has the least mean squared
//!   distance of that share to the tangent curve's; κ is found to a hundredth, by trying them all.
//! - A yarn has one direction: of a thread whose direction changes along its curve, the mean.
//! - u_max is at least γ_s, which stands for a spine that the tangent curve takes to be straight, and at most 80°, or nothing is
//!   left of the spine.

use crate::brdf::TangentCurve;
use crate::fabric::{Fabric, Irawan, Thread, Yarn};

/// Wider lobes, radians, are those of spun fibres.
const SPUN: f64 = 10.0 / 180.0 * std::f64::consts::PI;
/// η below this is low.
const LOW_ETA: f64 = 1.4;
/// u_max, radians.
const STEEPEST: f64 = 80.0 / 180.0 * std::f64::consts::PI;
/// Hundredths of κ that are tried.
const KAPPAS: std::ops::RangeInclusive<i32> = -99..=500;
/// Inclinations at which shares are compared.
const INCLINATIONS: u32 = 256;

/// The parameters that stand for `fabric`'s threads.
pub fn irawan_of(fabric: &Fabric) -> Irawan {
    let threads: Vec<&Thread> = fabric.visible_threads().collect();
    let least = |value: fn(&Thread) -> f64| {
        let values = threads.iter().map(|thread| value(thread));
        values.fold(f64::INFINITY, f64::min)
    };
    let is_staple = least(|thread| thread.optics.gamma_s) > SPUN;
    let least_coverage = least(|thread| thread.coverage);
    let mut diffuse = [0.0; 3];
    for thread in &threads {
        for (sum, albedo) in diffuse.iter_mut().zip(thread.albedo) {
            *sum += thread.coverage * thread.optics.k_d * albedo;
        }
    }
    let yarn = |thread: &&Thread| {
        let steepest = thread
            .tangent_offsets
            .iter()
            .fold(0.0, |u: f64, o| u.max(o.abs()));
        let u_max = steepest
            .max(thread.optics.gamma_s)
            .clamp(*Yarn::U_MAX.start(), STEEPEST);
        let tint = if thread.optics.eta < LOW_ETA {
            thread.albedo
        } else {
            [1.0; 3]
        };
        Yarn {
            direction: thread.direction(),
            coverage: thread.coverage,
            specular: tint.map(|tint| (1.0 - thread.optics.k_d) * tint),
            alpha: 0.01,
            beta: if thread.optics.gamma_s > SPUN {
                4.0
            } else {
                8.0
            },
            delta: if is_staple { 0.0 } else { 0.1 },
            psi: if is_staple { 35f64.to_radians() } else { 0.0 },
            u_max,
            kappa: closest_spine(&thread.tangents(), u_max),
            width: 1.0,
            length: (thread.coverage / least_coverage).min(*Yarn::SIZE.end()),
        }
    };
    Irawan {
        diffuse,
        yarns: threads.iter().map(yarn).collect(),
    }
}

/// κ of the spine whose tangents are distributed most like `curve`'s.
fn closest_spine(curve: &TangentCurve<f64>, u_max: f64) -> f64 {
    let inclinations: Vec<[f64; 2]> = (0..INCLINATIONS)
        .map(|k| u_max * ((2 * k + 1) as f64 / INCLINATIONS as f64 - 1.0))
        .map(|u| [u.sin(), share_below(curve, u)])
        .collect();
    let (sin, cos) = u_max.sin_cos();
    let distance = |kappa: f64| {
        let r = 1.0 + kappa * (1.0 + cos / sin);
        let q = |sin: f64| 1.0 + (r * r.abs() - 1.0) * sin * sin;
        let scale = q(sin).sqrt() / sin;
        let difference = |[sin, share]: &[f64; 2]| 0.5 + 0.5 * scale * sin / q(*sin).sqrt() - share;
        inclinations
            .iter()
            .map(|at| difference(at).powi(2))
            .sum::<f64>()
    };
    KAPPAS
        .map(|hundredths| f64::from(hundredths) / 100.0)
        .min_by(|a, b| distance(*a).total_cmp(&distance(*b)))
        .expect("there are many")
}

/// The share of the curve's length that is tilted less than `u`.
fn share_below(curve: &TangentCurve<f64>, u: f64) -> f64 {
    let tilts = curve.tilts().iter();
    let segments = curve.segments().iter();
    tilts
        .map(|tilt| if tilt.angle < u { tilt.weight } else { 0.0 })
        .sum::<f64>()
        + segments
            .map(|s| s.weight * ((u - s.from) / (s.to - s.from)).clamp(0.0, 1.0))
            .sum::<f64>()
}
