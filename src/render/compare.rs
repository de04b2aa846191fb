//! How far two pictures of the same cloth are apart: to the eye, and in numbers.
//!
//! The eye is that of ꟻLIP \[ANAMOH20\]: P. Andersson, J. Nilsson, T. Akenine-Möller, M. Oskarsson, K. Åström, M. Fairchild, *FLIP: A
//! Difference Evaluator for Alternating Images*, Proc. ACM Comput. Graph. Interact. Tech. 3(2), 2020, by its authors' own code, at 67
//! pixels per degree, of what a screen shows before black. It is between 0 (the same) and 1.

use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};

use super::{Display, Picture};
use crate::pattern::Transfer;

/// How far one picture is from another, over the pixels that either covers.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// FLIP of every pixel, `[row][column]`.
    pub flip: Vec<f32>,
    /// Mean FLIP …
    pub flip_mean: f64,
    /// … and the most.
    pub flip_max: f64,
    /// Root of the mean squared difference of radiance, over channels, too.
    pub rmse: f64,
    /// Mean over pixels of the largest channel's |A − B| / (B + 1 % of the mean of B).
    pub mean_relative_error: f64,
    /// A − B: signed radiance, and the larger coverage.
    pub difference: Picture,
    /// The power of two, at most 1024, by which [`Comparison::panels`] amplify the difference: the largest that keeps it below white.
    pub factor: f64,
    stops: f64,
}

/// Compares picture `a` with the truth `b`, as seen at an exposure of that many stops.
///
/// # Panics
/// When their sizes differ.
pub fn compare(a: &Picture, b: &Picture, stops: f64) -> Comparison {
    assert_eq!((a.width, a.height), (b.width, b.height), "sizes differ");
    let flip = flip(a, b, stops);
    let pairs = || a.pixels.iter().zip(&b.pixels);
    let covered: Vec<usize> = pairs()
        .enumerate()
        .filter(|(_, (a, b))| a[3].max(b[3]) > 0.0)
        .map(|(index, _)| index)
        .collect();
    let mean = |of: &dyn Fn(usize) -> f64| {
        covered.iter().map(|index| of(*index)).sum::<f64>() / covered.len().max(1) as f64
    };
    let value = |picture: &Picture, index: usize, k: usize| f64::from(picture.pixels[index][k]);
    let difference = |index: usize, k: usize| value(a, index, k) - value(b, index, k);
    let means = [0, 1, 2].map(|k| mean(&|index| value(b, index, k)));
    let largest = |of: &dyn Fn(usize) -> f64| (0..3).map(of).fold(0.0, f64::max);

    let most = covered.iter().fold(0.0, |most: f64, index| {
        most.max(largest(&|k| difference(*index, k).abs()))
    });
    let mut factor = 1024.0;
    while factor > 1.0 && factor * most * stops.exp2() > 1.0 {
        factor *= 0.5;
    }
    let signed =
        |(a, b): (&[f32; 4], &[f32; 4])| [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3].max(b[3])];
    Comparison {
        flip_mean: mean(&|index| f64::from(flip[index])),
        flip_max: covered
            .iter()
            .fold(0.0, |most, index| most.max(f64::from(flip[*index]))),
        rmse: mean(&|index| (0..3).map(|k| difference(index, k).powi(2)).sum::<f64>() / 3.0).sqrt(),
        mean_relative_error: mean(&|index| {
            largest(&|k| match value(b, index, k) + 0.01 * means[k] {
                0.0 => f64::from(u8::from(difference(index, k) != 0.0)),
                scale => difference(index, k).abs() / scale,
            })
        }),
        difference: Picture {
            width: a.width,
            height: a.height,
            pixels: pairs().map(signed).collect(),
        },
        factor,
        flip,
        stops,
    }
}

impl Comparison {
    /// Those of FLIP from 0 to 1.
    pub fn colours() -> Vec<[u8; 4]> {
        let colours = nv_flip::magma_lut().to_vec();
        let colours = colours.as_chunks::<3>().0.iter();
        colours.map(|[r, g, b]| [*r, *g, *b, 255]).collect()
    }

    /// The amplified absolute difference, and FLIP in magma colours.
    pub fn panels(&self, transfer: Transfer) -> [Display; 2] {
        let amplified = |pixel: &[f32; 4]| {
            let [r, g, b, coverage] = *pixel;
            let factor = self.factor as f32;
            let [r, g, b] = [r, g, b].map(|value| factor * value.abs());
            [r, g, b, coverage]
        };
        let Picture { width, height, .. } = self.difference;
        let amplified = Picture {
            width,
            height,
            pixels: self.difference.pixels.iter().map(amplified).collect(),
        };
        let colours = Self::colours();
        let colour = |error: &f32| colours[(255.0 * error.clamp(0.0, 1.0)).round() as usize];
        let flip = Display {
            width,
            height,
            pixels: self.flip.iter().map(colour).collect(),
            transfer,
            clipped: 0,
        };
        [Display::of(&amplified, self.stops, transfer), flip]
    }
}

/// FLIP of every pixel.
fn flip(a: &Picture, b: &Picture, stops: f64) -> Vec<f32> {
    let shown = |picture: &Picture| {
        // Over black the colours that coverage is multiplied into are what is seen.
        let opaque = |pixel: &[f32; 4]| [pixel[0], pixel[1], pixel[2], 1.0];
        let picture = Picture {
            pixels: picture.pixels.iter().map(opaque).collect(),
            ..*picture
        };
        let colours: Vec<u8> = Display::of(&picture, stops, Transfer::Srgb)
            .pixels
            .iter()
            .flat_map(|[r, g, b, _]| [*r, *g, *b])
            .collect();
        let side = |count: usize| u32::try_from(count).expect("pictures are small");
        FlipImageRgb8::with_data(side(picture.width), side(picture.height), &colours)
    };
    nv_flip::flip(shown(b), shown(a), DEFAULT_PIXELS_PER_DEGREE).to_vec()
}
