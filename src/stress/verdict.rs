//! What holds of an evaluator on hard pairs.

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::evaluator::{Evaluator, Missing, Spec};
use crate::fabric::Fabric;
use crate::math::{Vec3, normalized};
use crate::metrics::{PairKind, protocol_pairs};
use crate::model::{Model, Rule, Sadeghi};
use crate::table::Table;

/// Single-precision directions to the light and the viewer.
pub type SinglePair = [Vec3<f32>; 2];

/// The largest of something, and the pair where.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Worst {
    /// Relative to ρ plus a hundredth of its mean.
    pub value: f64,
    /// wi and wr.
    pub pair: SinglePair,
}

impl Worst {
    fn or(self, other: Self) -> Self {
        if other.value > self.value {
            other
        } else {
            self
        }
    }
}

/// What holds of an evaluator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Its name, as `midpoint:50` or `table:standard`.
    pub evaluator: String,
    /// Pairs it was asked.
    pub pairs: usize,
    /// Values that were infinite or no numbers.
    pub not_finite: usize,
    /// Values below 0.
    pub negative: usize,
    /// How far single precision is from double, beyond what the last bits of the directions account for: the distance from the
    /// values that the same rule takes in double precision over directions that differ by up to four such bits. Of the reference
    /// how far its tolerance of 1e-7 is from one of 1e-11, of a table how far a batch is from single lookups.
    pub deviation: Worst,
    /// How much more, or less, a value changes than the model's between directions a millionth apart, relative to the larger of
    /// the values, where the model does not itself jump there: a seam or a speck.
    pub step: Worst,
    /// The mean and the largest relative error against the reference.
    pub mean_error: f64,
    /// The largest of it.
    pub error: Worst,
}

/// The pairs, with what the model says of them.
pub(super) struct Trial<'a> {
    fabric: &'a Fabric,
    pairs: Vec<SinglePair>,
    /// Each a little beside.
    neighbours: Vec<SinglePair>,
    truth: Vec<[f64; 3]>,
    beside: Vec<[f64; 3]>,
    /// A hundredth of the mean ρ, and never 0.
    floor: f64,
}

/// Four units in the last place of a component near 1: its own, and those lost in turning it into a thread's frame.
const LAST_BITS: f64 = 2.0 * f32::EPSILON as f64;
/// How many directions within the last bits are looked at, and the deviation that needs no more.
const FEWEST_TURNS: usize = 16;
const MOST_TURNS: usize = 512;
const ENOUGH: f64 = 1e-3;
/// Of a fabric that is black at all protocol pairs, ρ that counts: vector exponentials end at e⁻⁸⁷.
const DARK: f64 = 1e-30;
/// How far neighbours are.
const STEP: f64 = 1e-6;
/// Where the model changes by more than this share over such a step, or over the last bits, it jumps.
const JUMP: f64 = 1e-3;
const TIGHT: Rule = Rule::Adaptive(1e-11);

type Double<'a> = &'a (dyn Fn(Vec3<f64>, Vec3<f64>) -> [f64; 3] + Sync);

impl<'a> Trial<'a> {
    pub(super) fn new(fabric: &'a Fabric, pairs: Vec<SinglePair>) -> Self {
        let model = Sadeghi::<f64>::new(fabric, Rule::REFERENCE);
        let renders: Vec<f64> = protocol_pairs(fabric, 256, 1)
            .par_iter()
            .filter(|pair| pair.kind == PairKind::Render)
            .map(|pair| model.eval_cos(pair.wi, pair.wr).iter().sum::<f64>() / 3.0)
            .collect();
        let mean = renders.iter().sum::<f64>() / renders.len().max(1) as f64;
        let neighbours: Vec<SinglePair> = pairs
            .iter()
            .enumerate()
            .map(|(index, pair)| {
                // Longer or shorter directions would be further from the pair than that.
                moved(pair, STEP, index).map(|w| normalized(w).unwrap_or(w).map(|x| x as f32))
            })
            .collect();
        let values = |pairs: &[SinglePair]| -> Vec<[f64; 3]> {
            pairs
                .par_iter()
                .map(|pair| at(&|wi, wr| model.eval_cos(wi, wr), pair))
                .collect()
        };
        Self {
            truth: values(&pairs),
            beside: values(&neighbours),
            floor: (0.01 * mean).max(DARK),
            fabric,
            pairs,
            neighbours,
        }
    }

