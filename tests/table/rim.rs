//! Grids that end before a thread's horizon, and what evaluates pairs beyond.

use std::sync::LazyLock;

use crate::common::hostile::repair_header;
use crate::common::{fabric, tiny};
use sateen::bake::{Direct, For, Request, Scope, Settings, bake};
use sateen::brdf::Reweighting;
use sateen::chart::height;
use sateen::fabric::Fabric;
use sateen::metrics::protocol_pairs;
use sateen::model::{Rule, Sadeghi};
use sateen::needs::{Directions, Needs};
use sateen::progress::Progress;
use sateen::table::{Error, Table, ThreadTable};

/// One pair at a time grids are cheap, so that threads have them; any error will do.
fn settings() -> Settings {
    Settings {
        direct: Direct::Worthwhile,
        made_for: For::Single,
        max_error: 1.0,
        ..tiny()
    }
}

fn baked(fabric: &Fabric, scope: Scope<'_>) -> Table {
    let request = Request {
        scope,
        ..(&settings()).into()
    };
    bake(fabric, request, Progress::silent()).unwrap().table
}

fn table() -> &'static Table {
    static TABLE: LazyLock<Table> = LazyLock::new(|| baked(&fabric("denim"), Scope::default()));
    &TABLE
}

/// How high above a thread's horizon a pair is, and the share of the thread's grid in it.
fn share(thread: &ThreadTable, wi: [f32; 3], wr: [f32; 3]) -> f32 {
    let frame = thread.frame().cast::<f32>();
    let (rim, _) = thread.rim().expect("its grid ends before the horizon");
    rim.share_of_box(height(frame.to_thread(wi), frame.to_thread(wr)))
}

fn pairs(fabric: &Fabric, count: usize) -> impl Iterator<Item = [[f32; 3]; 2]> {
    let single = |w: [f64; 3]| w.map(|x| x as f32);
    let pairs = protocol_pairs(fabric, count, 5).into_iter();
    pairs.map(move |pair| [single(pair.wi), single(pair.wr)])
}

/// Beyond its rim every thread is the quadrature that it names.
fn assert_direct_beyond(fabric: &Fabric, table: &Table) {
    let mut beyond = 0;
    for [wi, wr] in pairs(fabric, 4096) {
        let found = table.components(wi, wr);
        for (index, thread) in table.threads().iter().enumerate() {
            let (_, nodes) = thread.rim().expect("its grid ends before the horizon");
            if share(thread, wi, wr) > 0.0 {
                continue;
            }
            beyond += 1;
            let rule = Rule::Quadrature(nodes as u32);
            let direct = Sadeghi::<f32>::new(fabric, rule).components(wi, wr);
            let (found, direct) = (&found.threads[index], &direct.threads[index]);
            let near = |a: f32, b: f32| (a - b).abs() <= 1e-4 * b + 1e-6;
            assert!(near(found.response.surface, direct.response.surface));
            assert!(near(found.response.volume, direct.response.volume));
            assert!(near(found.projection, direct.projection));
        }
    }
    assert!(beyond > 100, "{beyond}");
}

#[test]
fn beyond_its_rim_a_thread_is_the_quadrature_that_it_names() {
    assert_direct_beyond(&fabric("denim"), table());
}

#[test]
fn rims_go_with_projections_by_both_directions() {
    let text = format!("reweighting = \"both\"\n{}", fabric("denim").toml);
    let both = Fabric::from_toml(&text, "denim", None).unwrap();
    assert_eq!(both.reweighting, Reweighting::Both);
    assert_direct_beyond(&both, &baked(&both, Scope::default()));
}

#[test]
fn a_table_with_rims_comes_back_from_its_bytes() {
    let bytes = table().to_mappable_bytes();
    assert_eq!(Table::from_bytes(&bytes).as_ref(), Ok(table()));
}

#[test]
fn widths_that_no_rim_has_are_refused() {
    let bytes = table().to_mappable_bytes();
    let (rim, nodes) = table().threads()[0].rim().unwrap();
    let entry = [4, rim.hundredths().into(), nodes as u32].map(u32::to_le_bytes);
    let at = bytes
        .windows(12)
        .position(|window| window == entry.as_flattened());
    let at = at.expect("the rim is in the header") + 4;
    for width in [0u32, 51, u32::MAX] {
        let mut changed = bytes.clone();
        changed[at..at + 4].copy_from_slice(&width.to_le_bytes());
        repair_header(&mut changed);
        let error = Table::from_bytes(&changed).expect_err("no rim is so wide");
        let expected = "width of the rim";
        assert!(
            matches!(error, Error::Invalid { what, .. } if what == expected),
            "{error:?}"
        );
    }
}

#[test]
fn values_are_continuous_across_rims() {
    let table = table();
    for turn in [0.0f32, 0.7, 1.57, 2.5] {
        let at = |step: u32| {
            let z = 0.3 - 1e-4 * step as f32;
            let r = (1.0 - z * z).sqrt();
            table.eval_cos([0.36, 0.48, 0.8], [r * turn.cos(), r * turn.sin(), z])[1]
        };
        // Close to the horizon a step is a large part of what is left.
        for step in 0..2800 {
            let (a, b) = (at(step), at(step + 1));
            assert!((a - b).abs() < 1e-2 * a + 1e-4, "{turn} {step}: {a} {b}");
        }
    }
}

#[test]
fn a_partial_table_lacks_nothing_beyond_its_rims() {
    let fabric = fabric("denim");
    let (mut lights, mut viewers) = (Directions::none(), Directions::none());
    lights.add_cap([0.48, -0.36, 0.8], 0.2);
    viewers.add_cap([0.0, 0.6, 0.8], 0.3);
    let mut needs = Needs::none();
    needs.add(&lights, &viewers);
    let part = baked(
        &fabric,
        Scope {
            needs: Some(&needs),
            fixed_albedo: false,
        },
    );
    let (mut beyond, mut baked) = (0, 0);
    for [wi, wr] in pairs(&fabric, 20_000) {
        let is_beyond = |thread: &ThreadTable| share(thread, wi, wr) == 0.0;
        let is_baked = part.is_baked(wi, wr);
        if part.threads().iter().all(is_beyond) {
            beyond += 1;
            assert!(is_baked);
        }
        if is_baked {
            baked += 1;
            assert_eq!(part.eval_cos(wi, wr), table().eval_cos(wi, wr));
        }
    }
    assert!(beyond > 100 && baked > beyond, "{beyond} {baked}");
}

#[test]
fn a_partial_table_may_be_all_beyond_its_rims() {
    let fabric = fabric("denim");
    let mut needs = Needs::none();
    needs.add_pair([0.8, 0.6, 1e-3], [0.6, -0.8, 1e-3]);
    let scope = Scope {
        needs: Some(&needs),
        fixed_albedo: false,
    };
    let part = baked(&fabric, scope);
    assert!(part.is_baked([0.8, 0.6, 1e-3], [0.6, -0.8, 1e-3]));
}
