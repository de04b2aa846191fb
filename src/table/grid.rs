//! The 4D table of one thread.

use half::slice::HalfFloatSliceExt;

use super::{Axis, Encoding, Samples, Stencil};
use crate::chart::{Chart, fold_ends};

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
/// Samples that are read along the sharp axis.
const ROW: usize = 4 * CHANNELS;
/// Rows that are read for a value, at most: four nodes on each of the other axes.
const MAX_ROWS: usize = 4 * 4 * 4;

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
    pub(crate) fn ratios(&self, wi: [f32; 3], wr: [f32; 3]) -> [f32; 2] {
        let (wi, wr) = if self.folded {
            fold_ends(wi, wr)
        } else {
            (wi, wr)
        };
        let u = self.chart.coordinates(wi, wr);
        let stencils = [0, 1, 2, 3].map(|k| self.axes[k].stencil(u[k]));
        let sums = match &self.samples {
            Samples::F32(samples) => {
                self.interpolate(&stencils, samples, |from, to| to.copy_from_slice(from))
            }
            // As one slice: the conversion looks up once per call which instructions there are.
            Samples::F16(samples) => {
                self.interpolate(&stencils, samples, |from, to| from.convert_to_f32_slice(to))
            }
        };
        [0, 1].map(|channel| self.scale[channel] * self.encoding.decode(sums[channel]))
    }

    /// Gathers the stencils' samples, converts them all at once, and sums up axis by axis, the sharp one last.
    #[inline(always)]
    fn interpolate<T: Copy + Default>(
        &self,
        stencils: &[Stencil; 4],
        samples: &[T],
        convert: impl Fn(&[T], &mut [f32]),
    ) -> [f32; CHANNELS] {
        let [n0, n1, n2, _] = self.axes.each_ref().map(Axis::len);
        let taps = self.axes.each_ref().map(Axis::taps);
        let length = CHANNELS * taps[0];
        let mut gathered = [T::default(); MAX_ROWS * ROW];
        let mut weights = [0.0; MAX_ROWS];
        let mut rows = 0;
        for d in 0..taps[3] {
            for c in 0..taps[2] {
                let plane = (stencils[3].first + d) * n2 + stencils[2].first + c;
                let plane_weight = stencils[3].weights[d] * stencils[2].weights[c];
                for b in 0..taps[1] {
                    let start =
                        CHANNELS * ((plane * n1 + stencils[1].first + b) * n0 + stencils[0].first);
                    let (from, to) = (&samples[start..start + length], &mut gathered[ROW * rows..]);
                    // Four nodes are the rule: a copy of known length needs no call.
                    match <&[T; ROW]>::try_from(from) {
                        Ok(row) => to[..ROW].copy_from_slice(row),
                        Err(_) => to[..length].copy_from_slice(from),
                    }
                    weights[rows] = plane_weight * stencils[1].weights[b];
                    rows += 1;
                }
            }
        }
        let mut values = [0.0; MAX_ROWS * ROW];
        convert(&gathered[..ROW * rows], &mut values[..ROW * rows]);
        let mut sums = [0.0; ROW];
        for (row, weight) in values.chunks_exact(ROW).zip(&weights[..rows]) {
            for (sum, value) in sums.iter_mut().zip(row) {
                *sum += weight * value;
            }
        }
        let mut result = [0.0; CHANNELS];
        for (node, weight) in sums.chunks_exact(CHANNELS).zip(stencils[0].weights) {
            for (result, sum) in result.iter_mut().zip(node) {
                *result += weight * sum;
            }
        }
        result
    }
}
