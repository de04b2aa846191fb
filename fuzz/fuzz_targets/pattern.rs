//! Any text, and after a NUL any bytes for the files that it names: they are no pattern, or one that is made of its materials
//! everywhere.
#![no_main]

use sateen::pattern::Pattern;

const PLACES: [f64; 8] = [0.0, 0.3, -0.5, 1.0, -1e-300, 1e300, f64::NAN, f64::INFINITY];

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let end = bytes.iter().position(|byte| *byte == 0);
    let (text, rest) = match end {
        Some(end) => (&bytes[..end], &bytes[end + 1..]),
        None => (bytes, &[][..]),
    };
    let Ok(text) = std::str::from_utf8(text) else {
        return;
    };
    let Ok(pattern) = Pattern::from_toml(text, "fuzz.toml", &|_| Ok(rest.to_vec())) else {
        return;
    };
    let bakes = pattern.bakes().len();
    assert!((1..=pattern.materials().len()).contains(&bakes));
    for u in PLACES {
        for v in PLACES {
            let place = pattern.at(u, v);
            assert!(pattern.materials().contains(place.material) && place.material.bake < bakes);
            assert_eq!(
                place.albedos.len(),
                place.material.fabric.visible_threads().count()
            );
            let mut albedos = place.albedos.iter().flatten();
            assert!(albedos.all(|albedo| (0.0..=1000.0).contains(albedo)));
        }
    }
});
