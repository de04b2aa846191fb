//! Which pairs of directions a cloth is asked for: what a table can be baked for, to leave out the rest.
//!
//! [`Needs`] are bits, one for every pair of bins of the hemisphere. They are added from whatever is known: from caps of directions,
//! as an analysis of a scene finds them, or one by one, as an engine records them while it draws. They know nothing of fabrics,
//! threads and charts. Light from the viewer's own direction, as of a lamp on a camera, is kept apart: it needs two of four dimensions.

mod bins;
mod format;

pub use bins::{Cap, Directions, Overlap, Pyramid, RESOLUTION};
pub use format::{MAX_NEEDS_BYTES, NeedsError};

use alloc::{vec, vec::Vec};

use bins::{BINS, WORDS, bin_of};

/// Pairs of directions in the surface frame, x along the warp, y along the weft, z the normal; `wi` to the light, `wr` to the
/// viewer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Needs {
    /// By bin of wi a bit for every bin of wr.
    pairs: Vec<u64>,
    /// Bins of directions that are wi and wr at once.
    collocated: Directions,
}

impl Needs {
    /// Nothing.
    pub fn none() -> Self {
        Self {
            pairs: vec![0; BINS * WORDS],
            collocated: Directions::none(),
        }
    }

    /// Every pair.
    pub fn everything() -> Self {
        Self {
            pairs: vec![u64::MAX; BINS * WORDS],
            collocated: Directions::all(),
        }
    }

    /// Adds a pair that was asked for; nothing if a direction is not above the surface. Wherever wi = wr to the last bit, only pairs
    /// of equal directions are needed.
    pub fn add_pair(&mut self, wi: [f32; 3], wr: [f32; 3]) {
        if let (Some(light), Some(viewer)) = (bin_of(wi), bin_of(wr)) {
            if wi == wr {
                self.collocated.add_bin(light);
            } else {
                self.pairs[light * WORDS + viewer / 64] |= 1 << (viewer % 64);
            }
        }
    }

    /// Adds every pair of a light and a viewer.
    pub fn add(&mut self, lights: &Directions, viewers: &Directions) {
        for light in lights.bins() {
            let row = &mut self.pairs[light * WORDS..][..WORDS];
            for (word, viewers) in row.iter_mut().zip(viewers.words()) {
                *word |= viewers;
            }
        }
    }

    /// The viewers that every one of some lights goes with, and that one at the viewer goes with if `is_collocated`; all viewers of no
    /// light.
    pub fn viewers_of_all(&self, lights: &Directions, is_collocated: bool) -> Directions {
        let mut viewers = if is_collocated {
            self.collocated.clone()
        } else {
            Directions::all()
        };
        for light in lights.bins() {
            viewers.keep(&self.pairs[light * WORDS..][..WORDS]);
        }
        viewers
    }

    /// Adds pairs wi = wr of these directions.
    pub fn add_collocated(&mut self, directions: &Directions) {
        self.collocated.join(directions);
    }

    /// Adds what `other` has.
    pub fn join(&mut self, other: &Self) {
        for (word, other) in self.pairs.iter_mut().zip(&other.pairs) {
            *word |= other;
        }
        self.collocated.join(&other.collocated);
    }

    /// Whether the pair was added, or one in the same bins.
    pub fn contains(&self, wi: [f32; 3], wr: [f32; 3]) -> bool {
        let (Some(light), Some(viewer)) = (bin_of(wi), bin_of(wr)) else {
            return false;
        };
        let is_pair = self.pairs[light * WORDS + viewer / 64] >> (viewer % 64) & 1 == 1;
        is_pair || wi == wr && self.collocated.has_bin(light)
    }

    /// Whether nothing is needed.
    pub fn is_empty(&self) -> bool {
        self.has_no_pairs() && self.collocated.is_empty()
    }

    /// Whether there are no pairs but those with wi = wr.
    pub fn has_no_pairs(&self) -> bool {
        self.pairs.iter().all(|word| *word == 0)
    }

    /// The share of all pairs of bins, 0 to 1; those with wi = wr do not count.
    pub fn share(&self) -> f64 {
        let count: u64 = self
            .pairs
            .iter()
            .map(|word| u64::from(word.count_ones()))
            .sum();
        count as f64 / (BINS * BINS) as f64
    }

    /// The viewers that go with a light in that bin.
    pub fn viewers(&self, light: usize) -> Directions {
        Directions::from_words(&self.pairs[light * WORDS..][..WORDS])
    }

    /// Directions that are wi and wr at once.
    pub fn collocated(&self) -> &Directions {
        &self.collocated
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_found_again_and_others_are_not() {
        let mut needs = Needs::none();
        assert!(needs.is_empty());
        let (wi, wr) = ([0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]);
        needs.add_pair(wi, wr);
        needs.add_pair([0.0, 0.6, 0.8], [0.0, 0.6, 0.8]);
        for below in [[0.0, 0.0, -1.0], [f32::NAN; 3], [1.0, 0.0, 0.0], [0.0; 3]] {
            needs.add_pair(wi, below);
            assert!(!needs.contains(below, wr));
        }
        assert!(needs.contains(wi, wr) && !needs.contains(wr, wi));
        assert!(needs.contains([0.0, 0.6, 0.8], [0.0, 0.6, 0.8]));
        assert!(!needs.contains([0.0, 0.6, 0.8], [0.0, 0.600_001, 0.799_999_2]));
        assert!((needs.share() * (BINS * BINS) as f64 - 1.0).abs() < 1e-9);
        let mut more = Needs::none();
        more.join(&needs);
        assert_eq!(more, needs);
        assert!(Needs::everything().contains(wr, wi));
    }
}
