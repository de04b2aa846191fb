//! What a screen shows of a picture, PNG, and pictures that others have made.
//!
//! ```text
//! value = 255 f(2^EV L), at most 255
//! ```
//!
//! with the curve f of sRGB, or that of \[Fecho13\], the power 1/2.2. The file says which. The background is transparent, and alpha not
//! multiplied in.

use ::png::{BitDepth, ColorType, Encoder, EncodingError, ScaledFloat, SrgbRenderingIntent};

use super::Picture;
use crate::pattern::{Transfer, decode_image};

/// The most pixels of a picture that is read: those of the largest that the tool takes.
const MAX_PIXELS: usize = 8192 * 4096;

/// Eight bits per channel.
#[derive(Debug, Clone, PartialEq)]
pub struct Display {
    /// Columns.
    pub width: usize,
    /// Rows, the first at the top.
    pub height: usize,
    /// `[row][column]`: red, green, blue and alpha.
    pub pixels: Vec<[u8; 4]>,
    /// The curve.
    pub transfer: Transfer,
    /// How many pixels are brighter than white, and shown as it is.
    pub clipped: usize,
}

impl Display {
    /// What is seen of `picture` at an exposure of that many stops.
    pub fn of(picture: &Picture, stops: f64, transfer: Transfer) -> Self {
        let gain = stops.exp2();
        let mut clipped = 0;
        let pixel = |[r, g, b, coverage]: &[f32; 4]| {
            let coverage = f64::from(*coverage);
            let shown = [r, g, b].map(|value| {
                let radiance = gain * f64::from(*value) / coverage;
                // Nothing over nothing is 0.
                (255.0 * transfer.shown(radiance.max(0.0))).round()
            });
            clipped += usize::from(shown.iter().any(|value| *value > 255.0));
            let [r, g, b] = shown.map(|value| value as u8);
            [r, g, b, (255.0 * coverage).round() as u8]
        };
        let pixels = picture.pixels.iter().map(pixel).collect();
        Self {
            width: picture.width,
            height: picture.height,
            pixels,
            transfer,
            clipped,
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
            transfer: parts.first().map_or(Transfer::Srgb, |part| part.transfer),
            clipped: parts.iter().map(|part| part.clipped).sum(),
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
        match self.transfer {
            Transfer::Srgb => encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric),
            Transfer::Power(power) => {
                encoder.set_source_gamma(ScaledFloat::from_scaled((1e5 / power).round() as u32));
            }
        }
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
    /// Decodes an EXR, which is linear, or a PNG by the curve that it names, sRGB unless it does. What has no alpha is covered all over.
    ///
    /// # Errors
    /// What is wrong with the bytes, or that there are too many.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let decoded = decode_image(bytes)?;
        let (width, height) = (decoded.width, decoded.height);
        if width * height > MAX_PIXELS {
            return Err(format!("it has more than {MAX_PIXELS} pixels"));
        }
        let (transfer, is_multiplied) = (decoded.transfer, decoded.is_multiplied());
        let radiance = |[r, g, b, coverage]: [f32; 4]| {
            let by = if is_multiplied { 1.0 } else { coverage };
            let radiance = |value: f32| (transfer.linear(value.into()) as f32) * by;
            let [r, g, b] = [r, g, b].map(radiance);
            [r, g, b, coverage]
        };
        let picture = Self {
            width,
            height,
            pixels: decoded.pixels().map(radiance).collect(),
        };
        let values = || picture.pixels.as_flattened().iter();
        if values().len() == 0 || !values().all(|value| value.is_finite()) {
            return Err("it has no pixels, or such as are no numbers".to_owned());
        }
        Ok(picture)
    }
}
