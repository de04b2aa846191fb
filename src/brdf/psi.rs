//! Angles in the plane of a thread and the normal, by their sines and cosines: which tilts a direction sees.
//!
//! A direction at angle ψ sees a cylinder tilted by δ at β = ψ + δ, if |β| < 90°. Both come from the direction's (x, z) by
//! rotation, so no angle is formed; and at an end of visibility β is ±90° exactly, so that what goes to 0 there, the visible
//! width and the cosines, keeps its relative precision. Q depends on that, and S and V over Q all the more.

use crate::math::{Lanes, Real, Vec3, norm2, splat};

/// Sine and cosine of an angle.
#[derive(Debug, Clone, Copy)]
pub(super) struct Psi<L> {
    pub(super) sin: L,
    pub(super) cos: L,
}

impl<L: Lanes> Psi<L> {
    /// ψ of a direction in thread coordinates, and √(x² + z²). Along s the angle is undefined; the normal's 0 is as good as any.
    #[inline(always)]
    pub(super) fn of(w: Vec3<L>) -> (Self, L) {
        let r = norm2(w[0], w[2]);
        let (defined, over) = (L::zero().lt(r), L::one() / r);
        let psi = Self {
            sin: L::select(defined, w[0] * over, L::zero()),
            cos: L::select(defined, w[2] * over, L::one()),
        };
        (psi, r)
    }

    #[inline(always)]
    fn select(mask: L::Mask, a: Self, b: Self) -> Self {
        Self {
            sin: L::select(mask, a.sin, b.sin),
            cos: L::select(mask, a.cos, b.cos),
        }
    }

    /// cos(ψ + δ): the projection p before it is cut at 0.
    #[inline(always)]
    pub(super) fn facing(self, cos_delta: L, sin_delta: L) -> L {
        self.cos * cos_delta - self.sin * sin_delta
    }

    /// ψ + δ.
    #[inline(always)]
    pub(super) fn turned<R: Real>(self, [cos, sin]: [R; 2]) -> Self {
        let (cos, sin) = (splat::<R, L>(cos), splat::<R, L>(sin));
        Self {
            sin: self.sin * cos + self.cos * sin,
            cos: self.facing(cos, sin),
        }
    }

    /// The same where it is within ±90°, else the nearer of the two.
    #[inline(always)]
    fn visible(self) -> Self {
        let beyond = L::select(self.sin.lt(L::zero()), L::of(-1.0), L::one());
        Self {
            sin: L::select(L::zero().lt(self.cos), self.sin, beyond),
            cos: self.cos.max(L::zero()),
        }
    }
}

impl<R: Real> Psi<R> {
    /// The same angle in every lane.
    #[inline(always)]
    pub(super) fn splat<L: Lanes>(self) -> Psi<L> {
        Psi {
            sin: splat(self.sin),
            cos: splat(self.cos),
        }
    }
}

/// tan((b−a)/2), for angles less than 180° apart.
#[inline(always)]
pub(super) fn half_tangent<L: Lanes>(a: Psi<L>, b: Psi<L>) -> L {
    (b.sin * a.cos - b.cos * a.sin) / (L::one() + (b.cos * a.cos + b.sin * a.sin))
}

/// Tilts between two ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Arc<R> {
    /// cos o and sin o of the ends.
    pub(super) from: [R; 2],
    pub(super) to: [R; 2],
    /// Tangent of half the width.
    pub(super) half_tangent: R,
    /// Share of the thread's length per radian.
    pub(super) density: R,
}

impl<R: Real> Arc<R> {
    pub(super) fn new(from: f64, to: f64, density: f64) -> Self {
        let end = |o: f64| {
            let (sin, cos) = num_traits::Float::sin_cos(o);
            [R::of(cos), R::of(sin)]
        };
        Self {
            from: end(from),
            to: end(to),
            half_tangent: R::of(num_traits::Float::tan(0.5 * (to - from))),
            density: R::of(density),
        }
    }

    /// cos and sin of the ends, the tangent of half the width and the density.
    #[cfg(feature = "shader")]
    pub(super) fn numbers(&self) -> [R; 6] {
        let ([a, b], [c, d]) = (self.from, self.to);
        [a, b, c, d, self.half_tangent, self.density]
    }

