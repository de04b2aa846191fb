//! What is wrapped around: ρ at many points of a surface.

use super::{Light, Place, radiance};
use crate::evaluator::Cloth;

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
        if self.cloth.is_pattern() {
            self.uv.push(arc.map(|arc| arc * self.scale));
        }
    }

    /// ρ of every pair: red, green and blue.
    pub(crate) fn rho(&self) -> [Vec<f32>; 3] {
        let count = self.wi[0].len();
        let mut rho = [(); 3].map(|()| vec![0.0; count]);
        self.cloth.eval_cos_batch(
            &self.uv,
            self.wi.each_ref().map(Vec::as_slice),
            self.wr.each_ref().map(Vec::as_slice),
            rho.each_mut().map(Vec::as_mut_slice),
        );
        rho
    }
}
