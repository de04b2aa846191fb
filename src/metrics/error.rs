//! Error of an approximation over protocol pairs.

use std::collections::HashMap;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::TableModel;
use super::pairs::{Pair, PairKind, endless_pairs, endless_rim, rim_count};
use crate::fabric::Fabric;
use crate::model::{Model, Rule, Sadeghi};
use crate::progress::{Cancelled, Progress, Steps};
use crate::table::Table;

/// Relative error over a set of pairs; all zero for no pairs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[expect(missing_docs, reason = "the names say it")]
pub struct Quantiles {
    pub pairs: usize,
    pub mean: f64,
    pub p50: f64,
    pub p95: f64,
    pub p99: f64,
    pub p999: f64,
    pub max: f64,
}

/// Bias of the directional reflectance at a view angle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Bias {
    /// Angle between viewer and normal, degrees; the viewer is half way between warp and weft.
    pub view_deg: f64,
    /// ∫ ρ dwi of the brightest channel, by direct integration.
    pub reflectance: f64,
    /// (R_T − R_D)/R_D of the channel where it is largest in magnitude.
    pub bias: f64,
}

/// What the approximation of a fabric costs in accuracy.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ErrorReport {
    /// The seed that drew the pairs.
    pub seed: u64,
    /// Over all protocol pairs.
    pub all: Quantiles,
    /// Over those with min(wi·n, wr·n) < 0.1.
    pub grazing: Quantiles,
    /// Over pairs of [`PairKind::Rim`] …
    #[serde(default)]
    pub rim: Quantiles,
    /// … [`PairKind::RimBoth`] …
    #[serde(default)]
    pub rim_both: Quantiles,
    /// … and [`PairKind::RimLast`], which `all` and `grazing` have none of. Tables from before there were rims have no pairs in them.
    #[serde(default)]
    pub rim_last: Quantiles,
    /// Root of the mean squared error over the mean, all channels and protocol pairs.
    pub rmse_over_mean: f64,
    /// Bias of the directional reflectance at 0°, 30°, 60° and 80°; none of a table that has not all pairs.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bias: Vec<Bias>,
}

/// Below this cosine a direction is grazing.
const GRAZING: f64 = 0.1;
/// The share of the mean that keeps relative error meaningful where a fabric is dark.
const FLOOR: f64 = 0.01;
const VIEW_ANGLES_DEG: [f64; 4] = [0.0, 30.0, 60.0, 80.0];
/// Strata of z and azimuth for directional reflectance.
const STRATA: (usize, usize) = (24, 64);

/// How far values are from the truth over the pairs of a [`Truth`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PairErrors {
    /// Over all protocol pairs.
    pub all: Quantiles,
    /// Over those with min(wi·n, wr·n) < 0.1.
    pub grazing: Quantiles,
    /// Over pairs of [`PairKind::Rim`] …
    pub rim: Quantiles,
    /// … [`PairKind::RimBoth`] …
    pub rim_both: Quantiles,
    /// … and [`PairKind::RimLast`], which `all` and `grazing` have none of.
    pub rim_last: Quantiles,
    /// Root of the mean squared error over the mean, all channels and protocol pairs.
    pub rmse_over_mean: f64,
}

/// Protocol pairs of a fabric, with those of its rims, and ρ by direct integration, computed once for any number of evaluators.
#[derive(Debug, Clone)]
pub struct Truth {
    pairs: Vec<Pair>,
    values: Vec<[f64; 3]>,
    /// 0.01 ρ̄.
    floor: [f64; 3],
}

