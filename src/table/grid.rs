//! The 4D table of one thread.

use super::{Axis, Encoding, Samples, Stencil};
use crate::chart::Chart;

/// S/F_S and V/F_V of one thread's segments on the nodes of a chart.
///
/// Samples are ordered `[u₃][u₂][u₁][u₀][channel]`, the last index fastest, channel 0 of S and 1 of V: the nodes that are
/// interpolated along the sharp axis are contiguous, both channels together.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub(crate) chart: Chart,
    /// Whether only u₀ ≥ ½ is stored, the segments looking the same from both ends of the thread.
    pub(crate) folded: bool,
    pub(crate) axes: [Axis; 4],
    pub(crate) encoding: Encoding,
    /// What decoded values of S/F_S and V/F_V are multiplied by.
    pub(crate) scale: [f32; 2],
    pub(crate) samples: Samples,
}

/// S and V.
pub(crate) const CHANNELS: usize = 2;

impl Grid {
    /// The chart that the axes are of.
    pub fn chart(&self) -> Chart {
        self.chart
    }

    /// Whether the table holds the half u₀ ≥ ½ only, for a thread that looks the same from both ends.
    pub fn is_folded(&self) -> bool {
        self.folded
    }

    /// The axes of u₀ to u₃.
    pub fn axes(&self) -> &[Axis; 4] {
        &self.axes
    }

    /// How samples are stored.
    pub fn encoding(&self) -> Encoding {
        self.encoding
    }

    /// Bytes of samples in memory.
    pub fn bytes(&self) -> usize {
        self.samples.len() * self.encoding.bytes()
    }

    /// S/F_S and V/F_V for a pair in thread coordinates.
    #[inline]
    pub(crate) fn ratios(&self, mut wi: [f32; 3], mut wr: [f32; 3]) -> [f32; 2] {
        if self.folded && wi[0] + wr[0] < 0.0 {
            wi[0] = -wi[0];
            wr[0] = -wr[0];
        }
        let u = self.chart.coordinates(wi, wr);
        let stencils = [0, 1, 2, 3].map(|k| self.axes[k].stencil(u[k]));
        let sums = match &self.samples {
            Samples::F32(samples) => self.interpolate(&stencils, samples, |x| x),
            Samples::F16(samples) => self.interpolate(&stencils, samples, half::f16::to_f32),
        };
        [0, 1].map(|channel| self.scale[channel] * self.encoding.decode(sums[channel]))
    }

    #[inline(always)]
    fn interpolate<T: Copy>(&self, stencils: &[Stencil; 4], samples: &[T], to_f32: impl Fn(T) -> f32) -> [f32; 2] {
        let [n0, n1, n2, _] = self.axes.each_ref().map(Axis::len);
        let taps = self.axes.each_ref().map(Axis::taps);
        let mut sums = [0.0; CHANNELS];
        for d in 0..taps[3] {
            for c in 0..taps[2] {
                let plane = (stencils[3].first + d) * n2 + stencils[2].first + c;
                for b in 0..taps[1] {
                    let row = (plane * n1 + stencils[1].first + b) * n0 + stencils[0].first;
                    let weight = stencils[3].weights[d] * stencils[2].weights[c] * stencils[1].weights[b];
                    let nodes = samples[CHANNELS * row..CHANNELS * (row + taps[0])].chunks_exact(CHANNELS);
                    for (node, w) in nodes.zip(stencils[0].weights) {
                        for (sum, sample) in sums.iter_mut().zip(node) {
                            *sum += weight * w * to_f32(*sample);
                        }
                    }
                }
            }
        }
        sums
    }
}
