//! Threads whose direction changes along their curve: direct evaluation against an independent float64 implementation
//! (`tests/data/golden_curves.csv`: 8-node Gauss–Legendre on every 0.02° of every curve) and against dense midpoints; what
//! such curves have in common with straight threads; and their tables.

use crate::common::{fabric, hostile_directions, tiny, tiny_table};
use proptest::prelude::*;
use sateen::bake::{Adapted, Baked, Goal, Provenance, Request, bake};
use sateen::brdf::Reweighting;
use sateen::chart::Coordinates;
use sateen::fabric::Fabric;
use sateen::metrics::protocol_pairs;
use sateen::model::{Model, Rule, Sadeghi};
use sateen::progress::Progress;
use sateen::table::Table;

const GOLDEN: &str = include_str!("../data/golden_curves.csv");

/// A fabric of one thread, with these lines of directions, offsets and lengths.
fn of_curve(directions: &str, offsets: &str, lengths: &str, gamma_deg: f64) -> Fabric {
    Fabric::from_toml(
        &text_of_curve(directions, offsets, lengths, gamma_deg),
        "curve.toml",
        None,
    )
    .unwrap()
}

fn text_of_curve(directions: &str, offsets: &str, lengths: &str, gamma_deg: f64) -> String {
    format!(
        "name = \"curve\"\n[[thread]]\nname = \"yarn\"\ndirection_deg = {directions}\ncoverage = 0.9\n\
         albedo = {{ color = [0.9, 0.5, 0.1] }}\neta = 1.5\nk_d = 0.2\ngamma_s_deg = {gamma_deg}\n\
         gamma_v_deg = {}\ntangent_offsets_deg = {offsets}\ntangent_lengths = {lengths}\n",
        2.0 * gamma_deg
    )
}

/// The largest and the mean relative difference of ρ of the red channel, over the mean plus each.
fn difference(values: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    let values: Vec<(f64, f64)> = values.collect();
    let mean = values.iter().map(|(_, truth)| truth).sum::<f64>() / values.len() as f64;
    let differences = values
        .iter()
        .map(|(value, truth)| (value - truth).abs() / (truth + 0.01 * mean));
    let (largest, sum) = differences.fold((0.0, 0.0), |(largest, sum): (f64, f64), x| {
        (largest.max(x), sum + x)
    });
    (largest, sum / values.len() as f64)
}

#[test]
fn the_reference_agrees_with_an_independent_implementation() {
    let mut models = std::collections::BTreeMap::new();
    let mut rows = 0;
    for line in GOLDEN.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let numbers: Vec<f64> = cells[2..]
            .iter()
            .map(|cell| cell.parse().unwrap())
            .collect();
        let model = models.entry((cells[0], cells[1])).or_insert_with(|| {
            let mut fabric = fabric(cells[0]);
            if cells[1] == "both" {
                fabric.reweighting = Reweighting::Both;
            }
            Sadeghi::<f64>::new(&fabric, Rule::REFERENCE)
        });
        let (pair, expected) = numbers.split_at(6);
        let [a, b, c, d, e, f] = *pair else {
            panic!("six numbers")
        };
        let found = model.components([a, b, c], [d, e, f]);
        let mut values = Vec::new();
        for thread in &found.threads {
            values.extend([
                thread.response.surface,
                thread.response.volume,
                thread.projection,
            ]);
        }
        values.push(found.q);
        values.extend(found.rho);
        assert_eq!(values.len(), expected.len());
        for (value, expected) in values.iter().zip(expected) {
            // Directions have 12 digits, which is 1e-10 of a height of 0.02, and panels of the golden values do not end at kinks.
            let allowed = 1e-6 * expected.abs() + 1e-9;
            assert!((value - expected).abs() <= allowed, "{line}: {values:?}");
        }
        rows += 1;
    }
    assert_eq!(rows, 900);
}

