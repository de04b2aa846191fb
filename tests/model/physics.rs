//! What every evaluator owes: finite, never negative, nothing below the surface, and the model's own symmetries.

use crate::common::{fabric, hostile_directions, tiny_table};
use proptest::prelude::*;
use sateen::brdf::{TangentCurve, ThreadPair, Tilt};
use sateen::fabric::LIBRARY;
use sateen::model::{Model, Rule, Sadeghi};

fn direction() -> impl Strategy<Value = [f64; 3]> {
    (1e-3..1f64, 0.0..std::f64::consts::TAU).prop_map(|(z, azimuth)| {
        let r = (1.0 - z * z).sqrt();
        [r * azimuth.cos(), r * azimuth.sin(), z]
    })
}

#[test]
fn hostile_directions_give_finite_light_and_none_below_the_surface() {
    let directions = hostile_directions();
    for name in [
        "denim",
        "velvet",
        "polyester-lining",
        "corduroy",
        "silk-crepe-de-chine",
        "tshirt-black-front",
    ] {
        let table = tiny_table(name);
        let midpoint = Sadeghi::<f32>::new(&fabric(name), Rule::THESIS);
        let reference = Sadeghi::<f64>::new(&fabric(name), Rule::Adaptive(1e-4));
        for wi in &directions {
            for wr in &directions {
                let double = |w: &[f32; 3]| w.map(f64::from);
                let values = [
                    table.eval_cos(*wi, *wr).map(f64::from),
                    table.eval(*wi, *wr).map(f64::from),
                    midpoint.eval_cos(*wi, *wr).map(f64::from),
                    reference.eval_cos(double(wi), double(wr)),
                ];
                for value in values.iter().flatten() {
                    assert!(
                        value.is_finite() && *value >= 0.0,
                        "{name} {wi:?} {wr:?}: {values:?}"
                    );
                }
                if !(wi[2] > 0.0 && wr[2] > 0.0) {
                    assert_eq!(values, [[0.0; 3]; 4], "{name} {wi:?} {wr:?}");
                }
            }
        }
    }
}

#[test]
fn the_brdf_is_rho_over_the_cosine() {
    let table = tiny_table("denim");
    let (wi, wr) = ([0.3f32, 0.4, 0.866_025_4], [-0.6f32, 0.0, 0.8]);
    let (rho, brdf) = (table.eval_cos(wi, wr), table.eval(wi, wr));
    for channel in 0..3 {
        assert!((brdf[channel] * wi[2] - rho[channel]).abs() < 1e-6 * rho[channel]);
    }
}

#[test]
fn the_albedo_is_a_factor_of_the_volume_part_alone() {
    let table = tiny_table("denim");
    let (wi, wr) = ([0.3f32, 0.4, 0.866_025_4], [-0.6f32, 0.0, 0.8]);
    let at = |albedo: f32| table.eval_cos_with(&[[albedo; 3], [albedo; 3]], wi, wr)[0];
    assert!((at(1.0) - at(0.0) - 2.0 * (at(0.5) - at(0.0))).abs() < 1e-6);
    let own = [table.threads()[0].albedo(), table.threads()[1].albedo()];
    assert_eq!(table.eval_cos_with(&own, wi, wr), table.eval_cos(wi, wr));
    assert_eq!(
        table.eval_cos_with(&own[..1], wi, wr),
        table.eval_cos(wi, wr)
    );
    let parts = table.components(wi, wr);
    for (part, rho) in parts.rho.iter().zip(table.eval_cos(wi, wr)) {
        assert!((part - rho).abs() < 1e-5 * rho);
    }
    let surface: f32 = parts
        .threads
        .iter()
        .zip(table.threads())
        .map(|(part, thread)| thread.coverage() * part.response.surface)
        .sum();
    assert!((surface / parts.q - at(0.0)).abs() < 1e-6);
}

#[test]
fn more_midpoints_come_closer_to_the_reference() {
    let fabric = fabric("polyester-lining");
    let reference = Sadeghi::<f64>::new(&fabric, Rule::REFERENCE);
    let pairs = sateen::metrics::protocol_pairs(&fabric, 200, 5);
    let error = |count| {
        let rule = Sadeghi::<f64>::new(&fabric, Rule::Midpoint(count));
        let error = |pair: &sateen::metrics::Pair| {
            (rule.eval_cos(pair.wi, pair.wr)[0] - reference.eval_cos(pair.wi, pair.wr)[0]).abs()
        };
        pairs.iter().map(error).sum::<f64>()
    };
    let errors = [10, 50, 250, 5000].map(error);
    assert!(
        errors.windows(2).all(|pair| pair[1] < pair[0]),
        "{errors:?}"
    );
}

