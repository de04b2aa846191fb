//! The mean of one thread's response over its tangents, to a requested accuracy.
//!
//! Every place where the integrand is not smooth is known, so panels end there:
//!
//! ```text
//! ψ + δ = ±90°            a direction passes behind the thread: P and M end
//! δ = −(ψ_i + ψ_r)/2      min in P changes sides
//! y_i z_r' = ±y_r z_i'    min in M changes sides, where m_i = m_r
//! δ = −ψ_H                the highlight: θ_h = 0, ψ_H = atan2(x_i + x_r, z_i + z_r)
//! ```
//!
//! θ_h grows by K = |H_nt| / (2 cos θ_d) per unit of tilt there, so a lobe of width γ is γ/K wide in δ. Within a panel,
//! Gauss–Legendre on the whole is compared with Gauss–Legendre on its halves. All panels where they do not agree are bisected,
//! and again until they do. What counts as agreement follows the sum as it becomes known: measured by a first sum that has
//! missed a narrow lobe, nothing would ever agree once the lobe is found.

use std::sync::LazyLock;

use gauss_quad::GaussLegendre;

use crate::brdf::{Optics, Response, TangentCurve, ThreadPair};
use crate::math::norm2;

const ORDER: usize = 7;
/// Widths of a lobe from the highlight to the next cuts. Between the first two it falls to nothing; in one panel with what is
/// beyond them, no node might see that.
const REACHES: [f64; 2] = [3.0, 9.0];
/// Rounds of bisection: 2⁻⁴⁰ of 180° is below the spacing of f64 tilts near 90°.
const MAX_ROUNDS: u32 = 40;
/// More panels are not bisected further: where that many disagree, it is about rounding.
const MAX_PANELS: usize = 1 << 14;

/// Errors below this do not count: no evaluator in single precision can tell.
const DARK: f64 = 1e-45;

static NODES: LazyLock<Vec<[f64; 2]>> = LazyLock::new(|| gauss_legendre(ORDER));

/// The Gauss–Legendre rule of `count` nodes (one if 0), each with its weight, on \[−1, 1\].
pub fn gauss_legendre(count: usize) -> Vec<[f64; 2]> {
    let rule = GaussLegendre::new(count.max(1).try_into().expect("not zero"));
    rule.iter().map(|(node, weight)| [*node, *weight]).collect()
}

/// S and V of a thread for a pair of directions: the mean of [`ThreadPair::response`] over `tangents`.
///
/// `tolerance` is relative to S and V; either is let off with a thousandth of it relative to the other, since they are
/// only ever used as a sum.
pub fn mean_response(
    pair: &ThreadPair<f64>,
    optics: &Optics<f64>,
    tangents: &TangentCurve<f64>,
    tolerance: f64,
) -> Response<f64> {
    let integrand = |delta: f64| {
        let (sin, cos) = delta.sin_cos();
        pair.response(optics, cos, sin)
    };
    let single = tangents.response_of_tilts(pair, optics);
    let cuts = Cuts::new(pair, optics);
    let mut panels: Vec<Panel> = Vec::new();
    for segment in tangents.segments() {
        let density = segment.weight / (segment.to - segment.from);
        let mut from = segment.from.max(cuts.visible.0);
        let end = segment.to.min(cuts.visible.1);
        for cut in cuts
            .kinks
            .iter()
            .copied()
            .filter(|cut| *cut < end)
            .chain([end])
        {
            if cut > from {
                let whole = gauss(from, cut, density, &integrand);
                panels.push(Panel::new(from, cut, density, whole, &integrand));
                from = cut;
            }
        }
    }

    for _ in 0..MAX_ROUNDS {
        let sum = sum_of(single, &panels);
        let allowed = Response {
            surface: (tolerance * (sum.surface + 1e-3 * sum.volume)).max(DARK),
            volume: (tolerance * (sum.volume + 1e-3 * sum.surface)).max(DARK),
        };
        let count = panels.len();
        if count > MAX_PANELS {
            break;
        }
        for index in 0..count {
            if panels[index].disagrees(allowed) {
                let [lower, upper] = panels[index].bisected(&integrand);
                panels[index] = lower;
                panels.push(upper);
            }
        }
        if panels.len() == count {
            break;
        }
    }
    sum_of(single, &panels)
}