#[test]
fn a_curve_of_one_direction_is_the_straight_thread_exactly() {
    for (offsets, lengths) in [
        ("[-20, -5, 5, 20]", "[1, 2, 1]"),
        ("[-7, -7, 7, 7]", "[0.2, 0.6, 0.2]"),
        ("[0, 0]", "[3]"),
    ] {
        let count = offsets.split(',').count();
        let curve = format!("[{}]", vec!["37.5"; count].join(", "));
        let straight = of_curve("37.5", offsets, lengths, 8.0);
        let curved = of_curve(&curve, offsets, lengths, 8.0);
        for rule in [
            Rule::Midpoint(7),
            Rule::THESIS,
            Rule::Quadrature(3),
            Rule::REFERENCE,
        ] {
            let [a, b] = [&straight, &curved].map(|fabric| Sadeghi::<f64>::new(fabric, rule));
            let [c, d] = [&straight, &curved].map(|fabric| Sadeghi::<f32>::new(fabric, rule));
            for pair in protocol_pairs(&straight, 200, 3) {
                assert_eq!(
                    a.components(pair.wi, pair.wr),
                    b.components(pair.wi, pair.wr)
                );
                let [wi, wr] = [pair.wi, pair.wr].map(|w| w.map(|x| x as f32));
                assert_eq!(c.eval_cos(wi, wr), d.eval_cos(wi, wr));
                assert_eq!(c.eval_cos_fast(wi, wr), d.eval_cos_fast(wi, wr));
            }
        }
        let [a, b] = [&straight, &curved]
            .map(|fabric| bake(fabric, tiny(), Progress::silent()).unwrap().table);
        assert_eq!(a.threads(), b.threads());
    }
}

#[test]
fn jumps_of_no_length_do_not_bend_a_thread() {
    let straight = of_curve("20", "[-10, 10]", "[1]", 8.0);
    let jumping = of_curve("[50, 20, 20, 90]", "[0, -10, 10, 30]", "[0, 1, 0]", 8.0);
    assert!(jumping.threads[0].is_straight());
    let [a, b] = [&straight, &jumping].map(|fabric| Sadeghi::<f64>::new(fabric, Rule::REFERENCE));
    for pair in protocol_pairs(&straight, 100, 3) {
        assert_eq!(a.eval_cos(pair.wi, pair.wr), b.eval_cos(pair.wi, pair.wr));
    }
}

#[test]
fn directions_that_jump_are_threads_side_by_side() {
    let one = of_curve("[10, 10, 70, 70]", "[-20, 5, 0, 15]", "[1, 0, 2]", 5.0);
    let mut two = one.clone();
    let thread = |share: f64, direction: f64, offsets: [f64; 2]| {
        let mut thread = one.threads[0].clone();
        thread.name = format!("yarn-{direction}");
        thread.coverage *= share;
        thread.directions = vec![f64::to_radians(direction); 2];
        thread.tangent_offsets = offsets.map(f64::to_radians).to_vec();
        thread.tangent_lengths = vec![1.0];
        thread
    };
    two.threads = vec![
        thread(1.0 / 3.0, 10.0, [-20.0, 5.0]),
        thread(2.0 / 3.0, 70.0, [0.0, 15.0]),
    ];
    for rule in [Rule::Quadrature(4), Rule::REFERENCE] {
        let [a, b] = [&one, &two].map(|fabric| Sadeghi::<f64>::new(fabric, rule));
        for pair in protocol_pairs(&one, 200, 3) {
            let [a, b] = [&a, &b].map(|model| model.eval_cos(pair.wi, pair.wr)[0]);
            assert!((a - b).abs() <= 1e-12 * b, "{a} {b}");
        }
    }
}

#[test]
fn the_reference_agrees_with_dense_midpoints_however_narrow_the_lobe() {
    let curves = [
        ("[0, 40]", "[-10, 30]", "[1]"),
        ("[0, 360]", "[5, 5]", "[1]"),
        ("[-80, 80, 80, 170]", "[0, 0, 20, -60]", "[1, 0, 2]"),
        ("[0, 30]", "[-90, -50]", "[1]"),
    ];
    // γ in degrees, and how many midpoints; multiples of 3, so that the curves' jumps fall between two of them.
    for (gamma_deg, midpoints) in [(15.0, 42_000), (1.0, 102_000), (0.05, 300_000)] {
        for (directions, offsets, lengths) in curves {
            for reweighting in [Reweighting::View, Reweighting::Both] {
                let mut fabric = of_curve(directions, offsets, lengths, gamma_deg);
                fabric.reweighting = reweighting;
                let exact = Sadeghi::<f64>::new(&fabric, Rule::REFERENCE);
                let dense = Sadeghi::<f64>::new(&fabric, Rule::Midpoint(midpoints));
                let pairs = protocol_pairs(&fabric, 16, 3);
                let (largest, _) = difference(pairs.iter().map(|pair| {
                    let at = |model: &Sadeghi<f64>| model.eval_cos(pair.wi, pair.wr)[0];
                    (at(&exact), at(&dense))
                }));
                assert!(
                    largest < 3e-6,
                    "{gamma_deg}° {directions} {offsets}: {largest}"
                );
            }
        }
    }
}