    /// The reference itself.
    pub(super) fn reference(&self) -> Verdict {
        let tight = Sadeghi::<f64>::new(self.fabric, TIGHT);
        let deviations = self.pairs.par_iter().zip(&self.truth).map(|(pair, value)| {
            let exact = at(&|wi, wr| tight.eval_cos(wi, wr), pair);
            self.relative(*value, exact)
        });
        let deviations: Vec<f64> = deviations.collect();
        let values = [self.truth.clone(), self.beside.clone()];
        self.verdict(&Spec::Rule(Rule::REFERENCE), &values, &deviations)
    }

    /// A rule that takes the same steps for every pair: one pair at a time, and in batches.
    pub(super) fn rule(&self, rule: Rule) -> Verdict {
        let double = Evaluator::<f64>::rule(self.fabric, rule);
        let double: Double<'_> = &|wi, wr| double.eval_cos(wi, wr);
        let single = Evaluator::rule(self.fabric, rule);
        let values = self.in_batches(&single);
        let deviations = self.pairs.par_iter().zip(&values[0]).enumerate();
        let deviations: Vec<f64> = deviations
            .map(|(index, (pair, batch))| {
                let one = single.eval_cos(pair[0], pair[1]).map(f64::from);
                let exact = at(double, pair);
                let mut deviation = self.relative(one, exact).max(self.relative(*batch, exact));
                if deviation > 1e-6 {
                    deviation = self.beyond_last_bits(double, pair, index, [one, *batch]);
                }
                deviation
            })
            .collect();
        // Steps are compared with the rule's own in double precision: a coarse rule may differ from the model.
        let own = |pairs: &[SinglePair]| pairs.par_iter().map(|pair| at(double, pair)).collect();
        let own: [Vec<[f64; 3]>; 2] = [own(&self.pairs), own(&self.neighbours)];
        // Where a tilt appears or vanishes within the last bits, the deviation has judged already.
        let is_judged = |index: usize| {
            let deviates = |k: usize| self.relative(values[k][index], own[k][index]) > JUMP;
            deviates(0) || deviates(1)
        };
        let mut verdict = self.verdict(&Spec::Rule(rule), &values, &deviations);
        verdict.step = self.worst_step(&values, &own, is_judged);
        verdict
    }

    /// A baked table.
    pub(super) fn table(&self, spec: &Spec, table: &Table) -> Verdict {
        let table = Evaluator::table(table.clone(), Vec::new(), Missing::Nearest);
        let values = self.in_batches(&table);
        let single = |pair: &SinglePair| table.eval_cos(pair[0], pair[1]).map(f64::from);
        let deviations = self.pairs.par_iter().zip(&values[0]);
        let deviations: Vec<f64> = deviations
            .map(|(pair, batch)| self.relative(*batch, single(pair)))
            .collect();
        self.verdict(spec, &values, &deviations)
    }

    /// Of the pairs and of their neighbours.
    fn in_batches(&self, evaluator: &Evaluator) -> [Vec<[f64; 3]>; 2] {
        [&self.pairs, &self.neighbours].map(|pairs| in_batches(pairs, evaluator))
    }

    fn verdict(&self, spec: &Spec, values: &[Vec<[f64; 3]>; 2], deviations: &[f64]) -> Verdict {
        let all = || values.iter().flatten().flatten();
        let errors: Vec<f64> = values[0]
            .iter()
            .zip(&self.truth)
            .map(|(value, truth)| self.relative(*value, *truth))
            .collect();
        Verdict {
            evaluator: spec.to_string(),
            pairs: self.pairs.len(),
            not_finite: all().filter(|x| !x.is_finite()).count(),
            negative: all().filter(|x| **x < 0.0).count(),
            deviation: self.worst(deviations),
            step: self.worst_step(values, &[self.truth.clone(), self.beside.clone()], |_| {
                false
            }),
            mean_error: errors.iter().sum::<f64>() / errors.len().max(1) as f64,
            error: self.worst(&errors),
        }
    }

    fn worst(&self, values: &[f64]) -> Worst {
        let all = self.pairs.iter().zip(values);
        all.map(|(pair, value)| Worst {
            value: *value,
            pair: *pair,
        })
        .fold(Worst::default(), Worst::or)
    }

