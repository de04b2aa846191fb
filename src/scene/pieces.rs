//! Ranges of places and directions in small pieces, and the caps of directions that these are seen in.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

use super::{Placement, Region, Sky};

/// Pieces at the edge of a range have at most this radius, radians, times the `detail`, 1 or more, that is asked for …
const FINE: f64 = 0.04;
/// … and those within it this: there neighbours cover what one of them covers too much.
const COARSE: f64 = 0.25;
/// The longest piece of a range of distances: far end over near is 1 and this, times the detail.
const STRETCH: f64 = 0.6;
/// A box is cut into at most this many along each side.
const MAX_CUTS: f64 = 12.0;

/// Where a light or a viewer may be.
#[derive(Debug, Clone, Copy)]
pub(super) enum Piece {
    /// Within `radius` of the straight line from `a` to `b`.
    Near { a: DVec3, b: DVec3, radius: f64 },
    /// In a direction within `radius` radians of the unit vector `axis`, infinitely far away.
    Far { axis: DVec3, radius: f64 },
}

impl Piece {
    /// The piece in the coordinates of an object.
    pub(super) fn local(&self, placement: &Placement) -> Self {
        match *self {
            Self::Near { a, b, radius } => Self::Near {
                a: placement.local(a),
                b: placement.local(b),
                radius: radius / placement.scale,
            },
            Self::Far { axis, radius } => Self::Far {
                axis: placement.rotation.inverse() * axis,
                radius,
            },
        }
    }

    /// A cap of all directions from anywhere within `around` of a point to the piece: its unit axis, and its radius, which is π if
    /// they may be any.
    pub(super) fn seen_from(&self, point: DVec3, around: f64) -> (DVec3, f64) {
        match *self {
            Self::Far { axis, radius } => (axis, radius),
            Self::Near { a, b, radius } => {
                let (to_a, to_b) = (a - point, b - point);
                let along = to_b - to_a;
                let share = match along.length_squared() {
                    0.0 => 0.0,
                    square => (-to_a.dot(along) / square).clamp(0.0, 1.0),
                };
                let nearest = (to_a + share * along).length();
                // From the point itself the line is an arc between its ends; both ends of a way move by their radii at most.
                let reach = radius + around;
                let axis = (to_a.normalize_or_zero() + to_b.normalize_or_zero()).try_normalize();
                match axis {
                    Some(axis) if reach < nearest => {
                        let half = angle(axis, to_a).max(angle(axis, to_b));
                        (axis, half + (reach / nearest).asin())
                    }
                    _ => (DVec3::Y, PI),
                }
            }
        }
    }

    /// How near it is to a ball, 0 if it reaches into it; infinity if it is far away.
    pub(super) fn distance(&self, point: DVec3, around: f64) -> f64 {
        match *self {
            Self::Far { .. } => f64::INFINITY,
            Self::Near { a, b, radius } => {
                let along = b - a;
                let share = match along.length_squared() {
                    0.0 => 0.0,
                    square => ((point - a).dot(along) / square).clamp(0.0, 1.0),
                };
                ((a + share * along).distance(point) - around - radius).max(0.0)
            }
        }
    }
}

impl Sky {
    /// Caps that cover the range.
    pub(super) fn caps(&self, detail: f64) -> Vec<(DVec3, f64)> {
        let mut caps = Vec::new();
        let mut open = vec![*self];
        while let Some(cell) = open.pop() {
            let middle = |[from, to]: [f64; 2]| 0.5 * (from + to);
            let half = |[from, to]: [f64; 2]| 0.5 * (to - from);
            let (azimuth, elevation) = (middle(cell.azimuth), middle(cell.elevation));
            // Along the meridian, then along the longest of the parallels.
            let [low, high] = cell.elevation;
            let widest = if low <= 0.0 && high >= 0.0 {
                1.0
            } else {
                low.cos().max(high.cos())
            };
            let sides = [half(cell.azimuth) * widest, half(cell.elevation)];
            let radius = sides[0] + sides[1];
            let is_inside = || radius <= COARSE && self.has_cap(azimuth, elevation, radius);
            if radius <= FINE * detail || is_inside() {
                caps.push((Self::at(azimuth, elevation), radius));
            } else if sides[0] > sides[1] {
                let [from, to] = cell.azimuth;
                open.extend(
                    [[from, azimuth], [azimuth, to]].map(|azimuth| Self { azimuth, ..cell }),
                );
            } else {
                let [from, to] = cell.elevation;
                open.extend(
                    [[from, elevation], [elevation, to]]
                        .map(|elevation| Self { elevation, ..cell }),
                );
            }
        }
        caps
    }