    /// ∫ max(cos(ψ + δ), 0) dδ. With a and b the ends within ±90° it is tan((b−a)/2) (cos a + cos b), a product of sums.
    ///
    /// For arcs up to 90° wide.
    #[inline(always)]
    pub(super) fn projection<L: Lanes>(&self, psi: Psi<L>) -> L {
        let (a, b) = (psi.turned(self.from), psi.turned(self.to));
        let is_whole = L::both(L::zero().lt(a.cos), L::zero().lt(b.cos));
        let (a, b) = (a.visible(), b.visible());
        L::select(is_whole, splat(self.half_tangent), half_tangent(a, b)) * (a.cos + b.cos)
    }
}

/// Two directions' angles in order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ordered<L: Lanes> {
    /// The smaller, which passes −90° as tilts fall.
    pub(super) first: Psi<L>,
    /// The larger, which passes 90° as tilts rise.
    pub(super) last: Psi<L>,
    /// Of the angle between, 0 to 180°.
    sin_between: L,
    pub(super) cos_between: L,
    /// Whether they changed places.
    pub(super) is_swapped: L::Mask,
}

impl<L: Lanes> Ordered<L> {
    #[inline(always)]
    pub(super) fn new(a: Psi<L>, b: Psi<L>) -> Self {
        let is_swapped = (b.sin * a.cos).lt(a.sin * b.cos);
        let (first, last) = (Psi::select(is_swapped, b, a), Psi::select(is_swapped, a, b));
        Self {
            first,
            last,
            sin_between: last.sin * first.cos - last.cos * first.sin,
            cos_between: last.cos * first.cos + last.sin * first.sin,
            is_swapped,
        }
    }

    /// What belongs to two directions in the order of their angles, or the other way round.
    #[inline(always)]
    pub(super) fn sort(&self, a: L, b: L) -> [L; 2] {
        [
            L::select(self.is_swapped, b, a),
            L::select(self.is_swapped, a, b),
        ]
    }

    /// Minus half the angle between: `first` where both are as far from 0.
    #[inline(always)]
    pub(super) fn half_back(&self) -> Psi<L> {
        // 1 ± cos cancels for one of sine and cosine, which follows from the other.
        let half = L::of(0.5);
        let larger = (half * (L::one() + self.cos_between.abs())).sqrt();
        let smaller = half * self.sin_between.max(L::zero()) / larger;
        let is_obtuse = self.cos_between.lt(L::zero());
        Psi {
            sin: -L::select(is_obtuse, larger, smaller),
            cos: L::select(is_obtuse, smaller, larger),
        }
    }

    /// Where one direction is at its horizon, the other is as far from there as they are apart.
    #[inline(always)]
    fn apart(&self, sin: L, sign: L) -> Psi<L> {
        Psi {
            sin: sin * self.cos_between,
            cos: sign * sin * self.sin_between,
        }
    }

    /// The tilts of an arc that both directions see.
    #[inline(always)]
    pub(super) fn seen<R: Real>(&self, arc: &Arc<R>) -> Seen<L> {
        let (from, to) = (self.first.turned(arc.from), self.last.turned(arc.to));
        let (first_a, last_b) = (from.visible(), to.visible());
        let (is_from, is_to) = (L::zero().lt(from.cos), L::zero().lt(to.cos));
        let last_a = self.last.turned(arc.from);
        let last_a = Psi::select(is_from, last_a, self.apart(first_a.sin, L::of(-1.0)));
        let first_b = self.first.turned(arc.to);
        let first_b = Psi::select(is_to, first_b, self.apart(last_b.sin, L::one()));
        // Near an end of visibility the width is as small as the cosine of the direction that ends there.
        let narrowed = half_tangent(
            Psi::select(is_to, first_a, last_a),
            Psi::select(is_to, first_b, last_b),
        );
        Seen {
            half_tangent: L::select(L::both(is_from, is_to), splat(arc.half_tangent), narrowed),
            first: [first_a, first_b],
            last: [last_a, last_b],
        }
    }
}

/// Tilts that two directions see.
pub(super) struct Seen<L> {
    /// Tangent of half their width; not above 0 where there are none.
    pub(super) half_tangent: L,
    /// β of both directions at the lower and the upper end.
    pub(super) first: [Psi<L>; 2],
    pub(super) last: [Psi<L>; 2],
}
