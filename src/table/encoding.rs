//! How a coefficient of a table is stored: the root of a value, which bends less than a lobe does, as a 16-bit integer.

use crate::math::Lanes;

/// The largest stored number: coefficients are divided by their scale and multiplied by it.
pub(crate) const UNIT: f64 = 32_767.0;

/// Bytes of a stored number.
#[cfg(feature = "bake")]
pub(crate) const COEFFICIENT_BYTES: usize = size_of::<i16>();

/// The quantity that splines are of, for a value.
#[cfg(feature = "bake")]
pub(crate) fn encode(value: f64) -> f64 {
    num_traits::Float::sqrt(value.max(0.0))
}

/// The value of a quantity that splines are of. They overshoot: below zero there is no light.
#[inline(always)]
pub(crate) fn decode<R: Lanes>(quantity: R) -> R {
    let quantity = quantity.max(R::zero());
    quantity * quantity
}
