//! Charts are bijections between the box and pairs of directions above the surface, up to the mirror s → −s.

use proptest::prelude::*;
use sateen::bake::enclosure::{Range, Span};
use sateen::chart::{Chart, Coordinates, Rim};
use sateen::needs::Cap;

fn any_chart() -> impl Strategy<Value = Chart> {
    prop::sample::select(Chart::ALL.to_vec())
}

fn any_rim() -> impl Strategy<Value = Rim> {
    prop::sample::select(
        [0, 10, 20, Rim::WIDEST]
            .map(|rim| Rim::new(rim).unwrap())
            .to_vec(),
    )
}

/// What grids of a thread's response may be functions of.
fn any_coordinates() -> impl Strategy<Value = Coordinates> {
    let thread = (any_chart(), any::<bool>(), any::<bool>(), any_rim()).prop_map(
        |(chart, ends_fold, sides_fold, rim)| Coordinates::Thread {
            chart,
            ends_fold,
            sides_fold,
            rim,
        },
    );
    prop_oneof![4 => thread, 1 => Just(Coordinates::Isotropic)]
}

/// A direction turned or mirrored.
type Image = Box<dyn Fn([f64; 3]) -> [f64; 3]>;

/// A unit direction above the surface; a tenth of them within 1e-6 of the horizon.
fn direction() -> impl Strategy<Value = [f64; 3]> {
    (0.0..1f64, -1.0..1f64, 0..10u8).prop_map(|(z, turn, near)| {
        let z = if near == 0 { 1e-6 * z } else { z }.max(1e-12);
        let (sin, cos) = (turn * std::f64::consts::PI).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [r * cos, r * sin, z]
    })
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

fn mirrored(w: [f64; 3]) -> [f64; 3] {
    [w[0], -w[1], w[2]]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn a_pair_comes_back_from_the_box(chart in any_chart(), wi in direction(), wr in direction()) {
        let u = chart.coordinates(Rim::NONE, wi, wr);
        prop_assert!(u.iter().all(|u| (0.0..=1.0).contains(u)), "{u:?}");
        let (vi, vr) = chart.directions(Rim::NONE, u);
        let error = (distance(vi, wi) + distance(vr, wr)).min(distance(vi, mirrored(wi)) + distance(vr, mirrored(wr)));
        prop_assert!(error < 2e-7, "{chart:?} {u:?}: {wi:?} {wr:?} came back as {vi:?} {vr:?}, {error:e} away");
    }

    #[test]
    fn a_point_of_the_box_comes_back_from_directions(chart in any_chart(), u in prop::array::uniform4(0.0..1f64)) {
        let (wi, wr) = chart.directions(Rim::NONE, u);
        for w in [wi, wr] {
            prop_assert!(w[2] >= 0.0 && (distance(w, [0.0; 3]) - 1.0).abs() < 1e-12, "{w:?}");
        }
        let v = chart.coordinates(Rim::NONE, wi, wr);
        // Where a range has shrunk by a factor, so has the precision of the coordinate in it.
        let room = (1.0 - (2.0 * u[0] - 1.0).abs()) * (1.0 - u[3]);
        let bound = 1e-9 / room.max(1e-9);
        for k in 0..4 {
            prop_assert!((u[k] - v[k]).abs() < bound, "{chart:?} {u:?} came back as {v:?}");
        }
    }

    #[test]
    fn a_pair_comes_back_from_any_coordinates_but_for_their_symmetries(
        coordinates in any_coordinates(), wi in direction(), wr in direction(),
    ) {
        let u = coordinates.of(wi, wr);
        prop_assert!(u.iter().all(|u| (0.0..=1.0).contains(u)), "{u:?}");
        // What is beyond a rim has no place in the box.
        let is_beyond = coordinates.share_of_box(wi, wr) <= 0.0;
        let (vi, vr) = coordinates.directions(u);
        let along = |w: [f64; 3]| [-w[0], w[1], w[2]];
        let same = |w: [f64; 3]| w;
        let mut images: Vec<Image> = vec![Box::new(same)];
        if let Coordinates::Thread { ends_fold, sides_fold, .. } = coordinates {
            if ends_fold {
                images.push(Box::new(along));
            }
            if sides_fold {
                images.push(Box::new(mirrored));
            }
            if ends_fold && sides_fold {
                images.push(Box::new(move |w| mirrored(along(w))));
            }
        } else {
            // Turned so that the light is at azimuth 0, and mirrored.
            let turned = move |w: [f64; 3]| {
                let r = wi[0].hypot(wi[1]);
                let (cos, sin) = if r > 0.0 { (wi[0] / r, wi[1] / r) } else { (1.0, 0.0) };
                [cos * w[0] + sin * w[1], cos * w[1] - sin * w[0], w[2]]
            };
            images = vec![Box::new(turned), Box::new(move |w| mirrored(turned(w)))];
        }
        let errors = images.iter().map(|image| distance(vi, image(wi)) + distance(vr, image(wr)));
        let error = errors.fold(f64::INFINITY, f64::min);
        prop_assert!(is_beyond || error < 2e-7, "{coordinates:?} {u:?}: {wi:?} {wr:?} came back as {vi:?} {vr:?}, {error:e} away");
    }

    #[test]
    fn the_view_comes_back_from_its_coordinates(wr in direction()) {
        let coordinates = Coordinates::View { isotropic: false };
        let (_, back) = coordinates.directions(coordinates.of([0.0, 0.0, 1.0], wr));
        prop_assert!(distance(back, wr) < 1e-12);
    }

    #[test]
    fn both_precisions_agree_on_the_coordinates(chart in any_chart(), wi in direction(), wr in direction()) {
        let single = |w: [f64; 3]| w.map(|x| x as f32);
        let u = chart.coordinates(Rim::NONE, single(wi), single(wr));
        let double = |w: [f32; 3]| w.map(f64::from);
        let v = chart.coordinates(Rim::NONE, double(single(wi)), double(single(wr)));
        let room = (1.0 - (2.0 * v[0] - 1.0).abs()) * (1.0 - v[3]);
        let bound = 1e-6 / room.max(1e-6);
        // At φ_h = 0 rounding decides which of the two mirror images a pair is.
        let flipped = v[3] < bound && (f64::from(u[2]) - v[2]).abs() > 0.5;
        for k in 0..4 {
            let expected = if k == 2 && flipped { 1.0 - v[k] } else { v[k] };
            prop_assert!((f64::from(u[k]) - expected).abs() < bound, "{chart:?} {u:?} {v:?}");
        }
    }
}

#[test]
fn the_highlight_of_a_tilted_segment_is_a_plane_of_the_box() {
    for tilt_deg in [-60.0, -25.0, 0.0, 5.0, 40.0f64] {
        let tilt = tilt_deg.to_radians();
        for (x, phi_i, phi_r) in [(0.1, 0.3, -0.2), (-0.4, 0.0, 1.0), (0.6f64, -0.9, -0.8f64)] {
            let r = (1.0 - x * x).sqrt();
            let to_thread = |x: f64, phi: f64| {
                let (y, z) = (r * phi.sin(), r * phi.cos());
                [
                    tilt.cos() * x - tilt.sin() * z,
                    y,
                    tilt.cos() * z + tilt.sin() * x,
                ]
            };
            let (wi, wr) = (to_thread(x, phi_i), to_thread(-x, phi_r));
            let u = Chart::Highlight.coordinates(Rim::NONE, wi, wr);
            assert!((u[0] - (0.5 - tilt_deg / 180.0)).abs() < 1e-12);
        }
    }
}

#[test]
fn special_pairs_have_the_stated_coordinates() {
    let w = [0.3f64, 0.4, (1.0 - 0.25f64).sqrt()];
    for chart in Chart::ALL {
        let u = chart.coordinates(Rim::NONE, w, w);
        assert!(
            (u[1] - 0.5).abs() < 1e-12 && (u[2] - 0.5).abs() < 1e-12,
            "wi = wr: {u:?}"
        );
        let u = chart.coordinates(Rim::NONE, w, [-w[0], -w[1], w[2]]);
        assert!(
            (u[0] - 0.5).abs() < 1e-12 && u[3].abs() < 1e-12,
            "mirror pair: {u:?}"
        );
        let along = [1.0, 0.0, 0.0];
        let u = chart.coordinates(Rim::NONE, along, along);
        assert_eq!(u[1..], [0.5, 0.5, 0.0], "both along the thread");
        let beside = [0.0, 1.0, 0.0f64];
        let u = chart.coordinates(Rim::NONE, beside, beside);
        assert!(
            (u[2] - 0.5).abs() < 1e-12 && u[3] > 1.0 - 1e-12,
            "both at the horizon beside the thread: {u:?}"
        );
        let u = chart.coordinates(Rim::NONE, [0.0, 1.0, 0.0], [0.0, 0.0, 1.0f64]);
        assert!((u[2] - 1.0).abs() < 1e-12, "light at the horizon: {u:?}");
        let u = chart.coordinates(Rim::NONE, [0.0, 0.0, 1.0], [0.0, 1.0, 0.0f64]);
        assert!(u[2].abs() < 1e-12, "viewer at the horizon: {u:?}");
    }
}

/// The cap around some directions, and directions in it.
fn cap() -> impl Strategy<Value = (Cap, [f64; 3])> {
    let radius = prop_oneof![Just(0.0), 1e-3..0.1f64, 0.1..1.0f64];
    (direction(), radius, 0.0..1f64, 0.0..6.3f64).prop_map(|(axis, radius, part, turn)| {
        let length = |a: f64, b: f64| (a * a + b * b).sqrt();
        let beside = if axis[2] < 0.9 {
            let r = length(axis[0], axis[1]);
            [-axis[1] / r, axis[0] / r, 0.0]
        } else {
            let r = length(axis[2], axis[0]);
            [axis[2] / r, 0.0, -axis[0] / r]
        };
        let [x, y, z] = axis;
        let [a, b, c] = beside;
        let third = [y * c - z * b, z * a - x * c, x * b - y * a];
        let (sin, cos) = (part * radius).sin_cos();
        let w = [0, 1, 2]
            .map(|k| cos * axis[k] + sin * (turn.cos() * beside[k] + turn.sin() * third[k]));
        (Cap { axis, radius }, w)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200_000))]

    #[test]
    fn pairs_of_two_caps_lie_in_the_boxes_that_enclose_them(
        coordinates in any_coordinates(), (cap_i, wi) in cap(), (cap_r, wr) in cap(),
    ) {
        let is_in = |u: [f64; 4], boxes: &[[Range; 4]]| {
            boxes.iter().any(|ranges| ranges.iter().zip(u).all(|([low, high], u)| (*low..=*high).contains(&u)))
        };
        if wi[2] > 0.0 && wr[2] > 0.0 {
            let mut boxes = Vec::new();
            coordinates.enclose(&Span::new(cap_i), &Span::new(cap_r), |found| boxes.push(found));
            let single = |w: [f64; 3]| w.map(|x| x as f32);
            let has_part = |wi, wr| coordinates.share_of_box(wi, wr) > 0.0;
            let u = coordinates.of(single(wi), single(wr)).map(f64::from);
            prop_assert!(!has_part(wi, wr) || is_in(u, &boxes), "{coordinates:?}: {u:?} of {wi:?} {wr:?} is not in {boxes:?}");
            prop_assert!(!has_part(wi, wr) || is_in(coordinates.of(wi, wr), &boxes));

            let mut boxes = Vec::new();
            coordinates.enclose_collocated(&Span::new(cap_i), |found| boxes.push(found));
            let u = coordinates.of(single(wi), single(wi)).map(f64::from);
            prop_assert!(!has_part(wi, wi) || is_in(u, &boxes), "{coordinates:?}: {u:?} of {wi:?} is not in {boxes:?}");
        }
    }
}
