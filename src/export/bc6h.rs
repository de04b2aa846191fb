//! BC6H, unsigned: blocks of 4 × 4 texels between two ends each, by the Khronos Data Format Specification 1.3, *BPTC Compressed Texture Image
//! Formats*.
//!
//! Of the fourteen modes the four that have one pair of ends are written: the three channels of a texel are values of one function at
//! neighbouring nodes ([`super::threes`]), which nearly lie on one line. For each block a line is fitted to the bits of the halves, which are
//! interpolated, and the mode and the places on the line that err least are taken, relative to the value and to what is dark anyway.

use half::f16;
use rayon::prelude::*;

/// Texels along a side of a block.
pub(super) const SIDE: usize = 4;
const BLOCK_BYTES: usize = 16;

/// Sixteen texels.
type Block = [[f16; 3]; SIDE * SIDE];

/// Its five bits, how many bits an end has, and how many the difference of the other from it; of the first mode, the other itself.
const MODES: [(u32, u32, u32); 4] = [
    (0b00011, 10, 10),
    (0b00111, 11, 9),
    (0b01011, 12, 8),
    (0b01111, 16, 4),
];
/// Bits of an end that come first.
const LOW_BITS: u32 = 10;
/// In 64ths, how near the second end is.
const WEIGHTS: [i32; 16] = [0, 4, 9, 13, 17, 21, 26, 30, 34, 38, 43, 47, 51, 55, 60, 64];
/// Of numbers from 0 to 1, what is dark: below this, errors are measured by it.
const DARK: f32 = 0.02;
/// Half floats below which all may be alike to the line that is fitted: 0, 2⁻⁹ and 2⁻⁶. The bits of dark numbers differ by far more than
/// they show.
const FLOORS: [f32; 3] = [0.0, 0x1800 as f32, 0x2400 as f32];
/// How often places and ends take turns.
const ROUNDS: usize = 3;

/// Slices of `width` × `height` texels, which are multiples of [`SIDE`], in blocks.
pub(super) fn encode(texels: &[[f16; 3]], size: [usize; 2]) -> Vec<u8> {
    let blocks = texels.len() / (SIDE * SIDE);
    let block = |index: usize| {
        let texel = |k: usize| texels[place(index, k, size)];
        encode_block(&std::array::from_fn(texel))
    };
    let bytes = (0..blocks).into_par_iter().map(block);
    bytes.collect::<Vec<_>>().concat()
}

/// What [`encode`] wrote.
pub(super) fn decode(bytes: &[u8], size: [usize; 2]) -> Vec<[f16; 3]> {
    let blocks = bytes.chunks_exact(BLOCK_BYTES);
    let mut texels = vec![[f16::ZERO; 3]; blocks.len() * SIDE * SIDE];
    for (index, block) in blocks.enumerate() {
        let bits = u128::from_le_bytes(block.try_into().expect("16 bytes"));
        for (k, texel) in decode_block(bits).into_iter().enumerate() {
            texels[place(index, k, size)] = texel;
        }
    }
    texels
}

/// Where texel `k` of a block is.
fn place(block: usize, k: usize, [width, height]: [usize; 2]) -> usize {
    let across = width / SIDE;
    let (column, row) = (block % across, block / across);
    debug_assert_eq!(height % SIDE, 0);
    (row * SIDE + k / SIDE) * width + column * SIDE + k % SIDE
}

/// Two ends, as they are stored.
#[derive(Clone, Copy)]
struct Ends {
    mode: usize,
    ends: [[i32; 3]; 2],
}

impl Ends {
    /// The nearest to a line in halves, whose bits are numbers; none where the ends are too far apart for the mode.
    fn nearest(mode: usize, line: &[[f32; 3]; 2]) -> Self {
        let bits = MODES[mode].1;
        let most = (1 << bits) - 1;
        let quantize = |half: f32| {
            // Of 65536, of which 31/64 are kept.
            let unquantized = half * (64.0 / 31.0);
            ((unquantized / (1 << (16 - bits)) as f32) as i32).clamp(0, most)
        };
        Self {
            mode,
            ends: line.map(|end| end.map(quantize)),
        }
    }

