//! Means over sweeps, along which tilt δ and direction α change together.
//!
//! With s from 0 to 1 along one, panels end at the roots of
//!
//! ```text
//! z_i', z_r'                  a direction passes behind the thread: P and M end
//! z_i' r_r − z_r' r_i         min in P changes sides;   r = √(x²+z²) in the untilted frame
//! y_i z_r' ∓ y_r z_i'         min in M changes sides, where m_i = m_r
//! X = H·t', dX/ds             the highlight, and where it is nearest if there is none
//! ```
//!
//! and where a lobe of width γ about a highlight falls to nothing: θ_h grows by |dX/ds| / (2 cos θ_d) there. The roots are
//! looked for between places 5° apart.

use super::adaptive::{Integrand, Piece, ROOM, integrate, reaches};
use crate::brdf::{Optics, Response, ThreadFrame, ThreadPair};
use crate::fabric::Sweep;
use crate::math::simd::Doubles;
use crate::math::{Vec3, each, norm2, root};

/// Between places where kinks are looked for, radians.
const STEP: f64 = 0.0873;
/// The largest piece, radians.
const PIECE: f64 = 8.0 * STEP;
/// The kinks of `min` are weak: only for tolerances below this it pays to look for them.
const COARSE: f64 = 1e-5;
/// How well kinks are located, in s: off by ε they cost ε².
const CLOSE: f64 = 1e-6;
/// What slopes are at least, so that widths are finite.
const LEAST_SLOPE: f64 = 1e-3;

/// `known` and the shares of S and V of all `sweeps`, for a pair of directions in the frame that α is counted from.
pub(super) fn response(
    known: Response<f64>,
    sweeps: &[Sweep],
    [wi, wr]: [Vec3<f64>; 2],
    optics: &Optics<f64>,
    sigma_u: f64,
    tolerance: f64,
) -> Response<f64> {
    let pieces_of = |(index, sweep): (usize, &Sweep)| {
        let ends = roots(sweep, |s| {
            let Place { i, r, .. } = Place::new(sweep, s, wi, wr);
            [i.z, r.z]
        });
        let mut cuts = ends.concat();
        if tolerance < COARSE {
            let kinks = roots(sweep, |s| {
                let Place { i, r, .. } = Place::new(sweep, s, wi, wr);
                let (a, b) = (i.y * r.z, r.y * i.z);
                [i.z * r.r - r.z * i.r, a - b, a + b]
            });
            cuts.extend(kinks.concat());
        }
        let [highlights, nearest] = roots(sweep, |s| Place::new(sweep, s, wi, wr).highlight());
        cuts.extend(nearest);
        for at in highlights {
            let place = Place::new(sweep, at, wi, wr);
            // At the highlight x_r = −x_i, so cos θ_d = cos θ_i.
            let cos = norm2(place.i.y, place.i.z);
            let slope = (place.highlight()[1].abs() / (2.0 * cos)).max(LEAST_SLOPE);
            cuts.push(at);
            // Pieces are no wider anyway.
            let narrow = reaches(optics, slope).filter(|width| width * sweep.width() < PIECE);
            cuts.extend(narrow.flat_map(|width| [at - width, at + width]));
        }
        let visible = |piece: &Piece| {
            let middle = 0.5 * (piece.from + piece.to) - index as f64;
            let Place { i, r, .. } = Place::new(sweep, middle, wi, wr);
            i.z > 0.0 && r.z > 0.0
        };
        let mut pieces = pieces(index, sweep, cuts);
        pieces.retain(visible);
        pieces
    };
    let pieces = sweeps.iter().enumerate().flat_map(pieces_of);
    let integrand = Responses {
        sight: Sight {
            sweeps,
            wi,
            wr,
            sigma_u,
        },
        optics,
    };
    integrate(known, pieces, integrand, tolerance)
}

/// The shares of p_r of all `sweeps`, or of P(t, wi, wr) if there is a `wi`.
pub(super) fn projection(
    sweeps: &[Sweep],
    wi: Option<Vec3<f64>>,
    wr: Vec3<f64>,
    sigma_u: f64,
    tolerance: f64,
) -> f64 {
    let other = wi.unwrap_or(wr);
    let pieces_of = |(index, sweep): (usize, &Sweep)| {
        let cuts = roots(sweep, |s| {
            let Place { i, r, .. } = Place::new(sweep, s, other, wr);
            [i.z, r.z, i.z * r.r - r.z * i.r]
        });
        pieces(index, sweep, cuts.concat())
    };
    let integrand = Projections {
        sight: Sight {
            sweeps,
            wi: other,
            wr,
            sigma_u,
        },
        are_joint: wi.is_some(),
    };
    let pieces = sweeps.iter().enumerate().flat_map(pieces_of);
    integrate(Response::zero(), pieces, integrand, tolerance).surface
}

/// A pair of directions that sees sweeps.
struct Sight<'a> {
    sweeps: &'a [Sweep],
    wi: Vec3<f64>,
    wr: Vec3<f64>,
    sigma_u: f64,
}

