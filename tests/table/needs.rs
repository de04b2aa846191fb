//! Tables of what is needed alone: they are those of everything wherever they were baked, and say so where not.

use crate::common::{assert_light, fabric, hostile_directions, tiny, tiny_table};
use proptest::prelude::*;
use std::sync::LazyLock;

use sateen::bake::{BakeError, Provenance, Request, Scope, Settings, bake, forecast};
use sateen::fabric::Fabric;
use sateen::metrics::protocol_pairs;
use sateen::needs::{Directions, Needs};
use sateen::progress::Progress;
use sateen::table::{Content, Table};

type Pair = [[f32; 3]; 2];

fn single(w: [f64; 3]) -> [f32; 3] {
    w.map(|x| x as f32)
}

fn pairs_of(fabric: &Fabric, count: usize) -> Vec<Pair> {
    let pairs = protocol_pairs(fabric, count, 5).into_iter();
    pairs
        .map(|pair| [single(pair.wi), single(pair.wr)])
        .collect()
}

fn full(fabric: &Fabric, settings: &Settings) -> Table {
    bake(fabric, settings, Progress::silent()).unwrap().table
}

/// Tables of [`FABRICS`], of everything and of [`some_needs`]: the latter count what they miss, and are one's own.
fn tables() -> impl Iterator<Item = (&'static str, &'static Table, Table)> {
    static PARTS: LazyLock<Vec<Table>> = LazyLock::new(|| {
        let part = |name: &str| pruned(&fabric(name), &tiny(), &some_needs());
        FABRICS.into_iter().map(part).collect()
    });
    let parts = PARTS.iter().cloned();
    FABRICS
        .into_iter()
        .zip(parts)
        .map(|(name, part)| (name, tiny_table(name), part))
}

fn pruned(fabric: &Fabric, settings: &Settings, needs: &Needs) -> Table {
    let scope = Scope {
        needs: Some(needs),
        fixed_albedo: false,
    };
    bake(
        fabric,
        Request {
            scope,
            ..settings.into()
        },
        Progress::silent(),
    )
    .unwrap()
    .table
}

/// A lamp and a viewer in some parts of the hemisphere, and a few pairs.
fn some_needs() -> Needs {
    let (mut lights, mut viewers) = (Directions::none(), Directions::none());
    lights.add_cap([0.48, -0.36, 0.8], 0.2);
    viewers.add_cap([0.0, 0.6, 0.8], 0.3);
    viewers.add_cap([-0.8, 0.0, 0.6], 0.1);
    let mut needs = Needs::none();
    needs.add(&lights, &viewers);
    needs.add_pair([0.0, 0.0, 1.0], [0.96, 0.28, 1e-3]);
    needs
}

/// Fabrics whose grids are of every kind: with ends folded and not, isotropic, sides not folded.
const FABRICS: [&str; 4] = ["polyester-lining", "corduroy", "felt", "weft-knit-curve"];

#[test]
fn where_it_was_baked_a_table_is_that_of_everything_to_the_last_bit() {
    let needs = some_needs();
    for (name, full, pruned) in tables() {
        let fabric = fabric(name);
        assert!(pruned.is_partial() && !full.is_partial());
        assert!(pruned.decoded_bytes() < full.decoded_bytes(), "{name}");
        let pairs = pairs_of(&fabric, 40_000);
        let (mut needed, mut missing) = (0, 0);
        for [wi, wr] in pairs.iter().copied() {
            let is_baked = pruned.is_baked(wi, wr);
            if needs.contains(wi, wr) {
                needed += 1;
                assert!(is_baked, "{name}: {wi:?} {wr:?}");
            }
            missing += usize::from(!is_baked);
            let rho = pruned.eval_cos(wi, wr);
            if is_baked {
                assert_eq!(rho, full.eval_cos(wi, wr), "{name}: {wi:?} {wr:?}");
                assert_eq!(pruned.strict_eval_cos_with(&[], wi, wr), Some(rho));
            } else {
                assert_eq!(pruned.strict_eval_cos_with(&[], wi, wr), None);
            }
        }
        assert!(needed > 100, "{name}: {needed}");
        assert!(missing > pairs.len() / 4, "{name}: {missing}");
        assert_eq!((pruned.misses(), full.misses()), (missing, 0));

        // Batches count, too, and are no different.
        pruned.reset_misses();
        let [wi, wr] = [0, 1].map(|which| {
            [0, 1, 2].map(|k| {
                pairs
                    .iter()
                    .map(|pair| pair[which][k])
                    .collect::<Vec<f32>>()
            })
        });
        let mut rho = [(); 3].map(|()| vec![0.0; pairs.len()]);
        pruned.eval_cos_batch(
            wi.each_ref().map(Vec::as_slice),
            wr.each_ref().map(Vec::as_slice),
            rho.each_mut().map(Vec::as_mut_slice),
        );
        assert_eq!(pruned.misses(), missing);
    }
}

