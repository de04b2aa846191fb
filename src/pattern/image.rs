//! Masks and albedo images.

use std::io::Cursor;

use exr::block;
use exr::prelude::{IntegerBounds, Text};
use exr::prelude::{ReadChannels, ReadLayers, Vec2};
use png::{ColorType, DecodeOptions, Decoder, Limits, Transformations};

/// The most bytes of an image file.
pub const MAX_IMAGE_BYTES: usize = 64 << 20;
/// The most columns and rows, and what decoding may take.
const MAX_SIDE: usize = 16_384;
const MAX_DECODED_BYTES: usize = 512 << 20;

/// What a decoded pixel takes beside what its file has.
const PIXEL_BYTES: usize = size_of::<[f32; 3]>();

/// How the numbers of a picture follow from light.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Transfer {
    /// IEC 61966-2-1.
    #[default]
    Srgb,
    /// To the power 1/p, as \[Fecho13\] with p = 2.2.
    Power(f64),
}

impl Transfer {
    /// The numbers are light.
    pub const LINEAR: Self = Self::Power(1.0);

    /// The number, where 1 is white, that shows linear light.
    pub fn shown(self, linear: f64) -> f64 {
        match self {
            Self::Srgb if linear <= 0.003_130_8 => 12.92 * linear,
            Self::Srgb => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
            Self::Power(power) => linear.powf(1.0 / power),
        }
    }

    /// The light that a number shows.
    pub fn linear(self, shown: f64) -> f64 {
        match self {
            Self::Srgb if shown <= 0.040_45 => shown / 12.92,
            Self::Srgb => ((shown + 0.055) / 1.055).powf(2.4),
            Self::LINEAR => shown,
            Self::Power(power) => shown.powf(power),
        }
    }

    /// What a PNG says of itself by its chunks sRGB and gAMA; sRGB if nothing. Profiles are not read: what has one is nearly always
    /// sRGB, too.
    fn of(info: &png::Info<'_>) -> Self {
        match info.gama_chunk {
            Some(gamma) if info.srgb.is_none() && gamma.into_value() > 0.0 => {
                Self::Power(1.0 / f64::from(gamma.into_value()))
            }
            _ => Self::Srgb,
        }
    }
}

/// An image, row 0 at the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
    transfer: Transfer,
}

