//! OpenEXR: the slabs of a volume side by side in one picture.

use std::io::Cursor;

use ::exr::error::Error;
use ::exr::meta::attribute::AttributeValue;
use ::exr::meta::header::{ImageAttributes, LayerAttributes};
use ::exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, IntegerBounds, Layer, SmallVec, Text,
    WritableImage, f16,
};

use super::note::{Atlas, Note};
use crate::table::place_of;
use crate::volume::Volume;

pub(super) fn write(volume: &Volume, mut note: Note<'_>) -> Result<Vec<u8>, Error> {
    let atlas = Atlas::of(volume.size());
    let size = (atlas.columns * atlas.slab[0], atlas.rows * atlas.slab[1]);
    // Where the last row has no slab, there is nothing.
    let mut planes: [Vec<f16>; 4] = std::array::from_fn(|_| vec![f16::ZERO; size.0 * size.1]);
    let [width, height, _] = volume.size();
    for (index, texel) in volume.texels().enumerate() {
        let [x, y, z] = place_of(index, volume.size());
        let column = z % atlas.columns * width + x;
        let row = z / atlas.columns * height + y;
        for (plane, bits) in planes.iter_mut().zip(texel) {
            plane[row * size.0 + column] = f16::from_bits(bits);
        }
    }
    let channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = ["R", "G", "B", "A"]
        .into_iter()
        .zip(planes)
        .map(|(name, plane)| AnyChannel::new(name, FlatSamples::F16(plane)))
        .collect();
    let mut attributes = LayerAttributes::named(Text::from("volume"));
    attributes.software_name = Text::new_or_none(crate::TOOL);
    attributes.comments = Text::new_or_none(atlas.in_words());
    note.atlas = Some(atlas);
    // One alone, since the order of several is not the same from run to run.
    attributes.other.extend(
        Text::new_or_none(note.to_json())
            .map(|json| (Text::from("sateen"), AttributeValue::Text(json))),
    );
    let layer = Layer::new(
        size,
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let bounds = IntegerBounds::from_dimensions(size);
    let layers: SmallVec<[_; 2]> = [layer].into_iter().collect();
    let image = Image::from_layers(ImageAttributes::new(bounds), layers);
    let mut bytes = Cursor::new(Vec::new());
    // Blocks in parallel would come in any order.
    image.write().non_parallel().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}
