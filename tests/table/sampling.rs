//! Drawing of directions: densities integrate to 1 and are those of what is drawn, what is drawn estimates the light without bias, and
//! nothing that reflects light is left out.

use crate::common::hostile::{chunk_range, repair_chunk};
use crate::common::{fabric, hostile_directions, tiny};
use sateen::bake::{Direct, Settings, bake};
use sateen::fabric::{Fabric, LIBRARY};
use sateen::lookup::Quantity;
use sateen::math::simd::Level;
use sateen::needs::Needs;
use sateen::progress::Progress;
use sateen::table::{Energy, Error, Table};
use std::f64::consts::{PI, TAU};

/// A table with all for sampling, and without grids where that can be.
fn table_of(fabric: &Fabric, energy: Energy) -> Table {
    let settings = Settings {
        direct: Direct::Always,
        sampling: true,
        energy,
        ..tiny()
    };
    bake(fabric, &settings, Progress::silent()).unwrap().table
}

fn table(name: &str) -> Table {
    table_of(&fabric(name), Energy::AsIs)
}

fn direction(elevation_deg: f64, azimuth_deg: f64) -> [f32; 3] {
    let (sin, cos) = elevation_deg.to_radians().sin_cos();
    let (y, x) = azimuth_deg.to_radians().sin_cos();
    [sin * x, sin * y, cos].map(|x| x as f32)
}

/// Views that every fabric is tried at.
fn views() -> Vec<[f32; 3]> {
    let elevations = [0.0, 25.0, 50.0, 70.0, 85.0, 89.0, 89.99];
    let azimuths = [5.0, 100.0, 222.0];
    let all = elevations.map(|e| azimuths.map(|a| direction(e, a)));
    all.as_flattened().to_vec()
}

/// Numbers that look random, in [0, 1).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = self
            .0
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    fn pair(&mut self) -> [f32; 2] {
        [self.next(), self.next()]
    }
}

/// Directions of a grid over part of the hemisphere, with weights that sum to its solid angle; z is the square of what is even, so that the
/// horizon has many.
struct Grid {
    wi: [Vec<f32>; 3],
    weights: Vec<f64>,
}

impl Grid {
    fn new(root_z: [f64; 2], azimuth: [f64; 2], counts: [usize; 2]) -> Self {
        let mut grid = Self {
            wi: Default::default(),
            weights: Vec::new(),
        };
        let step = |[from, to]: [f64; 2], count: usize| (to - from) / count as f64;
        let steps = [step(root_z, counts[0]), step(azimuth, counts[1])];
        for i in 0..counts[0] {
            let root = root_z[0] + steps[0] * (i as f64 + 0.5);
            let (z, r) = (root * root, (1.0 - root.powi(4)).sqrt());
            for j in 0..counts[1] {
                let (sin, cos) = (azimuth[0] + steps[1] * (j as f64 + 0.5)).sin_cos();
                for (to, x) in grid.wi.iter_mut().zip([r * cos, r * sin, z]) {
                    to.push(x as f32);
                }
                grid.weights.push(2.0 * root * steps[0] * steps[1]);
            }
        }
        grid
    }

    fn whole(count: usize) -> Self {
        Self::new([0.0, 1.0], [0.0, TAU], [count, 2 * count])
    }

    fn wi(&self) -> [&[f32]; 3] {
        self.wi.each_ref().map(Vec::as_slice)
    }

    fn views(&self, wr: [f32; 3]) -> [Vec<f32>; 3] {
        wr.map(|x| vec![x; self.weights.len()])
    }

    /// ∫ pdf dwi.
    fn density(&self, table: &Table, wr: [f32; 3]) -> f64 {
        let wr = self.views(wr);
        let mut pdf = vec![0.0; self.weights.len()];
        table.pdf_batch(&[], self.wi(), wr.each_ref().map(Vec::as_slice), &mut pdf);
        let terms = self.weights.iter().zip(&pdf);
        terms.map(|(weight, pdf)| weight * f64::from(*pdf)).sum()
    }

    /// ∫ ρ dwi, linear RGB.
    fn light(&self, table: &Table, albedos: &[[f32; 3]], wr: [f32; 3]) -> [f64; 3] {
        let wr = self.views(wr);
        let mut rho = [(); 3].map(|()| vec![0.0; self.weights.len()]);
        table.eval_batch_at(
            Level::detect(),
            albedos,
            Quantity::Rho,
            self.wi(),
            wr.each_ref().map(Vec::as_slice),
            rho.each_mut().map(Vec::as_mut_slice),
        );
        rho.map(|rho| {
            let terms = self.weights.iter().zip(&rho);
            terms.map(|(weight, rho)| weight * f64::from(*rho)).sum()
        })
    }
}

