//! One pair of directions at a time.

use alloc::vec::Vec;

use super::Quantity;
use super::batch::Lookup;
use super::kernel::{self, Woven};
use crate::brdf::Components;
use crate::math::simd::{Kernel, Level, Row, Vector, at_pair};
use crate::math::{each, splat};
use crate::table::Table;

/// Evaluation never fails, allocates (but for [`Table::components`]) or panics, and is never negative or NaN: directions that are not above the surface,
/// and those that are no numbers, give zero. Directions are unit vectors in the surface frame (x warp, y weft, z
/// normal); `wi` points to the light and `wr` to the viewer.
impl Table {
    /// The BRDF \[1/sr\], linear RGB, with the fabric's own albedo.
    pub fn eval(&self, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.eval_with(&[], wi, wr)
    }

    /// ρ = BRDF × cosine \[1/sr\], linear RGB, with the fabric's own albedo.
    pub fn eval_cos(&self, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.eval_cos_with(&[], wi, wr)
    }

    /// The BRDF with other albedos: see [`Table::eval_cos_with`].
    pub fn eval_with(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.at(albedos, Quantity::Brdf, wi, wr)
    }

    /// ρ with other albedos, linear RGB, one per thread in the order of [`Table::threads`]; where `albedos` ends, the
    /// fabric's own go on.
    pub fn eval_cos_with(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.at(albedos, Quantity::Rho, wi, wr)
    }

    fn at(&self, albedos: &[[f32; 3]], quantity: Quantity, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        let lookup = Lookup {
            table: self,
            albedos,
            quantity,
            asks: false,
        };
        at_pair(&lookup, wi, wr)
    }

    /// Whether the table was baked for the pair. What is not baked is looked up as well, as the nearest that is, and counted
    /// ([`Table::misses`]); this asks and does not count. Pairs that are not above the surface need nothing.
    pub fn is_baked(&self, wi: [f32; 3], wr: [f32; 3]) -> bool {
        self.has(&[], wi, wr)
    }

    /// ρ with other albedos ([`Table::eval_cos_with`]), or `None` where that would count as a miss: for who would rather fail than see
    /// the nearest value.
    pub fn strict_eval_cos_with(
        &self,
        albedos: &[[f32; 3]],
        wi: [f32; 3],
        wr: [f32; 3],
    ) -> Option<[f32; 3]> {
        self.has(albedos, wi, wr)
            .then(|| self.eval_cos_with(albedos, wi, wr))
    }

    fn has(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> bool {
        let lookup = Lookup {
            table: self,
            albedos,
            quantity: Quantity::Rho,
            asks: true,
        };
        !self.is_partial || at_pair(&lookup, wi, wr)[0] == 0.0
    }

    /// S, V and the projection of every thread, Q, and ρ with the fabric's own albedo.
    pub fn components(&self, wi: [f32; 3], wr: [f32; 3]) -> Components<f32> {
        Level::detect().run_single(All {
            table: self,
            wi,
            wr,
        })
    }
}

/// A table's components of one pair.
struct All<'a> {
    table: &'a Table,
    wi: [f32; 3],
    wr: [f32; 3],
}

impl Kernel for All<'_> {
    type Output = Components<f32>;

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) -> Components<f32> {
        let lane = |x: V| x.to_array().as_ref()[0];
        let mut threads = Vec::with_capacity(self.table.threads.len());
        let (wi, wr) = (
            each(self.wi, splat::<f32, V>),
            each(self.wr, splat::<f32, V>),
        );
        let Woven { weave, missing } = kernel::weave::<V, R>(self.table, &[], wi, wr, |thread| {
            threads.push(thread.map(lane));
        });
        self.table.count_missing(missing);
        Components {
            threads,
            q: lane(weave.q),
            rho: weave.rho().map(lane),
        }
    }
}
