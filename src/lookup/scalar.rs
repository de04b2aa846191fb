//! One pair of directions at a time.

use alloc::vec::Vec;

use super::Quantity;
use super::block::Block;
use super::pair::Pair;
use crate::brdf::Components;
use crate::math::simd::{Kernel, Level, Row, Single, Vector};
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
        self.at(Level::detect(), albedos, Quantity::Brdf, wi, wr)
    }

    /// ρ with other albedos, linear RGB, one per thread in the order of [`Table::threads`]; where `albedos` ends, the
    /// fabric's own go on.
    pub fn eval_cos_with(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        self.at(Level::detect(), albedos, Quantity::Rho, wi, wr)
    }

    /// A value, and whether it was not baked, by parts of all threads side by side, if they are all that there is.
    fn by_parts(
        &self,
        level: Level,
        albedos: &[[f32; 3]],
        quantity: Quantity,
        wi: [f32; 3],
        wr: [f32; 3],
    ) -> Option<([f32; 3], bool)> {
        let parts = self.parts.as_ref()?;
        Some(level.run_single(Pair {
            table: self,
            parts,
            albedos,
            quantity,
            wi,
            wr,
        }))
    }

    pub(super) fn at(
        &self,
        level: Level,
        albedos: &[[f32; 3]],
        quantity: Quantity,
        wi: [f32; 3],
        wr: [f32; 3],
    ) -> [f32; 3] {
        if let Some((value, is_missing)) = self.by_parts(level, albedos, quantity, wi, wr) {
            if is_missing {
                self.misses.add(1);
            }
            return value;
        }
        level.run_single(One {
            level,
            table: self,
            albedos,
            wi,
            wr,
            of: |block: &Block<1, 1>| {
                self.count_missing(block.missing::<Single>(0));
                block.value::<Single>(self, quantity, 0).map(|x| x.0)
            },
            see: |_: &Block<1, 1>| {},
        })
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
        let is_missing = || {
            let level = Level::detect();
            if let Some((_, is_missing)) = self.by_parts(level, albedos, Quantity::Rho, wi, wr) {
                return is_missing;
            }
            level.run_single(One {
                level,
                table: self,
                albedos,
                wi,
                wr,
                of: |block: &Block<1, 1>| block.missing::<Single>(0).0 > 0.0,
                see: |_: &Block<1, 1>| {},
            })
        };
        !self.is_partial || !is_missing()
    }

    /// S, V and the projection of every thread, Q, and ρ with the fabric's own albedo.
    pub fn components(&self, wi: [f32; 3], wr: [f32; 3]) -> Components<f32> {
        let mut threads = Vec::with_capacity(self.threads.len());
        let level = Level::detect();
        let (rho, q) = level.run_single(One {
            level,
            table: self,
            albedos: &[],
            wi,
            wr,
            of: |block: &Block<1, 1>| {
                self.count_missing(block.missing::<Single>(0));
                block.rho::<Single>(self, 0)
            },
            see: |block: &Block<1, 1>| threads.push(block.part::<Single>(0).map(|x| x.0)),
        });
        Components {
            threads,
            q: q.0,
            rho: rho.map(|x| x.0),
        }
    }
}

/// A table at one pair.
struct One<'a, F, S> {
    level: Level,
    table: &'a Table,
    albedos: &'a [[f32; 3]],
    wi: [f32; 3],
    wr: [f32; 3],
    of: F,
    see: S,
}

impl<T, F: Fn(&Block<1, 1>) -> T, S: FnMut(&Block<1, 1>)> Kernel for One<'_, F, S> {
    type Output = T;

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) -> T {
        let mut block = Block::new();
        let (wi, wr) = (self.wi.each_ref(), self.wr.each_ref());
        let slice = core::slice::from_ref;
        block.load(self.table, wi.map(slice), wr.map(slice));
        block.weave::<Single, R>(self.level, self.table, self.albedos, self.see);
        (self.of)(&block)
    }
}