impl Truth {
    /// Integrates `fabric` directly on `count` protocol pairs and those of the rims.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn new(
        fabric: &Fabric,
        count: usize,
        seed: u64,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let reference = Sadeghi::<f64>::new(fabric, Rule::REFERENCE);
        let pairs = drawn_pairs(fabric, count, seed, progress)?;
        Self::of_model(&reference, pairs, progress)
    }

    /// As [`Truth::new`], for what approximates a table: where that has not all pairs, up to `count` of those protocol pairs that it has.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn of_table(
        fabric: &Fabric,
        table: &Table,
        count: usize,
        seed: u64,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        if table.has_all_pairs() {
            return Self::new(fabric, count, seed, progress);
        }
        let pairs = baked_pairs(fabric, table, count, seed);
        let reference = Sadeghi::<f64>::new(fabric, Rule::REFERENCE);
        Self::of_model(&reference, pairs, progress)
    }

    /// Takes any model for the truth on `pairs`, those of rims last.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn of_model(
        model: &dyn Model<f64>,
        pairs: Vec<Pair>,
        progress: Progress<'_>,
    ) -> Result<Self, Cancelled> {
        let values = eval_pairs(model, &pairs, progress)?;
        Ok(Self::of_values(pairs, values))
    }

    fn of_values(pairs: Vec<Pair>, values: Vec<[f64; 3]>) -> Self {
        let mut floor = [0.0; 3];
        let mut renders = 0.0;
        for (pair, truth) in pairs.iter().zip(&values) {
            if pair.kind == PairKind::Render {
                renders += 1.0;
                for channel in 0..3 {
                    floor[channel] += FLOOR * truth[channel];
                }
            }
        }
        Self {
            floor: floor.map(|floor| floor / f64::max(renders, 1.0)),
            pairs,
            values,
        }
    }

    /// The pairs, in the order of all values.
    pub fn pairs(&self) -> &[Pair] {
        &self.pairs
    }

    /// Those that are of no rim.
    pub fn protocol_pairs(&self) -> &[Pair] {
        &self.pairs[..self.pairs.partition_point(|pair| !pair.kind.is_rim())]
    }

    /// ρ of a model at each pair.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn values_of(
        &self,
        model: &dyn Model<f64>,
        progress: Progress<'_>,
    ) -> Result<Vec<[f64; 3]>, Cancelled> {
        eval_pairs(model, &self.pairs, progress)
    }

    fn measure(
        &self,
        model: &dyn Model<f64>,
        progress: Progress<'_>,
    ) -> Result<PairErrors, Cancelled> {
        let values = self.values_of(model, progress)?;
        Ok(self.errors_of(&values))
    }

    /// The relative difference of ρ at each pair and channel, with its sign; none where all is dark.
    ///
    /// # Panics
    /// When there is not one value per pair.
    pub fn relative_residuals(&self, values: &[[f64; 3]]) -> Vec<f64> {
        assert_eq!(values.len(), self.values.len(), "one value per pair");
        let residual = |(truth, value): (&[f64; 3], &[f64; 3])| {
            [0, 1, 2].map(|c| {
                let size = truth[c] + self.floor[c];
                if size > 0.0 {
                    (value[c] - truth[c]) / size
                } else {
                    0.0
                }
            })
        };
        self.values.iter().zip(values).flat_map(residual).collect()
    }

    /// The relative error of ρ at each pair.
    ///
    /// # Panics
    /// When there is not one value per pair.
    pub fn relative_errors(&self, values: &[[f64; 3]]) -> Vec<f64> {
        assert_eq!(values.len(), self.values.len(), "one value per pair");
        let error = |(truth, value): (&[f64; 3], &[f64; 3])| {
            (0..3)
                .map(|c| ratio((value[c] - truth[c]).abs(), truth[c] + self.floor[c]))
                .fold(0.0, f64::max)
        };
        self.values.iter().zip(values).map(error).collect()
    }

    /// The error of ρ over all pairs.
    ///
    /// # Panics
    /// When there is not one value per pair.
    pub fn errors_of(&self, values: &[[f64; 3]]) -> PairErrors {
        let errors = self.relative_errors(values);
        let of = |is_in: &dyn Fn(&Pair) -> bool| {
            let those = self.pairs.iter().zip(&errors);
            let those = those.filter(|(pair, _)| is_in(pair));
            quantiles(those.map(|(_, error)| *error).collect())
        };
        let is_grazing = |pair: &Pair| pair.wi[2].min(pair.wr[2]) < GRAZING;
        let [rim, rim_both, rim_last] = PairKind::RIMS.map(|rim| of(&|pair| pair.kind == rim));
        let protocol = self.protocol_pairs().len();
        let (mut squares, mut sum) = (0.0, 0.0);
        for (truth, value) in self.values.iter().zip(values).take(protocol) {
            for channel in 0..3 {
                squares += (value[channel] - truth[channel]).powi(2);
                sum += truth[channel];
            }
        }
        let numbers = 3.0 * protocol as f64;
        PairErrors {
            all: of(&|pair| !pair.kind.is_rim()),
            grazing: of(&|pair| !pair.kind.is_rim() && is_grazing(pair)),
            rim,
            rim_both,
            rim_last,
            rmse_over_mean: ratio((squares / numbers).sqrt(), sum / numbers),
        }
    }
}