/// That the density integrates to 1, for views up to the horizon.
fn assert_dense(name: &str) {
    let (grid, table) = (Grid::whole(800), table(name));
    let views = [
        (0.0, 5.0),
        (50.0, 100.0),
        (80.0, 222.0),
        (89.0, 40.0),
        (89.99, 160.0),
    ];
    for (elevation, azimuth) in views {
        let integral = grid.density(&table, direction(elevation, azimuth));
        assert!(
            (integral - 1.0).abs() < 1e-3,
            "{name} {elevation} {azimuth}: {integral}"
        );
    }
}

#[test]
fn densities_integrate_to_one() {
    for name in ["velvet", "polyester-satin-charmeuse-front", "weft-knit"] {
        assert_dense(name);
    }
}

#[test]
#[ignore = "a sweep: scripts/sweeps.sh"]
fn densities_of_all_fabrics_integrate_to_one() {
    for entry in LIBRARY {
        assert_dense(entry.name);
    }
}

/// What χ² of so many degrees of freedom exceeds with probability about 10⁻⁶ (Wilson and Hilferty).
fn critical(freedom: f64) -> f64 {
    let ninth = 2.0 / (9.0 * freedom);
    freedom * (1.0 - ninth + 4.75 * ninth.sqrt()).powi(3)
}

/// χ² of what is drawn against the density, over cells of the hemisphere.
fn assert_drawn_as_dense(name: &str, table: &Table, wr: [f32; 3], samples: usize) {
    const CELLS: [usize; 2] = [12, 24];
    let mut found = vec![0.0; CELLS[0] * CELLS[1]];
    let mut numbers = Numbers(7);
    let view = table.at_view(&[], wr);
    for _ in 0..samples {
        let sample = view.sample_cos(numbers.pair()).expect("a direction");
        let [x, y, z] = sample.wi.map(f64::from);
        let row = (z.sqrt() * CELLS[0] as f64) as usize;
        let column = (y.atan2(x).rem_euclid(TAU) / TAU * CELLS[1] as f64) as usize;
        found[row.min(CELLS[0] - 1) * CELLS[1] + column.min(CELLS[1] - 1)] += 1.0;
    }
    let (mut chi2, mut freedom, mut rest) = (0.0, -1.0, [0.0; 2]);
    for (cell, found) in found.iter().enumerate() {
        let part =
            |k: usize, count: usize, end: f64| [k, k + 1].map(|k| end * k as f64 / count as f64);
        let [row, column] = [cell / CELLS[1], cell % CELLS[1]];
        let grid = Grid::new(
            part(row, CELLS[0], 1.0),
            part(column, CELLS[1], TAU),
            [40, 40],
        );
        let expected = samples as f64 * grid.density(table, wr);
        // Cells of a few samples count as one.
        if expected < 10.0 {
            rest = [rest[0] + expected, rest[1] + found];
        } else {
            chi2 += (found - expected).powi(2) / expected;
            freedom += 1.0;
        }
    }
    if rest[0] > 0.0 {
        chi2 += (rest[1] - rest[0]).powi(2) / rest[0].max(1.0);
        freedom += 1.0;
    }
    assert!(
        chi2 < critical(freedom),
        "{name} {wr:?}: {chi2} for {freedom}"
    );
}

#[test]
fn directions_are_drawn_as_their_density_says() {
    for name in ["denim", "velvet", "tshirt-white", "felt"] {
        let table = table(name);
        for wr in [
            direction(20.0, 30.0),
            direction(65.0, 200.0),
            direction(87.0, 100.0),
        ] {
            assert_drawn_as_dense(name, &table, wr, 100_000);
        }
    }
}

#[test]
#[ignore = "a sweep: scripts/sweeps.sh"]
fn directions_of_all_fabrics_are_drawn_as_their_density_says() {
    for entry in LIBRARY {
        let table = table(entry.name);
        for k in 0..20 {
            let wr = direction(4.6 * f64::from(k), 67.0 * f64::from(k));
            assert_drawn_as_dense(entry.name, &table, wr, 1_000_000);
        }
    }
}

