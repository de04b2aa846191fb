//! The error protocol: its pairs, and what relative error is of them.

use crate::common::fabric;
use sateen::metrics::{Pair, PairErrors, PairKind, Truth};
use sateen::progress::Progress;

const PAIRS: usize = 4000;

fn truth() -> Truth {
    Truth::new(&fabric("tshirt-white"), PAIRS, 7, Progress::silent()).unwrap()
}

fn of(truth: &Truth, kind: PairKind) -> Vec<Pair> {
    let pairs = truth.pairs().iter().copied();
    pairs.filter(|pair| pair.kind == kind).collect()
}

#[test]
fn rims_spread_evenly_over_their_heights() {
    let truth = truth();
    assert_eq!(truth.protocol_pairs().len(), PAIRS);
    for (kind, most) in [
        (PairKind::Rim, 0.1),
        (PairKind::RimBoth, 0.1),
        (PairKind::RimLast, 0.02),
    ] {
        let pairs = of(&truth, kind);
        assert_eq!(pairs.len(), PAIRS / 4);
        let mut lows = Vec::new();
        for (index, Pair { wi, wr, .. }) in pairs.iter().enumerate() {
            for w in [wi, wr] {
                assert!((w.iter().map(|x| x * x).sum::<f64>() - 1.0).abs() < 1e-12);
            }
            let [low, other] = if index % 2 == 0 { [wi, wr] } else { [wr, wi] };
            lows.push(*low);
            if kind == PairKind::Rim {
                assert!(other[2] > 0.0);
            } else {
                lows.push(*other);
            }
        }
        assert!(lows.iter().all(|w| (1e-4..most).contains(&w[2])));
        let mean = |value: &dyn Fn(&[f64; 3]) -> f64| {
            lows.iter().map(value).sum::<f64>() / lows.len() as f64
        };
        assert!((mean(&|w| w[2]) - 0.5 * (1e-4 + most)).abs() < 0.05 * most);
        assert!(mean(&|w| w[0]).abs() < 0.1 && mean(&|w| w[1]).abs() < 0.1);
    }
    // Of the other direction of a rim few are near the horizon: it is drawn as the protocol's.
    let rim = of(&truth, PairKind::Rim);
    let both = rim.iter().filter(|pair| pair.wi[2].max(pair.wr[2]) < 0.1);
    assert!(both.count() < rim.len() / 4);
    let few = Truth::new(&fabric("tshirt-white"), 4, 7, Progress::silent()).unwrap();
    assert_eq!(of(&few, PairKind::RimLast).len(), 512);
}

#[test]
fn errors_of_rims_are_relative_to_the_mean_of_the_protocol_and_in_no_other_set() {
    let truth = truth();
    // Half as much again at rims alone.
    let exact: Vec<[f64; 3]> = {
        use sateen::model::{Model, Rule, Sadeghi};
        let model = Sadeghi::<f64>::new(&fabric("tshirt-white"), Rule::REFERENCE);
        let pairs = truth.pairs().iter();
        pairs.map(|pair| model.eval_cos(pair.wi, pair.wr)).collect()
    };
    let values: Vec<[f64; 3]> = truth
        .pairs()
        .iter()
        .zip(&exact)
        .map(|(pair, rho)| rho.map(|x| if pair.kind.is_rim() { 1.5 * x } else { x }))
        .collect();
    let PairErrors {
        all,
        grazing,
        rim,
        rim_both,
        rim_last,
        rmse_over_mean,
    } = truth.errors_of(&values);
    assert_eq!(
        (all.pairs, all.max, grazing.max, rmse_over_mean),
        (PAIRS, 0.0, 0.0, 0.0)
    );
    let low = |pair: &&Pair| pair.wi[2].min(pair.wr[2]) < 0.1;
    assert_eq!(
        grazing.pairs,
        truth.protocol_pairs().iter().filter(low).count()
    );

    let renders = || {
        let pairs = truth.pairs().iter().zip(&exact);
        pairs.filter(|(pair, _)| pair.kind == PairKind::Render)
    };
    let count = renders().count() as f64;
    let mean = [0, 1, 2].map(|c| renders().map(|(_, rho)| rho[c]).sum::<f64>() / count);
    for (kind, set) in [
        (PairKind::Rim, rim),
        (PairKind::RimBoth, rim_both),
        (PairKind::RimLast, rim_last),
    ] {
        let pairs = truth.pairs().iter().zip(&exact);
        let errors = pairs.filter(|(pair, _)| pair.kind == kind).map(|(_, rho)| {
            let of = |c: usize| 0.5 * rho[c] / (rho[c] + 0.01 * mean[c]);
            (0..3).map(of).fold(0.0, f64::max)
        });
        let errors: Vec<f64> = errors.collect();
        assert_eq!(set.pairs, errors.len());
        let expected = errors.iter().sum::<f64>() / errors.len() as f64;
        assert!((set.mean - expected).abs() < 1e-12, "{kind:?}");
        assert!(set.mean > 0.1, "{kind:?}");
    }
}