/// Direct integration of a fabric for any number of evaluators, done once: on the pairs of every seed, and for directional
/// reflectances.
#[derive(Debug)]
pub struct Reference<'a> {
    fabric: &'a Fabric,
    model: Sadeghi<f64>,
    /// By count and seed.
    truths: Vec<((usize, u64), Truth)>,
    /// ρ at pairs that tables without all pairs were measured at, by the bits of both directions.
    partial: HashMap<[u64; 6], [f64; 3]>,
    /// ρ by light, at each of the view angles.
    views: Option<[Vec<[f64; 3]>; VIEW_ANGLES_DEG.len()]>,
}

impl<'a> Reference<'a> {
    /// Nothing is integrated yet.
    pub fn new(fabric: &'a Fabric) -> Self {
        Self {
            fabric,
            model: Sadeghi::new(fabric, Rule::REFERENCE),
            truths: Vec::new(),
            partial: HashMap::new(),
            views: None,
        }
    }

    /// As [`Truth::new`].
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn truth(
        &mut self,
        count: usize,
        seed: u64,
        progress: Progress<'_>,
    ) -> Result<&Truth, Cancelled> {
        let key = (count, seed);
        let index = match self.truths.iter().position(|(known, _)| *known == key) {
            Some(index) => index,
            None => {
                let pairs = drawn_pairs(self.fabric, count, seed, progress)?;
                let truth = Truth::of_model(&self.model, pairs, progress)?;
                self.truths.push((key, truth));
                self.truths.len() - 1
            }
        };
        Ok(&self.truths[index].1)
    }

    /// Measures `approximation` on `count` protocol pairs and those of the rims.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn measure(
        &mut self,
        approximation: &dyn Model<f64>,
        count: usize,
        seed: u64,
        progress: Progress<'_>,
    ) -> Result<ErrorReport, Cancelled> {
        let truth = self.truth(count, seed, progress.part(0.0, 0.9))?;
        let errors = truth.measure(approximation, progress.part(0.9, 0.95))?;
        let bias = self.bias(approximation, progress.part(0.95, 1.0))?;
        Ok(errors.report(seed, bias))
    }

    /// Measures a table: as [`Reference::measure`], if it has all pairs; else on up to `count` of those protocol pairs that it has, without
    /// directional reflectances, for which it would take all lights.
    ///
    /// # Errors
    /// When `progress` says stop.
    pub fn measure_table(
        &mut self,
        table: &Table,
        count: usize,
        seed: u64,
        progress: Progress<'_>,
    ) -> Result<ErrorReport, Cancelled> {
        if table.has_all_pairs() {
            return self.measure(&TableModel(table), count, seed, progress);
        }
        let truth = self.partial_truth(table, count, seed, progress.part(0.0, 0.9))?;
        let errors = truth.measure(&TableModel(table), progress.part(0.9, 1.0))?;
        Ok(errors.report(seed, Vec::new()))
    }

    fn partial_truth(
        &mut self,
        table: &Table,
        count: usize,
        seed: u64,
        progress: Progress<'_>,
    ) -> Result<Truth, Cancelled> {
        let key = |pair: &Pair| {
            let ([a, b, c], [d, e, f]) = (pair.wi, pair.wr);
            [a, b, c, d, e, f].map(f64::to_bits)
        };
        let pairs = baked_pairs(self.fabric, table, count, seed);
        let is_new = |pair: &&Pair| !self.partial.contains_key(&key(pair));
        let new: Vec<Pair> = pairs.iter().filter(is_new).copied().collect();
        let values = eval_pairs(&self.model, &new, progress)?;
        self.partial.extend(new.iter().map(key).zip(values));
        let values = pairs.iter().map(|pair| self.partial[&key(pair)]).collect();
        Ok(Truth::of_values(pairs, values))
    }

    fn bias(
        &mut self,
        approximation: &dyn Model<f64>,
        progress: Progress<'_>,
    ) -> Result<Vec<Bias>, Cancelled> {
        let (lights, solid_angle) = lights_and_solid_angle(STRATA);
        let steps = progress.steps(2 * VIEW_ANGLES_DEG.len() * lights.len());
        let views = match self.views.take() {
            Some(views) => views,
            None => views_of(&self.model, &lights, &steps)?,
        };
        let views = self.views.insert(views);
        let values = views_of(approximation, &lights, &steps)?;
        let of_views = VIEW_ANGLES_DEG.iter().zip(views).zip(values);
        let bias = |((view_deg, truth), value): ((&f64, &mut Vec<_>), Vec<_>)| {
            bias(*view_deg, truth, &value, solid_angle)
        };
        Ok(of_views.map(bias).collect())
    }
}

