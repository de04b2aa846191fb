//! How far a picture is from another: `compare A.png B.png MOST`, of the same size, RGBA of eight bits each. Fails where the mean
//! difference is more than MOST of 255.

use std::error::Error;
use std::fs::File;
use std::io::BufReader;

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};

struct Picture {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 4]>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let usage = "usage: compare A.png B.png MOST";
    let [a, b, most] = arguments.as_slice() else {
        return Err(usage.into());
    };
    let most: f64 = most.parse().map_err(|_| usage)?;
    let read = |path: &String| read(path).map_err(|error| format!("{path}: {error}"));
    let (a, b) = (read(a)?, read(b)?);
    if (a.width, a.height) != (b.width, b.height) {
        return Err("the pictures differ in size".into());
    }
    let flip = nv_flip::flip(b.shown(), a.shown(), DEFAULT_PIXELS_PER_DEGREE).to_vec();
    let (mut covered, mut by_one, mut sum, mut largest, mut flip_sum) = (0, 0, 0.0, 0, 0.0);
    for ((a, b), flip) in a.pixels.iter().zip(&b.pixels).zip(flip) {
        if a[3] == 0 && b[3] == 0 {
            continue;
        }
        covered += 1;
        by_one += usize::from(a[3] == 0 || b[3] == 0);
        flip_sum += f64::from(flip);
        for (a, b) in a.iter().zip(b).take(3) {
            sum += f64::from(a.abs_diff(*b)) / 3.0;
            largest = largest.max(a.abs_diff(*b));
        }
    }
    let mean = sum / f64::from(covered.max(1));
    let flip = flip_sum / f64::from(covered.max(1));
    println!("{covered} pixels covered, {by_one} of them by one picture alone");
    println!("mean difference {mean:.3} of 255, at most {largest}; mean FLIP {flip:.4}");
    if covered == 0 || mean > most {
        return Err(format!("the mean difference should be at most {most}").into());
    }
    Ok(())
}

fn read(path: &str) -> Result<Picture, Box<dyn Error>> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path)?)).read_info()?;
    let mut bytes = vec![0; reader.output_buffer_size().ok_or("too large")?];
    let info = reader.next_frame(&mut bytes)?;
    if (info.color_type, info.bit_depth) != (png::ColorType::Rgba, png::BitDepth::Eight) {
        return Err("not RGBA of eight bits each".into());
    }
    let (pixels, _) = bytes.as_chunks();
    Ok(Picture {
        width: info.width,
        height: info.height,
        pixels: pixels.to_vec(),
    })
}

impl Picture {
    /// Over black.
    fn shown(&self) -> FlipImageRgb8 {
        let opaque = |pixel: &[u8; 4]| match *pixel {
            [_, _, _, 0] => [0; 3],
            [r, g, b, _] => [r, g, b],
        };
        let colours: Vec<u8> = self.pixels.iter().flat_map(opaque).collect();
        FlipImageRgb8::with_data(self.width, self.height, &colours)
    }
}