    /// Whether all of a cap is in the range.
    fn has_cap(&self, azimuth: f64, elevation: f64, radius: f64) -> bool {
        const ROUNDING: f64 = 1e-9;
        let [low, high] = self.elevation;
        let is_around = self.azimuth[1] - self.azimuth[0] >= TAU - ROUNDING;
        let is_below = elevation + radius <= high || high >= FRAC_PI_2 - ROUNDING && is_around;
        let is_above = elevation - radius >= low || low <= ROUNDING - FRAC_PI_2 && is_around;
        let is_beside = is_around || {
            // A cap that does not reach the pole spans this much azimuth to either side.
            let reaches = elevation.abs() + radius < FRAC_PI_2;
            let half = (radius.sin() / elevation.cos()).min(1.0).asin();
            reaches && azimuth - half >= self.azimuth[0] && azimuth + half <= self.azimuth[1]
        };
        is_below && is_above && is_beside
    }

    /// The range as directions.
    pub(super) fn far(&self, detail: f64) -> Vec<Piece> {
        let far = |(axis, radius)| Piece::Far { axis, radius };
        self.caps(detail).into_iter().map(far).collect()
    }

    /// The range as places around a point.
    pub(super) fn around(&self, target: DVec3, [from, to]: [f64; 2], detail: f64) -> Vec<Piece> {
        let cuts = ((to / from).ln() / (STRETCH * detail).ln_1p())
            .ceil()
            .clamp(1.0, 64.0);
        let at = |k: f64| from * (to / from).powf(k / cuts);
        let mut pieces = Vec::new();
        for (axis, radius) in self.caps(detail) {
            for k in 0..cuts as u32 {
                let ends = [at(f64::from(k)), at(f64::from(k) + 1.0)];
                let [a, b] = ends.map(|distance| target + distance * axis);
                let radius = 2.0 * ends[1] * (0.5 * radius).sin();
                pieces.push(Piece::Near { a, b, radius });
            }
        }
        pieces
    }
}

impl Region {
    /// Balls that cover the box, small as seen from something within `around` of `point`.
    pub(super) fn pieces(&self, point: DVec3, around: f64, detail: f64) -> Vec<Piece> {
        let size = self.high - self.low;
        let nearest = point.clamp(self.low, self.high).distance(point) - around;
        let longest = (2.0 * FINE * detail * nearest).max(size.max_element() * detail / MAX_CUTS);
        let cuts = |length: f64| (length / longest).ceil().clamp(1.0, MAX_CUTS);
        let cuts = if size == DVec3::ZERO {
            DVec3::ONE
        } else {
            DVec3::new(cuts(size.x), cuts(size.y), cuts(size.z))
        };
        let step = size / cuts;
        let mut pieces = Vec::new();
        for x in 0..cuts.x as u32 {
            for y in 0..cuts.y as u32 {
                for z in 0..cuts.z as u32 {
                    let cell = DVec3::new(x.into(), y.into(), z.into()) + 0.5;
                    let middle = self.low + step * cell;
                    pieces.push(Piece::Near {
                        a: middle,
                        b: middle,
                        radius: 0.5 * step.length(),
                    });
                }
            }
        }
        pieces
    }
}

/// The angle between two vectors of any length.
pub(super) fn angle(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caps_cover_a_range_and_little_beside() {
        let degrees = |azimuth: [f64; 2], elevation: [f64; 2]| Sky {
            azimuth: azimuth.map(f64::to_radians),
            elevation: elevation.map(f64::to_radians),
        };
        for sky in [
            degrees([0.0, 360.0], [-90.0, 90.0]),
            degrees([-180.0, 180.0], [-10.0, 50.0]),
            degrees([20.0, 110.0], [30.0, 90.0]),
            degrees([33.0, 33.0], [7.0, 7.0]),
        ] {
            let caps = sky.caps(1.0);
            assert!(caps.len() < 3000, "{}", caps.len());
            let share = |[from, to]: [f64; 2], k: u32| from + (to - from) * f64::from(k) / 40.0;
            for k in 0..=40 {
                for j in 0..=40 {
                    let w = Sky::at(share(sky.azimuth, k), share(sky.elevation, j));
                    let is_in = |(axis, radius): &(DVec3, f64)| angle(*axis, w) <= radius + 1e-9;
                    assert!(caps.iter().any(is_in), "{w}");
                }
            }
            let high = sky.elevation[1];
            let highest = caps.iter().map(|(axis, radius)| axis.y.asin() + radius);
            assert!(
                highest.fold(-2.0, f64::max) < high + 2.0 * FINE + COARSE * f64::from(high > 1.5)
            );
        }
    }
}
