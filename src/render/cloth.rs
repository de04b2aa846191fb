//! What is wrapped around: ρ at many points of a surface.

use std::collections::BTreeMap;

use super::{Place, View, radiance};
use crate::lookup::Quantity;
use crate::math::simd::Level;
use crate::model::{Model, Sadeghi};
use crate::pattern::Pattern;
use crate::table::Table;

/// A cloth and a way to evaluate it.
pub enum Cloth {
    /// A table, and the albedos to use it with, as [`Table::eval_cos_with`] takes them: none are the table's own.
    Table(Box<Table>, Vec<[f32; 3]>),
    /// The microcylinder model by direct integration.
    Direct(Box<Sadeghi<f32>>),
    /// Any other model.
    Other(Box<dyn Model<f32> + Send>),
    /// A pattern, and a swatch for each of [`Pattern::bakes`].
    Pattern(Box<Pattern>, Vec<Swatch>),
}

/// A fabric of a pattern, which dyes it.
pub enum Swatch {
    /// A table.
    Table(Box<Table>),
    /// The microcylinder model by direct integration.
    Direct(Box<Sadeghi<f32>>),
}

impl Cloth {
    /// How far it is until the cloth repeats, in the unit of its u and v; `None` if it is the same everywhere.
    pub fn period(&self) -> Option<f64> {
        match self {
            Self::Table(..) | Self::Direct(_) | Self::Other(_) => None,
            Self::Pattern(pattern, _) => pattern.period(),
        }
    }
}

/// Points of a cloth that is lit and seen: structures of arrays.
pub(super) struct Points<'a> {
    cloth: &'a Cloth,
    light: [f64; 3],
    /// From arc lengths to the pattern's u and v.
    scale: f64,
    wi: [Vec<f32>; 3],
    wr: [Vec<f32>; 3],
    /// Only of patterns.
    uv: Vec<[f64; 2]>,
}

impl<'a> Points<'a> {
    /// None yet.
    pub(super) fn new(cloth: &'a Cloth, view: &View) -> Self {
        Self {
            cloth,
            light: view.light,
            scale: cloth.period().unwrap_or(1.0) * view.repeats / std::f64::consts::PI,
            wi: Default::default(),
            wr: Default::default(),
            uv: Vec::new(),
        }
    }

    /// One more.
    pub(super) fn push(&mut self, place: &Place) {
        let axes = [place.warp, place.weft, place.normal];
        for (k, axis) in axes.iter().enumerate() {
            let [x, y, z] = self.light;
            self.wi[k].push((axis[0] * x + axis[1] * y + axis[2] * z) as f32);
            // The viewer is at (0, 0, 1).
            self.wr[k].push(axis[2] as f32);
        }
        if matches!(self.cloth, Cloth::Pattern(..)) {
            self.uv.push(place.arc.map(|arc| arc * self.scale));
        }
    }

    /// Radiance of every point, linear RGB.
    pub(super) fn radiance(&self) -> Vec<[f32; 3]> {
        let count = self.wi[0].len();
        let mut rho = [(); 3].map(|()| vec![0.0; count]);
        match self.cloth {
            Cloth::Table(table, albedos) => lookup(table, albedos, &self.wi, &self.wr, &mut rho),
            Cloth::Direct(model) => model.eval_cos_batch(
                self.wi.each_ref().map(Vec::as_slice),
                self.wr.each_ref().map(Vec::as_slice),
                rho.each_mut().map(Vec::as_mut_slice),
            ),
            Cloth::Other(model) => {
                for index in 0..count {
                    let [wi, wr] = self.pair(index);
                    set(&mut rho, index, model.eval_cos(wi, wr));
                }
            }
            Cloth::Pattern(pattern, swatches) => self.printed(pattern, swatches, &mut rho),
        }
        let [r, g, b] = &rho;
        (0..count)
            .map(|index| [r[index], g[index], b[index]].map(radiance))
            .collect()
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
                Swatch::Table(table) => {
                    let some = |all: &Vec<f32>| indices.iter().map(|index| all[*index]).collect();
                    let mut found = [(); 3].map(|()| vec![0.0; indices.len()]);
                    let (wi, wr) = (self.wi.each_ref().map(some), self.wr.each_ref().map(some));
                    lookup(table, &albedos, &wi, &wr, &mut found);
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
    albedos: &[[f32; 3]],
    wi: &[Vec<f32>; 3],
    wr: &[Vec<f32>; 3],
    rho: &mut [Vec<f32>; 3],
) {
    table.eval_batch_at(
        Level::detect(),
        albedos,
        Quantity::Rho,
        wi.each_ref().map(Vec::as_slice),
        wr.each_ref().map(Vec::as_slice),
        rho.each_mut().map(Vec::as_mut_slice),
    );
}
