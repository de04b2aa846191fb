//! Many pairs of directions at a time.

use super::kernel::{self, Woven};
use crate::brdf::without_cosine;
use crate::math::Vec3;
use crate::math::simd::{Colours, Directions, Level, PairFunction, Row, Vector, map_pairs};
use crate::table::Table;

/// Evaluation of many pairs: structures of arrays, with the widest vector instructions of the machine. A result differs from
/// that for one pair by no more than rounding, and does not depend on its neighbours.
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
        values: Colours<'_>,
    ) {
        let function = Lookup {
            table: self,
            albedos,
            quantity,
            asks: false,
        };
        map_pairs(level, &function, wi, wr, values);
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

/// A table as a function of directions.
pub(super) struct Lookup<'a> {
    pub(super) table: &'a Table,
    pub(super) albedos: &'a [[f32; 3]],
    pub(super) quantity: Quantity,
    /// Whether what is wanted is not the quantity, but whether it is missing: above 0.
    pub(super) asks: bool,
}

impl PairFunction for Lookup<'_> {
    #[inline(always)]
    fn at<V: Vector, R: Row>(&self, wi: Vec3<V>, wr: Vec3<V>) -> Vec3<V> {
        let Woven { weave, missing } =
            kernel::weave::<V, R>(self.table, self.albedos, wi, wr, |_| {});
        if self.asks {
            return [missing; 3];
        }
        self.table.count_missing(missing);
        let rho = weave.rho();
        match self.quantity {
            Quantity::Brdf => without_cosine(rho, wi[2]),
            Quantity::Rho => rho,
        }
    }
}
