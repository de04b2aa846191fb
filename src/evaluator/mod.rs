//! Ways to evaluate a fabric: by a table, by direct integration, by another model.
//!
//! A [`Spec`] is the name of a way, an [`Evaluator`] is a fabric that is ready to be evaluated in that way, and a [`Cloth`] is one
//! fabric everywhere or a pattern of several.

mod cloth;
mod spec;

pub use cloth::Cloth;
pub use spec::{Spec, SpecError};

use std::sync::Arc;

use crate::brdf::Components;
use crate::fabric::Fabric;
use crate::lookup::Quantity;
use crate::math::simd::{Colours, Directions, Level};
use crate::math::{Real, Vec3};
use crate::model::{Model, ModelKind, Rule, Sadeghi, SpineError, irawan_of};
use crate::table::Table;

/// A fabric that is ready to be evaluated, in single precision or in double. (Tables are single whatever is asked.)
#[derive(Clone)]
pub struct Evaluator<R: Real = f32> {
    way: Way<R>,
    pace: Pace,
}

#[derive(Clone)]
enum Way<R> {
    Table {
        table: Arc<Table>,
        albedos: Vec<[f32; 3]>,
        missing: Missing,
    },
    Rule(Arc<Sadeghi<R>>),
    Model(Arc<dyn Model<R> + Send>),
}

/// What is seen where a table was not baked for a pair.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Missing {
    /// The nearest value, as lookups have it.
    #[default]
    Nearest,
    /// [`MISSING`].
    Magenta,
}

/// ρ that shows what a table lacks.
pub const MISSING: [f32; 3] = [1.0, 0.0, 1.0];

/// How [`Evaluator::eval_cos_batch`] takes its pairs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Pace {
    /// Many at once, where that is known how.
    #[default]
    Batch,
    /// One after the other, by the same instructions.
    Single,
    /// One after the other, by the formulas as they are written.
    Plain,
}

impl<R: Real> Evaluator<R> {
    fn new(way: Way<R>) -> Self {
        Self {
            way,
            pace: Pace::default(),
        }
    }

    /// A table, and the albedos to use it with, as [`Table::eval_cos_with`] takes them: none are the table's own.
    pub fn table(table: impl Into<Arc<Table>>, albedos: Vec<[f32; 3]>, missing: Missing) -> Self {
        Self::new(Way::Table {
            table: table.into(),
            albedos,
            missing,
        })
    }

    /// Direct integration of the microcylinder model.
    pub fn rule(fabric: &Fabric, rule: Rule) -> Self {
        Sadeghi::new(fabric, rule).into()
    }

    /// Another model with the parameters of the fabric's file; `None` where it has none. Irawan's are translated from the threads then.
    ///
    /// # Errors
    /// When a yarn of Irawan's has no spine, which files are checked for.
    pub fn model(fabric: &Fabric, kind: ModelKind) -> Result<Option<Self>, SpineError> {
        let mut models = fabric.models.clone();
        if kind == ModelKind::Irawan && models.irawan.is_none() {
            models.irawan = Some(irawan_of(fabric));
        }
        Ok(kind.prepare(&models)?.map(Self::from))
    }

    /// The same, with batches at another pace.
    pub fn at_pace(self, pace: Pace) -> Self {
        Self { pace, ..self }
    }

    /// ρ = BRDF × cosine \[1/sr\], linear RGB.
    pub fn eval_cos(&self, wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        match &self.way {
            Way::Table { albedos, .. } => self.eval_cos_with(albedos, wi, wr),
            _ => self.eval_cos_with(&[], wi, wr),
        }
    }

    /// ρ with other albedos, as [`Table::eval_cos_with`] takes them. Another model has its own whatever is asked.
    pub fn eval_cos_with(&self, albedos: &[[f32; 3]], wi: Vec3<R>, wr: Vec3<R>) -> Vec3<R> {
        match &self.way {
            Way::Table { table, missing, .. } => {
                let (wi, wr) = (single(wi), single(wr));
                let rho = table.eval_cos_with(albedos, wi, wr);
                let is_shown = *missing == Missing::Nearest || table.is_baked(wi, wr);
                let rho = if is_shown { rho } else { MISSING };
                rho.map(|x| R::of(x.into()))
            }
            Way::Rule(model) if albedos.is_empty() => model.eval_cos(wi, wr),
            Way::Rule(model) => model.eval_cos_with(&cast(albedos), wi, wr),
            Way::Model(model) => model.eval_cos(wi, wr),
        }
    }

