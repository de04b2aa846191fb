//! Coordinates of one pair for several threads, side by side.

use super::{Angles, Chart, Coordinates, Rim, highlight, shared_coordinates, thesis};
use crate::math::{Lanes, Vec3};

/// The four coordinates of as many threads as there are lanes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Several<L: Lanes> {
    is_highlight: L::Mask,
    ends_fold: L::Mask,
    sides_fold: L::Mask,
    /// Where boxes end, and what is over it.
    azimuth: [L; 2],
    /// The heights from which shares of the box are counted; below any where there is no rim.
    rim: L,
}

/// A height below any.
const BELOW: f32 = -4.0;

impl Coordinates {
    /// As numbers, of a thread: what [`Several::of_numbers`] takes.
    pub(crate) fn numbers(self) -> Option<[f32; 6]> {
        let Self::Thread {
            chart,
            ends_fold,
            sides_fold,
            rim,
        } = self
        else {
            return None;
        };
        let [azimuth, over] = rim.end();
        let flag = |is: bool| f32::from(u8::from(is));
        let height = if rim.is_none() {
            BELOW
        } else {
            rim.height() as f32
        };
        Some([
            flag(chart == Chart::Highlight),
            flag(ends_fold),
            flag(sides_fold),
            azimuth,
            over,
            height,
        ])
    }
}

impl<L: Lanes> Several<L> {
    /// Those with these [`Coordinates::numbers`].
    #[inline(always)]
    pub(crate) fn of_numbers([chart, ends, sides, azimuth, over, rim]: [L; 6]) -> Self {
        let half = L::of(0.5);
        Self {
            is_highlight: half.lt(chart),
            ends_fold: half.lt(ends),
            sides_fold: half.lt(sides),
            azimuth: [azimuth, over],
            rim,
        }
    }

    /// The points of a pair in each thread's coordinates, and the shares of their boxes, as [`Coordinates::with_share`].
    #[inline(always)]
    pub(crate) fn with_share(&self, wi: Vec3<L>, wr: Vec3<L>) -> ([L; 4], L) {
        let (zero, half, one) = (L::zero(), L::of(0.5), L::one());
        let away = L::both((wi[0] + wr[0]).lt(zero), self.ends_fold);
        let wi = [L::select(away, -wi[0], wi[0]), wi[1], wi[2]];
        let wr = [L::select(away, -wr[0], wr[0]), wr[1], wr[2]];
        let angles = Angles::of(wi, wr);
        let [u1, u2, u3] = shared_coordinates(self.azimuth, &angles);
        let (theta_h, psi) = (thesis::first(&angles), highlight::first(wi, wr));
        let is_mirrored = angles.side.lt(zero);
        let mirrored = L::select(is_mirrored, one - u2, u2);
        let u = [
            L::select(self.is_highlight, psi, theta_h),
            u1,
            L::select(self.sides_fold, u2, mirrored),
            L::select(self.sides_fold, u3, half + half * angles.side * u3),
        ];
        (u, Rim::share_from(self.rim, angles.height))
    }
}
