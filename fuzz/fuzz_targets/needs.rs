//! Any bytes as a recording: they are none, or needs that come back from their bytes.
#![no_main]

use sateen::needs::Needs;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let Ok(needs) = Needs::from_bytes(bytes) else {
        return;
    };
    assert!((0.0..=1.0).contains(&needs.share()));
    assert_eq!(needs.to_bytes(), bytes);
});
