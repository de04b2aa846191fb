//! Pairs of directions that are hard on an evaluator.
//!
//! Every component is a number of single precision, so that evaluators of both precisions are asked the same question.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::brdf::ThreadFrame;
use crate::fabric::{Fabric, Thread};
use crate::math::{Vec3, normalized};
use crate::table::Table;

/// What makes pairs hard.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    /// One or both directions from 6° down to 1e-7 rad above the horizon.
    Grazing,
    /// wi = wr.
    Retro,
    /// wr is wi mirrored at the normal, or at one of a thread's planes.
    Mirror,
    /// Directions along a thread, or along one of its tilts.
    Along,
    /// Directions in the plane across a thread, down to its horizon.
    Across,
    /// Both directions along a thread from its opposite ends: cos θ_d and cos θ_i + cos θ_r go to 0.
    Opposite,
    /// On the highlight of a tilt or of a segment's end, and a few γ_s beside it.
    Highlight,
    /// ψ of a direction at the end of a tilt's visibility, where P and Q go to 0.
    Visibility,
    /// φ_d at ±180°: the directions at the horizon on the thread's two sides.
    Sides,
    /// φ_d and ψ_d on the shoulder of u, where its second derivative is largest.
    Shoulder,
}

impl Geometry {
    /// All of them.
    pub const ALL: [Self; 10] = [
        Self::Grazing,
        Self::Retro,
        Self::Mirror,
        Self::Along,
        Self::Across,
        Self::Opposite,
        Self::Highlight,
        Self::Visibility,
        Self::Sides,
        Self::Shoulder,
    ];

    /// `count` pairs above the surface for `fabric`, the same for the same seed.
    pub fn pairs(self, fabric: &Fabric, count: usize, seed: u64) -> Vec<[Vec3<f32>; 2]> {
        let threads: Vec<&Thread> = fabric.visible_threads().collect();
        let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
        let mut pairs = Vec::with_capacity(count);
        // A family may draw below the surface, but never always.
        for attempt in 0..100 * count {
            if pairs.len() == count || threads.is_empty() {
                break;
            }
            let thread = threads[attempt % threads.len()];
            let [wi, wr] = self.pair(&mut draw, fabric, thread);
            let [wi, wr] = [wi, wr].map(|w| normalized(w).map(|w| w.map(|x| x as f32)));
            if let (Some(wi), Some(wr)) = (wi, wr)
                && wi[2] > 0.0
                && wr[2] > 0.0
            {
                pairs.push([wi, wr]);
            }
        }
        pairs
    }

    fn pair(self, draw: &mut Draw, fabric: &Fabric, thread: &Thread) -> [Vec3<f64>; 2] {
        let [delta, direction] = draw.tangent(thread);
        let frame = ThreadFrame::new(direction);
        match self {
            Self::Grazing => {
                let (low, any) = (draw.azimuth(direction), draw.direction());
                let grazing = elevated(low, draw.small());
                match draw.below(3) {
                    0 => [grazing, any],
                    1 => [any, grazing],
                    _ => [grazing, elevated(draw.azimuth(direction), draw.small())],
                }
            }
            Self::Retro => {
                let elevation = if draw.below(2) == 0 {
                    draw.small()
                } else {
                    draw.uniform() * FRAC_PI_2
                };
                let w = elevated(draw.azimuth(direction), elevation);
                [w, w]
            }
            Self::Mirror => {
                let w = frame.to_thread(elevated(draw.azimuth(direction), draw.elevation()));
                let [t, s] = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0]][draw.below(3)];
                [w, [t * w[0], s * w[1], w[2]]].map(|w| frame.to_surface(w))
            }
            Self::Along => {
                let end = if draw.below(2) == 0 { 0.0 } else { PI };
                // At tilt δ the thread points δ above the surface at one end and below at the other.
                let elevation = if draw.below(2) == 0 {
                    draw.small()
                } else {
                    delta.abs() + draw.offset()
                };
                let along = elevated(direction + end, elevation);
                let other = if draw.below(2) == 0 {
                    draw.direction()
                } else {
                    elevated(direction + end, draw.small())
                };
                draw.either([along, other])
            }
            Self::Across => {
                let side = if draw.below(2) == 0 {
                    FRAC_PI_2
                } else {
                    -FRAC_PI_2
                };
                let across = elevated(direction + side, draw.elevation());
                let other = if draw.below(2) == 0 {
                    draw.direction()
                } else {
                    elevated(direction - side, draw.elevation())
                };
                draw.either([across, other])
            }
            Self::Opposite => {
                let (a, b) = (draw.small(), draw.small());
                let pair = [
                    elevated(direction + draw.offset(), a),
                    elevated(direction + PI + draw.offset(), b),
                ];
                draw.either(pair)
            }
            Self::Highlight => {
                let beside =
                    [-3.0, -1.0, 0.0, 0.0, 0.0, 1.0, 3.0][draw.below(7)] * thread.optics.gamma_s;
                reflected(draw, &frame, delta + beside)
            }
            Self::Visibility => {
                let end = if draw.below(2) == 0 {
                    FRAC_PI_2
                } else {
                    -FRAC_PI_2
                };
                let psi = end - delta - end.signum() * draw.offset();
                let theta = (draw.uniform() - 0.5) * PI;
                let at_end = frame.to_surface([
                    theta.cos() * psi.sin(),
                    theta.sin(),
                    theta.cos() * psi.cos(),
                ]);
                let other = draw.direction();
                draw.either([at_end, other])
            }
            Self::Sides => {
                let (a, b) = (draw.small(), draw.small());
                let side = direction + FRAC_PI_2;
                let turn = draw.offset();
                let pair = [
                    elevated(side + turn, a),
                    elevated(side + PI + draw.offset(), b),
                ];
                draw.either(pair)
            }
            Self::Shoulder => {
                let apart = fabric.sigma_u * [1.0, 3f64.sqrt(), 3.0][draw.below(3)];
                let (theta, psi) = (draw.uniform() - 0.5, draw.uniform() - 0.5);
                let at = |angle: f64| {
                    if is_of_phi(theta) {
                        [
                            theta.sin(),
                            theta.cos() * angle.sin(),
                            theta.cos() * angle.cos(),
                        ]
                    } else {
                        [
                            theta.cos() * angle.sin(),
                            theta.sin(),
                            theta.cos() * angle.cos(),
                        ]
                    }
                };
                [at(psi), at(psi + apart)].map(|w| frame.to_surface(w))
            }
        }
    }
}