#[test]
fn samples_estimate_the_light_from_everywhere_without_bias() {
    let grid = Grid::whole(300);
    for name in [
        "denim",
        "velvet",
        "tshirt-white",
        "silk-shot",
        "weft-knit",
        "felt",
    ] {
        let table = table(name);
        for wr in [
            direction(0.0, 0.0),
            direction(45.0, 20.0),
            direction(80.0, 250.0),
        ] {
            let view = table.at_view(&[], wr);
            let mut numbers = Numbers(3);
            let (mut sum, mut squares) = (0.0, 0.0);
            let count = 40_000;
            for _ in 0..count {
                let sample = view.sample_cos(numbers.pair()).expect("a direction");
                assert_eq!(sample.pdf, view.pdf(sample.wi));
                assert_eq!(sample.rho, table.eval_cos(sample.wi, wr));
                let weight = f64::from(sample.rho[1] / sample.pdf);
                sum += weight;
                squares += weight * weight;
            }
            let mean = sum / f64::from(count);
            let variance = squares / f64::from(count) - mean * mean;
            let deviation = (variance / f64::from(count)).sqrt();
            let [_, truth, _] = grid.light(&table, &[], wr);
            assert!(
                (mean - truth).abs() < 5.0 * deviation + 2e-3 * truth,
                "{name} {wr:?}: {mean} ± {deviation}, {truth}"
            );
            // What stands almost upright is harder to tell from nodes.
            let albedo = f64::from(table.albedo(wr).unwrap()[1]);
            assert!(
                (albedo / truth - 1.0).abs() < 0.03,
                "{name} {wr:?}: {albedo}, {truth}"
            );
        }
    }
}

#[test]
fn a_viewer_is_found_for_a_light_by_its_view() {
    let table = table("silk-shot");
    let wi = direction(50.0, 70.0);
    let view = table.at_view(&[], wi);
    let mut numbers = Numbers(5);
    let count = 40_000;
    let mut sum = 0.0;
    for _ in 0..count {
        let sample = view.sample_cos(numbers.pair()).expect("a direction");
        let wr = sample.wi;
        sum += f64::from(table.eval(wi, wr)[0] * wr[2] / sample.pdf) / f64::from(count);
    }
    let grid = Grid::whole(300);
    let directions = (0..grid.weights.len()).map(|k| grid.wi.each_ref().map(|w| w[k]));
    let terms = grid.weights.iter().zip(directions);
    let truth: f64 = terms
        .map(|(weight, wr)| weight * f64::from(table.eval(wi, wr)[0] * wr[2]))
        .sum();
    assert!((sum / truth - 1.0).abs() < 0.05, "{sum} {truth}");
}

#[test]
fn what_reflects_light_is_drawn() {
    for name in [
        "velvet",
        "faux-suede",
        "tshirt-black-front",
        "felt",
        "weft-knit",
    ] {
        let table = table(name);
        let mut numbers = Numbers(11);
        for _ in 0..20_000 {
            let mut direction = || {
                let [u, v] = numbers.pair();
                let z = u * u * u + 1e-7;
                let r = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
                let (sin, cos) = (std::f32::consts::TAU * v).sin_cos();
                [r * cos, r * sin, z]
            };
            let (wi, wr) = (direction(), direction());
            let pdf = table.pdf(wi, wr);
            // The cosine alone sees to that.
            assert!(
                pdf >= 0.049 * wi[2] / PI as f32,
                "{name} {wi:?} {wr:?}: {pdf}"
            );
        }
    }
}

#[test]
fn hostile_directions_and_numbers_give_no_sample_or_a_number() {
    let hostile_numbers = [
        0.0,
        -0.0,
        f32::MIN_POSITIVE,
        0.05,
        0.5,
        1.0 - f32::EPSILON / 2.0,
    ];
    let no_numbers = [-1e-9, 1.0, 2.0, f32::NAN, f32::INFINITY];
    for name in ["denim", "velvet", "felt"] {
        for table in [
            table(name),
            bake(&fabric(name), tiny(), Progress::silent())
                .unwrap()
                .table,
        ] {
            for wr in hostile_directions() {
                let view = table.at_view(&[], wr);
                let albedo = view.albedo().unwrap_or([0.0; 3]);
                assert!(
                    albedo.iter().all(|x| x.is_finite() && *x >= 0.0),
                    "{wr:?} {albedo:?}"
                );
                for wi in hostile_directions() {
                    let pdf = view.pdf(wi);
                    assert!(pdf.is_finite() && pdf >= 0.0, "{name} {wi:?} {wr:?}: {pdf}");
                    assert!(pdf == table.pdf(wi, wr) && (pdf == 0.0 || wi[2] > 0.0 && wr[2] > 0.0));
                }
                for u in hostile_numbers {
                    for v in hostile_numbers {
                        if let Some(sample) = view.sample_cos([u, v]) {
                            let [x, y, z] = sample.wi;
                            assert!(z > 0.0 && (x * x + y * y + z * z - 1.0).abs() < 1e-3);
                            assert!(sample.pdf > 0.0 && sample.pdf.is_finite());
                            assert!(sample.rho.iter().all(|x| x.is_finite() && *x >= 0.0));
                        } else {
                            assert!(
                                !(wr[2] > 1e-30 && wr[2] <= 1.0 && wr[0].is_finite()),
                                "{wr:?} {u} {v}"
                            );
                        }
                    }
                    for v in no_numbers {
                        assert_eq!(view.sample_cos([u, v]), None);
                        assert_eq!(view.sample_cos([v, u]), None);
                    }
                }
            }
        }
    }
}