fn sum_of(single: Response<f64>, panels: &[Panel]) -> Response<f64> {
    panels.iter().fold(single, |sum, panel| {
        sum.plus(1.0, panel.halves[0]).plus(1.0, panel.halves[1])
    })
}

/// Where the integrand's range ends and where it is not smooth, in tilt.
struct Cuts {
    visible: (f64, f64),
    /// In ascending order.
    kinks: Vec<f64>,
}

impl Cuts {
    fn new(pair: &ThreadPair<f64>, optics: &Optics<f64>) -> Self {
        let (wi, wr) = (pair.wi(), pair.wr());
        let (psi_i, psi_r) = (wi[0].atan2(wi[2]), wr[0].atan2(wr[2]));
        let quarter = std::f64::consts::FRAC_PI_2;
        let visible = (-quarter - psi_i.min(psi_r), quarter - psi_i.max(psi_r));

        let mut kinks: Vec<f64> = vec![-0.5 * (psi_i + psi_r)];
        for sign in [1.0, -1.0] {
            let sin = wi[1] * wr[2] - sign * wr[1] * wi[2];
            let cos = wi[1] * wr[0] - sign * wr[1] * wi[0];
            if cos != 0.0 {
                kinks.push((sin / cos).atan());
            }
        }

        let (h_t, h_n) = (wi[0] + wr[0], wi[2] + wr[2]);
        let highlight = -h_t.atan2(h_n);
        let (sin, cos) = highlight.sin_cos();
        // At the highlight x_r = −x_i, so cos θ_d = cos θ_i.
        let z_i = cos * wi[2] - sin * wi[0];
        let slope = (norm2(h_t, h_n) / (2.0 * norm2(wi[1], z_i))).max(1e-3);
        kinks.push(highlight);
        for gamma in [optics.gamma_s, optics.gamma_v] {
            for reach in REACHES {
                let width = reach * gamma / slope;
                kinks.extend([highlight - width, highlight + width]);
            }
        }
        kinks.retain(|cut| cut.is_finite());
        kinks.sort_by(f64::total_cmp);
        Self { visible, kinks }
    }
}

/// A part of the integral.
struct Panel {
    from: f64,
    to: f64,
    density: f64,
    /// Gauss–Legendre values of the whole and of its halves.
    whole: Response<f64>,
    halves: [Response<f64>; 2],
}

impl Panel {
    fn new(
        from: f64,
        to: f64,
        density: f64,
        whole: Response<f64>,
        integrand: &impl Fn(f64) -> Response<f64>,
    ) -> Self {
        let middle = 0.5 * (from + to);
        Self {
            from,
            to,
            density,
            whole,
            halves: [(from, middle), (middle, to)]
                .map(|(from, to)| gauss(from, to, density, integrand)),
        }
    }

    /// Whether bisection is to be expected to change the value by more than is `allowed`.
    fn disagrees(&self, allowed: Response<f64>) -> bool {
        let [lower, upper] = self.halves;
        let halves = lower.plus(1.0, upper);
        let middle = 0.5 * (self.from + self.to);
        // Not where a value is no number, either.
        ((halves.surface - self.whole.surface).abs() > allowed.surface
            || (halves.volume - self.whole.volume).abs() > allowed.volume)
            && self.from < middle
            && middle < self.to
    }

    fn bisected(&self, integrand: &impl Fn(f64) -> Response<f64>) -> [Self; 2] {
        let middle = 0.5 * (self.from + self.to);
        let half = |from, to, whole| Self::new(from, to, self.density, whole, integrand);
        [
            half(self.from, middle, self.halves[0]),
            half(middle, self.to, self.halves[1]),
        ]
    }
}

/// The Gauss–Legendre value of ∫ `density` · `integrand`.
fn gauss(
    from: f64,
    to: f64,
    density: f64,
    integrand: &impl Fn(f64) -> Response<f64>,
) -> Response<f64> {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    NODES.iter().fold(Response::zero(), |sum, [node, weight]| {
        sum.plus(weight * half * density, integrand(middle + half * node))
    })
}