    /// S, V and the projection of every visible thread, Q, and ρ with the fabric's own albedos; `None` of another model.
    pub fn components(&self, wi: Vec3<R>, wr: Vec3<R>) -> Option<Components<R>> {
        match &self.way {
            Way::Table { table, .. } => Some(table.components(single(wi), single(wr)).cast()),
            Way::Rule(model) => Some(model.components(wi, wr)),
            Way::Model(_) => None,
        }
    }

    /// The table that is looked up, if any.
    pub fn looked_up(&self) -> Option<&Table> {
        match &self.way {
            Way::Table { table, .. } => Some(table),
            _ => None,
        }
    }
}

impl<R: Real> From<Sadeghi<R>> for Evaluator<R> {
    fn from(model: Sadeghi<R>) -> Self {
        Self::new(Way::Rule(Arc::new(model)))
    }
}

impl<R: Real> From<Box<dyn Model<R> + Send>> for Evaluator<R> {
    fn from(model: Box<dyn Model<R> + Send>) -> Self {
        Self::new(Way::Model(model.into()))
    }
}

impl Evaluator<f32> {
    /// ρ of every pair.
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn eval_cos_batch(&self, wi: Directions<'_>, wr: Directions<'_>, rho: Colours<'_>) {
        match &self.way {
            Way::Table { albedos, .. } => self.eval_cos_batch_with(albedos, wi, wr, rho),
            _ => self.eval_cos_batch_with(&[], wi, wr, rho),
        }
    }

    /// ρ of every pair with other albedos, as [`Evaluator::eval_cos_with`] takes them.
    ///
    /// # Panics
    /// When the slices are not all of one length.
    pub fn eval_cos_batch_with(
        &self,
        albedos: &[[f32; 3]],
        wi: Directions<'_>,
        wr: Directions<'_>,
        rho: Colours<'_>,
    ) {
        let count = wi[0].len();
        let is_whole = |slices: Directions<'_>| slices.iter().all(|slice| slice.len() == count);
        let of_rho = rho.each_ref().map(|slice| slice.len());
        assert!(
            is_whole(wi) && is_whole(wr) && of_rho == [count; 3],
            "slices differ in length"
        );
        // The loops are within the arms, so that what is called is known in them.
        match (&self.way, self.pace) {
            (Way::Table { table, missing, .. }, pace) => {
                let [r, g, b] = rho;
                let found = [&mut *r, &mut *g, &mut *b];
                if pace == Pace::Batch {
                    table.eval_batch_at(Level::detect(), albedos, Quantity::Rho, wi, wr, found);
                } else {
                    one_by_one(wi, wr, found, |wi, wr| table.eval_cos_with(albedos, wi, wr));
                }
                if *missing == Missing::Magenta {
                    for (index, ((r, g), b)) in r.iter_mut().zip(g).zip(b).enumerate() {
                        let [wi, wr] = [wi, wr].map(|w| w.map(|w| w[index]));
                        if !table.is_baked(wi, wr) {
                            [*r, *g, *b] = MISSING;
                        }
                    }
                }
            }
            (Way::Rule(model), Pace::Batch) if albedos.is_empty() => {
                model.eval_cos_batch(wi, wr, rho);
            }
            (Way::Rule(model), Pace::Single) if albedos.is_empty() => {
                one_by_one(wi, wr, rho, |wi, wr| model.eval_cos_fast(wi, wr));
            }
            (Way::Rule(model), _) => {
                one_by_one(wi, wr, rho, |wi, wr| model.eval_cos_with(albedos, wi, wr));
            }
            (Way::Model(model), _) => one_by_one(wi, wr, rho, |wi, wr| model.eval_cos(wi, wr)),
        }
    }
}

fn one_by_one(
    wi: Directions<'_>,
    wr: Directions<'_>,
    [r, g, b]: Colours<'_>,
    eval_cos: impl Fn([f32; 3], [f32; 3]) -> [f32; 3],
) {
    for (index, ((r, g), b)) in r.iter_mut().zip(g).zip(b).enumerate() {
        [*r, *g, *b] = eval_cos(wi.map(|w| w[index]), wr.map(|w| w[index]));
    }
}

fn single<R: Real>(w: Vec3<R>) -> [f32; 3] {
    w.map(|x| x.to_double() as f32)
}

fn cast<R: Real>(albedos: &[[f32; 3]]) -> Vec<[R; 3]> {
    let cast = |albedo: &[f32; 3]| albedo.map(|x| R::of(x.into()));
    albedos.iter().map(cast).collect()
}