/// A random curve with a mean P and projection by brute force.
fn curve() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    prop::collection::vec((-1.57..1.57f64, 0.0..1f64, any::<bool>()), 1..6).prop_map(|parts| {
        let (mut offsets, mut lengths) = (vec![parts[0].0], Vec::new());
        for (offset, length, stays) in parts {
            let last = offsets[offsets.len() - 1];
            offsets.push(if stays { last } else { offset });
            lengths.push(length + 1e-3);
        }
        (offsets, lengths)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn projections_in_closed_form_are_the_means(
        (offsets, lengths) in curve(), wi in direction(), wr in direction(), sigma_u in 0.1..3f64,
    ) {
        let curve = TangentCurve::<f64>::new(&offsets, &lengths);
        let single = TangentCurve::<f32>::new(&offsets, &lengths);
        let pair = ThreadPair::new(wi, wr, sigma_u);
        let u = pair.correlation_psi();
        let (mut view, mut both) = (0.0, 0.0);
        let total: f64 = lengths.iter().sum();
        const COUNT: usize = 4000;
        for (ends, length) in offsets.windows(2).zip(&lengths) {
            for k in 0..COUNT {
                let tilt = Tilt::<f64>::new(ends[0] + (ends[1] - ends[0]) * (k as f64 + 0.5) / COUNT as f64, 1.0);
                let facing = |w: [f64; 3]| {
                    ((tilt.cos * w[2] - tilt.sin * w[0]) / (w[0] * w[0] + w[2] * w[2]).sqrt()).max(0.0)
                };
                let (p_i, p_r) = (facing(wi), facing(wr));
                let weight = length / total / COUNT as f64;
                view += weight * p_r;
                both += weight * ((1.0 - u) * p_i * p_r + u * p_i.min(p_r));
            }
        }
        prop_assert!((curve.projection(wr) - view).abs() < 1e-5);
        prop_assert!((curve.joint_projection(&pair) - both).abs() < 1e-5);
        prop_assert!((f64::from(single.projection(wr.map(|x| x as f32))) - view).abs() < 3e-5);
    }

    #[test]
    fn the_model_is_symmetric_under_the_mirrors_of_warp_and_weft(
        index in 0..LIBRARY.len(), wi in direction(), wr in direction(),
    ) {
        let fabric = LIBRARY[index].load();
        // Of woven cloth; what symmetries curves have is in curves.rs.
        let is_woven = |name: &str| name == "warp" || name == "weft";
        prop_assume!(fabric.threads.iter().all(|thread| thread.is_straight() && is_woven(&thread.name)));
        let model = Sadeghi::<f64>::new(&fabric, Rule::Adaptive(1e-9));
        let symmetric = |name: &str| {
            let thread = fabric.threads.iter().find(|thread| thread.name == name);
            thread.is_none_or(|thread| {
                let curve = thread.tangents::<f64>();
                let tilts = curve.tilts();
                let mirrored = |a: &Tilt<f64>| tilts.iter().any(|b| (a.angle + b.angle).abs() < 1e-9 && a.weight == b.weight);
                curve.segments_are_symmetric() && tilts.iter().all(mirrored)
            })
        };
        // x → −x turns the warp around and mirrors the weft, which never minds.
        for (axis, thread) in [(0, "warp"), (1, "weft")] {
            if symmetric(thread) {
                let mirrored = |mut w: [f64; 3]| { w[axis] = -w[axis]; w };
                let (a, b) = (model.eval_cos(wi, wr), model.eval_cos(mirrored(wi), mirrored(wr)));
                for channel in 0..3 {
                    prop_assert!((a[channel] - b[channel]).abs() <= 1e-6 * a[channel] + 1e-12, "{} {a:?} {b:?}", fabric.name);
                }
            }
        }
    }
}

#[test]
fn a_segment_narrower_than_single_precision_is_a_tilt() {
    let wide = TangentCurve::<f32>::new(&[0.5, 0.5 + 1e-4], &[1.0]);
    assert_eq!((wide.tilts().len(), wide.segments().len()), (0, 1));
    let narrow = TangentCurve::<f32>::new(&[0.5, 0.5 + 1e-7], &[1.0]);
    assert_eq!((narrow.tilts().len(), narrow.segments().len()), (1, 0));
}

#[test]
fn overlapping_segments_become_disjoint_ones() {
    // -90 to 90 once, and -30 to 10 half as long, as corduroy's warp.
    let deg = |x: f64| x.to_radians();
    let curve = TangentCurve::<f64>::new(
        &[deg(-90.0), deg(90.0), deg(-30.0), deg(10.0)],
        &[1.0, 0.0, 0.5],
    );
    let pieces: Vec<(i64, i64)> = curve
        .segments()
        .iter()
        .map(|s| {
            (
                s.from.to_degrees().round() as i64,
                s.to.to_degrees().round() as i64,
            )
        })
        .collect();
    assert_eq!(pieces, [(-90, -30), (-30, 10), (10, 90)]);
    let sum: f64 = curve.segments().iter().map(|s| s.weight).sum();
    assert!((sum - 1.0).abs() < 1e-12);
    // Two parts of one density are one.
    let curve = TangentCurve::<f64>::new(&[deg(-20.0), deg(0.0), deg(10.0)], &[2.0, 1.0]);
    assert_eq!(curve.segments().len(), 1);
}
