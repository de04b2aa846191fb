//! What is where.

use super::Image;

/// Materials, by index, over the plane.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Layout {
    /// The same everywhere.
    Plain,
    Dots {
        background: usize,
        dots: usize,
        /// From dot to dot along u and v.
        spacing: [f64; 2],
        radius: f64,
        /// Whether every other row is shifted by half a spacing.
        staggered: bool,
    },
    Stripes {
        materials: Vec<usize>,
        /// Where each stripe ends, ascending, from 0; the last is the period.
        ends: Vec<f64>,
        /// Cosine and sine of the direction across the stripes, from u towards v.
        across: [f64; 2],
    },
    Checks {
        materials: [usize; 2],
        size: [f64; 2],
    },
    Mask {
        image: Image,
        /// From dark to bright.
        materials: Vec<usize>,
        /// What the image spans.
        size: [f64; 2],
    },
    Albedo {
        image: Image,
        material: usize,
        size: [f64; 2],
        /// Which visible threads take the image's colour.
        threads: Vec<bool>,
    },
}

/// A colour that threads take at a point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Dye {
    pub(super) albedo: [f32; 3],
    pub(super) threads: Vec<bool>,
}

impl Layout {
    /// The material at (u, v), and what dyes it there.
    pub(super) fn at(&self, u: f64, v: f64) -> (usize, Option<Dye>) {
        match self {
            Self::Plain => (0, None),
            Self::Dots {
                background,
                dots,
                spacing,
                radius,
                staggered,
            } => {
                // A dot may reach into the rows beside its own.
                let row = (v / spacing[1]).round();
                let is_dot = [-1.0, 0.0, 1.0].into_iter().any(|beside| {
                    let row = row + beside;
                    let shift = if *staggered && row.rem_euclid(2.0) == 1.0 {
                        0.5
                    } else {
                        0.0
                    };
                    let column = (u / spacing[0] - shift).round();
                    let du = u - (column + shift) * spacing[0];
                    let dv = v - row * spacing[1];
                    du * du + dv * dv <= radius * radius
                });
                (if is_dot { *dots } else { *background }, None)
            }
            Self::Stripes {
                materials,
                ends,
                across,
            } => {
                let period = ends.last().copied().unwrap_or(1.0);
                let place = (u * across[0] + v * across[1]).rem_euclid(period);
                let stripe = ends.iter().position(|end| place < *end).unwrap_or(0);
                (materials[stripe], None)
            }
            Self::Checks { materials, size } => {
                let odd = |x: f64, size: f64| (x / size).floor().rem_euclid(2.0) == 1.0;
                (
                    materials[usize::from(odd(u, size[0]) != odd(v, size[1]))],
                    None,
                )
            }
            Self::Mask {
                image,
                materials,
                size,
            } => {
                let [red, ..] = sample(image, size, u, v);
                let last = materials.len() - 1;
                let index = (f64::from(red.clamp(0.0, 1.0)) * last as f64).round() as usize;
                (materials[index], None)
            }
            Self::Albedo {
                image,
                material,
                size,
                threads,
            } => {
                let dye = Dye {
                    albedo: sample(image, size, u, v),
                    threads: threads.clone(),
                };
                (*material, Some(dye))
            }
        }
    }
}

impl Layout {
    /// Its longest period along u, v or across.
    pub(super) fn period(&self) -> Option<f64> {
        let longer = |[u, v]: [f64; 2]| Some(u.max(v));
        match self {
            Self::Plain => None,
            Self::Dots {
                spacing: [u, v],
                staggered,
                ..
            } => longer([*u, if *staggered { 2.0 * v } else { *v }]),
            Self::Stripes { ends, .. } => ends.last().copied(),
            Self::Checks { size, .. } => longer(size.map(|size| 2.0 * size)),
            Self::Mask { size, .. } | Self::Albedo { size, .. } => longer(*size),
        }
    }
}

/// The image repeats over the plane, its lower left corner at the origin.
fn sample(image: &Image, size: &[f64; 2], u: f64, v: f64) -> [f32; 3] {
    image.at((u / size[0]).rem_euclid(1.0), (v / size[1]).rem_euclid(1.0))
}