    /// The largest difference between the steps of `values` and those of `model`, from pairs to their neighbours, but for those
    /// that are judged already.
    fn worst_step(
        &self,
        values: &[Vec<[f64; 3]>; 2],
        model: &[Vec<[f64; 3]>; 2],
        is_judged: impl Fn(usize) -> bool,
    ) -> Worst {
        let step = |index: usize| {
            let excess = |c: usize| {
                let (from, to) = (model[0][index][c], model[1][index][c]);
                let (own_from, own_to) = (values[0][index][c], values[1][index][c]);
                let step = to - from;
                let jumps = step.abs() > JUMP * (from.max(to) + self.floor);
                if jumps || is_judged(index) {
                    return 0.0;
                }
                // Against what is seen: where a value is off, that is its error and no step.
                let seen = from.max(to).max(own_from).max(own_to) + self.floor;
                (own_to - own_from - step).abs() / seen
            };
            (0..3).map(excess).fold(0.0, f64::max)
        };
        let steps: Vec<f64> = (0..self.pairs.len()).map(step).collect();
        self.worst(&steps)
    }

    /// The largest |a − b| over b plus the floor. What is no number is infinitely far.
    fn relative(&self, a: [f64; 3], b: [f64; 3]) -> f64 {
        (0..3)
            .map(|c| (a[c] - b[c]).abs() / (b[c].max(0.0) + self.floor))
            .fold(0.0, |most, x| if x > most || x.is_nan() { x } else { most })
    }

    /// How far `values` are from all that `double` takes on where directions differ in their last bits.
    fn beyond_last_bits(
        &self,
        double: Double<'_>,
        pair: &SinglePair,
        index: usize,
        values: [[f64; 3]; 2],
    ) -> f64 {
        let mut least = at(double, pair);
        let mut most = least;
        let mut distance = f64::INFINITY;
        for turn in 0..MOST_TURNS {
            let [wi, wr] = moved(pair, LAST_BITS, MOST_TURNS * index + turn);
            let value = double(wi, wr);
            for c in 0..3 {
                least[c] = least[c].min(value[c]);
                most[c] = most[c].max(value[c]);
            }
            let beyond = |value: &[f64; 3], c: usize| {
                let distance = (value[c] - most[c]).max(least[c] - value[c]).max(0.0);
                distance / (most[c] + self.floor)
            };
            let all = values
                .iter()
                .flat_map(|value| (0..3).map(move |c| (value, c)));
            distance = all.map(|(value, c)| beyond(value, c)).fold(0.0, f64::max);
            // A lobe narrower than the last bits is hit by few of them.
            if distance < ENOUGH && turn >= FEWEST_TURNS {
                break;
            }
        }
        distance
    }
}

fn at(model: Double<'_>, pair: &SinglePair) -> [f64; 3] {
    let [wi, wr] = pair.map(|w| w.map(f64::from));
    model(wi, wr)
}

/// A pair whose components differ by up to `distance`, in ways that follow from `index`; still above the surface.
fn moved(pair: &SinglePair, distance: f64, index: usize) -> [Vec3<f64>; 2] {
    // Odd multiples of an irrational number are spread evenly.
    let mut turn = index as f64 * 6.0;
    let mut shift = || {
        turn += 1.0;
        2.0 * (turn * 0.618_033_988_749_894_9).fract() - 1.0
    };
    pair.map(|w| {
        let [x, y, z] = w.map(|x| f64::from(x) + distance * shift());
        [x, y, if z > 0.0 { z } else { f64::from(w[2]) }]
    })
}

/// All pairs at once.
fn in_batches(pairs: &[SinglePair], evaluator: &Evaluator) -> Vec<[f64; 3]> {
    let component = |side: usize, k: usize| pairs.iter().map(|pair| pair[side][k]).collect();
    let [wi, wr]: [[Vec<f32>; 3]; 2] = [0, 1].map(|side| [0, 1, 2].map(|k| component(side, k)));
    let mut rho = [0, 1, 2].map(|_| vec![0.0; pairs.len()]);
    evaluator.eval_cos_batch(
        wi.each_ref().map(Vec::as_slice),
        wr.each_ref().map(Vec::as_slice),
        rho.each_mut().map(Vec::as_mut_slice),
    );
    (0..pairs.len())
        .map(|index| [0, 1, 2].map(|c| f64::from(rho[c][index])))
        .collect()
}
