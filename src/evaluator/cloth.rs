//! One fabric everywhere, or a pattern of several.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Evaluator, Missing};
use crate::math::simd::{Colours, Directions};
use crate::math::{Real, Vec3};
use crate::model::{Model, Sadeghi};
use crate::pattern::Pattern;
use crate::table::Table;

/// A cloth and a way to evaluate it.
#[derive(Clone)]
pub struct Cloth<R: Real = f32> {
    pattern: Option<Arc<Pattern>>,
    /// The one, or one for each of [`Pattern::bakes`], which the pattern dyes.
    evaluators: Arc<[Evaluator<R>]>,
}

impl<R: Real> Cloth<R> {
    /// A pattern, with an evaluator for each of [`Pattern::bakes`].
    pub fn pattern(pattern: Arc<Pattern>, evaluators: Vec<Evaluator<R>>) -> Self {
        Self {
            pattern: Some(pattern),
            evaluators: evaluators.into(),
        }
    }

    /// Whether it differs from place to place.
    pub fn is_pattern(&self) -> bool {
        self.pattern.is_some()
    }

    /// The evaluator of what is the same everywhere, or those of a pattern's fabrics.
    pub fn evaluators(&self) -> &[Evaluator<R>] {
        &self.evaluators
    }

    /// How far it is until the cloth repeats, in the unit of its u and v; `None` if it is the same everywhere.
    pub fn period(&self) -> Option<f64> {
        self.pattern.as_ref().and_then(|pattern| pattern.period())
    }

    /// Whether tables are looked up.
    pub fn has_tables(&self) -> bool {
        self.tables().next().is_some()
    }

    /// How many pairs tables were asked for and not baked for.
    pub fn misses(&self) -> usize {
        self.tables().map(Table::misses).sum()
    }

    fn tables(&self) -> impl Iterator<Item = &Table> {
        self.evaluators.iter().filter_map(Evaluator::looked_up)
    }

    /// ρ at (u, v) \[1/sr\], linear RGB.
    pub fn eval_cos(&self, [u, v]: [f64; 2], wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        match &self.pattern {
            None => self.evaluators[0].eval_cos(wi, wr),
            Some(pattern) => {
                let place = pattern.at(u, v);
                self.evaluators[place.material.bake].eval_cos_with(&place.albedos, wi, wr)
            }
        }
    }
}

impl<R: Real> From<Evaluator<R>> for Cloth<R> {
    fn from(evaluator: Evaluator<R>) -> Self {
        Self {
            pattern: None,
            evaluators: [evaluator].into(),
        }
    }
}

impl Cloth {
    /// A table: see [`Evaluator::table`].
    pub fn table(table: impl Into<Arc<Table>>, albedos: Vec<[f32; 3]>, missing: Missing) -> Self {
        Evaluator::table(table, albedos, missing).into()
    }

    /// The microcylinder model by direct integration.
    pub fn direct(model: Sadeghi<f32>) -> Self {
        Evaluator::from(model).into()
    }

    /// Any other model.
    pub fn other(model: Box<dyn Model<f32> + Send>) -> Self {
        Evaluator::from(model).into()
    }

    /// ρ of every pair, each at its (u, v); of what is the same everywhere `places` are ignored.
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn eval_cos_batch(
        &self,
        places: &[[f64; 2]],
        wi: Directions<'_>,
        wr: Directions<'_>,
        mut rho: Colours<'_>,
    ) {
        let Some(pattern) = &self.pattern else {
            return self.evaluators[0].eval_cos_batch(wi, wr, rho);
        };
        // Pairs that differ in nothing but directions, at once.
        let mut alike: BTreeMap<(usize, Vec<[u32; 3]>), Vec<usize>> = BTreeMap::new();
        for (index, [u, v]) in places.iter().enumerate() {
            let place = pattern.at(*u, *v);
            let bits = |albedo: &[f32; 3]| albedo.map(f32::to_bits);
            let albedos = place.albedos.iter().map(bits).collect();
            let key = (place.material.bake, albedos);
            alike.entry(key).or_default().push(index);
        }
        for ((bake, bits), indices) in alike {
            let albedos: Vec<[f32; 3]> = bits.iter().map(|bits| bits.map(f32::from_bits)).collect();
            let some = |all: &[f32]| indices.iter().map(|index| all[*index]).collect();
            let [wi, wr]: [[Vec<f32>; 3]; 2] = [wi, wr].map(|w| w.map(some));
            let mut found = [(); 3].map(|()| vec![0.0; indices.len()]);
            self.evaluators[bake].eval_cos_batch_with(
                &albedos,
                wi.each_ref().map(Vec::as_slice),
                wr.each_ref().map(Vec::as_slice),
                found.each_mut().map(Vec::as_mut_slice),
            );
            for (rho, found) in rho.iter_mut().zip(&found) {
                for (index, value) in indices.iter().zip(found) {
                    rho[*index] = *value;
                }
            }
        }
    }
}
