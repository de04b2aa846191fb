//! What is stored at a node.
use rayon::prelude::*;
use crate::brdf::*;
use crate::chart::Chart;
use crate::fabric::{Fabric, Thread};
use crate::math::Vec3;
use crate::model::mean_response;
use crate::table::{Axis, Encoding, Grid, Samples};
use super::Settings;

/// Values are taken this far inside the box: on its faces S and F are both 0.
const INSET: f64 = 1e-4;

/// integrand
pub struct Integrand<'a> {
    pub(super) thread: &'a Thread,
    optics: Optics<f64>,
    tangents: TangentCurve<f64>,
    factors: Factors<f64>,
    sigma_u: f64,
    chart: Chart,
    tolerance: f64,
    pub(super) folded: bool,
}

/// sample
#[derive(Clone, Copy, Debug)]
#[expect(missing_docs, reason = "trial")]
pub struct Sample { pub response: Response<f64>, pub factor: Response<f64> }
impl Sample {
    /// ratio
    pub fn ratio(&self) -> [f64; 2] {
        let ratio = |value: f64, factor: f64| if factor > 1e-30 { value / factor } else { f64::NAN };
        [ratio(self.response.surface, self.factor.surface), ratio(self.response.volume, self.factor.volume)]
    }
}

impl<'a> Integrand<'a> {
    /// new
    pub fn new(fabric: &Fabric, thread: &'a Thread, settings: &Settings) -> Self {
        let tangents = thread.tangents();
        Self { thread, optics: thread.optics, factors: Factors::new(&thread.optics, &tangents), folded: tangents.is_symmetric(), tangents, sigma_u: fabric.sigma_u, chart: settings.chart, tolerance: settings.tolerance }
    }
    /// at pair
    pub fn at(&self, wi: Vec3<f64>, wr: Vec3<f64>) -> Sample {
        let pair = ThreadPair::new(wi, wr, self.sigma_u);
        Sample { response: mean_response(&pair, &self.optics, &self.tangents, self.tolerance), factor: self.factors.at(&pair, &self.tangents) }
    }
    /// at u
    pub fn at_point(&self, u: [f64; 4]) -> Sample {
        let mut v = u;
        for k in 0..3 { v[k] = v[k].clamp(INSET, 1.0 - INSET); }
        v[3] = v[3].min(1.0 - INSET);
        let (wi, wr) = self.chart.directions(v);
        self.at(wi, wr)
    }
    /// fill
    pub fn fill(&self, axes: [Axis; 4], settings: &Settings) -> Grid {
        let [n0, n1, n2, n3] = [0, 1, 2, 3].map(|k| axes[k].len());
        let node = |k: usize, i: usize| f64::from(axes[k].nodes()[i]);
        let rows: Vec<Vec<[f64; 2]>> = (0..n1 * n2 * n3).into_par_iter().map(|row| {
            let (i1, i2, i3) = (row % n1, row / n1 % n2, row / n1 / n2);
            let mut values: Vec<[f64; 2]> = (0..n0).map(|i0| self.at_point([node(0, i0), node(1, i1), node(2, i2), node(3, i3)]).ratio()).collect();
            // where nothing is visible
            for c in 0..2 {
                for i in 1..n0 { if values[i][c].is_nan() { values[i][c] = values[i-1][c]; } }
                for i in (0..n0-1).rev() { if values[i][c].is_nan() { values[i][c] = values[i+1][c]; } }
                for v in &mut values { if v[c].is_nan() { v[c] = 0.0; } }
            }
            values
        }).collect();
        let max = |c: usize| rows.iter().flatten().map(|v| v[c]).fold(0.0, f64::max);
        let scale = [max(0), max(1)].map(|m| if m > 0.0 { m } else { 1.0 });
        let encoding: Encoding = settings.encoding;
        let samples = Samples::store(encoding, rows.iter().flatten().flat_map(|v| [0, 1].map(|c| encoding.encode(v[c] / scale[c]))));
        Grid { chart: self.chart, folded: self.folded, axes, encoding, scale: scale.map(|s| s as f32), samples }
    }
}
