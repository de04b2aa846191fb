//! Integrals of two functions at once, to a requested accuracy.
//!
//! Within a panel, Gauss–Legendre on the whole is compared with Gauss–Legendre on its halves. All panels where they do not
//! agree are bisected, and again until they do. What counts as agreement follows the sum as it becomes known: measured by a
//! first sum that has missed a narrow lobe, nothing would ever agree once the lobe is found.

use std::sync::LazyLock;

use gauss_quad::GaussLegendre;

use crate::brdf::{Optics, Response};
use crate::math::simd::{DoubleKernel, Doubles, Level};

const ORDER: usize = 7;
/// Of all places that are evaluated side by side.
pub(super) const ROOM: usize = ORDER;
/// Rounds of bisection: 2⁻⁴⁰ of 180° is below the spacing of f64 tilts near 90°.
const MAX_ROUNDS: u32 = 40;
/// More panels are not bisected further: where that many disagree, it is about rounding.
const MAX_PANELS: usize = 1 << 14;

/// Errors below this do not count: no evaluator in single precision can tell.
const DARK: f64 = 1e-45;

/// Nodes, and their weights.
static NODES: LazyLock<[[f64; ORDER]; 2]> = LazyLock::new(|| {
    let rule = gauss_legendre(ORDER);
    [0, 1].map(|part| std::array::from_fn(|k| rule[k][part]))
});

/// Widths of a lobe from the highlight to the next cuts. Between the first two it falls to nothing; in one panel with what is
/// beyond them, no node might see that.
const REACHES: [f64; 2] = [3.0, 9.0];

/// How far from a highlight panels end on either side, where θ_h grows by `slope` per unit.
pub(super) fn reaches(optics: &Optics<f64>, slope: f64) -> impl Iterator<Item = f64> {
    let of_lobe = move |gamma: f64| REACHES.map(|reach| reach * gamma / slope);
    [optics.gamma_s, optics.gamma_v]
        .into_iter()
        .flat_map(of_lobe)
}

/// Two functions of one variable.
pub(super) trait Integrand {
    /// Their values at places side by side; inlined for certain.
    fn at<L: Doubles>(&self, places: L) -> Response<L>;
}

/// The Gauss–Legendre rule of `count` nodes (one if 0), each with its weight, on \[−1, 1\].
pub fn gauss_legendre(count: usize) -> Vec<[f64; 2]> {
    let rule = GaussLegendre::new(count.max(1).try_into().expect("not zero"));
    rule.iter().map(|(node, weight)| [*node, *weight]).collect()
}

/// A range on which the integrand is smooth, or nearly so, and what it is multiplied by there.
pub(super) struct Piece {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) density: f64,
}

impl Piece {
    /// The range in parts that end at `cuts`, which ascend and may lie outside.
    pub(super) fn cut(self, cuts: &[f64]) -> impl Iterator<Item = Self> {
        let Self {
            mut from,
            to,
            density,
        } = self;
        let cuts = cuts
            .iter()
            .copied()
            .filter(move |cut| *cut < to)
            .chain([to]);
        cuts.filter_map(move |cut| {
            let piece = Self {
                from,
                to: cut,
                density,
            };
            from = from.max(cut);
            (cut > piece.from).then_some(piece)
        })
    }
}

/// `known` and the integral of `integrand` over all `pieces`.
///
/// `tolerance` is relative to both parts of the sum; either is let off with a thousandth of it relative to the other, since
/// they are only ever used as a sum. With an infinite one the first look has to do: Gauss–Legendre on whole pieces.
pub(super) fn integrate(
    known: Response<f64>,
    pieces: impl Iterator<Item = Piece>,
    integrand: impl Integrand,
    tolerance: f64,
) -> Response<f64> {
    if tolerance == f64::INFINITY {
        return pieces.fold(known, |sum, Piece { from, to, density }| {
            sum.plus(1.0, gauss(from, to, density, &integrand))
        });
    }
    let panel = |Piece { from, to, density }| {
        let whole = gauss(from, to, density, &integrand);
        Panel::new(from, to, density, whole, &integrand)
    };
    let mut panels: Vec<Panel> = pieces.map(panel).collect();
    for _ in 0..MAX_ROUNDS {
        let sum = sum_of(known, &panels);
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
    sum_of(known, &panels)
}

fn sum_of(known: Response<f64>, panels: &[Panel]) -> Response<f64> {
    panels.iter().fold(known, |sum, panel| {
        sum.plus(1.0, panel.halves[0]).plus(1.0, panel.halves[1])
    })
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
        integrand: &impl Integrand,
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

    fn bisected(&self, integrand: &impl Integrand) -> [Self; 2] {
        let middle = 0.5 * (self.from + self.to);
        let half = |from, to, whole| Self::new(from, to, self.density, whole, integrand);
        [
            half(self.from, middle, self.halves[0]),
            half(middle, self.to, self.halves[1]),
        ]
    }
}

/// The Gauss–Legendre value of ∫ `density` · `integrand`.
fn gauss(from: f64, to: f64, density: f64, integrand: &impl Integrand) -> Response<f64> {
    let half = 0.5 * (to - from);
    let values = Level::detect().run_doubles(AtNodes {
        integrand,
        middle: 0.5 * (from + to),
        half,
    });
    let weights = &NODES[1];
    let sum = Response::zero();
    values
        .iter()
        .zip(weights)
        .fold(sum, |sum, (value, weight)| {
            sum.plus(weight * half * density, *value)
        })
}

/// An integrand at the nodes of a panel.
struct AtNodes<'a, I> {
    integrand: &'a I,
    middle: f64,
    half: f64,
}

impl<I: Integrand> DoubleKernel for AtNodes<'_, I> {
    type Output = [Response<f64>; ORDER];

    #[inline(always)]
    fn run<L: Doubles>(self) -> Self::Output {
        const { assert!(ORDER.is_multiple_of(L::LANES), "no lane is left over") };
        let [nodes, _] = &*NODES;
        let (middle, half) = (L::of(self.middle), L::of(self.half));
        let (mut surface, mut volume) = ([0.0; ORDER], [0.0; ORDER]);
        for first in (0..ORDER).step_by(L::LANES) {
            let places = middle + half * L::load(&nodes[first..]);
            let values = self.integrand.at(places);
            values.surface.store(&mut surface[first..]);
            values.volume.store(&mut volume[first..]);
        }
        let mut values = [Response::default(); ORDER];
        for (k, value) in values.iter_mut().enumerate() {
            (value.surface, value.volume) = (surface[k], volume[k]);
        }
        values
    }
}
