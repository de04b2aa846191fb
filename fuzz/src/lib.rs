//! What the fuzz targets share: what holds of every table that loads, and files whose checksums are right.

use sateen::table::Table;

mod repair;

pub use repair::repaired;

/// Pairs of directions, ordinary and hostile: grazing, along a thread, of no length, below the surface, no numbers.
pub const PAIRS: [[[f32; 3]; 2]; 8] = [
    [[0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]],
    [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]],
    [[0.6, 0.0, 0.8], [-0.6, 0.0, 0.8]],
    [[1.0, 0.0, 1e-7], [0.0, -1.0, 1e-20]],
    [[-1.0, 0.0, 1e-45], [1.0, 0.0, 1e-45]],
    [[0.0, 0.0, 0.0], [0.0, 0.6, 0.8]],
    [[0.0, 0.6, -0.8], [f32::INFINITY; 3]],
    [[f32::NAN; 3], [0.0, 0.0, 1.0]],
];

/// A table of more tilts and nodes than this is right, but too slow to evaluate again and again.
const MOST_WORK: usize = 20_000;
/// A table of more bytes than this takes too long to compress.
const MOST_BYTES: usize = 1 << 18;

/// Whether light is finite and none of it is negative.
pub fn is_light(rho: &[f32]) -> bool {
    rho.iter().all(|rho| rho.is_finite() && *rho >= 0.0)
}

/// Panics unless `table` evaluates to light everywhere and comes back from its bytes.
pub fn check_table(table: &Table) {
    let work: usize = table
        .threads()
        .iter()
        .map(|thread| {
            let tangents = thread.tangents();
            let nodes = thread.direct_nodes().unwrap_or(1);
            tangents.tilts().len() + tangents.segments().len() * nodes
        })
        .sum();
    if work <= MOST_WORK {
        check_pairs(table);
        check_batch(table);
    }
    if table.decoded_bytes() + table.metadata().len() <= MOST_BYTES {
        let bytes = table.to_bytes().expect("there is memory");
        assert_eq!(Table::from_bytes(&bytes).as_ref(), Ok(table));
    }
}

fn check_pairs(table: &Table) {
    for [wi, wr] in PAIRS {
        let (rho, brdf) = (table.eval_cos(wi, wr), table.eval(wi, wr));
        assert!(
            is_light(&rho) && is_light(&brdf),
            "{wi:?} {wr:?}: {rho:?}, {brdf:?}"
        );
        let components = table.components(wi, wr);
        assert!(!components.q.is_nan());
    }
}

fn check_batch(table: &Table) {
    let component = |which: usize, k: usize| PAIRS.map(|pair| pair[which][k]);
    let [x, y, z] = [0, 1, 2].map(|k| component(0, k));
    let [x2, y2, z2] = [0, 1, 2].map(|k| component(1, k));
    let [mut r, mut g, mut b] = [[-1.0; PAIRS.len()]; 3];
    table.eval_cos_batch([&x, &y, &z], [&x2, &y2, &z2], [&mut r, &mut g, &mut b]);
    assert!(
        is_light(&r) && is_light(&g) && is_light(&b),
        "{r:?} {g:?} {b:?}"
    );
}
