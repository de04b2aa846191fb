//! atan2, exp, sine and cosine by polynomials.
//!
//! Coefficients minimise the largest error (Lawson's iteratively reweighted least squares in f64, rounded to f32).
//! Largest errors against f64, over 200 000 arguments each: atan2 all around the circle 2.8e-7 radians (half an ulp at π is
//! 1.2e-7), exp on −87…88 2.2e-7 of its value, sine and cosine on ±10 1.6e-7 and 3.4e-7. `tests/core.rs` checks them.

use super::Vector;

/// atan(a)/a in powers of a², for a from 0 to 1.
const ATAN: [f64; 8] = [
    0.999_999_940_395_355_2,
    -0.333_320_945_501_327_5,
    0.199_713_751_673_698_43,
    -0.140_294_209_122_657_78,
    0.099_427_603_185_176_85,
    -0.059_904_728_084_802_63,
    0.024_557_130_411_267_29,
    -0.004_780_456_423_759_46,
];

/// exp(r) in powers of r, for |r| up to ln 2 / 2.
const EXP: [f64; 6] = [
    1.000_000_119_209_289_6,
    0.999_999_701_976_776_1,
    0.499_988_943_338_394_17,
    0.166_675_746_440_887_45,
    0.041_915_398_091_077_805,
    0.008_297_661_319_375_038,
];

/// sin(r)/r in powers of r², for |r| up to π/2.
const SIN: [f64; 6] = [
    1.0,
    -0.166_666_671_633_720_4,
    0.008_333_329_111_337_662,
    -0.000_198_407_025_895_913_57,
    2.751_885_403_995_402e-6,
    -2.379_469_599_134_154e-8,
];

/// π in two parts, the first with so few bits that its integer multiples are exact.
const PI: [f64; 2] = [3.140_625, 9.676_535_897_932_385e-4];

/// ln 2 in two parts, the first with so few bits that its integer multiples are exact.
const LN_2: [f64; 2] = [0.693_145_751_953_125, 1.428_606_765_330_187e-6];

#[inline(always)]
fn polynomial<V: Vector>(coefficients: &[f64], x: V) -> V {
    let (last, rest) = coefficients.split_last().expect("not empty");
    let mut sum = V::of(*last);
    for c in rest.iter().rev() {
        sum = sum.mul_add(x, V::of(*c));
    }
    sum
}

#[inline(always)]
pub(super) fn atan2<V: Vector>(y: V, x: V) -> V {
    let (ax, ay) = (x.abs(), y.abs());
    let (small, large) = (ax.min(ay), ax.max(ay));
    // At the origin 0/0 is NaN, which max replaces by 0.
    let a = (small / large).max(V::zero());
    let angle = a * polynomial(&ATAN, a * a);
    let angle = V::select(
        ax.lt(ay),
        V::of(core::f64::consts::FRAC_PI_2) - angle,
        angle,
    );
    let angle = V::select(x.lt(V::zero()), V::of(core::f64::consts::PI) - angle, angle);
    angle.copysign(y)
}

/// By Estrin's scheme, whose chain is half as long as Horner's.
#[inline(always)]
pub(super) fn twice_atan<V: Vector>(a: V) -> V {
    let [c0, c1, c2, c3, c4, c5, c6, c7] = [
        V::of(2.0 * ATAN[0]),
        V::of(2.0 * ATAN[1]),
        V::of(2.0 * ATAN[2]),
        V::of(2.0 * ATAN[3]),
        V::of(2.0 * ATAN[4]),
        V::of(2.0 * ATAN[5]),
        V::of(2.0 * ATAN[6]),
        V::of(2.0 * ATAN[7]),
    ];
    let x = a * a;
    let x2 = x * x;
    let x4 = x2 * x2;
    let low = x2.mul_add(x.mul_add(c3, c2), x.mul_add(c1, c0));
    let high = x2.mul_add(x.mul_add(c7, c6), x.mul_add(c5, c4));
    a * x4.mul_add(high, low)
}

#[inline(always)]
pub(super) fn exp<V: Vector>(x: V) -> V {
    let x = x.max(V::of(-87.0)).min(V::of(88.0));
    let n = (x * V::of(core::f64::consts::LOG2_E)).round();
    let r = n.mul_add(V::of(-LN_2[1]), n.mul_add(V::of(-LN_2[0]), x));
    polynomial(&EXP, r) * n.exp2_integer()
}

#[inline(always)]
pub(super) fn sin<V: Vector>(x: V) -> V {
    let n = (x * V::of(core::f64::consts::FRAC_1_PI)).round();
    let r = n.mul_add(V::of(-PI[1]), n.mul_add(V::of(-PI[0]), x));
    let sin = r * polynomial(&SIN, r * r);
    // Every other half turn is upside down.
    let half = V::of(0.5) * n;
    let odd = V::of(0.25).lt((half - half.round()).abs());
    V::select(odd, -sin, sin)
}