#[test]
fn what_a_bake_leaves_out_is_known_before_it_is_done() {
    let needs = some_needs();
    for (name, full, part) in tables() {
        let scope = Scope {
            needs: Some(&needs),
            fixed_albedo: false,
        };
        let forecast = forecast(&fabric(name), &tiny(), &scope, Progress::silent()).unwrap();
        let mut decoded = [0; 2];
        let threads = part.threads().iter().zip(full.threads());
        assert_eq!(forecast.threads.len(), part.threads().len(), "{name}");
        for (said, (part, full)) in forecast.threads.iter().zip(threads) {
            assert_eq!(said.thread, part.name(), "{name}");
            let Some(said) = &said.grid else {
                assert!(part.grid().is_none(), "{name}");
                continue;
            };
            let [part, full] = [part, full].map(|thread| thread.grid().unwrap());
            assert_eq!(said.coordinates, part.coordinates(), "{name}");
            assert_eq!(said.cells, part.baked_cells(), "{name}");
            assert_eq!(said.bytes, [part.bytes(), full.bytes()], "{name}");
            assert!(said.sites[0] < said.sites[1] && said.seconds[0] < said.seconds[1]);
            for projection in &said.projections {
                let [right, up] = projection.knots.each_ref().map(Vec::len);
                assert!(!projection.shares.is_empty() && projection.shares.len() <= up);
                for shares in &projection.shares {
                    assert!(!shares.is_empty() && shares.len() <= right);
                    assert!(shares.iter().all(|share| (0.0..=1.0).contains(share)));
                }
            }
            decoded[0] += said.bytes[0];
            decoded[1] += said.bytes[1];
        }
        assert!(decoded[0] < decoded[1], "{name}: {decoded:?}");
    }
    // What needs nothing has no forecast.
    let none = Needs::none();
    let scope = Scope {
        needs: Some(&none),
        fixed_albedo: false,
    };
    let error = forecast(&fabric("felt"), &tiny(), &scope, Progress::silent());
    assert!(matches!(error, Err(BakeError::NotNeeded(_))));
}

#[test]
fn light_from_the_viewer_needs_a_fiftieth() {
    let settings = tiny();
    let mut needs = Needs::none();
    needs.add_collocated(&Directions::all());
    for (name, full, _) in tables() {
        let fabric = fabric(name);
        let pruned = pruned(&fabric, &settings, &needs);
        let bytes = pruned.to_bytes().unwrap();
        assert_eq!(Table::from_bytes(&bytes).as_ref(), Ok(&pruned));
        let share = pruned.decoded_bytes() as f64 / full.decoded_bytes() as f64;
        // Those of which the projection of the viewer is a part keep that. (Tables this small have some 8 places on each of the axes that
        // collapse.)
        let has_projection = ["felt", "weft-knit-curve"].contains(&name);
        assert!(
            share <= if has_projection { 0.4 } else { 0.035 },
            "{name}: {share}"
        );
        for [w, other] in pairs_of(&fabric, 4_000) {
            assert!(
                pruned.is_baked(w, w) && !pruned.is_baked(w, other),
                "{name}: {w:?}"
            );
            assert_eq!(pruned.eval_cos(w, w), full.eval_cos(w, w), "{name}: {w:?}");
        }
        let error = Provenance::of(&pruned).unwrap().error;
        assert_eq!(error.all.pairs, settings.error_pairs);
        // Both directions are at the horizon, or none.
        let rims = [error.rim, error.rim_both, error.rim_last].map(|rim| rim.pairs);
        assert_eq!(rims, [0, 512, 512]);
        assert!(error.bias.is_empty());
    }
}

#[test]
fn the_nearest_value_is_light() {
    let directions = hostile_directions();
    let pairs: Vec<Pair> = directions
        .iter()
        .flat_map(|wi| directions.iter().map(|wr| [*wi, *wr]))
        .collect();
    for (name, _, pruned) in tables() {
        assert_light(name, &pruned, &pairs);
    }
}

#[test]
fn a_part_survives_being_a_file() {
    for (_, _, table) in tables() {
        let bytes = table.to_bytes().unwrap();
        let read = Table::from_bytes(&bytes).unwrap();
        assert_eq!(read, table);
        assert!(read.is_partial());
        let note = Provenance::of(&read).unwrap().scope.unwrap();
        assert_eq!(note.share, Some(some_needs().share()));
    }
}

