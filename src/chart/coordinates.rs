//! What a grid is a function of.

use super::{Chart, Rim, height, isotropic, view};
use crate::math::{Lanes, Real, Vec3};

/// How a pair of directions in thread coordinates becomes a point of a box of up to four dimensions. Coordinates that a
/// function does not depend on are 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Coordinates {
    /// The four of a thread.
    Thread {
        /// Which.
        chart: Chart,
        /// Whether the thread looks the same from both ends: a pair with (wi + wr)·t < 0 is mirrored t → −t, and u₀ ≥ ½.
        ends_fold: bool,
        /// Whether it looks the same from both sides, as a straight thread does: a pair with φ_h < 0 is mirrored s → −s. If
        /// not, u₃ = (1 + φ_h / (π/2)) / 2.
        sides_fold: bool,
        /// How far before the horizon the box ends.
        rim: Rim,
    },
    /// The three of a thread that goes in all directions.
    Isotropic,
    /// Those of the viewer.
    View {
        /// Whether all azimuths are the same: one coordinate, or two.
        isotropic: bool,
    },
}

impl Coordinates {
    /// How many there are: the first ones.
    pub fn rank(self) -> usize {
        match self {
            Self::Thread { .. } => 4,
            Self::Isotropic => 3,
            Self::View { isotropic } => 2 - usize::from(isotropic),
        }
    }

    /// How far before the horizon the box ends.
    pub fn rim(self) -> Rim {
        match self {
            Self::Thread { rim, .. } => rim,
            Self::Isotropic | Self::View { .. } => Rim::NONE,
        }
    }

    /// The same in a box that ends elsewhere, of a thread; others have no rim.
    #[must_use]
    pub fn with_rim(mut self, to: Rim) -> Self {
        if let Self::Thread { rim, .. } = &mut self {
            *rim = to;
        }
        self
    }

    /// The share of the box in the value of a pair: see [`Rim::share_of_box`].
    #[inline(always)]
    pub fn share_of_box<R: Lanes>(self, wi: Vec3<R>, wr: Vec3<R>) -> R {
        self.rim().share_of_box(height(wi, wr))
    }

    /// What to call them.
    pub fn names(self) -> &'static [&'static str] {
        match self {
            Self::Thread {
                chart: Chart::Thesis,
                ..
            } => &["theta_h", "theta_d", "phi_d", "phi_h"],
            Self::Thread {
                chart: Chart::Highlight,
                ..
            } => &["psi", "theta_d", "phi_d", "phi_h"],
            Self::Isotropic => &["theta_sum", "theta_difference", "phi"],
            Self::View { isotropic: false } => &["theta_r", "phi_r"],
            Self::View { isotropic: true } => &["theta_r"],
        }
    }

    /// Whether functions on the sphere bend at the middle of a coordinate's range: the normalisation of u₁ does at that of u₀,
    /// and `min` in M at φ_d = 0 and φ_h = 0. Where wi = wr it does so of all tangents at once, so that their mean has the tip of a
    /// cone there: at θ_d = 0, too. Splines that are smooth in u₁ cut that tip, and make denim too dark by 0.3 % (facing) to 2 % wherever
    /// it is lit from the camera.
    pub fn kinks(self) -> [bool; 4] {
        match self {
            Self::Thread { sides_fold, .. } => [true, true, true, !sides_fold],
            Self::Isotropic => [true, true, false, false],
            Self::View { .. } => [false; 4],
        }
    }

    /// Whether points u and 1 − u of a coordinate are the two sides of a face on which pairs are mirrored into each other, so
    /// that a function is even on it: of u₂ at φ_h = 0, of u₁ at θ_h = 0.
    pub fn mirrored(self) -> [bool; 4] {
        match self {
            Self::Thread {
                ends_fold,
                sides_fold,
                ..
            } => [false, ends_fold, sides_fold, false],
            Self::Isotropic | Self::View { .. } => [false; 4],
        }
    }

    /// Whether the box ends at (0, 1) in a coordinate where directions are ambiguous: they are not where it ends in the plane
    /// of a mirror.
    pub fn is_face(self) -> [[bool; 2]; 4] {
        match self {
            Self::Thread { sides_fold, .. } => {
                [[true; 2], [true; 2], [true; 2], [!sides_fold, true]]
            }
            Self::Isotropic => [[true; 2], [true; 2], [false; 2], [false; 2]],
            Self::View { .. } => [[true; 2], [false; 2], [false; 2], [false; 2]],
        }
    }

    /// The point of a pair of unit directions above the surface.
    #[inline(always)]
    pub fn of<R: Lanes>(self, wi: Vec3<R>, wr: Vec3<R>) -> [R; 4] {
        self.with_share(wi, wr).0
    }

    /// The same, and the share of the box.
    #[inline(always)]
    pub(crate) fn with_share<R: Lanes>(self, wi: Vec3<R>, wr: Vec3<R>) -> ([R; 4], R) {
        let u = match self {
            Self::Thread {
                chart,
                ends_fold,
                sides_fold,
                rim,
            } => {
                let (wi, wr) = if ends_fold {
                    fold_ends(wi, wr)
                } else {
                    (wi, wr)
                };
                let (u, angles) = chart.coordinates_and_angles(rim, wi, wr);
                let share = rim.share_of_box(angles.height);
                if sides_fold {
                    return (u, share);
                }
                let (half, side) = (R::of(0.5), angles.side);
                let is_mirrored = side.lt(R::zero());
                let u = [
                    u[0],
                    u[1],
                    R::select(is_mirrored, R::one() - u[2], u[2]),
                    half + half * side * u[3],
                ];
                return (u, share);
            }
            Self::Isotropic => isotropic::coordinates(wi, wr),
            Self::View { isotropic } => {
                let u = view::coordinates(wr);
                if isotropic {
                    [u[0], R::zero(), R::zero(), R::zero()]
                } else {
                    u
                }
            }
        };
        (u, R::one())
    }

    /// A pair at a point of the box; what the coordinates do not tell is anything.
    pub fn directions<R: Real>(self, u: [R; 4]) -> (Vec3<R>, Vec3<R>) {
        match self {
            Self::Thread {
                chart,
                sides_fold: true,
                rim,
                ..
            } => chart.directions(rim, u),
            Self::Thread {
                chart,
                sides_fold: false,
                rim,
                ..
            } => {
                let side = R::of(2.0) * u[3] - R::one();
                let is_mirrored = side < R::zero();
                let phi_d = if is_mirrored { R::one() - u[2] } else { u[2] };
                let (wi, wr) = chart.directions(rim, [u[0], u[1], phi_d, side.abs()]);
                if is_mirrored {
                    ([wi[0], -wi[1], wi[2]], [wr[0], -wr[1], wr[2]])
                } else {
                    (wi, wr)
                }
            }
            Self::Isotropic => isotropic::directions(u),
            Self::View { .. } => ([R::zero(), R::zero(), R::one()], view::direction(u)),
        }
    }
}

/// A pair mirrored t → −t, if need be, so that it leans towards t: u₀ ≥ ½ in every chart.
#[inline(always)]
fn fold_ends<R: Lanes>(wi: Vec3<R>, wr: Vec3<R>) -> (Vec3<R>, Vec3<R>) {
    let away = (wi[0] + wr[0]).lt(R::zero());
    (
        [R::select(away, -wi[0], wi[0]), wi[1], wi[2]],
        [R::select(away, -wr[0], wr[0]), wr[1], wr[2]],
    )
}
