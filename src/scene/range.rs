//! Where lights and viewers may be, as seen from somewhere: which directions lead to them.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::sky::SkyMap;
use super::{Region, Sky};
use crate::needs::Overlap;

/// Angles that rounding may turn a direction by, amply.
const ROUNDING: f64 = 1e-9;
/// The longest step along the arc in which an orbit's distances are seen, radians, and the most such steps.
const STEP: f64 = 0.05;
const MAX_STEPS: f64 = 4.0;

/// Where a light or a viewer may be.
#[derive(Debug, Clone)]
pub(super) enum Place {
    /// Anywhere in a box.
    Near(Region),
    /// In a direction from a target, at a distance from it.
    Around {
        target: DVec3,
        distance: [f64; 2],
        sky: SkyMap,
    },
    /// Infinitely far away in a direction.
    Toward(DVec3),
    /// Infinitely far away, in part of the sky.
    Far(SkyMap),
    /// Infinitely far away in any direction from a target to a box.
    Along { target: DVec3, region: Region },
    /// Infinitely far away, above an elevation.
    Above(f64),
}

/// From where it is looked for.
#[derive(Debug, Clone, Copy)]
pub(super) struct Eye {
    /// Anywhere within `radius` of this.
    pub(super) center: DVec3,
    pub(super) radius: f64,
}

impl Place {
    /// Infinitely far away in part of the sky.
    pub(super) fn far(sky: Sky) -> Self {
        match sky.only() {
            Some(way) => Self::Toward(way),
            None => Self::Far(SkyMap::new(sky)),
        }
    }

    /// At a distance from a target in part of the sky.
    pub(super) fn around(target: DVec3, distance: [f64; 2], sky: Sky) -> Self {
        match sky.only() {
            Some(way) if distance[0] == distance[1] => {
                Self::Near(Region::point(target + distance[0] * way))
            }
            _ => Self::Around {
                target,
                distance,
                sky: SkyMap::new(sky),
            },
        }
    }

    /// Whether directions within `radius` of a unit vector, of which each may be off by `slack` radians more, lead there.
    pub(super) fn overlap(&self, eye: Eye, to: DVec3, radius: f64, slack: f64) -> Overlap {
        let tolerance = radius + slack;
        let some = |is_some: bool| {
            if is_some {
                Overlap::Some
            } else {
                Overlap::None
            }
        };
        match self {
            Self::Toward(way) => {
                some(way.distance(to) <= 2.0 * (0.5 * tolerance).min(FRAC_PI_2).sin() + ROUNDING)
            }
            Self::Far(sky) => sky.overlap(to, radius, slack),
            Self::Above(elevation) => {
                let height = to.y.clamp(-1.0, 1.0).asin();
                if height - radius >= *elevation {
                    Overlap::All
                } else {
                    some(height + tolerance >= elevation - ROUNDING)
                }
            }
            Self::Near(region) => some(region.is_met(eye, to, tolerance)),
            Self::Along { target, region } => {
                let eye = Eye {
                    center: *target,
                    radius: 0.0,
                };
                some(region.is_met(eye, to, tolerance))
            }
            Self::Around {
                target,
                distance: [near, far],
                sky,
            } => {
                let offset = eye.center - *target;
                // As seen from the target, the direction to a camera moves by less than (1 + x) times as much, x how far the eye is
                // from the target over how far the camera is, and by another asin x for the radius of the eye.
                let share = offset.length() / near;
                let stray = eye.radius / near;
                if share + stray >= 0.9 {
                    return Overlap::Some;
                }
                let growth = 1.0 + share + stray;
                // Where the ray leaves the sphere of a distance D, seen from the target at asin(p/D) from the ray: p, how far it passes the target.
                let along = to.dot(offset);
                let at = |distance: f64| {
                    let root = along * along - offset.length_squared() + distance * distance;
                    (offset + (root.max(0.0).sqrt() - along) * to) / distance
                };
                let arc = (share - offset.length() / far) / (1.0 - share * share).sqrt();
                // Large caps need no more than one look.
                let steps = (arc / STEP.max(radius)).ceil().clamp(1.0, MAX_STEPS);
                let tolerance = growth * tolerance + stray.asin() + 0.5 * arc / steps + ROUNDING;
                let mut found = Overlap::None;
                for k in 0..steps as u32 {
                    let share = (f64::from(k) + 0.5) / steps;
                    // Steps of 1/D, along which that angle changes most evenly.
                    let distance = 1.0 / ((1.0 - share) / near + share / far);
                    match sky.overlap(at(distance), growth * radius, tolerance - growth * radius) {
                        Overlap::All => return Overlap::All,
                        Overlap::Some => found = Overlap::Some,
                        Overlap::None => {}
                    }
                }
                found
            }
        }
    }

    /// How near it is to a ball, 0 if it reaches into it; infinity if it is far away.
    pub(super) fn distance(&self, center: DVec3, radius: f64) -> f64 {
        match self {
            Self::Near(region) => {
                (center.clamp(region.low, region.high).distance(center) - radius).max(0.0)
            }
            Self::Around {
                target,
                distance: [near, _],
                ..
            } => (near - center.distance(*target) - radius).max(0.0),
            Self::Toward(_) | Self::Far(_) | Self::Along { .. } | Self::Above(_) => f64::INFINITY,
        }
    }