    /// Whether the difference can be written.
    fn fits(&self) -> bool {
        let (_, bits, other) = MODES[self.mode];
        let half = 1 << (other - 1);
        let [first, second] = self.ends;
        bits == other || (0..3).all(|c| (-half..half).contains(&(second[c] - first[c])))
    }

    /// The sixteen texels between them, as bits of halves.
    fn palette(&self) -> [[u16; 3]; 16] {
        let bits = MODES[self.mode].1;
        let unquantized = self.ends.map(|end| end.map(|x| unquantize(x, bits)));
        WEIGHTS.map(|weight| {
            [0, 1, 2].map(|c| {
                let [first, second] = unquantized.map(|end| end[c]);
                let between = (first * (64 - weight) + second * weight + 32) >> 6;
                ((between * 31) >> 6) as u16
            })
        })
    }
}

fn unquantize(x: i32, bits: u32) -> i32 {
    if bits >= 15 || x == 0 {
        x
    } else if x == (1 << bits) - 1 {
        0xFFFF
    } else {
        ((x << 16) + 0x8000) >> bits
    }
}

fn encode_block(block: &Block) -> [u8; BLOCK_BYTES] {
    let bits = block.map(|texel| texel.map(|x| f32::from(x.to_bits())));
    let values = block.map(|texel| texel.map(f16::to_f32));
    let (mut best, mut least) = (None, f32::INFINITY);
    for floor in FLOORS {
        let points = bits.map(|texel| texel.map(|x| x.max(floor)));
        let mut line = principal_line(&points);
        for _ in 0..ROUNDS {
            let (mut places, mut least_here) = ([0; 16], f32::INFINITY);
            for mode in 0..MODES.len() {
                let ends = Ends::nearest(mode, &line);
                let (indices, error) = indices(&ends.palette(), &values);
                let (ends, indices) = anchored(ends, indices);
                if !ends.fits() {
                    continue;
                }
                if error < least {
                    (best, least) = (Some((ends, indices)), error);
                }
                if error < least_here {
                    least_here = error;
                    places = indices;
                }
            }
            line = fitted_line(&points, &places).unwrap_or(line);
        }
    }
    let (ends, indices) = best.expect("the first mode has any ends");
    pack(&ends, &indices).to_le_bytes()
}

/// The nearest entries, and how far they are.
fn indices(palette: &[[u16; 3]; 16], values: &[[f32; 3]; 16]) -> ([usize; 16], f32) {
    let palette = palette.map(|entry| entry.map(|bits| f16::from_bits(bits).to_f32()));
    let (mut indices, mut sum) = ([0; 16], 0.0);
    for (index, value) in indices.iter_mut().zip(values) {
        let size = value.map(|x| 1.0 / (x + DARK));
        let mut least = f32::INFINITY;
        for (k, entry) in palette.iter().enumerate() {
            let error: f32 = (0..3)
                .map(|c| ((entry[c] - value[c]) * size[c]).powi(2))
                .sum();
            if error < least {
                (*index, least) = (k, error);
            }
        }
        sum += least;
    }
    (indices, sum)
}

/// With the first index below 8, whose highest bit is not stored.
fn anchored(mut ends: Ends, mut indices: [usize; 16]) -> (Ends, [usize; 16]) {
    if indices[0] >= 8 {
        ends.ends.reverse();
        indices = indices.map(|index| 15 - index);
    }
    (ends, indices)
}

