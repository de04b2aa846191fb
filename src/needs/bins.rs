//! The hemisphere in bins, by the octahedral map: w/(|x| + |y| + z) is on the upper half of an octahedron, which is flattened and
//! turned by 45° to a square.
//!
//! C. Cigolle and others, *A Survey of Efficient Representations for Independent Unit Vectors*, JCGT 3(2), 2014.

use alloc::{vec, vec::Vec};

use num_traits::Float;

/// Bins along each side of the square: some 2° each.
pub const RESOLUTION: u32 = 64;
/// All bins.
pub(super) const BINS: usize = (RESOLUTION * RESOLUTION) as usize;
/// Words of a bit per bin.
pub(super) const WORDS: usize = BINS / 64;

const N: f64 = RESOLUTION as f64;
/// What rounding may do to an angle.
const ROUNDING: f64 = 1e-9;

/// A cap of directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cap {
    /// Unit vector to its middle.
    pub axis: [f64; 3],
    /// Radians.
    pub radius: f64,
}

/// How many directions of a cap belong to a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Overlap {
    /// None, for certain.
    None,
    /// Perhaps some.
    Some,
    /// All, for certain.
    All,
}

/// Caps around squares of bins, of 8² squares, 16², … down to the bins.
pub struct Pyramid {
    levels: Vec<Vec<Cap>>,
}

/// Squares along each side at the top of a [`Pyramid`].
const TOP: u32 = 8;

impl Pyramid {
    /// Builds it.
    #[expect(clippy::new_without_default, reason = "it is not for nothing")]
    pub fn new() -> Self {
        let sides = core::iter::successors(Some(TOP), |side| Some(2 * side));
        let sides = sides.take_while(|side| *side <= RESOLUTION);
        let level = |side: u32| {
            (0..side * side)
                .map(|square| cap(square as usize, side))
                .collect()
        };
        Self {
            levels: sides.map(level).collect(),
        }
    }

    /// All bins whose cap has some directions in a set; of those that are `known` perhaps not.
    pub fn find(&self, known: &Directions, overlap: &impl Fn(&Cap) -> Overlap) -> Directions {
        let mut found = known.clone();
        for square in 0..self.levels[0].len() {
            self.descend(0, square, overlap, &mut found);
        }
        found.remove(known);
        found
    }

    fn descend(
        &self,
        level: usize,
        square: usize,
        overlap: &impl Fn(&Cap) -> Overlap,
        found: &mut Directions,
    ) {
        let side = (TOP as usize) << level;
        let (row, column) = (square / side, square % side);
        let width = RESOLUTION as usize / side;
        if found.has_square(row * width, column * width, width) {
            return;
        }
        match overlap(&self.levels[level][square]) {
            Overlap::None => {}
            Overlap::Some if level + 1 < self.levels.len() => {
                for (down, right) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    let square = (2 * row + down) * 2 * side + 2 * column + right;
                    self.descend(level + 1, square, overlap, found);
                }
            }
            _ => {
                for row in row * width..(row + 1) * width {
                    for column in column * width..(column + 1) * width {
                        found.add_bin(row * RESOLUTION as usize + column);
                    }
                }
            }
        }
    }
}

/// A set of bins of directions above the surface.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Directions {
    words: Vec<u64>,
}

impl Default for Directions {
    fn default() -> Self {
        Self::none()
    }
}

impl Directions {
    /// None.
    pub fn none() -> Self {
        Self {
            words: vec![0; WORDS],
        }
    }

    /// All that are above the surface.
    pub fn all() -> Self {
        Self {
            words: vec![u64::MAX; WORDS],
        }
    }

    pub(super) fn from_words(words: &[u64]) -> Self {
        Self {
            words: words.to_vec(),
        }
    }

    pub(super) fn words(&self) -> &[u64] {
        &self.words
    }

    /// Adds all bins that a cap reaches into, and perhaps some beside it: `axis` is a unit vector, `radius` in radians. The part of
    /// the cap below the horizon adds nothing.
    pub fn add_cap(&mut self, axis: [f64; 3], radius: f64) {
        let overlap = |cap: &Cap| {
            let chord = [0, 1, 2].map(|k| cap.axis[k] - axis[k]);
            let half = 0.5 * Float::sqrt(chord.iter().map(|x| x * x).sum::<f64>());
            let apart = 2.0 * Float::asin(half.min(1.0));
            if apart + cap.radius <= radius {
                Overlap::All
            } else if apart <= radius + cap.radius + ROUNDING {
                Overlap::Some
            } else {
                Overlap::None
            }
        };
        self.join(&Pyramid::new().find(self, &overlap));
    }

