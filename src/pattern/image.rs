//! Masks and albedo images.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

/// The most bytes of an image file.
pub const MAX_IMAGE_BYTES: usize = 64 << 20;
/// The most columns and rows, and what decoding may take.
const MAX_SIDE: u32 = 16_384;
const MAX_DECODED_BYTES: u64 = 512 << 20;

/// An image, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
}

impl Image {
    /// Decodes a PNG or EXR file. Values are as stored: those of a PNG from 0 to 1 and not linear, those of an EXR linear.
    ///
    /// # Errors
    /// What is wrong with the bytes, or that there are too many.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let decoded = decode(bytes)?.into_rgb32f();
        let (width, height) = (decoded.width() as usize, decoded.height() as usize);
        let pixels: Vec<[f32; 3]> = decoded.pixels().map(|pixel| pixel.0).collect();
        if pixels.is_empty() || pixels.iter().flatten().any(|value| !value.is_finite()) {
            return Err("it has no pixels, or such as are no numbers".to_owned());
        }
        Ok(Self {
            width,
            height,
            pixels,
        })
    }

    /// Every pixel changed.
    pub(super) fn map(mut self, of: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        for pixel in &mut self.pixels {
            *pixel = of(*pixel);
        }
        self
    }

    /// The pixel at (x, y) from 0 to 1, y upwards.
    pub(super) fn at(&self, x: f64, y: f64) -> [f32; 3] {
        let index = |share: f64, count: usize| ((share * count as f64) as usize).min(count - 1);
        let row = self.height - 1 - index(y, self.height);
        self.pixels[row * self.width + index(x, self.width)]
    }

    pub(super) fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }
}

/// Decodes a PNG or EXR file that is not too large.
pub(crate) fn decode(bytes: &[u8]) -> Result<DynamicImage, String> {
    if bytes.len() > MAX_IMAGE_BYTES {
        return Err(format!("it has more than {MAX_IMAGE_BYTES} bytes"));
    }
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_DECODED_BYTES);
    let mut reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| error.to_string())?;
    reader.limits(limits);
    if !matches!(
        reader.format(),
        Some(ImageFormat::Png | ImageFormat::OpenExr)
    ) {
        return Err("it is neither PNG nor EXR".to_owned());
    }
    reader.decode().map_err(|error| error.to_string())
}

/// IEC 61966-2-1: what a PNG stores to linear.
pub(super) fn srgb_to_linear(value: f32) -> f32 {
    if value <= 0.040_45 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}
