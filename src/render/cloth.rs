//! What is wrapped around: ρ at many points of a surface.

use super::{Light, Place, radiance};
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

impl Swatch {
    /// ρ \[1/sr\] with other albedos, one per visible thread.
    fn rho(&self, albedos: &[[f32; 3]], wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Table(table) => table.eval_cos_with(albedos, wi, wr),
            Self::Direct(model) => model.eval_cos_with(albedos, wi, wr),
        }
    }
}

/// Points of a cloth that is lit and seen: structures of arrays.
pub(super) struct Points<'a> {
    cloth: &'a Cloth,
    light: &'a Light,
    /// From arc lengths to the pattern's u and v.
    scale: f64,
    wi: [Vec<f32>; 3],
    wr: [Vec<f32>; 3],
    /// Only of patterns.
    uv: Vec<[f64; 2]>,
}

impl<'a> Points<'a> {
    /// None yet; a pattern repeats `repeats` times along an arc length of 1.
    pub(super) fn new(cloth: &'a Cloth, light: &'a Light, repeats: f64) -> Self {
        Self {
            cloth,
            light,
            scale: cloth.period().unwrap_or(1.0) * repeats,
            wi: Default::default(),
            wr: Default::default(),
            uv: Vec::new(),
        }
    }

    /// One more.
    pub(super) fn push(&mut self, place: &Place) {
        let axes = [place.warp, place.weft, place.normal];
        for (k, axis) in axes.iter().enumerate() {
            let [x, y, z] = self.light.direction;
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
        let of_rho = |rho| radiance(rho, self.light.strength);
        let (wi, wr) = (self.wi.each_ref(), self.wr.each_ref());
        let one_by_one = |rho: &dyn Fn(usize, [f32; 3], [f32; 3]) -> [f32; 3]| {
            let at = |index: usize| rho(index, wi.map(|w| w[index]), wr.map(|w| w[index]));
            (0..count).map(|index| at(index).map(of_rho)).collect()
        };
        let mut rho = [(); 3].map(|()| vec![0.0; count]);
        let (wi_slices, wr_slices) = (wi.map(Vec::as_slice), wr.map(Vec::as_slice));
        let rho_slices = rho.each_mut().map(Vec::as_mut_slice);
        match self.cloth {
            Cloth::Table(table, albedos) => table.eval_batch_at(
                Level::detect(),
                albedos,
                Quantity::Rho,
                wi_slices,
                wr_slices,
                rho_slices,
            ),
            Cloth::Direct(model) => model.eval_cos_batch(wi_slices, wr_slices, rho_slices),
            Cloth::Other(model) => return one_by_one(&|_, wi, wr| model.eval_cos(wi, wr)),
            Cloth::Pattern(pattern, swatches) => {
                return one_by_one(&|index, wi, wr| {
                    let [u, v] = self.uv[index];
                    let place = pattern.at(u, v);
                    swatches[place.material.bake].rho(&place.albedos, wi, wr)
                });
            }
        }
        let [r, g, b] = &rho;
        (0..count)
            .map(|index| [r[index], g[index], b[index]].map(of_rho))
            .collect()
    }
}
