//! Three mantissas of nine bits that share an exponent of five, by the rules of the OpenGL extension EXT_texture_shared_exponent.

use half::f16;

const MANTISSA_BITS: i32 = 9;
const BIAS: i32 = 15;

/// Of numbers from 0 to 1: R in the lowest bits, the exponent in the highest.
pub(super) fn encode(texels: &[[f16; 3]]) -> Vec<u32> {
    texels.iter().map(|texel| word(*texel)).collect()
}

fn word(texel: [f16; 3]) -> u32 {
    let texel = texel.map(f16::to_f32);
    let largest = texel.into_iter().fold(0.0, f32::max);
    // Of 0 it is −∞, which saturates; −BIAS and below are those of the smallest exponent.
    let mut exponent = (largest.log2().floor() as i32).max(-BIAS - 1) + 1;
    let mantissa = |x: f32, exponent: i32| (x * unit(exponent).recip()).round() as u32;
    if mantissa(largest, exponent) == 1 << MANTISSA_BITS {
        exponent += 1;
    }
    let [r, g, b] = texel.map(|x| mantissa(x, exponent));
    r | g << 9 | b << 18 | ((exponent + BIAS) as u32) << 27
}

/// What 1 of a mantissa stands for.
fn unit(exponent: i32) -> f32 {
    2f32.powi(exponent - MANTISSA_BITS)
}

/// All of them are half floats.
pub(super) fn decode(words: &[u32]) -> Vec<[f16; 3]> {
    let texel = |word: &u32| {
        let unit = unit((word >> 27) as i32 - BIAS);
        [0, 9, 18].map(|shift| f16::from_f32((word >> shift & 511) as f32 * unit))
    };
    words.iter().map(texel).collect()
}
