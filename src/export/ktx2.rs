//! KTX 2.0 (Khronos, *KTX File Format Specification* 2.0, with the *Khronos Data Format Specification* 1.3 for its descriptor): a 3D texture of
//! one level.

use std::io;

use super::Pixels;

const IDENTIFIER: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";
/// What comes before the descriptor: identifier, header, index and one level.
const HEAD_BYTES: usize = 12 + 36 + 32 + 24;
const SCHEME_ZSTD: u32 = 2;
/// Small, at some seconds for the largest volumes.
const ZSTD_LEVEL: i32 = 19;

/// A channel of the data format descriptor.
struct Sample {
    bit_offset: u32,
    bits: u32,
    /// With its qualifiers: FLOAT 128, SIGNED 64, EXPONENT 32.
    channel: u32,
    lower: u32,
    upper: u32,
}

/// What a format is called and made of.
struct Description {
    vk_format: u32,
    /// Of the units that another byte order would swap.
    type_bytes: u32,
    block_bytes: u32,
    /// Texels along x and y of a block.
    block_side: u32,
    colour_model: u32,
    samples: Vec<Sample>,
}

const ONE: u32 = 1f32.to_bits();
const MINUS_ONE: u32 = (-1f32).to_bits();

impl Description {
    fn of(pixels: Pixels) -> Self {
        match pixels {
            Pixels::Rgba16f => Self {
                vk_format: 97,
                type_bytes: 2,
                block_bytes: 8,
                block_side: 1,
                colour_model: 1,
                samples: [0, 1, 2, 15]
                    .into_iter()
                    .zip(0..)
                    .map(|(channel, k)| Sample {
                        bit_offset: 16 * k,
                        bits: 16,
                        channel: channel | 128 | 64,
                        lower: MINUS_ONE,
                        upper: ONE,
                    })
                    .collect(),
            },
            // Per channel a mantissa, of which 8448 would be 1 if the exponent were least, and the exponent, from its bias to its end.
            Pixels::Rgb9e5 => Self {
                vk_format: 123,
                type_bytes: 4,
                block_bytes: 4,
                block_side: 1,
                colour_model: 1,
                samples: (0..3)
                    .flat_map(|channel| {
                        let mantissa = Sample {
                            bit_offset: 9 * channel,
                            bits: 9,
                            channel,
                            lower: 0,
                            upper: 8448,
                        };
                        let exponent = Sample {
                            bit_offset: 27,
                            bits: 5,
                            channel: channel | 32,
                            lower: 15,
                            upper: 31,
                        };
                        [mantissa, exponent]
                    })
                    .collect(),
            },
            Pixels::Bc6h => Self {
                vk_format: 143,
                type_bytes: 1,
                block_bytes: 16,
                block_side: 4,
                colour_model: 133,
                samples: vec![Sample {
                    bit_offset: 0,
                    bits: 128,
                    channel: 128,
                    lower: 0,
                    upper: ONE,
                }],
            },
        }
    }

    /// The data format descriptor. It is that of the texels before they are compressed: readers want `bytesPlane0`, which earlier revisions
    /// set to 0 there (KhronosGroup/KTX-Specification, issue 217; KTX-Software, pull request 988).
    fn descriptor(&self) -> Vec<u8> {
        let block_bytes = 24 + 16 * self.samples.len() as u32;
        let side = self.block_side - 1;
        // Colours are none, but BT.709 and linear are what readers expect.
        let (primaries, linear) = (1, 1);
        let mut words = vec![
            4 + block_bytes,
            0,
            2 | block_bytes << 16,
            self.colour_model | primaries << 8 | linear << 16,
            side | side << 8,
            self.block_bytes,
            0,
        ];
        for sample in &self.samples {
            words.extend([
                sample.bit_offset | (sample.bits - 1) << 16 | sample.channel << 24,
                0,
                sample.lower,
                sample.upper,
            ]);
        }
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// Keys in ascending order and their values, each of which ends in 0.
fn key_values(json: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (key, value) in [
        // Right, down and in: texels as they come.
        ("KTXorientation", "rdi"),
        ("KTXwriter", crate::TOOL),
        ("sateen", json),
    ] {
        let entry = [key.as_bytes(), value.as_bytes()].map(|text| [text, b"\0"].concat());
        let entry = entry.concat();
        bytes.extend((entry.len() as u32).to_le_bytes());
        bytes.extend(entry);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

pub(super) fn write(
    pixels: Pixels,
    size: [usize; 3],
    texels: &[u8],
    json: &str,
    supercompress: bool,
) -> io::Result<Vec<u8>> {
    let description = Description::of(pixels);
    let (descriptor, keys) = (description.descriptor(), key_values(json));
    let compressed = if supercompress {
        Some(zstd::bulk::compress(texels, ZSTD_LEVEL)?)
    } else {
        None
    };
    let level = compressed.as_deref().unwrap_or(texels);
    let keys_at = HEAD_BYTES + descriptor.len();
    // What is compressed lies anywhere.
    let alignment = if supercompress {
        1
    } else {
        description.block_bytes.max(4) as usize
    };
    let level_at = (keys_at + keys.len()).next_multiple_of(alignment);

    let mut bytes = Vec::with_capacity(level_at + level.len());
    bytes.extend(IDENTIFIER);
    let [width, height, depth] = size.map(|side| side as u32);
    let (layers, faces, levels) = (0, 1, 1);
    let scheme = if supercompress { SCHEME_ZSTD } else { 0 };
    let words = [
        description.vk_format,
        description.type_bytes,
        width,
        height,
        depth,
        layers,
        faces,
        levels,
        scheme,
        HEAD_BYTES as u32,
        descriptor.len() as u32,
        keys_at as u32,
        keys.len() as u32,
    ];
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    // No global data of the compression; then the level.
    let words = [0, 0, level_at, level.len(), texels.len()].map(|word| word as u64);
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    debug_assert_eq!(bytes.len(), HEAD_BYTES);
    bytes.extend(descriptor);
    bytes.extend(keys);
    bytes.resize(level_at, 0);
    bytes.extend(level);
    Ok(bytes)
}
