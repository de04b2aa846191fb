//! Pairs of directions to measure error on.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

use crate::fabric::{Fabric, Thread};

/// How a pair was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PairKind {
    /// Both directions independent and cosine-weighted.
    Render,
    /// Near the highlight of a thread.
    Highlight,
    /// One direction near the horizon, alternately light and viewer; the other as above.
    Rim,
    /// Both directions near the horizon.
    RimBoth,
    /// Both in its last degree.
    RimLast,
}

impl PairKind {
    /// Those of the rims.
    pub const RIMS: [Self; 3] = [Self::Rim, Self::RimBoth, Self::RimLast];

    /// Whether it is one of them, and none of the protocol's own.
    pub fn is_rim(self) -> bool {
        Self::RIMS.contains(&self)
    }
}

/// A pair of unit directions above the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// To the light.
    pub wi: [f64; 3],
    /// To the viewer.
    pub wr: [f64; 3],
    /// How it was drawn; a highlight pair below the horizon was redrawn as a render pair.
    pub kind: PairKind,
}

/// Pairs of directions, each component an array of its own.
#[derive(Debug, Clone)]
pub struct Pairs {
    /// x, y and z to the lights.
    pub wi: [Vec<f32>; 3],
    /// x, y and z to the viewers.
    pub wr: [Vec<f32>; 3],
}

impl Pairs {
    /// The same pairs in single precision.
    pub fn new(pairs: &[Pair]) -> Self {
        let components = |direction: fn(&Pair) -> [f64; 3]| {
            [0, 1, 2].map(|k| pairs.iter().map(|pair| direction(pair)[k] as f32).collect())
        };
        Self {
            wi: components(|pair| pair.wi),
            wr: components(|pair| pair.wr),
        }
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.wi[0].len()
    }

    /// Slices of `wi`.
    pub fn lights(&self) -> [&[f32]; 3] {
        self.wi.each_ref().map(Vec::as_slice)
    }

    /// Slices of `wr`.
    pub fn viewers(&self) -> [&[f32]; 3] {
        self.wr.each_ref().map(Vec::as_slice)
    }
}

/// `count` pairs for `fabric`, alternately render and highlight, the same for the same seed.
pub fn protocol_pairs(fabric: &Fabric, count: usize, seed: u64) -> Vec<Pair> {
    endless_pairs(fabric, seed).take(count).collect()
}

/// How many pairs of each rim are beside `count` of the protocol.
pub(super) fn rim_count(count: usize) -> usize {
    (count / 4).max(FEWEST_RIM_PAIRS)
}

const FEWEST_RIM_PAIRS: usize = 512;
/// w·n of directions near the horizon: from the least on …
const LOWEST: f64 = 1e-4;
/// … to this, or …
const LOW: f64 = 0.1;
/// … in its last degree.
const LAST: f64 = 0.02;

/// The pairs of a rim for `fabric`, one by one, the same for the same seed.
pub(super) fn endless_rim(fabric: &Fabric, rim: PairKind, seed: u64) -> impl Iterator<Item = Pair> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    // 0 is the protocol's.
    rng.set_stream(1 + rim as u64);
    let threads: Vec<&Thread> = fabric.visible_threads().collect();
    let pair = move |index: usize| {
        let low = near_horizon(if rim == PairKind::RimLast { LAST } else { LOW }, &mut rng);
        let other = match rim {
            PairKind::RimBoth => near_horizon(LOW, &mut rng),
            PairKind::RimLast => near_horizon(LAST, &mut rng),
            _ => match threads.is_empty() || index % 4 < 2 {
                true => cosine_weighted(&mut rng),
                false => {
                    let thread = threads[rng.random_range(0..threads.len())];
                    let mirrored = on_reflection_cone(thread, low, &mut rng);
                    if mirrored.z > 0.0 {
                        mirrored
                    } else {
                        cosine_weighted(&mut rng)
                    }
                }
            },
        };
        let (wi, wr) = if index.is_multiple_of(2) {
            (low, other)
        } else {
            (other, low)
        };
        Pair {
            wi: wi.to_array(),
            wr: wr.to_array(),
            kind: rim,
        }
    };
    (0..).map(pair)
}

/// At any azimuth, w·n uniform below `most`.
fn near_horizon(most: f64, rng: &mut ChaCha8Rng) -> DVec3 {
    let z = rng.random_range(LOWEST..most);
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

/// The pairs of [`protocol_pairs`], one by one.
pub(super) fn endless_pairs(fabric: &Fabric, seed: u64) -> impl Iterator<Item = Pair> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let threads: Vec<&Thread> = fabric.visible_threads().collect();
    let pair = move |index: usize| {
        let wi = cosine_weighted(&mut rng);
        if index % 2 == 1 && !threads.is_empty() {
            let thread = threads[rng.random_range(0..threads.len())];
            let wr = on_reflection_cone(thread, wi, &mut rng);
            if wr.z > 0.0 {
                return Pair {
                    wi: wi.to_array(),
                    wr: wr.to_array(),
                    kind: PairKind::Highlight,
                };
            }
        }
        Pair {
            wi: wi.to_array(),
            wr: cosine_weighted(&mut rng).to_array(),
            kind: PairKind::Render,
        }
    };
    (0..).map(pair)
}

fn cosine_weighted(rng: &mut ChaCha8Rng) -> DVec3 {
    // 1 − [0, 1) keeps z above 0.
    let z = (1.0 - rng.random::<f64>()).sqrt();
    let (sin, cos) = (TAU * rng.random::<f64>()).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}

/// A direction at which a cylinder of a random tilt of `thread`, jittered by γ_s, reflects light from `wi`: the half of
/// the cone that leaves the cylinder on its outer side, azimuth uniform.
fn on_reflection_cone(thread: &Thread, wi: DVec3, rng: &mut ChaCha8Rng) -> DVec3 {
    let [tilt, direction] = thread.tangent_at(rng.random());
    let tilt = tilt + thread.optics.gamma_s * rng.sample::<f64, _>(StandardNormal);

    let along = DVec3::new(direction.cos(), direction.sin(), 0.0);
    let side = DVec3::Z.cross(along);
    let tangent = tilt.cos() * along + tilt.sin() * DVec3::Z;
    let normal = tilt.cos() * DVec3::Z - tilt.sin() * along;
    let x = -wi.dot(tangent);
    let r = (1.0 - x * x).max(0.0).sqrt();
    let (sin, cos) = (FRAC_PI_2 * (2.0 * rng.random::<f64>() - 1.0)).sin_cos();
    (x * tangent + r * (sin * side + cos * normal)).normalize()
}
