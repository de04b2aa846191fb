//! The 4D table of one thread.

use super::{Axis, Encoding, Samples};
use crate::chart::Chart;

/// S/F_S and V/F_V of one thread on the nodes of a chart.
///
/// Samples are ordered `[u₃][u₂][u₁][u₀][channel]`, the last index fastest, channel 0 of S and 1 of V: the sharp axis'
/// four interpolated nodes of both channels are contiguous.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub(crate) chart: Chart,
    /// Whether only u₀ ≥ ½ is stored, the thread being symmetric under t → −t.
    pub(crate) folded: bool,
    pub(crate) axes: [Axis; 4],
    pub(crate) encoding: Encoding,
    pub(crate) scale: [f32; 2],
    pub(crate) samples: Samples,
}

impl Grid {
    /// Nodes in the box.
    pub fn node_count(&self) -> usize {
        self.axes.iter().map(Axis::len).product()
    }

    /// Bytes of samples in memory.
    pub fn bytes(&self) -> usize {
        self.samples.len() * self.encoding.bytes()
    }

    /// S/F_S and V/F_V at a point of the box.
    #[inline(always)]
    pub(crate) fn interpolate(&self, u: [f32; 4]) -> [f32; 2] {
        let stencils = [0, 1, 2, 3].map(|k| self.axes[k].stencil(u[k]));
        let taps = [0, 1, 2, 3].map(|k| self.axes[k].taps());
        let (n0, n1, n2) = (self.axes[0].len(), self.axes[1].len(), self.axes[2].len());
        let mut sum = [0.0f32; 2];
        for d in 0..taps[3] {
            for c in 0..taps[2] {
                let w_dc = stencils[3].weights[d] * stencils[2].weights[c];
                let plane = (stencils[3].first + d) * n2 + stencils[2].first + c;
                for b in 0..taps[1] {
                    let w = w_dc * stencils[1].weights[b];
                    let row = 2 * ((plane * n1 + stencils[1].first + b) * n0 + stencils[0].first);
                    let line = [0; 4];
                    let _: [i32; 4] = line;
                    match &self.samples {
                        Samples::F32(samples) => {
                            for (a, pair) in samples[row..row + 2 * taps[0]].chunks_exact(2).enumerate() {
                                let w = w * stencils[0].weights[a];
                                sum[0] += w * pair[0];
                                sum[1] += w * pair[1];
                            }
                        }
                        Samples::F16(samples) => {
                            for (a, pair) in samples[row..row + 2 * taps[0]].chunks_exact(2).enumerate() {
                                let w = w * stencils[0].weights[a];
                                sum[0] += w * pair[0].to_f32();
                                sum[1] += w * pair[1].to_f32();
                            }
                        }
                    }
                }
            }
        }
        [self.scale[0] * self.encoding.decode(sum[0]), self.scale[1] * self.encoding.decode(sum[1])]
    }
}
