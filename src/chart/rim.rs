//! Pairs near a thread's horizon, which grids err most at.

use core::f64::consts::FRAC_PI_2;

use crate::math::{Lanes, Vec3, norm2};

/// How far before a thread's horizon its box ends, in hundredths of a radian of azimuth: 0 at the horizon.
///
/// Pairs beyond the box are evaluated without it, pairs within [`Rim::BAND`] of its end both ways, blended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Rim(u8);

impl Rim {
    /// The box ends at the horizon.
    pub const NONE: Self = Self(0);
    /// The widest rim, in hundredths.
    pub const WIDEST: u8 = 50;
    /// How far within the box both ways are blended, as heights are measured by [`height`].
    pub const BAND: f64 = 0.05;

    /// From hundredths of a radian; `None` beyond [`Rim::WIDEST`].
    pub const fn new(hundredths: u8) -> Option<Self> {
        if hundredths <= Self::WIDEST {
            Some(Self(hundredths))
        } else {
            None
        }
    }

    /// In hundredths of a radian.
    pub const fn hundredths(self) -> u8 {
        self.0
    }

    /// Whether there is none.
    pub const fn is_none(self) -> bool {
        self.0 == 0
    }

    /// The azimuth at which the box ends.
    #[inline(always)]
    pub fn azimuth(self) -> f64 {
        FRAC_PI_2 - 0.01 * f64::from(self.0)
    }

    /// The same, and what is over it.
    #[inline(always)]
    pub(super) fn end<R: Lanes>(self) -> [R; 2] {
        [R::of(self.azimuth()), R::of(1.0 / self.azimuth())]
    }

    /// The share of the box in the value of a pair at a [`height`]: 0 beyond it, 1 from the band on. All is the box's where there is no
    /// rim.
    #[inline(always)]
    pub fn share_of_box<R: Lanes>(self, height: R) -> R {
        if self.is_none() {
            return R::one();
        }
        Self::share_from(R::of(self.height()), height)
    }

    /// The height of the end of the box, or a little more: it has to go on to where it counts.
    pub(super) fn height(self) -> f64 {
        0.01 * f64::from(self.0)
    }

    #[inline(always)]
    pub(super) fn share_from<R: Lanes>(from: R, height: R) -> R {
        let share = (height - from) * R::of(1.0 / Self::BAND);
        share.max(R::zero()).min(R::one())
    }
}

/// How high above a thread's horizon a pair of unit directions in thread coordinates is: the least over both of the cosine
/// of the azimuth and 1.5 times the cosine to the normal. (Of what was tried, at equal share of pairs, it leaves the least
/// error.)
#[inline(always)]
pub fn height<R: Lanes>(wi: Vec3<R>, wr: Vec3<R>) -> R {
    height_of([wi[2], wr[2]], [norm2(wi[1], wi[2]), norm2(wr[1], wr[2])])
}

/// The same by the directions' z and √(y² + z²).
#[inline(always)]
pub(super) fn height_of<R: Lanes>([z_i, z_r]: [R; 2], [rho_i, rho_r]: [R; 2]) -> R {
    let tiny = R::of(super::TINY);
    let (rho_i, rho_r) = (rho_i.max(tiny), rho_r.max(tiny));
    // The smaller of two quotients by one division.
    let azimuth = (z_i * rho_r).min(z_r * rho_i) / (rho_i * rho_r);
    azimuth.min(R::of(1.5) * z_i.min(z_r))
}
