//! OpenEXR: linear radiance, several pictures as layers of one file.

use std::io::Cursor;

use ::exr::error::Error;
use ::exr::meta::header::{ImageAttributes, LayerAttributes};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, IntegerBounds, Layer as ExrLayer,
    SmallVec, Text, WritableImage, f16,
};

/// One layer of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// What to call it; no two of a file have one name.
    pub name: String,
    /// What there is to say to it: keys and values.
    pub notes: Vec<(&'static str, String)>,
    /// Names of the channels and their values, `[row][column]`, all of the same number.
    pub channels: Vec<(&'static str, Vec<f32>)>,
}

impl Layer {
    /// R, G, B and A of a picture, the colours already multiplied by coverage.
    pub fn of(name: &str, picture: &super::Picture) -> Self {
        let channel = |k: usize| picture.pixels.iter().map(|pixel| pixel[k]).collect();
        Self {
            name: name.to_owned(),
            notes: Vec::new(),
            channels: ["R", "G", "B", "A"]
                .into_iter()
                .enumerate()
                .map(|(k, name)| (name, channel(k)))
                .collect(),
        }
    }
}

/// An OpenEXR file of layers of `width` columns each, as halves or 32-bit floats. The notes are lines of the layer's attribute
/// `comments`, since that keeps their order.
///
/// # Errors
/// What the layers have that such a file cannot hold.
pub fn to_exr(layers: &[Layer], width: usize, as_float: bool) -> Result<Vec<u8>, Error> {
    let count = layers
        .first()
        .and_then(|layer| layer.channels.first())
        .map_or(0, |(_, values)| values.len());
    let size = (width, count.checked_div(width).unwrap_or(0));
    let layers: Vec<ExrLayer<AnyChannels<FlatSamples>>> = layers
        .iter()
        .map(|layer| {
            let channel = |(name, values): &(&str, Vec<f32>)| {
                let samples = if as_float {
                    FlatSamples::F32(values.clone())
                } else {
                    // What is too bright for a half stays a number.
                    let half = |x: &f32| f16::from_f32(x.min(f16::MAX.to_f32()));
                    FlatSamples::F16(values.iter().map(half).collect())
                };
                AnyChannel::new(*name, samples)
            };
            let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> =
                layer.channels.iter().map(channel).collect();
            let mut attributes = LayerAttributes::named(text(&layer.name));
            attributes.software_name = Some(text(crate::TOOL));
            let line = |(key, value): &(&str, String)| format!("{key}: {value}\n");
            attributes.comments = Some(text(&layer.notes.iter().map(line).collect::<String>()));
            ExrLayer::new(
                size,
                attributes,
                Encoding::SMALL_LOSSLESS,
                AnyChannels::sort(channels),
            )
        })
        .collect();
    let bounds = IntegerBounds::from_dimensions(size);
    let image = Image::from_layers(ImageAttributes::new(bounds), layers);
    let mut bytes = Cursor::new(Vec::new());
    // Blocks in parallel would come in any order.
    image.write().non_parallel().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

/// The letters that the format has, others as `?`.
fn text(text: &str) -> Text {
    let plain: String = text
        .chars()
        .map(|letter| if letter.is_ascii() { letter } else { '?' })
        .collect();
    Text::new_or_none(plain).unwrap_or_default()
}
