//! Many pairs of directions at a time.

use super::block::Block;
use crate::math::each;
use crate::math::simd::{Colours, Directions, Kernel, Level, Row, Vector};
use crate::table::Table;

/// Evaluation of many pairs: structures of arrays, with the widest vector instructions of the machine. A result differs from
/// that for one pair by no more than rounding; batches of one or two pairs are as single pairs are. It does not depend on its neighbours.
impl Table {
    /// The BRDF \[1/sr\] of every pair, with the fabric's own albedo; see [`Table::eval`].
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn eval_batch(&self, wi: Directions<'_>, wr: Directions<'_>, brdf: Colours<'_>) {
        self.eval_batch_at(Level::detect(), &[], Quantity::Brdf, wi, wr, brdf);
    }

    /// ρ = BRDF × cosine \[1/sr\] of every pair, with the fabric's own albedo; see [`Table::eval_cos`].
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn eval_cos_batch(&self, wi: Directions<'_>, wr: Directions<'_>, rho: Colours<'_>) {
        self.eval_batch_at(Level::detect(), &[], Quantity::Rho, wi, wr, rho);
    }

    /// With other `albedos`, as [`Table::eval_cos_with`], and a chosen instruction set; one that the machine does not have
    /// counts as [`Level::Portable`].
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn eval_batch_at(
        &self,
        level: Level,
        albedos: &[[f32; 3]],
        quantity: Quantity,
        wi: Directions<'_>,
        wr: Directions<'_>,
        mut values: Colours<'_>,
    ) {
        let pairs = wi[0].len();
        let inputs = wi.iter().chain(&wr).all(|slice| slice.len() == pairs);
        assert!(
            inputs && values.iter().all(|slice| slice.len() == pairs),
            "slices of directions and values must be of one length"
        );
        // So few are not worth a vector of pairs.
        if pairs <= ALONE {
            for pair in 0..pairs {
                let [wi, wr] = [wi, wr].map(|w| w.map(|w| w[pair]));
                let value = self.at(level, albedos, quantity, wi, wr);
                for (to, value) in values.each_mut().into_iter().zip(value) {
                    to[pair] = value;
                }
            }
            return;
        }
        level.run(Batch {
            level,
            table: self,
            albedos,
            quantity,
            wi,
            wr,
            values,
        });
    }
}

impl Table {
    /// Counts the lanes that are above 0.
    #[inline(always)]
    pub(super) fn count_missing<V: Vector>(&self, missing: V) {
        if self.is_partial {
            let missing = missing.to_array();
            let count = missing.as_ref().iter().filter(|x| **x > 0.0).count();
            if count > 0 {
                self.misses.add(count);
            }
        }
    }
}

/// What a batch is evaluated to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Quantity {
    /// The BRDF.
    Brdf,
    /// ρ = BRDF × cosine.
    Rho,
}

/// What is asked of a table.
struct Batch<'a> {
    level: Level,
    table: &'a Table,
    albedos: &'a [[f32; 3]],
    quantity: Quantity,
    wi: Directions<'a>,
    wr: Directions<'a>,
    values: Colours<'a>,
}

impl Kernel for Batch<'_> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) {
        // A large block has more to prepare than a few pairs are worth.
        if self.wi[0].len() <= FEW {
            self.in_blocks::<V, R, FEW, FEW>();
        } else {
            self.in_blocks::<V, R, BLOCK, STEP>();
        }
    }
}

/// Pairs of a block: so many that those near the horizon fill vectors, and so few that all that is known of them stays in the first cache …
const BLOCK: usize = 256;
/// … as the places of so many in a grid do beside it.
const STEP: usize = 64;
/// So many pairs are evaluated one by one.
const ALONE: usize = 2;
/// Pairs of a block for few.
const FEW: usize = 16;

impl Batch<'_> {
    #[inline(always)]
    fn in_blocks<V: Vector, R: Row, const N: usize, const S: usize>(mut self) {
        let mut block = Block::<N, S>::new();
        let pairs = self.wi[0].len();
        let mut from = 0;
        while from < pairs {
            block.load(
                self.table,
                each(
                    self.wi,
                    #[inline(always)]
                    |w| &w[from..],
                ),
                each(
                    self.wr,
                    #[inline(always)]
                    |w| &w[from..],
                ),
            );
            block.weave::<V, R>(
                self.level,
                self.table,
                self.albedos,
                #[inline(always)]
                |_| {},
            );
            let mut at = 0;
            while at < block.pairs {
                self.table.count_missing(block.missing::<V>(at));
                let value = block.value::<V>(self.table, self.quantity, at);
                let count = V::LANES.min(block.pairs - at);
                for (to, value) in self.values.iter_mut().zip(value) {
                    let to = &mut to[from + at..][..count];
                    if count == V::LANES {
                        value.store(to);
                    } else {
                        to.copy_from_slice(&value.to_array().as_ref()[..count]);
                    }
                }
                at += V::LANES;
            }
            from += N;
        }
    }
}
