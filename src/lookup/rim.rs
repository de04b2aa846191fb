//! Pairs near a thread's horizon, by placed tilts.
//!
//! Few pairs of a block are, spread over it: they are collected, so that vectors are full.

use super::block::Block;
use crate::brdf::{PlacedNodes, Response, ThreadPair};
use crate::math::simd::{Kernel, Row, Vector};
use crate::math::splat;
use crate::table::{Table, ThreadTable};

/// Blends what `nodes` say into the responses of pairs that are not the grid's alone.
pub(super) struct BlendRim<'a, const N: usize, const STEP: usize>(
    pub(super) &'a mut Block<N, STEP>,
    pub(super) &'a Table,
    pub(super) &'a ThreadTable,
    pub(super) &'a PlacedNodes<f32>,
);

impl<const N: usize, const STEP: usize> Kernel for BlendRim<'_, N, STEP> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) {
        let Self(block, table, thread, nodes) = self;
        let mut pairs = [0u16; N];
        let mut count = 0;
        for pair in 0..block.pairs {
            // Without a branch, which would often be taken wrongly.
            pairs[count] = pair as u16;
            count += usize::from(block.share[pair] < 1.0);
        }
        let frame = thread.frame.cast::<V>();
        let optics = thread.optics.cast::<V>();
        for pairs in pairs[..count].chunks(V::LANES) {
            let wi = frame.to_thread(collect::<V, N>(&block.wi, pairs));
            let wr = frame.to_thread(collect::<V, N>(&block.wr, pairs));
            let pair = ThreadPair::new(wi, wr, splat(table.sigma_u));
            let direct = nodes.mean_response(&pair, &optics);
            let share = collect::<V, N>(&[block.share, block.surface, block.volume], pairs);
            let [share, surface, volume] = share;
            let blended = Response {
                surface: blend(direct.surface, share, surface),
                volume: blend(direct.volume, share, volume),
            };
            let (surface, volume) = (blended.surface.to_array(), blended.volume.to_array());
            for (lane, pair) in pairs.iter().enumerate() {
                let pair = usize::from(*pair);
                block.surface[pair] = surface.as_ref()[lane];
                block.volume[pair] = volume.as_ref()[lane];
            }
        }
    }
}

/// Between what is direct and what is a grid's. (Where a grid has no share it may be anything.)
#[inline(always)]
fn blend<V: Vector>(direct: V, share: V, grid: V) -> V {
    let mixed = (grid - direct).mul_add(share, direct);
    V::select(V::zero().lt(share), mixed, direct)
}

/// Numbers of some pairs.
#[inline(always)]
fn collect<V: Vector, const N: usize>(from: &[[f32; N]; 3], pairs: &[u16]) -> [V; 3] {
    let mut lanes = [V::Array::default(); 3];
    for (lanes, from) in lanes.iter_mut().zip(from) {
        for (lane, pair) in lanes.as_mut().iter_mut().zip(pairs) {
            *lane = from[usize::from(*pair)];
        }
    }
    [
        V::from_array(lanes[0]),
        V::from_array(lanes[1]),
        V::from_array(lanes[2]),
    ]
}