#[test]
fn everything_is_everything() {
    let fabric = fabric("denim");
    let all = pruned(&fabric, &tiny(), &Needs::everything());
    let table = tiny_table("denim");
    assert!(all.has_all_pairs());
    assert_eq!(all.decoded_bytes(), table.decoded_bytes());
    let scope = Scope {
        needs: Some(&Needs::none()),
        fixed_albedo: false,
    };
    let refused = bake(
        &fabric,
        Request {
            scope,
            ..tiny().into()
        },
        Progress::silent(),
    );
    assert_eq!(
        refused.err(),
        Some(BakeError::NotNeeded("denim".to_owned()))
    );
}

/// Linen of another albedo.
fn linen(albedo: &str) -> Fabric {
    let toml = fabric("linen-plain").toml;
    let changed = toml.replace("[0.2, 0.8, 1]", albedo);
    assert_ne!(toml, changed);
    Fabric::from_toml(&changed, "linen", None).unwrap()
}

#[test]
fn an_albedo_that_stays_grey_needs_one_channel() {
    for (albedo, content) in [
        ("[0.25, 0.25, 0.25]", Content::Dyed),
        ("[0, 0, 0]", Content::Surface),
        ("[0.25, 0.5, 0.25]", Content::Both),
    ] {
        let fabric = linen(albedo);
        let scope = Scope {
            needs: None,
            fixed_albedo: true,
        };
        let one = bake(
            &fabric,
            Request {
                scope,
                ..tiny().into()
            },
            Progress::silent(),
        )
        .unwrap()
        .table;
        assert_eq!(one.threads()[0].grid().unwrap().content(), content);
        if content == Content::Both {
            continue;
        }
        let both = full(&fabric, &tiny());
        assert_eq!(2 * one.decoded_bytes(), both.decoded_bytes());
        let [one_error, error] = [&one, &both].map(|table| Provenance::of(table).unwrap().error);
        assert!(
            one_error.all.mean < 1.2 * error.all.mean,
            "{one_error:?} {error:?}"
        );
        assert_eq!(
            Table::from_bytes(&one.to_bytes().unwrap()).as_ref(),
            Ok(&one)
        );
        // Another albedo is not in it, and is noticed.
        let (wi, wr) = ([0.0, 0.6, 0.8], [0.0, 0.0, 1.0]);
        assert!(one.is_baked(wi, wr));
        assert_eq!(one.misses(), 0);
        assert_eq!(one.eval_with(&[[1.0, 0.0, 0.0]], wi, wr), one.eval(wi, wr));
        assert_eq!(one.misses(), 1);
        assert_eq!(one.strict_eval_cos_with(&[[1.0, 0.0, 0.0]], wi, wr), None);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(4) })]

    #[test]
    fn whatever_is_recorded_is_baked(
        pairs in prop::collection::vec((prop::array::uniform4(0.0..1f64), 0..8u8), 1..60),
        which in 0..3usize,
    ) {
        let fabric = fabric(FABRICS[which]);
        let direction = |z: f64, turn: f64| {
            let (sin, cos) = (std::f64::consts::TAU * turn).sin_cos();
            let r = (1.0 - z * z).sqrt();
            [(r * cos) as f32, (r * sin) as f32, z as f32]
        };
        let mut needs = Needs::none();
        let mut recorded = Vec::new();
        for ([z_i, turn_i, z_r, turn_r], kind) in pairs {
            let wi = direction(if kind == 1 { 1e-6 * z_i } else { z_i }, turn_i);
            let wr = match kind {
                0 => wi,
                2 => direction(1e-6 * z_r, turn_r),
                _ => direction(z_r, turn_r),
            };
            needs.add_pair(wi, wr);
            recorded.push([wi, wr]);
        }
        if needs.is_empty() {
            return Ok(());
        }
        let settings = Settings { max_bytes: 8 << 10, error_pairs: 16, ..tiny() };
        let (full, pruned) = (full(&fabric, &settings), pruned(&fabric, &settings, &needs));
        for [wi, wr] in recorded {
            prop_assert!(pruned.is_baked(wi, wr) || !(wi[2] > 0.0 && wr[2] > 0.0), "{:?} {:?}", wi, wr);
            prop_assert_eq!(pruned.eval_cos(wi, wr), full.eval_cos(wi, wr));
        }
        prop_assert_eq!(pruned.misses(), 0);
    }
}