impl Image {
    /// Decodes a PNG or EXR file. Values are as stored: those of a PNG from 0 to 1.
    ///
    /// # Errors
    /// What is wrong with the bytes, or that there are too many.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let decoded = decode(bytes)?;
        let pixels: Vec<[f32; 3]> = decoded.pixels().map(|[r, g, b, _]| [r, g, b]).collect();
        if pixels.is_empty() || pixels.iter().flatten().any(|value| !value.is_finite()) {
            return Err("it has no pixels, or such as are no numbers".to_owned());
        }
        Ok(Self {
            width: decoded.width,
            height: decoded.height,
            pixels,
            transfer: decoded.transfer,
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

    pub(super) fn transfer(&self) -> Transfer {
        self.transfer
    }

    pub(super) fn pixels(&self) -> &[[f32; 3]] {
        &self.pixels
    }
}

/// An image as its file has it.
pub(crate) struct Decoded {
    pub(crate) width: usize,
    pub(crate) height: usize,
    /// Grey, grey and alpha, RGB or RGBA: 1 to 4.
    channels: usize,
    pub(crate) transfer: Transfer,
    samples: Samples,
}

/// `[row][column][channel]`
enum Samples {
    /// Of a PNG with at most 8 bits …
    Bytes(Vec<u8>),
    /// … and with 16, big-endian.
    Words(Vec<u8>),
    /// Of an EXR.
    Floats(Vec<f32>),
}

impl Decoded {
    /// Whether colours are multiplied by alpha: those of an EXR are.
    #[cfg(feature = "render")]
    pub(crate) fn is_multiplied(&self) -> bool {
        matches!(self.samples, Samples::Floats(_))
    }

    /// Red, green, blue and alpha, which is 1 where the file has none; integers as shares of the largest.
    pub(crate) fn pixels(&self) -> impl Iterator<Item = [f32; 4]> {
        let sample = |index: usize| match &self.samples {
            Samples::Bytes(bytes) => f32::from(bytes[index]) / f32::from(u8::MAX),
            Samples::Words(bytes) => {
                let word = [bytes[2 * index], bytes[2 * index + 1]];
                f32::from(u16::from_be_bytes(word)) / f32::from(u16::MAX)
            }
            Samples::Floats(floats) => floats[index],
        };
        (0..self.width * self.height).map(move |pixel| {
            let channel = |k: usize| sample(self.channels * pixel + k);
            match self.channels {
                1 => [channel(0), channel(0), channel(0), 1.0],
                2 => [channel(0), channel(0), channel(0), channel(1)],
                3 => [channel(0), channel(1), channel(2), 1.0],
                _ => [channel(0), channel(1), channel(2), channel(3)],
            }
        })
    }
}

/// Decodes a PNG or EXR file that is not too large.
pub(crate) fn decode(bytes: &[u8]) -> Result<Decoded, String> {
    if bytes.len() > MAX_IMAGE_BYTES {
        return Err(format!("it has more than {MAX_IMAGE_BYTES} bytes"));
    }
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        decode_png(bytes)
    } else if bytes.starts_with(&[0x76, 0x2f, 0x31, 0x01]) {
        decode_exr(bytes)
    } else {
        Err("it is neither PNG nor EXR".to_owned())
    }
}

/// That an image is not too large, before there is memory for it.
fn check_size([width, height]: [usize; 2], bytes_per_pixel: usize) -> Result<(), String> {
    if width > MAX_SIDE || height > MAX_SIDE {
        return Err(format!(
            "it has {width} × {height} pixels, more than {MAX_SIDE} on a side; scale it down"
        ));
    }
    if width * height * bytes_per_pixel > MAX_DECODED_BYTES {
        return Err(format!(
            "its {width} × {height} pixels take more than {MAX_DECODED_BYTES} bytes; scale it down"
        ));
    }
    Ok(())
}

fn decode_png(bytes: &[u8]) -> Result<Decoded, String> {
    let wrong = |error: png::DecodingError| format!("it is no PNG that can be read: {error}");
    let mut options = DecodeOptions::default();
    options.set_ignore_text_chunk(true);
    options.set_ignore_iccp_chunk(true);
    let mut decoder = Decoder::new_with_options(Cursor::new(bytes), options);
    decoder.set_limits(Limits {
        bytes: MAX_DECODED_BYTES,
    });
    // Palettes become colours, bits bytes, and a transparent colour alpha.
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(wrong)?;
    let (width, height) = reader.info().size();
    let (width, height) = (width as usize, height as usize);
    let (color, depth) = reader.output_color_type();
    let channels = match color {
        ColorType::Grayscale | ColorType::Indexed => 1,
        ColorType::GrayscaleAlpha => 2,
        ColorType::Rgb => 3,
        ColorType::Rgba => 4,
    };
    let transfer = Transfer::of(reader.info());
    let is_wide = depth == png::BitDepth::Sixteen;
    check_size(
        [width, height],
        channels * (1 + usize::from(is_wide)) + PIXEL_BYTES,
    )?;
    let mut samples = vec![0; reader.output_buffer_size().unwrap_or(0)];
    reader.next_frame(&mut samples).map_err(wrong)?;
    Ok(Decoded {
        width,
        height,
        channels,
        transfer,
        samples: if is_wide {
            Samples::Words(samples)
        } else {
            Samples::Bytes(samples)
        },
    })
}

/// The first layer that has R, G and B, at its largest resolution, cut to the display window.
fn decode_exr(bytes: &[u8]) -> Result<Decoded, String> {
    let wrong = |error: exr::error::Error| format!("it is no EXR that can be read: {error}");
    let chunks = block::read(Cursor::new(bytes), false).map_err(wrong)?;
    let header = chunks.headers().iter().find(|header| {
        let has = |name| {
            let channels = &header.channels;
            channels.find_index_of_channel(&Text::from(name)).is_some()
        };
        !header.deep && ["R", "G", "B"].into_iter().all(has)
    });
    let Some(header) = header else {
        return Err("it has no layer with the channels R, G and B".to_owned());
    };
    let alpha = Text::from("A");
    let channels = 3 + usize::from(header.channels.find_index_of_channel(&alpha).is_some());
    check_size(
        [header.layer_size.width(), header.layer_size.height()],
        header.channels.bytes_per_pixel,
    )?;
    let IntegerBounds { position, size } = header.shared_attributes.display_window;
    let offset = header.own_attributes.layer_position - position;
    check_size([size.width(), size.height()], 4 * channels + PIXEL_BYTES)?;
    let begins = |from: i32, length: usize| i64::from(from) < length as i64;
    let ends = |from: i32, length: usize| i64::from(from) + length as i64 > 0;
    let is_inside = begins(offset.x(), size.width())
        && begins(offset.y(), size.height())
        && ends(offset.x(), header.layer_size.width())
        && ends(offset.y(), header.layer_size.height());
    if !is_inside {
        return Err(
            "its data window lies outside of its display window, so that nothing is seen; crop it anew"
                .to_owned(),
        );
    }
    let read = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgba_channels(
            move |_, _| vec![0.0; size.area() * channels],
            move |samples: &mut Vec<f32>, at: Vec2<usize>, (r, g, b, a): (f32, f32, f32, f32)| {
                let at = at.to_i32() + offset;
                let (x, y) = (usize::try_from(at.x()), usize::try_from(at.y()));
                if let (Ok(x), Ok(y)) = (x, y)
                    && x < size.width()
                    && y < size.height()
                {
                    let index = channels * (y * size.width() + x);
                    samples[index..index + channels].copy_from_slice(&[r, g, b, a][..channels]);
                }
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_chunks(chunks)
        .map_err(wrong)?;
    Ok(Decoded {
        width: size.width(),
        height: size.height(),
        channels,
        transfer: Transfer::LINEAR,
        samples: Samples::Floats(read.layer_data.channel_data.pixels),
    })
}

#[cfg(test)]
mod tests {
    use image::{DynamicImage, ImageFormat, RgbaImage};

    use super::*;

    #[test]
    fn every_kind_of_png_is_decoded() {
        let image = DynamicImage::from(RgbaImage::from_fn(5, 3, |x, y| {
            image::Rgba([40 * x as u8, 90 * y as u8, 7, 255 - 60 * x as u8])
        }));
        for image in [
            DynamicImage::from(image.to_luma8()),
            image.to_luma16().into(),
            image.to_luma_alpha8().into(),
            image.to_luma_alpha16().into(),
            image.to_rgb8().into(),
            image.to_rgb16().into(),
            image.to_rgba16().into(),
            image.clone(),
        ] {
            let mut bytes = Cursor::new(Vec::new());
            image.write_to(&mut bytes, ImageFormat::Png).unwrap();
            let decoded = decode(bytes.get_ref()).unwrap();
            let expected = image.to_rgba32f();
            assert_eq!((decoded.width, decoded.height), (5, 3));
            for (found, expected) in decoded.pixels().zip(expected.pixels()) {
                for (found, expected) in found.into_iter().zip(expected.0) {
                    // Grey values are multiplied there, and divided here.
                    assert!((found - expected).abs() < 1e-7, "{found} {expected}");
                }
            }
        }
    }
}
