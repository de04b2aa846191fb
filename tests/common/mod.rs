//! What several tests need.
#![allow(dead_code, reason = "each binary uses a part")]

#[cfg(feature = "bake")]
pub(crate) mod hostile;
pub(crate) mod process;

use std::io::Write;
use std::sync::Once;

use sateen::math::simd::Level;
use sateen::table::Table;

#[cfg(feature = "bake")]
mod baking;

#[cfg(feature = "bake")]
#[allow(unused_imports, reason = "each binary uses a part")]
pub(crate) use baking::*;

/// Says something that is seen of passing tests, too: what they print is not.
pub(crate) fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// For a test, or a part of one, that the machine lacks something for: says so, and panics where `SATEEN_REQUIRE_ALL=1`.
pub(crate) fn skip(what: &str) {
    let is_required = std::env::var_os("SATEEN_REQUIRE_ALL").is_some_and(|value| value == "1");
    assert!(!is_required, "{what}, and SATEEN_REQUIRE_ALL=1");
    say(&format!("SKIPPED: {what}"));
}

/// The levels of the processor, and which there are beside them. Panics if the library does not use all that it could.
pub(crate) fn levels() -> Vec<Level> {
    static SAID: Once = Once::new();
    let (there, missing): (Vec<Level>, Vec<Level>) = Level::ALL.into_iter().partition(is_there);
    for level in Level::ALL {
        assert_eq!(level.is_available(), there.contains(&level), "{level:?}");
    }
    let names = |levels: &[Level]| levels.iter().map(|level| level.name()).collect::<Vec<_>>();
    SAID.call_once(|| {
        say(&format!(
            "levels {:?}, not {:?}",
            names(&there),
            names(&missing)
        ));
    });
    there
}

/// Whether the processor, or Miri, has the instructions.
#[cfg(target_arch = "x86_64")]
fn is_there(level: &Level) -> bool {
    let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
    let is_small = cfg!(feature = "small");
    match level.name() {
        "portable" => true,
        "avx2" => avx2,
        "avx512" => avx2 && is_x86_feature_detected!("avx512f") && !is_small,
        "neon" => false,
        other => panic!("{other} is tested nowhere"),
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn is_there(level: &Level) -> bool {
    let is_arm = cfg!(all(target_arch = "aarch64", target_endian = "little"));
    *level == Level::Portable || is_arm && level.name() == "neon"
}

/// Panics unless `bytes` are no table, or one that evaluates to light for ordinary and hostile directions.
pub(crate) fn assert_refused_or_light(name: &str, bytes: &[u8]) {
    let Ok(table) = Table::from_bytes(bytes) else {
        return;
    };
    let pairs = [
        [[0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]],
        [[1.0, 0.0, 1e-7], [0.0, -1.0, 1e-20]],
        [[-1.0, 0.0, 1e-45], [1.0, 0.0, 1e-45]],
        [[f32::NAN; 3], [0.0, 0.6, 0.8]],
    ];
    assert_light(name, &table, &pairs);
}

/// Panics unless the table's light is finite and not negative at these pairs, one by one and in a batch.
pub(crate) fn assert_light(name: &str, table: &Table, pairs: &[[[f32; 3]; 2]]) {
    let is_light = |rho: &[f32]| rho.iter().all(|rho| rho.is_finite() && *rho >= 0.0);
    for [wi, wr] in pairs {
        for rho in [table.eval_cos(*wi, *wr), table.eval(*wi, *wr)] {
            assert!(is_light(&rho), "{name}: {wi:?} {wr:?} {rho:?}");
        }
    }
    let slice =
        |which: usize, k: usize| -> Vec<f32> { pairs.iter().map(|pair| pair[which][k]).collect() };
    let [x, y, z] = [0, 1, 2].map(|k| slice(0, k));
    let [x2, y2, z2] = [0, 1, 2].map(|k| slice(1, k));
    let [mut r, mut g, mut b] = [0; 3].map(|_| vec![-1.0; pairs.len()]);
    table.eval_cos_batch([&x, &y, &z], [&x2, &y2, &z2], [&mut r, &mut g, &mut b]);
    let rho = [r, g, b].concat();
    assert!(is_light(&rho), "{name}: {rho:?}");
}

/// Directions that are hard on evaluators: poles, horizons, grazing to the last bit, denormals, and no directions at all.
pub(crate) fn hostile_directions() -> Vec<[f32; 3]> {
    let mut directions = vec![
        [0.0, 0.0, 0.0],
        [0.0, 0.0, -1.0],
        [f32::NAN; 3],
        [f32::INFINITY; 3],
        [1.0, 0.0, f32::NAN],
    ];
    let heights = [
        1.0,
        0.5,
        1e-2,
        1e-4,
        1e-7,
        1e-20,
        f32::MIN_POSITIVE,
        1e-45,
        0.0,
        -0.0,
        -1e-7,
    ];
    for z in heights {
        let r = (1.0 - z * z).sqrt();
        for azimuth_deg in [0.0f32, 1e-5, 30.0, 45.0, 89.999, 90.0, 180.0, 270.0, 301.0] {
            let (sin, cos) = azimuth_deg.to_radians().sin_cos();
            directions.push([r * cos, r * sin, z]);
        }
        directions.extend([[r, 0.0, z], [-r, 0.0, z], [0.0, r, z], [0.0, -r, z]]);
    }
    directions
}