/// Measures a table against direct integration of its `fabric`, as [`Reference::measure_table`].
///
/// # Errors
/// When `progress` says stop.
pub fn measure_table(
    fabric: &Fabric,
    table: &Table,
    count: usize,
    seed: u64,
    progress: Progress<'_>,
) -> Result<ErrorReport, Cancelled> {
    Reference::new(fabric).measure_table(table, count, seed, progress)
}

/// How many pairs are drawn for each that is wanted, at most.
const DRAWS: usize = 64;

/// Protocol pairs, then those of the rims; there may be many.
fn drawn_pairs(
    fabric: &Fabric,
    count: usize,
    seed: u64,
    progress: Progress<'_>,
) -> Result<Vec<Pair>, Cancelled> {
    let steps = progress.steps(count);
    let wanted = |pair| steps.check().map(|()| pair);
    let rim = |rim| endless_rim(fabric, rim, seed).take(rim_count(count));
    let rims = PairKind::RIMS.into_iter().flat_map(rim);
    let pairs = endless_pairs(fabric, seed).take(count);
    pairs.chain(rims).map(wanted).collect()
}

/// Protocol pairs and those of the rims that the table has; of one for light from the viewer's direction such pairs.
fn baked_pairs(fabric: &Fabric, table: &Table, count: usize, seed: u64) -> Vec<Pair> {
    let single = |w: [f64; 3]| w.map(|x| x as f32);
    let is_baked = |pair: &Pair| table.is_baked(single(pair.wi), single(pair.wr));
    let draws = || endless_pairs(fabric, seed).take(DRAWS * count);
    let rim_count = rim_count(count);
    let rim_draws = |rim| endless_rim(fabric, rim, seed).take(DRAWS * rim_count);
    let mut pairs: Vec<Pair> = draws().filter(is_baked).take(count).collect();
    if !pairs.is_empty() {
        for rim in PairKind::RIMS {
            pairs.extend(rim_draws(rim).filter(is_baked).take(rim_count));
        }
        return pairs;
    }
    let collocated = |pair: Pair| Pair {
        wr: pair.wi,
        ..pair
    };
    let renders = draws().map(|pair| Pair {
        kind: PairKind::Render,
        ..collocated(pair)
    });
    pairs.extend(renders.filter(is_baked).take(count));
    for rim in [PairKind::RimBoth, PairKind::RimLast] {
        let rims = rim_draws(rim).map(collocated);
        pairs.extend(rims.filter(is_baked).take(rim_count));
    }
    pairs
}

