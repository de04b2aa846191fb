//! Compares every slab of volume.dds with the raw texels.

use std::error::Error;
use std::fs::{self, File};
use std::io::BufReader;

use dds::{ColorFormat, DataLayout, Decoder, ImageViewMut, Size};
use half::f16;

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("a folder")?;
    let raw = fs::read(format!("{folder}/volume.bin"))?;
    let mut decoder = Decoder::new(BufReader::new(File::open(format!("{folder}/volume.dds"))?))?;
    let DataLayout::Volume(volume) = decoder.layout() else {
        return Err("it is no volume".into());
    };
    let (main, format) = (volume.main(), decoder.format());
    let (width, height, depth) = (main.width(), main.height(), main.depth());
    let bytes = 8 * (width * height) as usize;
    assert_eq!(raw.len(), bytes * depth as usize);
    let mut slab = vec![0; 2 * bytes];
    for expected in raw.chunks_exact(bytes) {
        let size = Size::new(width, height);
        let view = ImageViewMut::new(&mut slab, size, ColorFormat::RGBA_F32).ok_or("no view")?;
        decoder.read_surface(view)?;
        let halves = expected.as_chunks::<2>().0.iter();
        let read = slab.as_chunks::<4>().0.iter();
        for (half, float) in halves.zip(read) {
            assert_eq!(
                f16::from_le_bytes(*half).to_f32(),
                f32::from_ne_bytes(*float)
            );
        }
    }
    println!(
        "dds (crates.io): volume.dds is {width} × {height} × {depth} of {format:?}, all as they were"
    );
    Ok(())
}
