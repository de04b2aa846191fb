//! A function of two directions over slices, and at one pair.

use core::ops::Range;

use crate::math::simd::{Colours, Directions, Kernel, Level, Row, Vector};
use crate::math::{Vec3, each, splat};

/// A colour for a pair of directions `wi` and `wr`.
pub(super) trait PairFunction {
    /// The function, for several pairs side by side. Lanes do not know of each other.
    fn at<V: Vector, R: Row>(&self, wi: Vec3<V>, wr: Vec3<V>) -> Vec3<V>;
}

/// The `function` of every pair, with the instructions of `level`.
///
/// # Panics
/// When the slices are not all of one length.
pub(super) fn map_pairs<F: PairFunction>(
    level: Level,
    function: &F,
    wi: Directions<'_>,
    wr: Directions<'_>,
    values: Colours<'_>,
) {
    let pairs = wi[0].len();
    let inputs = wi.iter().chain(&wr).all(|slice| slice.len() == pairs);
    assert!(
        inputs && values.iter().all(|slice| slice.len() == pairs),
        "slices of directions and values must be of one length"
    );
    level.run(Many {
        function,
        wi,
        wr,
        values,
    });
}

/// The `function` of one pair, compiled for the machine's instructions.
pub(super) fn at_pair<F: PairFunction>(function: &F, wi: [f32; 3], wr: [f32; 3]) -> [f32; 3] {
    Level::detect().run_single(One { function, wi, wr })
}

struct One<'a, F> {
    function: &'a F,
    wi: [f32; 3],
    wr: [f32; 3],
}

impl<F: PairFunction> Kernel for One<'_, F> {
    type Output = [f32; 3];

    #[inline(always)]
    fn run<V: Vector, R: Row>(self) -> [f32; 3] {
        let (wi, wr) = (
            each(self.wi, splat::<f32, V>),
            each(self.wr, splat::<f32, V>),
        );
        each(self.function.at::<V, R>(wi, wr), first)
    }
}

#[inline(always)]
fn first<V: Vector>(x: V) -> f32 {
    x.to_array().as_ref()[0]
}

struct Many<'a, F> {
    function: &'a F,
    wi: Directions<'a>,
    wr: Directions<'a>,
    values: Colours<'a>,
}

impl<F: PairFunction> Kernel for Many<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<V: Vector, R: Row>(mut self) {
        let pairs = self.wi[0].len();
        let mut start = 0;
        while start < pairs {
            let here = start..pairs.min(start + V::LANES);
            let (wi, wr) = (load::<V>(self.wi, &here), load::<V>(self.wr, &here));
            let value = self.function.at::<V, R>(wi, wr);
            for (to, value) in self.values.iter_mut().zip(value) {
                to[here.clone()].copy_from_slice(&value.to_array().as_ref()[..here.len()]);
            }
            start = here.end;
        }
    }
}

/// The directions of some pairs, filled up with zeros.
#[inline(always)]
fn load<V: Vector>(from: Directions<'_>, pairs: &Range<usize>) -> Vec3<V> {
    each(
        from,
        #[inline(always)]
        |from| {
            let mut lanes = V::Array::default();
            lanes.as_mut()[..pairs.len()].copy_from_slice(&from[pairs.clone()]);
            V::from_array(lanes)
        },
    )
}