/// The ends of points along the line on which they lie best.
fn principal_line(points: &[[f32; 3]; 16]) -> [[f32; 3]; 2] {
    let mut mean = [0.0; 3];
    for point in points {
        mean = [0, 1, 2].map(|c| mean[c] + point[c] / 16.0);
    }
    let away = points.map(|point| [0, 1, 2].map(|c| point[c] - mean[c]));
    let dot = |a: &[f32; 3], b: &[f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let furthest = |a: &&[f32; 3], b: &&[f32; 3]| dot(a, a).total_cmp(&dot(b, b));
    let mut axis = *away.iter().max_by(furthest).expect("sixteen");
    // Powers of the covariance: three turns take the axis near enough.
    for _ in 0..3 {
        let mut next = [0.0; 3];
        for point in &away {
            let along = dot(point, &axis);
            next = [0, 1, 2].map(|c| next[c] + along * point[c]);
        }
        let length = dot(&next, &next).sqrt();
        if !(length > 0.0) {
            return [mean; 2];
        }
        axis = next.map(|x| x / length);
    }
    let along = away.map(|point| dot(&point, &axis));
    let low = along.into_iter().fold(f32::INFINITY, f32::min);
    let high = along.into_iter().fold(f32::NEG_INFINITY, f32::max);
    [low, high].map(|along| [0, 1, 2].map(|c| mean[c] + along * axis[c]))
}

/// The ends from which points at these places are least far; none where all places are one.
fn fitted_line(points: &[[f32; 3]; 16], places: &[usize; 16]) -> Option<[[f32; 3]; 2]> {
    let (mut a2, mut ab, mut b2) = (0.0, 0.0, 0.0);
    let (mut first, mut second) = ([0.0; 3], [0.0; 3]);
    for (point, place) in points.iter().zip(places) {
        let b = WEIGHTS[*place] as f32 / 64.0;
        let a = 1.0 - b;
        a2 += a * a;
        ab += a * b;
        b2 += b * b;
        for c in 0..3 {
            first[c] += a * point[c];
            second[c] += b * point[c];
        }
    }
    let determinant = a2 * b2 - ab * ab;
    (determinant > 1e-3).then(|| {
        [
            [0, 1, 2].map(|c| (b2 * first[c] - ab * second[c]) / determinant),
            [0, 1, 2].map(|c| (a2 * second[c] - ab * first[c]) / determinant),
        ]
    })
}

/// Bits from the lowest.
struct Bits {
    bits: u128,
    count: u32,
}

impl Bits {
    fn push(&mut self, value: u32, count: u32) {
        self.bits |= u128::from(value & ((1 << count) - 1)) << self.count;
        self.count += count;
    }

    fn pull(&mut self, count: u32) -> u32 {
        let value = (self.bits >> self.count) as u32 & ((1 << count) - 1);
        self.count += count;
        value
    }
}

fn pack(ends: &Ends, indices: &[usize; 16]) -> u128 {
    let (code, bits, other) = MODES[ends.mode];
    let [first, second] = ends.ends;
    let mut out = Bits { bits: 0, count: 0 };
    out.push(code, 5);
    for end in first {
        out.push(end as u32, LOW_BITS);
    }
    for c in 0..3 {
        let is_difference = bits != other;
        out.push(
            (second[c] - if is_difference { first[c] } else { 0 }) as u32,
            other,
        );
        // The highest first.
        for bit in (LOW_BITS..bits).rev() {
            out.push(first[c] as u32 >> bit, 1);
        }
    }
    for (k, index) in indices.iter().enumerate() {
        out.push(*index as u32, if k == 0 { 3 } else { 4 });
    }
    debug_assert_eq!(out.count, 128);
    out.bits
}

/// A block of one of [`MODES`].
fn decode_block(bits: u128) -> Block {
    let mut input = Bits { bits, count: 0 };
    let code = input.pull(5);
    let mode = MODES.iter().position(|(other, ..)| *other == code);
    let mode = mode.expect("one of the modes that are written");
    let (_, bits, other) = MODES[mode];
    let mut first = [0; 3].map(|_: i32| input.pull(LOW_BITS) as i32);
    let mut second = [0; 3];
    for c in 0..3 {
        second[c] = input.pull(other) as i32;
        for bit in (LOW_BITS..bits).rev() {
            first[c] |= (input.pull(1) << bit) as i32;
        }
        if bits != other {
            let unused = 32 - other;
            second[c] = first[c] + (second[c] << unused >> unused);
        }
    }
    let ends = Ends {
        mode,
        ends: [first, second],
    };
    let palette = ends.palette();
    std::array::from_fn(|k| {
        let index = input.pull(if k == 0 { 3 } else { 4 });
        palette[index as usize].map(f16::from_bits)
    })
}