#[test]
fn batches_are_as_single_pairs_on_every_level() {
    for name in ["denim", "velvet", "weft-knit"] {
        let table = table(name);
        let mut numbers = Numbers(23);
        let count = 203;
        let mut directions = || {
            let mut all: [Vec<f32>; 3] = Default::default();
            for _ in 0..count {
                let [u, v] = numbers.pair();
                for (to, x) in all
                    .iter_mut()
                    .zip(direction(f64::from(u) * 89.9, f64::from(v) * 360.0))
                {
                    to.push(x);
                }
            }
            all
        };
        let (wi, wr) = (directions(), directions());
        let slices = |w: &'_ [Vec<f32>; 3]| w.each_ref().map(|w| w.clone());
        let (wi, wr) = (slices(&wi), slices(&wr));
        let at = |w: &[Vec<f32>; 3], k: usize| w.each_ref().map(|w| w[k]);
        let tint = [[0.9, 0.1, 0.3], [0.0, 0.5, 0.2]];
        for level in Level::ALL {
            let mut pdf = vec![f32::NAN; count];
            let refs = [&wi, &wr].map(|w| w.each_ref().map(Vec::as_slice));
            table.pdf_batch_at(level, &tint, refs[0], refs[1], &mut pdf);
            for (k, pdf) in pdf.into_iter().enumerate() {
                let single = table.at_view(&tint, at(&wr, k)).pdf(at(&wi, k));
                let difference = (pdf - single).abs();
                assert!(
                    difference <= 1e-4 * single + 1e-6,
                    "{name} {}: {pdf} {single}",
                    level.name()
                );
            }
        }
        let u: [Vec<f32>; 2] = [(); 2].map(|()| (0..count).map(|_| numbers.next()).collect());
        let [mut found, mut rho] = [(); 2].map(|()| [(); 3].map(|()| vec![0.0; count]));
        let mut pdf = vec![0.0; count];
        table.sample_cos_batch(
            &tint,
            wr.each_ref().map(Vec::as_slice),
            u.each_ref().map(Vec::as_slice),
            found.each_mut().map(Vec::as_mut_slice),
            rho.each_mut().map(Vec::as_mut_slice),
            &mut pdf,
        );
        for k in 0..count {
            let view = table.at_view(&tint, at(&wr, k));
            let sample = view.sample_cos([u[0][k], u[1][k]]).unwrap();
            assert_eq!(at(&found, k), sample.wi);
            assert!((pdf[k] / sample.pdf - 1.0).abs() < 1e-3);
            let close = |(a, b): (f32, f32)| (a - b).abs() <= 1e-3 * b + 1e-4;
            assert!(at(&rho, k).into_iter().zip(sample.rho).all(close));
        }
    }
}

#[test]
fn tints_are_in_albedos_and_steer_what_is_drawn() {
    let table = table("silk-shot");
    let grid = Grid::whole(200);
    let wr = direction(40.0, 75.0);
    let red_warp = [[1.0, 0.0, 0.0], [0.0, 0.0, 0.0]];
    let view = table.at_view(&red_warp, wr);
    let truth = grid.light(&table, &red_warp, wr);
    for (albedo, truth) in view.albedo().unwrap().into_iter().zip(truth) {
        assert!(
            (f64::from(albedo) / truth - 1.0).abs() < 0.02,
            "{albedo} {truth}"
        );
    }
    let black = [[0.0; 3]; 2];
    let wi = direction(10.0, 10.0);
    assert_ne!(view.pdf(wi), table.at_view(&black, wr).pdf(wi));
}

