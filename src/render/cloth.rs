//! What is wrapped around: ρ at many points of a surface.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Light, Place, radiance};
use crate::lookup::Quantity;
use crate::math::simd::Level;
use crate::model::{Model, Sadeghi};
use crate::pattern::Pattern;
use crate::table::Table;

/// ρ of pairs: wi, wr, and where r, g and b go, all of the same length.
pub type Evaluate = dyn Fn([&[f32]; 3], [&[f32]; 3], [&mut [f32]; 3]) + Send + Sync;

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

/// A cloth and a way to evaluate it.
#[derive(Clone)]
pub enum Cloth {
    /// The same everywhere.
    Even(Arc<Evaluate>),
    /// A pattern, and a swatch for each of [`Pattern::bakes`].
    Pattern(Arc<Pattern>, Arc<[Swatch]>),
}

/// A fabric of a pattern, which dyes it.
pub enum Swatch {
    /// A table.
    Table(Arc<Table>, Missing),
    /// The microcylinder model by direct integration.
    Direct(Box<Sadeghi<f32>>),
}

impl Cloth {
    /// A table, and the albedos to use it with, as [`Table::eval_cos_with`] takes them: none are the table's own.
    pub fn table(table: impl Into<Arc<Table>>, albedos: Vec<[f32; 3]>, missing: Missing) -> Self {
        let table = table.into();
        Self::Even(Arc::new(move |wi, wr, rho| {
            lookup(&table, missing, &albedos, wi, wr, rho);
        }))
    }

    /// The microcylinder model by direct integration.
    pub fn direct(model: Sadeghi<f32>) -> Self {
        Self::Even(Arc::new(move |wi, wr, rho| {
            model.eval_cos_batch(wi, wr, rho);
        }))
    }

    /// Any other model.
    pub fn other(model: Box<dyn Model<f32> + Send>) -> Self {
        Self::Even(Arc::new(move |wi, wr, rho| {
            let [r, g, b] = rho;
            for (index, ((r, g), b)) in r.iter_mut().zip(g).zip(b).enumerate() {
                [*r, *g, *b] = model.eval_cos(wi.map(|w| w[index]), wr.map(|w| w[index]));
            }
        }))
    }

    /// How far it is until the cloth repeats, in the unit of its u and v; `None` if it is the same everywhere.
    pub fn period(&self) -> Option<f64> {
        match self {
            Self::Even(_) => None,
            Self::Pattern(pattern, _) => pattern.period(),
        }
    }
}

/// Points of a cloth that a directional light shines on.
pub(super) struct Points<'a> {
    pairs: Pairs<'a>,
    light: &'a Light,
}

impl<'a> Points<'a> {
    /// None yet; a pattern repeats `repeats` times along an arc length of 1.
    pub(super) fn new(cloth: &'a Cloth, light: &'a Light, repeats: f64) -> Self {
        Self {
            pairs: Pairs::new(cloth, repeats),
            light,
        }
    }

    /// One more.
    pub(super) fn push(&mut self, place: &Place) {
        let axes = [place.warp, place.weft, place.normal];
        let [x, y, z] = self.light.direction;
        let wi = axes.map(|axis| (axis[0] * x + axis[1] * y + axis[2] * z) as f32);
        // The viewer is at (0, 0, 1).
        let wr = axes.map(|axis| axis[2] as f32);
        self.pairs.push(wi, wr, place.arc);
    }

    /// Radiance of every point, linear RGB.
    pub(super) fn radiance(&self) -> Vec<[f32; 3]> {
        let of_rho = |rho| radiance(rho, self.light.strength);
        let [r, g, b] = self.pairs.rho();
        (0..r.len())
            .map(|index| [r[index], g[index], b[index]].map(of_rho))
            .collect()
    }
}

/// Pairs of directions that a cloth is asked for, and where on it: structures of arrays.
pub(crate) struct Pairs<'a> {
    cloth: &'a Cloth,
    /// From arc lengths to the pattern's u and v.
    scale: f64,
    wi: [Vec<f32>; 3],
    wr: [Vec<f32>; 3],
    /// Only of patterns.
    uv: Vec<[f64; 2]>,
}