#[test]
fn what_goes_in_all_directions_looks_the_same_from_all() {
    let is_isotropic = |directions: &str, offsets: &str, lengths: &str| {
        of_curve(directions, offsets, lengths, 10.0).threads[0]
            .strands(0.0)
            .are_isotropic()
    };
    assert!(is_isotropic("[0, 360]", "[0, 0]", "[1]"));
    assert!(
        is_isotropic("[20, 200]", "[0, 0]", "[1]"),
        "flat fibres: half a turn is all directions"
    );
    assert!(
        !is_isotropic("[20, 200]", "[9, 9]", "[1]"),
        "half a turn that leans"
    );
    assert!(
        is_isotropic("[20, 200, 200, 20]", "[9, 9, -9, -9]", "[1, 0, 1]"),
        "and leans back"
    );
    assert!(
        !is_isotropic("[20, 200, 200, 20]", "[9, 9, -9, -9]", "[1, 0, 2]"),
        "unevenly"
    );
    assert!(
        is_isotropic("[0, 100, 100, 360]", "[9, 9, 9, 9]", "[10, 0, 26]"),
        "in two parts of the same density"
    );
    assert!(
        !is_isotropic("[0, 100, 100, 360]", "[9, 9, 9, 9]", "[1, 0, 1]"),
        "of different ones"
    );
    assert!(!is_isotropic("[0, 359]", "[9, 9]", "[1]"));
    assert!(
        !is_isotropic("[0, 360]", "[0, 9]", "[1]"),
        "a helix has a seam"
    );
    assert!(!is_isotropic("0", "[9, 9]", "[1]"));
    assert!(is_isotropic("0", "[90, 90]", "[1]"), "upright");

    let felt = fabric("felt");
    let model = Sadeghi::<f64>::new(&felt, Rule::REFERENCE);
    let table = tiny_table("felt");
    for pair in protocol_pairs(&felt, 60, 3) {
        let turned = |w: [f64; 3]| {
            let (sin, cos) = 1.234f64.sin_cos();
            [cos * w[0] - sin * w[1], sin * w[0] + cos * w[1], w[2]]
        };
        let mirrored = |w: [f64; 3]| [w[0], -w[1], w[2]];
        let [rho, ..] = model.eval_cos(pair.wi, pair.wr);
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        let [looked_up, ..] = table.eval_cos(single(pair.wi), single(pair.wr));
        for map in [&turned as &dyn Fn([f64; 3]) -> [f64; 3], &mirrored] {
            let (wi, wr) = (map(pair.wi), map(pair.wr));
            let [other, ..] = model.eval_cos(wi, wr);
            assert!((other - rho).abs() <= 1e-6 * rho, "{other} {rho}");
            let [other, ..] = table.eval_cos(single(wi), single(wr));
            assert!(
                (other - looked_up).abs() <= 1e-4 * looked_up,
                "{other} {looked_up}"
            );
        }
    }
}

#[test]
fn felt_has_a_table_of_three_axes_and_the_smallest_of_all() {
    let felt = tiny_table("felt");
    let grid = felt.threads()[0].grid().unwrap();
    assert_eq!(grid.coordinates(), Coordinates::Isotropic);
    assert!(grid.axes()[3].is_flat());
    let projection = felt.threads()[0].projection_grid().unwrap();
    assert_eq!(
        projection.coordinates(),
        Coordinates::View { isotropic: true }
    );
    assert!(felt.decoded_bytes() < 10 << 10, "{}", felt.decoded_bytes());
    let error = Provenance::of(felt).unwrap().error.all;
    assert!(error.mean < 0.005, "{}", error.mean);
}