#[test]
fn energy_per_view_dims_the_views_that_overshoot_alone() {
    let fabric = fabric("tshirt-white");
    let (plain, dimmed) = (
        table_of(&fabric, Energy::AsIs),
        table_of(&fabric, Energy::PerView),
    );
    assert_eq!(dimmed.energy(), Energy::PerView);
    let grid = Grid::whole(200);
    let wi = direction(30.0, 140.0);
    let mut overshoots = 0;
    for wr in views() {
        let albedo = plain.albedo(wr).unwrap();
        let most = albedo.into_iter().fold(1.0, f32::max);
        overshoots += u32::from(most > 1.0);
        let [a, b] = [&plain, &dimmed].map(|table| table.eval_cos(wi, wr));
        for (a, b) in a.into_iter().zip(b) {
            assert!(
                (a / most - b).abs() <= 1e-5 * a,
                "{wr:?}: {a} / {most}, {b}"
            );
        }
        assert_eq!(
            dimmed.components(wi, wr).rho.map(|x| (x * 1e4).round()),
            b.map(|x| (x * 1e4).round())
        );
        let after = grid.light(&dimmed, &[], wr);
        // Albedos are from nodes.
        let limit = if wr[2] > 0.1 { 1.05 } else { 1.15 };
        assert!(after.iter().all(|x| *x < limit), "{wr:?}: {after:?}");
        assert!(dimmed.albedo(wr).unwrap().iter().all(|x| *x <= 1.0));
    }
    assert!(overshoots > 3);
    // Shaders do not know albedos by view.
    #[cfg(feature = "shader")]
    assert_eq!(
        sateen::volume::Volume::new(&dimmed, &sateen::volume::Settings::default()).unwrap_err(),
        sateen::volume::Error::PerView
    );
    // The pairs of a scene need no directions drawn, but what they are divided by.
    let scene = Settings {
        energy: Energy::PerView,
        sampling: true,
        ..tiny()
    };
    let request = sateen::bake::Request {
        scope: sateen::bake::Scope {
            needs: Some(&Needs::everything()),
            fixed_albedo: false,
        },
        ..scene.into()
    };
    let table = bake(&fabric, request, Progress::silent()).unwrap().table;
    assert!(table.has_albedo() && !table.has_sampling());
}

#[test]
fn what_there_is_for_sampling_comes_back_and_is_checked() {
    let whole = table("velvet");
    let bytes = whole.to_mappable_bytes();
    assert!(whole.has_sampling());
    assert_eq!(Table::from_bytes(&bytes).as_ref(), Ok(&whole));
    assert_eq!(
        Table::from_bytes(&whole.to_bytes().unwrap()).as_ref(),
        Ok(&whole)
    );
    // All of its chunk, which is the last: albedos, totals, edges, sums of the first thread.
    let chunk = chunk_range(&bytes, 1);
    let albedos = 33 * 33 * 8;
    let edges = albedos + 45 * 8;
    let changes: [(usize, &[u8], &str); 5] = [
        (0, &f32::NAN.to_le_bytes(), "an albedo that is no number"),
        (8, &(-1f32).to_le_bytes(), "an albedo below 0"),
        (
            albedos,
            &f32::INFINITY.to_le_bytes(),
            "a total that is infinite",
        ),
        (
            edges + 2,
            &(-32767i16).to_le_bytes(),
            "edges that are the same",
        ),
        (edges + 66 + 4, &[255; 4], "sums that descend"),
    ];
    for (at, change, what) in changes {
        let mut bytes = bytes.clone();
        bytes[chunk.start + at..][..change.len()].copy_from_slice(change);
        assert!(
            matches!(Table::from_bytes(&bytes), Err(Error::Checksum { .. })),
            "{what}"
        );
        repair_chunk(&mut bytes, 1);
        assert!(
            matches!(Table::from_bytes(&bytes), Err(Error::Invalid { .. })),
            "{what}"
        );
    }
    let without = bake(&fabric("velvet"), tiny(), Progress::silent())
        .unwrap()
        .table;
    assert!(!without.has_sampling() && without.albedo([0.0, 0.0, 1.0]).is_none());
    // By the cosine.
    let wi = direction(60.0, 0.0);
    assert!((without.pdf(wi, direction(10.0, 0.0)) - 0.5 / PI as f32).abs() < 1e-6);
}