impl Sight<'_> {
    /// The pair in the frames of places, and the cosines and sines of their tilts.
    #[inline(always)]
    fn from<L: Doubles>(&self, places: L) -> (ThreadPair<L>, [L; 2]) {
        let mut s = [0.0; ROOM];
        places.store(&mut s);
        let (mut wi, mut wr, mut tilt) = ([[0.0; ROOM]; 3], [[0.0; ROOM]; 3], [[0.0; ROOM]; 2]);
        for k in 0..L::LANES {
            let place = Place::among(self.sweeps, s[k], self.wi, self.wr);
            let directions = [&mut wi, &mut wr].into_iter().zip([self.wi, self.wr]);
            for (lanes, direction) in directions {
                for (lanes, x) in lanes.iter_mut().zip(place.frame.to_thread(direction)) {
                    lanes[k] = x;
                }
            }
            (tilt[0][k], tilt[1][k]) = (place.tilt[0], place.tilt[1]);
        }
        let vector = |lanes: [[f64; ROOM]; 3]| each(lanes, |lanes| L::load(&lanes));
        let pair = ThreadPair::new(vector(wi), vector(wr), L::of(self.sigma_u));
        (pair, [L::load(&tilt[0]), L::load(&tilt[1])])
    }
}

/// S and V by place.
struct Responses<'a> {
    sight: Sight<'a>,
    optics: &'a Optics<f64>,
}

impl Integrand for Responses<'_> {
    #[inline(always)]
    fn at<L: Doubles>(&self, places: L) -> Response<L> {
        let (pair, [cos, sin]) = self.sight.from(places);
        pair.response(&self.optics.cast(), cos, sin)
    }
}

/// p_r by place, or P(t, wi, wr), as one of two functions that are integrated at once.
struct Projections<'a> {
    sight: Sight<'a>,
    are_joint: bool,
}

impl Integrand for Projections<'_> {
    #[inline(always)]
    fn at<L: Doubles>(&self, places: L) -> Response<L> {
        let (pair, [cos, sin]) = self.sight.from(places);
        Response {
            surface: if self.are_joint {
                pair.visibility(cos, sin)
            } else {
                pair.projection(cos, sin)
            },
            volume: L::zero(),
        }
    }
}

/// A place on a sweep, seen by a pair of directions.
struct Place {
    frame: ThreadFrame<f64>,
    /// cos δ and sin δ.
    tilt: [f64; 2],
    /// dδ/ds, and cos δ dα/ds.
    turns: [f64; 2],
    i: Seen,
    r: Seen,
}

/// A direction in the tilted frame, and r = √(x²+z²) of it in the untilted one.
struct Seen {
    x: f64,
    y: f64,
    z: f64,
    r: f64,
}

impl Place {
    fn new(sweep: &Sweep, s: f64, wi: Vec3<f64>, wr: Vec3<f64>) -> Self {
        let [delta, alpha] = sweep.at(s);
        let frame = ThreadFrame::new(alpha);
        let (sin, cos) = delta.sin_cos();
        let seen = |w: Vec3<f64>| {
            let [x, y, z] = frame.to_thread(w);
            Seen {
                x: cos * x + sin * z,
                y,
                z: cos * z - sin * x,
                r: norm2(x, z),
            }
        };
        let [tilting, turning] = [0, 1].map(|k| sweep.to[k] - sweep.from[k]);
        Self {
            i: seen(wi),
            r: seen(wr),
            tilt: [cos, sin],
            turns: [tilting, cos * turning],
            frame,
        }
    }

    /// With s from k to k + 1 along sweep k.
    fn among(sweeps: &[Sweep], s: f64, wi: Vec3<f64>, wr: Vec3<f64>) -> Self {
        let index = (s as usize).min(sweeps.len() - 1);
        Self::new(&sweeps[index], s - index as f64, wi, wr)
    }

    /// X and dX/ds.
    fn highlight(&self) -> [f64; 2] {
        let Self { turns, i, r, .. } = self;
        let slope = (i.z + r.z) * turns[0] + turns[1] * (i.y + r.y);
        [i.x + r.x, slope]
    }
}

/// Where each of the functions `of` s passes 0.
fn roots<const N: usize>(sweep: &Sweep, of: impl Fn(f64) -> [f64; N]) -> [Vec<f64>; N] {
    let count = (sweep.width() / STEP).ceil();
    let mut found = [const { Vec::new() }; N];
    let (mut from, mut before) = (0.0, of(0.0));
    for k in 1..=count as usize {
        let to = k as f64 / count;
        let after = of(to);
        for (index, found) in found.iter_mut().enumerate() {
            let (a, b) = (before[index], after[index]);
            if a < 0.0 && b >= 0.0 {
                found.push(root(from, to, CLOSE, |s| of(s)[index]));
            } else if a > 0.0 && b <= 0.0 {
                found.push(root(from, to, CLOSE, |s| -of(s)[index]));
            }
        }
        (from, before) = (to, after);
    }
    found
}

/// The whole of a sweep in pieces that end at `cuts`, and every few steps; s from `index` on.
fn pieces(index: usize, sweep: &Sweep, mut cuts: Vec<f64>) -> Vec<Piece> {
    let count = (sweep.width() / PIECE).ceil();
    cuts.extend((1..count as usize).map(|k| k as f64 / count));
    cuts.sort_by(f64::total_cmp);
    let from = index as f64;
    cuts.iter_mut().for_each(|cut| *cut += from);
    let whole = Piece {
        from,
        to: from + 1.0,
        density: sweep.share,
    };
    whole.cut(&cuts).collect()
}