    /// Adds what `other` has.
    pub fn join(&mut self, other: &Self) {
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word |= other;
        }
    }

    /// Takes away what `other` has.
    fn remove(&mut self, other: &Self) {
        for (word, other) in self.words.iter_mut().zip(&other.words) {
            *word &= !other;
        }
    }

    /// Takes away what `other` has not.
    pub(super) fn keep(&mut self, other: &[u64]) {
        for (word, other) in self.words.iter_mut().zip(other) {
            *word &= other;
        }
    }

    /// Whether all bins of so many rows from one on and columns from one on are there. A row is a word.
    fn has_square(&self, row: usize, column: usize, width: usize) -> bool {
        let mask = ((1 << width) - 1) << column;
        let mut rows = self.words[row..row + width].iter();
        rows.all(|word| word & mask == mask)
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.words.iter().all(|word| *word == 0)
    }

    /// Their bins' numbers, ascending.
    pub fn bins(&self) -> impl Iterator<Item = usize> + '_ {
        self.words.iter().enumerate().flat_map(|(index, word)| {
            let mut left = *word;
            core::iter::from_fn(move || {
                let bit = left.trailing_zeros() as usize;
                left &= left.wrapping_sub(1);
                (bit < 64).then_some(64 * index + bit)
            })
        })
    }

    /// A cap around every bin, by its number.
    pub fn caps() -> Vec<Cap> {
        (0..BINS).map(|bin| cap(bin, RESOLUTION)).collect()
    }

    pub(super) fn add_bin(&mut self, bin: usize) {
        self.words[bin / 64] |= 1 << (bin % 64);
    }

    pub(super) fn has_bin(&self, bin: usize) -> bool {
        self.words[bin / 64] >> (bin % 64) & 1 == 1
    }
}

/// The bin of a direction above the surface.
pub(super) fn bin_of([x, y, z]: [f32; 3]) -> Option<usize> {
    let is_direction = z > 0.0 && x.is_finite() && y.is_finite() && z.is_finite();
    is_direction.then(|| {
        let [u, v] = to_square([x, y, z].map(f64::from));
        index_of(v) * RESOLUTION as usize + index_of(u)
    })
}

/// The place of a direction on the square ±1.
fn to_square([x, y, z]: [f64; 3]) -> [f64; 2] {
    let size = x.abs() + y.abs() + z;
    [(x + y) / size, (x - y) / size]
}

/// The direction at a place on the square.
fn from_square([u, v]: [f64; 2]) -> [f64; 3] {
    let (x, y) = (0.5 * (u + v), 0.5 * (u - v));
    let z = (1.0 - x.abs() - y.abs()).max(0.0);
    let length = Float::sqrt(x * x + y * y + z * z);
    [x / length, y / length, z / length]
}

/// The row or column at a coordinate of the square.
fn index_of(place: f64) -> usize {
    (0.5 * (place + 1.0) * N).clamp(0.0, N - 1.0) as usize
}

/// A place in one of `side`² squares.
fn corner(square: usize, side: u32, [right, down]: [f64; 2]) -> [f64; 3] {
    let place = |index: usize, part: f64| 2.0 * (index as f64 + part) / f64::from(side) - 1.0;
    let side = side as usize;
    from_square([place(square % side, right), place(square / side, down)])
}

/// The smallest cap around the centre of one of `side`² squares. Its edges are arcs of great circles, so that no point is farther
/// than a corner.
fn cap(square: usize, side: u32) -> Cap {
    let axis = corner(square, side, [0.5, 0.5]);
    let farthest = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]]
        .map(|part| {
            let corner = corner(square, side, part);
            let chord = [0, 1, 2].map(|k| corner[k] - axis[k]);
            Float::sqrt(chord.iter().map(|x| x * x).sum::<f64>())
        })
        .into_iter()
        .fold(0.0, f64::max);
    Cap {
        axis,
        radius: 2.0 * Float::asin(0.5 * farthest),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    /// The largest bins are those in the middles of octants, with half diagonals of √6 / N.
    const LARGEST: f64 = 2.45 / N;

    /// Directions spread over the sphere.
    fn directions(count: u32) -> Vec<[f64; 3]> {
        (0..count)
            .map(|k| {
                let z = 2.0 * (f64::from(k) + 0.5) / f64::from(count) - 1.0;
                let (sin, cos) = (2.399_963 * f64::from(k)).sin_cos();
                let r = (1.0 - z * z).sqrt();
                [r * cos, r * sin, z]
            })
            .collect()
    }

    fn angle(a: [f64; 3], b: [f64; 3]) -> f64 {
        let chord = [0, 1, 2].map(|k| a[k] - b[k]);
        2.0 * (0.5 * chord.iter().map(|x| x * x).sum::<f64>().sqrt()).asin()
    }

    #[test]
    fn bins_lie_in_their_caps() {
        let caps = Directions::caps();
        assert!(caps.iter().all(|cap| cap.radius <= LARGEST));
        for w in directions(200_000).into_iter().filter(|w| w[2] > 0.0) {
            let bin = bin_of(w.map(|x| x as f32)).unwrap();
            assert!(angle(w, caps[bin].axis) <= caps[bin].radius + 1e-6, "{w:?}");
        }
    }

    #[test]
    fn a_cap_adds_every_bin_that_it_reaches() {
        let all = directions(20_000);
        for (axis, radius) in directions(60).into_iter().zip(
            [1e-6, 0.01, 0.05, 0.2, 0.7, 1.5, 1.7, 3.2]
                .into_iter()
                .cycle(),
        ) {
            let mut found = Directions::none();
            found.add_cap(axis, radius);
            for w in all
                .iter()
                .filter(|w| w[2] > 1e-6 && angle(**w, axis) <= radius)
            {
                let bin = bin_of(w.map(|x| x as f32)).unwrap();
                assert!(found.has_bin(bin), "{axis:?} {radius} {w:?}");
            }
            // And little more.
            let beside = found
                .bins()
                .map(|bin| cap(bin, RESOLUTION).axis)
                .filter(|w| angle(*w, axis) > radius + 2.0 * LARGEST);
            assert_eq!(beside.count(), 0);
        }
    }
}
