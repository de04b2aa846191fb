//! Roots of functions of one variable.

use super::Real;

/// The root of `f` in \[a, b\], where f(a) ≤ 0 ≤ f(b): regula falsi, halving the weight of an end that stays twice in a
/// row (Illinois), with a bisection at every fourth step, until a step is not above `tolerance`; if that is 0, to the last bit or two.
pub(crate) fn root<R: Real>(mut a: R, mut b: R, tolerance: R, f: impl Fn(R) -> R) -> R {
    let half = R::of(0.5);
    let (mut f_a, mut f_b) = (f(a), f(b));
    if f_a >= R::zero() {
        return a;
    }
    if f_b <= R::zero() {
        return b;
    }
    let mut moved_up = None;
    let mut last = a;
    for step in 0..256 {
        let secant = (a * f_b - b * f_a) / (f_b - f_a);
        let bisect = step % 4 == 3 || !(secant > a && secant < b);
        let x = if bisect { half * (a + b) } else { secant };
        let f_x = f(x);
        if x <= a || x >= b || f_x == R::zero() || (x - last).abs() < tolerance {
            return x;
        }
        last = x;
        let is_below = f_x < R::zero();
        if is_below {
            a = x;
            f_a = f_x;
            f_b = f_b
                * if moved_up == Some(true) {
                    half
                } else {
                    R::one()
                };
        } else {
            b = x;
            f_b = f_x;
            f_a = f_a
                * if moved_up == Some(false) {
                    half
                } else {
                    R::one()
                };
        }
        moved_up = Some(is_below);
    }
    half * (a + b)
}