/// Whether the shoulder is that of φ_d rather than ψ_d.
fn is_of_phi(theta: f64) -> bool {
    theta > 0.0
}

/// Pairs on the planes of a table's knots, and an ulp to either side of them.
pub(super) fn on_planes(table: &Table, count: usize, seed: u64) -> Vec<[Vec3<f32>; 2]> {
    let mut draw = Draw(ChaCha8Rng::seed_from_u64(seed));
    let grids: Vec<_> = table
        .threads()
        .iter()
        .filter_map(|thread| Some((thread.frame(), thread.grid()?)))
        .collect();
    let mut pairs = Vec::new();
    if grids.is_empty() {
        return pairs;
    }
    while pairs.len() < count {
        let (frame, grid) = grids[draw.below(grids.len())];
        let axis = draw.below(grid.coordinates().rank());
        let knots: Vec<f64> = grid.axes()[axis].knots().collect();
        let mut u = [0.0; 4].map(|_: f64| 1e-3 + 0.998 * draw.uniform());
        u[axis] = knots[draw.below(knots.len())].clamp(1e-6, 1.0 - 1e-6);
        let (wi, wr) = grid.coordinates().directions(u);
        let on = [wi, wr].map(|w| frame.to_surface(w).map(|x| x as f32));
        for ulp in [0, 1, -1] {
            let beside = |x: f32| match ulp {
                1 => x.next_up(),
                -1 => x.next_down(),
                _ => x,
            };
            let pair = on.map(|w| w.map(beside));
            if pair.iter().all(|w| w[2] > 0.0) {
                pairs.push(pair);
            }
        }
    }
    pairs
}

/// A direction at a height above the horizon.
fn elevated(azimuth: f64, elevation: f64) -> Vec3<f64> {
    let (sin, cos) = azimuth.sin_cos();
    let r = elevation.cos();
    [r * cos, r * sin, elevation.sin()]
}

/// A pair that the cylinder of tilt `delta` mirrors into each other.
fn reflected(draw: &mut Draw, frame: &ThreadFrame<f64>, delta: f64) -> [Vec3<f64>; 2] {
    let (sin, cos) = delta.sin_cos();
    let wi = frame.to_thread(draw.direction());
    let x = cos * wi[0] + sin * wi[2];
    let r = (1.0 - x * x).max(0.0).sqrt();
    let (side, out) = (PI * (draw.uniform() - 0.5)).sin_cos();
    // Back from the tilted frame, where θ_r = −θ_i.
    let (t, n) = (-x, r * out);
    let wr = [cos * t - sin * n, r * side, cos * n + sin * t];
    [wi, wr].map(|w| frame.to_surface(w))
}

struct Draw(ChaCha8Rng);

impl Draw {
    fn uniform(&mut self) -> f64 {
        self.0.random()
    }

    fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    /// From 0.1 down to 1e-7, evenly in the logarithm.
    fn small(&mut self) -> f64 {
        10f64.powf(-1.0 - 6.0 * self.uniform())
    }

    /// The same to both sides, and 0.
    fn offset(&mut self) -> f64 {
        [0.0, 1.0, -1.0][self.below(3)] * self.small()
    }

    fn elevation(&mut self) -> f64 {
        if self.below(2) == 0 {
            self.small()
        } else {
            FRAC_PI_2 * self.uniform()
        }
    }

    /// Any azimuth, or one along or across a thread's direction.
    fn azimuth(&mut self, direction: f64) -> f64 {
        match self.below(3) {
            0 => direction + FRAC_PI_2 * self.below(4) as f64 + self.offset(),
            _ => TAU * self.uniform(),
        }
    }

    fn direction(&mut self) -> Vec3<f64> {
        elevated(TAU * self.uniform(), self.uniform().asin())
    }

    /// Tilt and direction at one of the thread's tangent offsets, or between.
    fn tangent(&mut self, thread: &Thread) -> [f64; 2] {
        if self.below(2) == 0 {
            let end = self.below(thread.tangent_offsets.len());
            [thread.tangent_offsets[end], thread.directions[end]]
        } else {
            thread.tangent_at(self.uniform())
        }
    }

    fn either(&mut self, [a, b]: [Vec3<f64>; 2]) -> [Vec3<f64>; 2] {
        if self.below(2) == 0 { [a, b] } else { [b, a] }
    }
}
