//! How a value of a table is stored.

use alloc::vec::Vec;

use half::f16;

/// What a stored number is of the value it stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(
    feature = "bake",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "kebab-case")
)]
pub enum Encoding {
    /// Value / scale as f32.
    F32,
    /// Value / scale as f16.
    F16,
    /// √(value / scale) as f16. Interpolation is of the root, which bends less than a lobe does.
    SqrtF16,
}

impl Encoding {
    /// All encodings.
    pub const ALL: [Self; 3] = [Self::F32, Self::F16, Self::SqrtF16];

    /// Bytes per stored number.
    pub const fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F16 | Self::SqrtF16 => 2,
        }
    }

    /// The number to store for a value that has been divided by its scale.
    pub fn encode(self, value: f64) -> f64 {
        match self {
            Self::F32 | Self::F16 => value,
            Self::SqrtF16 => num_traits::Float::sqrt(value.max(0.0)),
        }
    }

    /// By how much a value grows with its stored number, there.
    pub fn slope(self, stored: f64) -> f64 {
        match self {
            Self::F32 | Self::F16 => 1.0,
            Self::SqrtF16 => 2.0 * stored,
        }
    }

    /// The value, before its scale, of an interpolated stored number. Cubics overshoot: below zero there is no light.
    #[inline(always)]
    pub fn decode(self, stored: f32) -> f32 {
        let stored = stored.max(0.0);
        match self {
            Self::F32 | Self::F16 => stored,
            Self::SqrtF16 => stored * stored,
        }
    }
}

/// The stored numbers of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Samples {
    /// Of [`Encoding::F32`].
    F32(Vec<f32>),
    /// Of the others.
    F16(Vec<f16>),
}

impl Samples {
    /// Stores encoded numbers.
    pub fn store(encoding: Encoding, numbers: impl Iterator<Item = f64>) -> Self {
        match encoding {
            Encoding::F32 => Self::F32(numbers.map(|x| x as f32).collect()),
            Encoding::F16 | Encoding::SqrtF16 => Self::F16(numbers.map(f16::from_f64).collect()),
        }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        match self {
            Self::F32(samples) => samples.len(),
            Self::F16(samples) => samples.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
