//! Coordinates of one pair for several threads, side by side.

use core::f64::consts::{FRAC_2_PI, FRAC_PI_2};

use super::{Angles, Chart, Coordinates, Rim, highlight, shared_coordinates, thesis};
use crate::math::{Lanes, Vec3};

/// The four coordinates of as many threads as there are numbers. Flags are 1, or else 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Several<T> {
    is_highlight: T,
    ends_fold: T,
    sides_fold: T,
    /// Where boxes end, and what is over it.
    azimuth: [T; 2],
    /// The heights from which shares of the box are counted; below any where there is no rim.
    rim: T,
}

/// A height below any.
const BELOW: f32 = -4.0;

impl<const N: usize> Several<[f32; N]> {
    /// None yet.
    pub(crate) fn new() -> Self {
        Self {
            is_highlight: [0.0; N],
            ends_fold: [0.0; N],
            sides_fold: [1.0; N],
            azimuth: [[FRAC_PI_2 as f32; N], [FRAC_2_PI as f32; N]],
            rim: [BELOW; N],
        }
    }

    /// Puts those of a thread into a lane; `None` if they are others.
    pub(crate) fn set(&mut self, lane: usize, coordinates: Coordinates) -> Option<()> {
        let Coordinates::Thread {
            chart,
            ends_fold,
            sides_fold,
            rim,
        } = coordinates
        else {
            return None;
        };
        let flag = |is: bool| f32::from(u8::from(is));
        self.is_highlight[lane] = flag(chart == Chart::Highlight);
        self.ends_fold[lane] = flag(ends_fold);
        self.sides_fold[lane] = flag(sides_fold);
        for (to, end) in self.azimuth.iter_mut().zip(rim.end::<f32>()) {
            to[lane] = end;
        }
        if !rim.is_none() {
            self.rim[lane] = rim.height() as f32;
        }
        Some(())
    }

    /// All of them in other numbers.
    #[inline(always)]
    pub(crate) fn map<L>(&self, of: impl Fn(&[f32; N]) -> L) -> Several<L> {
        Several {
            is_highlight: of(&self.is_highlight),
            ends_fold: of(&self.ends_fold),
            sides_fold: of(&self.sides_fold),
            azimuth: [of(&self.azimuth[0]), of(&self.azimuth[1])],
            rim: of(&self.rim),
        }
    }
}

impl<L: Lanes> Several<L> {
    /// The points of a pair in each thread's coordinates, as [`Coordinates::of`].
    #[inline(always)]
    pub(crate) fn of(&self, wi: Vec3<L>, wr: Vec3<L>) -> [L; 4] {
        let (zero, half, one) = (L::zero(), L::of(0.5), L::one());
        let is = |flag: L| half.lt(flag);
        let away = L::both((wi[0] + wr[0]).lt(zero), is(self.ends_fold));
        let wi = [L::select(away, -wi[0], wi[0]), wi[1], wi[2]];
        let wr = [L::select(away, -wr[0], wr[0]), wr[1], wr[2]];
        let angles = Angles::of(wi, wr);
        let [u1, u2, u3] = shared_coordinates(self.azimuth, &angles);
        let by_chart = [thesis::first(&angles), highlight::first(wi, wr)];
        let u0 = L::select(is(self.is_highlight), by_chart[1], by_chart[0]);
        let mirrored = L::both(angles.side.lt(zero), self.sides_fold.lt(half));
        let unfolded = half + half * angles.side * u3;
        [
            u0,
            u1,
            L::select(mirrored, one - u2, u2),
            L::select(is(self.sides_fold), u3, unfolded),
        ]
    }

    /// The share of each thread's box in the value of a pair, by the pair's heights: see [`Rim::share_of_box`].
    #[inline(always)]
    pub(crate) fn share_of_box(&self, height: L) -> L {
        Rim::share_from(self.rim, height)
    }
}