    /// The direction to it and by how many radians that may differ, where it is one point.
    pub(super) fn direction(&self, eye: Eye) -> Option<(DVec3, f64)> {
        match *self {
            Self::Toward(way) => Some((way, 0.0)),
            Self::Near(region) if self.is_fixed() => {
                let to = region.low - eye.center;
                let length = to.length();
                (eye.radius < length).then(|| (to / length, (eye.radius / length).asin()))
            }
            Self::Along { target, region } if self.is_fixed() => {
                (region.low - target).try_normalize().map(|to| (to, 0.0))
            }
            _ => None,
        }
    }

    /// Whether it is one place.
    pub(super) fn is_fixed(&self) -> bool {
        match self {
            Self::Toward(_) => true,
            Self::Near(region) | Self::Along { region, .. } => region.low == region.high,
            Self::Around { .. } | Self::Far(_) | Self::Above(_) => false,
        }
    }
}

impl Region {
    /// Whether a ray from the eye, off by so many radians, meets the box: it then meets one that is larger by as much as that is at its
    /// far end.
    fn is_met(&self, eye: Eye, to: DVec3, tolerance: f64) -> bool {
        if tolerance >= FRAC_PI_2 {
            return true;
        }
        let farthest = (self.low - eye.center)
            .abs()
            .max((self.high - eye.center).abs());
        let margin = eye.radius + 2.0 * (0.5 * tolerance).sin() * farthest.length();
        let (low, high) = (
            self.low - margin - eye.center,
            self.high + margin - eye.center,
        );
        // The part of the ray between each pair of planes.
        let (mut enters, mut leaves) = (0.0, f64::INFINITY);
        for k in 0..3 {
            if to[k].abs() < 1e-12 {
                if low[k] > 0.0 || high[k] < 0.0 {
                    return false;
                }
                continue;
            }
            let (a, b) = (low[k] / to[k], high[k] / to[k]);
            enters = f64::max(enters, a.min(b));
            leaves = f64::min(leaves, a.max(b));
        }
        enters <= leaves
    }
}

/// The angle between two vectors of any length.
pub(super) fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// A number from 0 to 1, the k-th of its kind.
    fn share(k: u32, step: f64) -> f64 {
        (0.5 + f64::from(k) * step).fract()
    }

    #[test]
    fn directions_to_a_place_are_found_from_everywhere_near() {
        let sky = Sky {
            azimuth: [-0.4, 2.0],
            elevation: [-0.3, 0.9],
        };
        let region = Region {
            low: DVec3::new(1.0, -0.5, 2.0),
            high: DVec3::new(1.5, 0.5, 2.0),
        };
        let target = DVec3::new(0.1, 0.0, -0.2);
        let distance = [1.0, 4.0];
        let places = [
            Place::Near(region),
            Place::far(sky),
            Place::around(target, distance, sky),
            Place::Along { target, region },
            Place::Above(-0.3),
        ];
        for k in 0..20_000 {
            let at = |range: [f64; 2], step: f64| range[0] + (range[1] - range[0]) * share(k, step);
            let to_sky = Sky::at(at(sky.azimuth, 0.618), at(sky.elevation, 0.755));
            let in_box = DVec3::new(at([1.0, 1.5], 0.57), at([-0.5, 0.5], 0.43), 2.0);
            let eye = Eye {
                center: DVec3::new(at([-0.4, 0.4], 0.22), at([-0.3, 0.3], 0.83), 0.1),
                radius: 0.05,
            };
            let from = eye.center + 0.049 * Sky::at(at([0.0, TAU], 0.35), at([-1.5, 1.5], 0.91));
            let camera = target + at(distance, 0.71) * to_sky;
            let radius = at([0.0, 0.3], 0.27);
            // Off by as much as is allowed.
            let turned = |w: DVec3| {
                let beside = w.any_orthonormal_vector();
                let beside = glam::DQuat::from_axis_angle(w, at([0.0, TAU], 0.13)) * beside;
                (radius * 0.999).cos() * w + (radius * 0.999).sin() * beside
            };
            // To the first, the second … place.
            let ways = [
                (in_box - from).normalize(),
                to_sky,
                (camera - from).normalize(),
                (in_box - target).normalize(),
                to_sky,
            ];
            for (place, to) in places.iter().zip(ways) {
                let half = 0.5 * radius;
                let found = place.overlap(eye, turned(to), half, half);
                assert_ne!(found, Overlap::None, "{place:?} {to} {radius}");
                // What is found to be all is all.
                let other = turned(-to);
                if place.overlap(eye, other, radius, 0.0) == Overlap::All {
                    let none = place.overlap(eye, turned(other), 0.0, 0.0);
                    assert_ne!(none, Overlap::None, "{place:?}");
                }
            }
        }
    }
}
