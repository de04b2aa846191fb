//! What a screen shows of a picture, PNG, and pictures that others have made.
//!
//! ```text
//! value = 255 (2^EV L)^(1/2.2), at most 255
//! ```
//!
//! as \[Fecho13\] has it. The file says sRGB, whose own curve differs by at most 0.03 from that exponent. The background is
//! transparent, and alpha not multiplied in.

use ::png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};

use super::Picture;
use crate::pattern::decode_image;

/// The most pixels of a picture that is read: those of the largest that the tool takes.
const MAX_PIXELS: usize = 8192 * 4096;

/// The exponent of the screen.
const EXPONENT: f64 = 1.0 / 2.2;

/// Eight bits per channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Display {
    /// Columns.
    pub width: usize,
    /// Rows, the first at the top.
    pub height: usize,
    /// `[row][column]`: red, green, blue and alpha.
    pub pixels: Vec<[u8; 4]>,
}

impl Display {
    /// What is seen of `picture` at an exposure of that many stops.
    pub fn of(picture: &Picture, stops: f64) -> Self {
        let gain = stops.exp2();
        let pixel = |[r, g, b, coverage]: &[f32; 4]| {
            let coverage = f64::from(*coverage);
            let [r, g, b] = [r, g, b].map(|value| {
                let radiance = gain * f64::from(*value) / coverage;
                // Nothing over nothing is 0.
                (255.0 * radiance.max(0.0).powf(EXPONENT)).round() as u8
            });
            [r, g, b, (255.0 * coverage).round() as u8]
        };
        Self {
            width: picture.width,
            height: picture.height,
            pixels: picture.pixels.iter().map(pixel).collect(),
        }
    }

    /// Pictures of the same height from left to right.
    ///
    /// # Panics
    /// When their heights differ.
    pub fn beside(parts: &[Self]) -> Self {
        let height = parts.first().map_or(0, |part| part.height);
        assert!(parts.iter().all(|part| part.height == height));
        let row = |row: usize| {
            parts.iter().flat_map(move |part| {
                part.pixels[row * part.width..(row + 1) * part.width]
                    .iter()
                    .copied()
            })
        };
        Self {
            width: parts.iter().map(|part| part.width).sum(),
            height,
            pixels: (0..height).flat_map(row).collect(),
        }
    }

    /// A PNG file with `notes`, keywords of at most 79 letters and what there is to say to them.
    ///
    /// # Errors
    /// When there are no pixels, more than a PNG file has, or a keyword is none.
    pub fn to_png(&self, notes: &[(&str, String)]) -> Result<Vec<u8>, EncodingError> {
        let side = |count: usize| u32::try_from(count).unwrap_or(u32::MAX);
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, side(self.width), side(self.height));
        encoder.set_color(ColorType::Rgba);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
        for (keyword, text) in notes {
            encoder.add_itxt_chunk((*keyword).to_owned(), text.clone())?;
        }
        let mut writer = encoder.write_header()?;
        writer.write_image_data(self.pixels.as_flattened())?;
        writer.finish()?;
        Ok(bytes)
    }
}

impl Picture {
    /// Decodes an EXR, which is linear, or a PNG, as [`Display`] shows pictures at an exposure of 0. What has no alpha is covered all over.
    ///
    /// # Errors
    /// What is wrong with the bytes, or that there are too many.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let decoded = decode_image(bytes)?;
        let (width, height) = (decoded.width, decoded.height);
        if width * height > MAX_PIXELS {
            return Err(format!("it has more than {MAX_PIXELS} pixels"));
        }
        let is_linear = decoded.is_linear();
        let linear = |[r, g, b, coverage]: [f32; 4]| {
            let radiance = |value: f32| (f64::from(value).powf(1.0 / EXPONENT) as f32) * coverage;
            let [r, g, b] = [r, g, b].map(radiance);
            [r, g, b, coverage]
        };
        let picture = Self {
            width,
            height,
            pixels: decoded
                .pixels()
                .map(|pixel| if is_linear { pixel } else { linear(pixel) })
                .collect(),
        };
        let values = || picture.pixels.as_flattened().iter();
        if values().len() == 0 || !values().all(|value| value.is_finite()) {
            return Err("it has no pixels, or such as are no numbers".to_owned());
        }
        Ok(picture)
    }
}
