//! How a coefficient of a table is stored.

use super::numbers::Numbers;
#[cfg(feature = "bake")]
use super::numbers::own;

/// How samples are stored. The root of a value bends less than a lobe does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "bake",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
#[cfg_attr(feature = "cli", derive(clap::ValueEnum))]
#[non_exhaustive]
pub enum Encoding {
    /// 32-bit floats.
    F32,
    /// 16-bit integers.
    I16,
    /// 32-bit floats of the square root.
    SqrtF32,
    /// 16-bit integers of the square root.
    SqrtI16,
    /// 8-bit integers of the square root.
    SqrtI8,
}

impl Encoding {
    /// All encodings.
    pub const ALL: [Self; 5] = [
        Self::F32,
        Self::I16,
        Self::SqrtF32,
        Self::SqrtI16,
        Self::SqrtI8,
    ];

    /// What files, flags and reports call it: `sqrt-i16`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::I16 => "i16",
            Self::SqrtF32 => "sqrt-f32",
            Self::SqrtI16 => "sqrt-i16",
            Self::SqrtI8 => "sqrt-i8",
        }
    }

    /// Bytes per stored number.
    pub const fn bytes(self) -> usize {
        match self {
            Self::F32 | Self::SqrtF32 => 4,
            Self::I16 | Self::SqrtI16 => 2,
            Self::SqrtI8 => 1,
        }
    }

    /// Whether splines are of the square root.
    pub const fn is_root(self) -> bool {
        matches!(self, Self::SqrtF32 | Self::SqrtI16 | Self::SqrtI8)
    }

    /// The largest stored number: coefficients are divided by their scale and multiplied by it.
    pub const fn unit(self) -> f64 {
        match self {
            Self::F32 | Self::SqrtF32 => 1.0,
            Self::I16 | Self::SqrtI16 => 32_767.0,
            Self::SqrtI8 => 127.0,
        }
    }

    /// The quantity that splines are of, for a value.
    pub fn encode(self, value: f64) -> f64 {
        if self.is_root() {
            num_traits::Float::sqrt(value.max(0.0))
        } else {
            value
        }
    }

    /// The value of a quantity that splines are of. They overshoot: below zero there is no light.
    #[inline(always)]
    pub fn decode<R: crate::math::Lanes>(self, quantity: R) -> R {
        let quantity = quantity.max(R::zero());
        if self.is_root() {
            quantity * quantity
        } else {
            quantity
        }
    }
}

/// The stored numbers of a table, and what follows them so that rows can be read whole: zeros, or what else is behind them in a
/// file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Samples {
    /// Of 32-bit floats.
    F32(Numbers<f32>),
    /// Of 16-bit integers.
    I16(Numbers<i16>),
    /// Of 8-bit integers.
    I8(Numbers<i8>),
}

impl Samples {
    /// Stores numbers of magnitude up to [`Encoding::unit`], and the zeros that a grid's samples end with.
    #[cfg(feature = "bake")]
    pub(crate) fn store(encoding: Encoding, numbers: impl Iterator<Item = f64>) -> Self {
        let round: fn(f64) -> f64 = num_traits::Float::round;
        match encoding {
            Encoding::F32 | Encoding::SqrtF32 => Self::F32(own(numbers.map(|x| x as f32))),
            Encoding::I16 | Encoding::SqrtI16 => Self::I16(own(numbers.map(|x| round(x) as i16))),
            Encoding::SqrtI8 => Self::I8(own(numbers.map(|x| round(x) as i8))),
        }
    }

    /// How many there are, with those that follow them.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::F32(samples) => samples.len(),
            Self::I16(samples) => samples.len(),
            Self::I8(samples) => samples.len(),
        }
    }

    /// Whether they are in the memory of the file that they were loaded from ([`super::Table::from_static`]).
    pub(crate) fn is_lent(&self) -> bool {
        match self {
            Self::F32(samples) => samples.is_lent(),
            Self::I16(samples) => samples.is_lent(),
            Self::I8(samples) => samples.is_lent(),
        }
    }
}