impl ErrorReport {
    /// The sets of pairs by the names that people read.
    pub fn sets(&self) -> [(&'static str, &Quantiles); 5] {
        [
            ("all", &self.all),
            ("grazing", &self.grazing),
            ("rim", &self.rim),
            ("rim, both", &self.rim_both),
            ("rim, last", &self.rim_last),
        ]
    }
}

impl PairErrors {
    fn report(self, seed: u64, bias: Vec<Bias>) -> ErrorReport {
        let Self {
            all,
            grazing,
            rim,
            rim_both,
            rim_last,
            rmse_over_mean,
        } = self;
        ErrorReport {
            seed,
            all,
            grazing,
            rim,
            rim_both,
            rim_last,
            rmse_over_mean,
            bias,
        }
    }
}

/// ρ of every pair.
fn eval_pairs(
    model: &dyn Model<f64>,
    pairs: &[Pair],
    progress: Progress<'_>,
) -> Result<Vec<[f64; 3]>, Cancelled> {
    let steps = progress.steps(pairs.len());
    let values = pairs.par_iter().map(|pair| {
        steps.advance()?;
        Ok(model.eval_cos(pair.wi, pair.wr))
    });
    values.collect()
}

/// `error / size`, where no error of nothing is no error.
fn ratio(error: f64, size: f64) -> f64 {
    if error == 0.0 { 0.0 } else { error / size }
}

pub(super) fn quantiles(mut errors: Vec<f64>) -> Quantiles {
    let Some(last) = errors.len().checked_sub(1) else {
        return Quantiles::default();
    };
    errors.sort_by(f64::total_cmp);
    let at = |share: f64| errors[(share * last as f64).round() as usize];
    Quantiles {
        pairs: errors.len(),
        mean: errors.iter().sum::<f64>() / errors.len() as f64,
        p50: at(0.5),
        p95: at(0.95),
        p99: at(0.99),
        p999: at(0.999),
        max: at(1.0),
    }
}

/// To the viewer at an angle from the normal, half way between warp and weft.
fn viewer(view_deg: f64) -> [f64; 3] {
    let (sin, cos) = view_deg.to_radians().sin_cos();
    let diagonal = std::f64::consts::FRAC_1_SQRT_2;
    [sin * diagonal, sin * diagonal, cos]
}

/// Directions in bands of z and azimuth, each of which stands for the same solid angle of the hemisphere.
pub(super) fn lights_and_solid_angle((rows, columns): (usize, usize)) -> (Vec<[f64; 3]>, f64) {
    // Equal steps of z are equal solid angles.
    let light = |index: usize| {
        let z = ((index / columns) as f64 + 0.5) / rows as f64;
        let (sin, cos) =
            (std::f64::consts::TAU * ((index % columns) as f64 + 0.5) / columns as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [r * cos, r * sin, z]
    };
    let solid_angle = std::f64::consts::TAU / (rows * columns) as f64;
    ((0..rows * columns).map(light).collect(), solid_angle)
}

/// ρ by light, at each of the view angles.
fn views_of(
    model: &dyn Model<f64>,
    lights: &[[f64; 3]],
    steps: &Steps<'_>,
) -> Result<[Vec<[f64; 3]>; VIEW_ANGLES_DEG.len()], Cancelled> {
    let mut views = [const { Vec::new() }; VIEW_ANGLES_DEG.len()];
    for (view, angle) in views.iter_mut().zip(VIEW_ANGLES_DEG) {
        let wr = viewer(angle);
        let value = |wi: &[f64; 3]| {
            steps.advance()?;
            Ok(model.eval_cos(*wi, wr))
        };
        *view = lights.par_iter().map(value).collect::<Result<_, _>>()?;
    }
    Ok(views)
}

/// At a view angle, from ρ by light.
fn bias(view_deg: f64, truth: &[[f64; 3]], value: &[[f64; 3]], solid_angle: f64) -> Bias {
    let mut result = Bias {
        view_deg,
        reflectance: 0.0,
        bias: 0.0,
    };
    for channel in 0..3 {
        let reflectance =
            |rho: &[[f64; 3]]| -> f64 { rho.iter().map(|rho| rho[channel] * solid_angle).sum() };
        let (truth, value) = (reflectance(truth), reflectance(value));
        result.reflectance = result.reflectance.max(truth);
        let bias = if value == truth {
            0.0
        } else {
            (value - truth) / truth
        };
        if bias.abs() > result.bias.abs() {
            result.bias = bias;
        }
    }
    result
}
