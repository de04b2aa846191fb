//! How far a direction is from a part of the sky, by looking it up.
//!
//! The sphere is in cells, by the octahedral map (`needs/bins.rs` names its source); each has the distance of its middle, from which
//! that of no direction in it differs by more than they are apart.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::Sky;
use crate::needs::Overlap;

/// Cells along each side of the map's square.
const SIDE: usize = 1024;
/// From a cell's middle to its farthest corner, radians: the largest cells are those in the middles of octants, where a step along the
/// square's diagonal is √18 times as long as along a side.
const STRAY: f64 = 4.25 / SIDE as f64;
/// What rounding may do to a distance.
const ROUNDING: f64 = 1e-6;

/// A part of the sky, with distances to it.
#[derive(Debug, Clone)]
pub(super) enum SkyMap {
    /// All the way around: distances are differences of elevations.
    Belt(Sky),
    /// By cell: see [`Sky::distance`].
    Cells(Vec<f32>),
}

impl SkyMap {
    pub(super) fn new(sky: Sky) -> Self {
        if sky.is_around() {
            return Self::Belt(sky);
        }
        let middle = |index: usize| 2.0 * (index as f64 + 0.5) / SIDE as f64 - 1.0;
        let distance = |cell: usize| {
            let place = [middle(cell % SIDE), middle(cell / SIDE)];
            sky.distance(from_square(place)) as f32
        };
        Self::Cells((0..SIDE * SIDE).map(distance).collect())
    }

    /// Whether directions within `radius` of a unit vector, of which each may be off by `slack` radians more, are in it.
    pub(super) fn overlap(&self, to: DVec3, radius: f64, slack: f64) -> Overlap {
        let (distance, stray) = match self {
            Self::Belt(sky) => (sky.above_or_below(to.y.clamp(-1.0, 1.0).asin()), ROUNDING),
            Self::Cells(distances) => {
                let index = |place: f64| 0.5 * (place + 1.0) * SIDE as f64;
                let [column, row] =
                    to_square(to).map(|place| index(place).clamp(0.0, SIDE as f64 - 1.0) as usize);
                (f64::from(distances[row * SIDE + column]), STRAY + ROUNDING)
            }
        };
        if distance > radius + slack + stray {
            Overlap::None
        } else if distance < -(radius + stray) {
            Overlap::All
        } else {
            Overlap::Some
        }
    }
}

impl Sky {
    /// The one direction of the range, if there are no more.
    pub(super) fn only(&self) -> Option<DVec3> {
        let is_one = |[from, to]: [f64; 2]| from == to;
        let are = is_one(self.azimuth) && is_one(self.elevation);
        are.then(|| Self::at(self.azimuth[0], self.elevation[0]))
    }

    fn is_around(&self) -> bool {
        self.azimuth[1] - self.azimuth[0] >= TAU - ROUNDING
    }

    /// The angle to the nearest direction of the range; of one that is in it minus the angle to the nearest that is not, or less.
    fn distance(&self, to: DVec3) -> f64 {
        let elevation = to.y.atan2(to.x.hypot(to.z));
        if self.is_around() {
            return self.above_or_below(elevation);
        }
        let [low, high] = self.elevation;
        let half = 0.5 * (self.azimuth[1] - self.azimuth[0]);
        let middle = 0.5 * (self.azimuth[0] + self.azimuth[1]);
        let apart = ((to.x.atan2(to.z) - middle + PI).rem_euclid(TAU) - PI).abs();
        // To the part of a meridian that bounds the range.
        let to_meridian = |apart: f64| {
            let (toward, up) = (elevation.cos() * apart.cos(), elevation.sin());
            let foot = up.atan2(toward);
            if (low..=high).contains(&foot) {
                (elevation.cos() * apart.sin()).abs().min(1.0).asin()
            } else {
                let to = |end: f64| {
                    (toward.hypot(up) * (foot - end).cos())
                        .clamp(-1.0, 1.0)
                        .acos()
                };
                to(low).min(to(high))
            }
        };
        let beside = to_meridian(half - apart).min(to_meridian(half + apart));
        if apart > half {
            return beside;
        }
        self.above_or_below(elevation).max(-beside)
    }

    /// How far an elevation is above or below the range, or, negative, within it; a whole turn has no bound at a pole.
    fn above_or_below(&self, elevation: f64) -> f64 {
        let [low, high] = self.elevation;
        let is_open = |end: f64| self.is_around() && end >= FRAC_PI_2 - ROUNDING;
        let below = if is_open(-low) { -PI } else { low - elevation };
        let above = if is_open(high) { -PI } else { elevation - high };
        below.max(above)
    }
}

/// The place of a direction on the square ±1.
fn to_square(w: DVec3) -> [f64; 2] {
    let size = w.x.abs() + w.y.abs() + w.z.abs();
    let (u, v) = (w.x / size, w.y / size);
    if w.z >= 0.0 {
        [u, v]
    } else {
        [(1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v)]
    }
}

/// The direction at a place on the square.
fn from_square([u, v]: [f64; 2]) -> DVec3 {
    let z = 1.0 - u.abs() - v.abs();
    let [x, y] = if z >= 0.0 {
        [u, v]
    } else {
        [(1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v)]
    };
    DVec3::new(x, y, z).normalize()
}

#[cfg(test)]
mod tests {
    use super::super::range::angle;
    use super::*;

    #[test]
    fn cells_are_no_farther_than_is_said_and_distances_change_no_faster() {
        let skies = [
            ([-0.4, 2.0], [-0.3, 0.9]),
            ([-PI, PI], [-0.1, 0.4]),
            ([0.0, TAU], [0.2, FRAC_PI_2]),
            ([1.0, 1.0], [0.3, 0.8]),
            ([2.5, 6.5], [-1.5, 1.2]),
        ]
        .map(|(azimuth, elevation)| Sky { azimuth, elevation });
        let share = |k: u32, step: f64| (0.5 + f64::from(k) * step).fract();
        for sky in skies {
            let map = SkyMap::new(sky);
            for k in 0..20_000 {
                let way =
                    |a: f64, b: f64| Sky::at(TAU * share(k, a), (2.0 * share(k, b) - 1.0).asin());
                let (a, b) = (way(0.618, 0.755), way(0.57, 0.43));
                let [x, y] = to_square(a);
                let nearby = from_square(
                    [x + 1.0 / SIDE as f64, y - 1.0 / SIDE as f64].map(|p| p.clamp(-1.0, 1.0)),
                );
                assert!(angle(from_square([x, y]), a) < 1e-7);
                assert!(angle(nearby, a) <= STRAY, "{a} {}", angle(nearby, a));
                for other in [b, nearby] {
                    let change = (sky.distance(a) - sky.distance(other)).abs();
                    assert!(
                        change <= angle(a, other) + ROUNDING,
                        "{sky:?} {a} {other} {change}"
                    );
                }
                let at =
                    |range: [f64; 2], step: f64| range[0] + (range[1] - range[0]) * share(k, step);
                let inside = Sky::at(at(sky.azimuth, 0.22), at(sky.elevation, 0.83));
                assert!(sky.distance(inside) <= ROUNDING, "{sky:?} {inside}");
                assert!(sky.distance(a) <= angle(a, inside) + ROUNDING);
                assert_ne!(map.overlap(a, 0.0, angle(a, inside)), Overlap::None);
                assert_ne!(map.overlap(inside, 0.0, 0.0), Overlap::None);
            }
        }
    }
}
