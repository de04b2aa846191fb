//! Compares every texel of volume.dds with the raw ones, by two readers.

use std::error::Error;
use std::fs::{self, File};
use std::io::BufReader;

use dds::{ColorFormat, DataLayout, Decoder, ImageViewMut, Size};
use half::f16;
use image_dds::Surface;
use image_dds::ddsfile::Dds;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("a folder")?;
    let raw = fs::read(format!("{folder}/volume.bin"))?;
    let halves = raw.as_chunks::<2>().0.iter();
    let expected: Vec<f32> = halves
        .map(|half| f16::from_le_bytes(*half).to_f32())
        .collect();
    for (reader, read) in [("dds", by_dds as Reader), ("image_dds", by_image_dds)] {
        let (size, texels) = read(&format!("{folder}/volume.dds"))?;
        assert!(texels == expected, "{reader} reads other texels");
        println!("{reader} (crates.io): volume.dds is {size}, all as they were");
    }
    Ok(())
}

/// What it says of a file, and all numbers.
type Reader = fn(&str) -> Result<(String, Vec<f32>), Box<dyn Error>>;

fn by_dds(path: &str) -> Result<(String, Vec<f32>), Box<dyn Error>> {
    let mut decoder = Decoder::new(BufReader::new(File::open(path)?))?;
    let DataLayout::Volume(volume) = decoder.layout() else {
        return Err("it is no volume".into());
    };
    let (main, format) = (volume.main(), decoder.format());
    let (width, height, depth) = (main.width(), main.height(), main.depth());
    let mut texels = Vec::new();
    let mut slab = vec![0; 16 * (width * height) as usize];
    for _ in 0..depth {
        let size = Size::new(width, height);
        let view = ImageViewMut::new(&mut slab, size, ColorFormat::RGBA_F32).ok_or("no view")?;
        decoder.read_surface(view)?;
        let floats = slab.as_chunks::<4>().0.iter();
        texels.extend(floats.map(|float| f32::from_ne_bytes(*float)));
    }
    Ok((
        format!("{width} × {height} × {depth} of {format:?}"),
        texels,
    ))
}

fn by_image_dds(path: &str) -> Result<(String, Vec<f32>), Box<dyn Error>> {
    let file = Dds::read(BufReader::new(File::open(path)?))?;
    let surface = Surface::from_dds(&file)?;
    let (width, height, depth) = (surface.width, surface.height, surface.depth);
    let said = format!("{width} × {height} × {depth} of {:?}", surface.image_format);
    Ok((said, surface.decode_rgbaf32()?.data))
}