#[test]
fn grids_are_folded_only_where_the_curve_allows() {
    let fold = |fabric: &Fabric| {
        let table = bake(fabric, tiny(), Progress::silent()).unwrap().table;
        match table.threads()[0].grid().unwrap().coordinates() {
            Coordinates::Thread {
                ends_fold,
                sides_fold,
                ..
            } => (ends_fold, sides_fold),
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(
        fold(&of_curve("[-20, 20]", "[0, 0]", "[1]", 20.0)),
        (true, true)
    );
    assert_eq!(
        fold(&of_curve("[-20, 20]", "[9, 9]", "[1]", 20.0)),
        (false, true)
    );
    assert_eq!(
        fold(&of_curve("[-20, 20]", "[-9, 9]", "[1]", 20.0)),
        (true, false)
    );
    assert_eq!(
        fold(&of_curve("[-20, 20]", "[-9, 19]", "[1]", 20.0)),
        (false, false)
    );
}

#[test]
fn tables_of_curves_keep_what_bakes_say_of_them_and_have_no_seams() {
    // Neither ends nor sides the same: the box is twice as large, and a wrong side would show.
    let fabric = of_curve("[0, 70]", "[-10, 35]", "[1]", 20.0);
    // The projection of both directions takes half of the bytes.
    for (reweighting, max_bytes) in [("view", 256 << 10), ("both", 512 << 10)] {
        let text = format!("reweighting = \"{reweighting}\"\n{}", fabric.toml);
        let fabric = Fabric::from_toml(&text, "curve.toml", None).unwrap();
        let settings = sateen::bake::Settings {
            max_bytes,
            ..tiny()
        };
        let table = bake(&fabric, &settings, Progress::silent()).unwrap().table;
        let error = Provenance::of(&table).unwrap().error.all;
        assert!(error.mean < 0.015, "{reweighting}: {}", error.mean);

        // Across φ_h = 0, at the normal and where azimuths begin anew.
        let model = Sadeghi::<f64>::new(&fabric, Rule::REFERENCE);
        let (sin, cos) = 35f64.to_radians().sin_cos();
        let turned = |w: [f64; 3]| [cos * w[0] - sin * w[1], sin * w[0] + cos * w[1], w[2]];
        let single = |w: [f64; 3]| turned(w).map(|x| x as f32);
        for (x, y) in [(0.3, 0.2), (-0.5, 0.4), (0.0, 0.6), (-0.6, 0.0)] {
            let at = |x: f64, y: f64| [x, y, (1.0 - x * x - y * y).sqrt()];
            let wr = at(x, -y);
            let steps = [-1e-6, 1e-6].map(|step| {
                let wi = at(0.2, y + step);
                let [rho, ..] = table.eval_cos(single(wi), single(wr));
                let [truth, ..] = model.eval_cos(turned(wi), turned(wr));
                assert!(
                    (f64::from(rho) - truth).abs() < 0.1 * truth,
                    "{rho} for {truth}"
                );
                rho
            });
            let step = (steps[0] - steps[1]).abs() / steps[0];
            assert!(step < 1e-3, "{reweighting} {x} {y}: {step}");
        }
    }
}

#[test]
fn tables_of_curves_come_back_from_their_bytes_and_no_prefix_of_them_does() {
    for name in ["felt", "weft-knit-curve"] {
        let table = tiny_table(name);
        let bytes = table.to_bytes().unwrap();
        assert_eq!(Table::from_bytes(&bytes).as_ref(), Ok(table));
        for length in 0..bytes.len().min(1500) {
            assert!(
                Table::from_bytes(&bytes[..length]).is_err(),
                "{name}: {length} bytes"
            );
        }
    }
    let bytes = tiny_table("felt").to_bytes().unwrap();
    let header = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    for bit in 0..8 * header {
        let mut flipped = bytes.clone();
        flipped[bit / 8] ^= 1 << (bit % 8);
        assert!(Table::from_bytes(&flipped).is_err(), "bit {bit}");
        // With a checksum that fits, what is still a table is one that evaluates.
        let crc = crc32fast::hash(&flipped[20..header]);
        flipped[16..20].copy_from_slice(&crc.to_le_bytes());
        crate::common::assert_refused_or_light(&format!("bit {bit}"), &flipped);
    }
}

#[test]
fn a_bake_does_not_try_direct_evaluation_where_every_thread_is_a_curve() {
    let settings = sateen::bake::Settings {
        max_bytes: 4 << 10,
        ..tiny()
    };
    let fabric = of_curve("[0, 150]", "[-30, 60]", "[1]", 3.0);
    let request = Request {
        goal: Goal::Promise,
        ..settings.into()
    };
    let Baked {
        provenance, within, ..
    } = bake(&fabric, request, Progress::silent()).unwrap();
    assert!(
        !within && provenance.adapted == Some(Adapted::Larger),
        "{:?}",
        provenance.adapted
    );
}

#[test]
fn mistakes_in_directions_are_named() {
    let error = |directions: &str| {
        let text = text_of_curve(directions, "[-20, 20]", "[1]", 8.0);
        Fabric::from_toml(&text, "curve.toml", None)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        error("[0, 1, 2]"),
        "curve.toml:4: direction_deg: 3 directions for 2 tangent offsets; give one for each, or a single one for all"
    );
    assert_eq!(
        error("[0, 361]"),
        "curve.toml:4: direction_deg = 361.0 must lie between -360 and 360"
    );
    assert_eq!(
        error("nan"),
        "curve.toml:4: direction_deg = NaN must lie between -360 and 360"
    );
    let wrong = error("\"north\"");
    assert!(
        wrong.contains("curve.toml:4: direction_deg")
            && wrong.contains("degrees, or a list of them"),
        "{wrong}"
    );
}

#[test]
fn the_text_of_a_curve_reads_back() {
    for name in ["weft-knit-curve", "warp-knit", "felt", "velvet-spread"] {
        let fabric = fabric(name);
        let again = Fabric::from_toml(&fabric.to_toml(), name, None).unwrap();
        for (a, b) in fabric.threads.iter().zip(&again.threads) {
            let close = |a: &[f64], b: &[f64]| {
                a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-14)
            };
            assert!(
                close(&a.directions, &b.directions)
                    && close(&a.tangent_offsets, &b.tangent_offsets)
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    /// Whatever the curve, light is finite and not negative, for hostile directions too, and all rules are near each other.
    #[test]
    fn any_curve_is_light(
        points in prop::collection::vec((-90.0..90f64, -360.0..360f64, prop_oneof![1 => Just(0.0), 4 => 0.01..2f64]), 2..6),
        gamma_deg in prop_oneof![Just(0.01), 0.1..60f64],
        seed in 0..1000u64,
    ) {
        let list = |of: &dyn Fn(&(f64, f64, f64)) -> f64, skip: usize| {
            let numbers: Vec<String> = points.iter().skip(skip).map(|point| format!("{:?}", of(point))).collect();
            format!("[{}]", numbers.join(", "))
        };
        prop_assume!(points.iter().skip(1).any(|point| point.2 > 0.0));
        let fabric = of_curve(&list(&|p| p.1, 0), &list(&|p| p.0, 0), &list(&|p| p.2, 1), gamma_deg);
        let reference = Sadeghi::<f64>::new(&fabric, Rule::REFERENCE);
        let single = Sadeghi::<f32>::new(&fabric, Rule::Quadrature(4));
        let hostile = hostile_directions();
        for (k, wi) in hostile.iter().enumerate().step_by(3) {
            let wr = hostile[(k * 7 + seed as usize) % hostile.len()];
            let rho = single.eval_cos(*wi, wr);
            prop_assert!(rho.iter().all(|x| x.is_finite() && *x >= 0.0), "{wi:?} {wr:?} {rho:?}");
            let rho = reference.eval_cos(wi.map(f64::from), wr.map(f64::from));
            prop_assert!(rho.iter().all(|x| x.is_finite() && *x >= 0.0), "{wi:?} {wr:?} {rho:?}");
        }
        if gamma_deg > 5.0 {
            // Midpoints lie evenly along the length: a pair that sees a short part alone has few of them.
            let lengths = points.iter().skip(1).map(|point| point.2).filter(|length| *length > 0.0);
            let shortest = lengths.clone().fold(f64::INFINITY, f64::min);
            let parts = (lengths.sum::<f64>() / shortest).min(50.0);
            let fine = Sadeghi::<f64>::new(&fabric, Rule::Midpoint((10_000.0 * parts.max(2.0)) as u32));
            let (largest, _) = difference(protocol_pairs(&fabric, 8, seed).iter().map(|pair| {
                (reference.eval_cos(pair.wi, pair.wr)[0], fine.eval_cos(pair.wi, pair.wr)[0])
            }));
            prop_assert!(largest < 1e-3, "{largest}");
        }
    }
}
