//! Evaluation of a baked fabric.
//!
//! `block` is the one algorithm, from pairs of directions to numbers, in blocks of some hundred pairs, thread by
//! thread. Each step is done for all pairs of a block before the next, so that none waits for another pair's long chain:
//!
//! 1. `grid`: the pair's place in the thread's frame and chart, and the weights there (as many pairs at once as the machine's
//!    vectors have lanes); the sums of the tiles (a pair after the other, whose numbers lie side by side); S and V of them.
//! 2. `rim`: pairs near the thread's horizon by placed tilts, those of a block collected in full vectors.
//! 3. Single tilts by their closed form, the projection, and the sum over threads.
//!
//! `sampling` draws directions for a view, and tells how likely they are, from tables of their own.
//!
//! `batch` runs it over slices; `pair` is one pair, with parts of all threads side by side instead of pairs. All are compiled for every
//! instruction set of [`crate::math::simd`]. These round differently, so that results differ by at most 1e-4 of the value and a thousandth
//! of the mean, 5e-7 on average (`tests/table/parity.rs`).

mod batch;
mod block;
mod grid;
mod pair;
#[cfg(feature = "shader")]
mod points;
mod rim;
mod sampling;
mod scalar;

pub use batch::Quantity;
#[cfg(feature = "shader")]
pub(crate) use points::roots;
pub use sampling::{Sample, View};
