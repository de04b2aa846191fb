//! Any bytes as PNG or EXR: a mask, an albedo image, and a picture to compare. They are none, or pixels that are numbers.
#![no_main]

use sateen::pattern::Image;
use sateen::render::Picture;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let image = Image::from_bytes(bytes);
    let Ok(picture) = Picture::from_bytes(bytes) else {
        return;
    };
    assert!(image.is_ok());
    assert_eq!(picture.pixels.len(), picture.width * picture.height);
    assert!(
        picture
            .pixels
            .as_flattened()
            .iter()
            .all(|value| value.is_finite())
    );
});