impl<'a> Pairs<'a> {
    /// None yet; a pattern repeats `repeats` times along an arc length of 1.
    pub(crate) fn new(cloth: &'a Cloth, repeats: f64) -> Self {
        Self {
            cloth,
            scale: cloth.period().unwrap_or(1.0) * repeats,
            wi: Default::default(),
            wr: Default::default(),
            uv: Vec::new(),
        }
    }

    /// One more, at arc lengths along warp and weft.
    pub(crate) fn push(&mut self, wi: [f32; 3], wr: [f32; 3], arc: [f64; 2]) {
        for k in 0..3 {
            self.wi[k].push(wi[k]);
            self.wr[k].push(wr[k]);
        }
        if matches!(self.cloth, Cloth::Pattern(..)) {
            self.uv.push(arc.map(|arc| arc * self.scale));
        }
    }

    /// ρ of every pair: red, green and blue.
    pub(crate) fn rho(&self) -> [Vec<f32>; 3] {
        let count = self.wi[0].len();
        let mut rho = [(); 3].map(|()| vec![0.0; count]);
        match self.cloth {
            Cloth::Even(evaluate) => evaluate(
                self.wi.each_ref().map(Vec::as_slice),
                self.wr.each_ref().map(Vec::as_slice),
                rho.each_mut().map(Vec::as_mut_slice),
            ),
            Cloth::Pattern(pattern, swatches) => self.printed(pattern, swatches, &mut rho),
        }
        rho
    }

    /// ρ of a pattern: points that differ in nothing but directions at once.
    fn printed(&self, pattern: &Pattern, swatches: &[Swatch], rho: &mut [Vec<f32>; 3]) {
        let mut alike: BTreeMap<(usize, Vec<[u32; 3]>), Vec<usize>> = BTreeMap::new();
        for (index, [u, v]) in self.uv.iter().enumerate() {
            let place = pattern.at(*u, *v);
            let bits = |albedo: &[f32; 3]| albedo.map(f32::to_bits);
            let albedos = place.albedos.iter().map(bits).collect();
            let key = (place.material.bake, albedos);
            alike.entry(key).or_default().push(index);
        }
        for ((bake, bits), indices) in alike {
            let albedos: Vec<[f32; 3]> = bits.iter().map(|bits| bits.map(f32::from_bits)).collect();
            match &swatches[bake] {
                Swatch::Table(table, missing) => {
                    let some = |all: &Vec<f32>| indices.iter().map(|index| all[*index]).collect();
                    let [wi, wr]: [[Vec<f32>; 3]; 2] =
                        [&self.wi, &self.wr].map(|w| w.each_ref().map(some));
                    let mut found = [(); 3].map(|()| vec![0.0; indices.len()]);
                    lookup(
                        table,
                        *missing,
                        &albedos,
                        wi.each_ref().map(Vec::as_slice),
                        wr.each_ref().map(Vec::as_slice),
                        found.each_mut().map(Vec::as_mut_slice),
                    );
                    let [r, g, b] = found;
                    for (k, index) in indices.into_iter().enumerate() {
                        set(rho, index, [r[k], g[k], b[k]]);
                    }
                }
                Swatch::Direct(model) => {
                    for index in indices {
                        let [wi, wr] = self.pair(index);
                        set(rho, index, model.eval_cos_with(&albedos, wi, wr));
                    }
                }
            }
        }
    }

    fn pair(&self, index: usize) -> [[f32; 3]; 2] {
        [&self.wi, &self.wr].map(|w| w.each_ref().map(|slice| slice[index]))
    }
}

fn set(colours: &mut [Vec<f32>; 3], index: usize, colour: [f32; 3]) {
    for (channel, value) in colours.iter_mut().zip(colour) {
        channel[index] = value;
    }
}

/// ρ of a table for all pairs.
fn lookup(
    table: &Table,
    missing: Missing,
    albedos: &[[f32; 3]],
    wi: [&[f32]; 3],
    wr: [&[f32]; 3],
    [r, g, b]: [&mut [f32]; 3],
) {
    let level = Level::detect();
    table.eval_batch_at(level, albedos, Quantity::Rho, wi, wr, [r, g, b]);
    if missing == Missing::Magenta {
        for (index, ((r, g), b)) in r.iter_mut().zip(g).zip(b).enumerate() {
            let [wi, wr] = [wi, wr].map(|w| w.map(|w| w[index]));
            if !table.is_baked(wi, wr) {
                [*r, *g, *b] = MISSING;
            }
        }
    }
}
