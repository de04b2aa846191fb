//! How a coefficient of a table is stored: the root of a value, which bends less than a lobe does, as a 16-bit integer.

use crate::math::Lanes;

/// The largest stored number: coefficients are divided by their scale and multiplied by it.
pub(crate) const UNIT: f64 = 32_767.0;

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

/// To be removed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "bake",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
pub enum Encoding {
    /// It.
    SqrtI16,
}

#[expect(missing_docs, reason = "to be removed")]
impl Encoding {
    pub const ALL: [Self; 1] = [Self::SqrtI16];
    pub const fn name(self) -> &'static str {
        "sqrt-i16"
    }
    pub const fn bytes(self) -> usize {
        2
    }
    pub const fn is_root(self) -> bool {
        true
    }
    pub const fn unit(self) -> f64 {
        UNIT
    }
    #[cfg(feature = "bake")]
    pub fn encode(self, value: f64) -> f64 {
        encode(value)
    }
}
