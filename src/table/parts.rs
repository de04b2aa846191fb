//! What one pair of directions is evaluated with: parts of all threads, eight side by side.
//!
//! A batch has as many pairs for a vector as there are lanes. One pair has as many parts of threads: grids, single tilts, segments, and
//! the arcs of projections. Each adds to sums over all of them, so that it does not matter whose they are.

use alloc::{vec, vec::Vec};

use super::{Content, Segments, ThreadTable};
use crate::brdf::{PlacedNodes, Reweighting, SharedNodes};
use crate::math::simd::Vector;

/// Lanes.
pub(crate) const PARTS: usize = 8;

/// The most tilts and segments of all threads: files may have very many, for which this is no gain.
const MOST: usize = 512;

/// What one pair is evaluated with.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Parts {
    /// Grids of straight threads' segments.
    pub(crate) grids: Vec<GridGroup>,
    /// Single tilts: frame, optics, cosine and sine.
    pub(crate) tilts: Vec<Group<8>>,
    /// Arcs of tilts, for projections: frame, arc.
    pub(crate) arcs: Vec<Group<8>>,
    /// Single tilts, for projections: frame, cosine and sine.
    pub(crate) facings: Vec<Group<4>>,
    /// Segments that are evaluated directly.
    pub(crate) segments: Vec<SegmentGroup>,
}

/// Up to eight parts, each of so many numbers. What lanes without one say has no weight.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group<const K: usize> {
    /// By part: its thread.
    pub(crate) threads: Vec<usize>,
    /// The part's share of the surface.
    pub(crate) weight: [f32; PARTS],
    /// The fabric's own.
    pub(crate) albedo: [[f32; PARTS]; 3],
    numbers: [[f32; PARTS]; K],
}

impl<const K: usize> Group<K> {
    /// The part's numbers.
    #[inline(always)]
    pub(crate) fn numbers<V: Vector>(&self) -> [V; K] {
        load(&self.numbers)
    }

    /// The albedos of the parts' threads, where there are others for the first threads.
    #[inline(always)]
    pub(crate) fn albedo<V: Vector>(&self, albedos: &[[f32; 3]]) -> [V; 3] {
        if albedos.is_empty() {
            return load(&self.albedo);
        }
        let mut albedo = self.albedo;
        dye(&mut albedo, &self.threads, albedos);
        load(&albedo)
    }

    /// Of one part.
    fn of(index: usize, thread: &ThreadTable, share: f32, numbers: [f32; K]) -> Self {
        let mut group = Self {
            threads: Vec::new(),
            weight: [0.0; PARTS],
            albedo: [[0.0; PARTS]; 3],
            // In all lanes what is some part's, so that they are as good as any.
            numbers: numbers.map(|number| [number; PARTS]),
        };
        group.put(index, thread, share, numbers);
        group
    }

    /// Puts a part into the next lane; there is one.
    fn put(&mut self, index: usize, thread: &ThreadTable, share: f32, numbers: [f32; K]) {
        let lane = self.threads.len();
        self.threads.push(index);
        self.weight[lane] = thread.coverage * share;
        for (to, albedo) in self.albedo.iter_mut().zip(thread.albedo) {
            to[lane] = albedo;
        }
        for (to, number) in self.numbers.iter_mut().zip(numbers) {
            to[lane] = number;
        }
    }

    /// Puts a part into the last group, or into a new one.
    fn add(
        groups: &mut Vec<Self>,
        index: usize,
        thread: &ThreadTable,
        share: f32,
        numbers: [f32; K],
    ) {
        match groups.last_mut() {
            Some(group) if group.threads.len() < PARTS => group.put(index, thread, share, numbers),
            _ => groups.push(Self::of(index, thread, share, numbers)),
        }
    }
}

/// Grids: frame, coordinates, what integers of both channels stand for, and 2^depth of the axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GridGroup {
    pub(crate) group: Group<14>,
    /// The axes' words, one behind the other, and where those of each axis begin.
    pub(crate) words: Vec<u32>,
    pub(crate) starts: [[u32; PARTS]; 4],
    /// From one coefficient of u₀, from one tile, and from one coefficient of u₂ and u₃ to the next, in numbers.
    pub(crate) strides: [[u32; PARTS]; 4],
    /// Whether some have not all pairs.
    pub(crate) is_partial: bool,
    /// Segments of threads whose grids have rims, for pairs near these threads' horizons. Of each the thread is its lane here.
    pub(crate) rims: Vec<SegmentGroup>,
}

/// Segments of one rule: frame, optics, arc. Each has as many lanes as there is room for, which share its nodes; in the first it
/// has its weight.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SegmentGroup {
    pub(crate) group: Group<12>,
    /// The rule, of some thread.
    pub(crate) rule: PlacedNodes<f32>,
    pub(crate) nodes: SharedNodes,
}

/// Segments that are to become groups.
#[derive(Default)]
struct Collected<'a>(Vec<(&'a PlacedNodes<f32>, Vec<Segment<'a>>)>);

/// A segment, and whose.
struct Segment<'a> {
    index: usize,
    thread: &'a ThreadTable,
    arc: [f32; 6],
}

impl<'a> Collected<'a> {
    /// Adds all segments of a thread.
    fn add(&mut self, index: usize, thread: &'a ThreadTable, nodes: &'a PlacedNodes<f32>) {
        for arc in nodes.arcs() {
            let segment = Segment { index, thread, arc };
            let last = self
                .0
                .iter_mut()
                .rev()
                .find(|(rule, _)| rule.is_as_for(nodes));
            match last {
                Some((_, segments)) if segments.len() < PARTS => segments.push(segment),
                _ => self.0.push((nodes, vec![segment])),
            }
        }
    }

    fn groups(self) -> Vec<SegmentGroup> {
        let group = |(rule, segments): (&PlacedNodes<f32>, Vec<Segment<'_>>)| {
            let room = PARTS / segments.len();
            let lanes = (1 << room.ilog2()).min(rule.count().next_power_of_two());
            let mut groups: Vec<Group<12>> = Vec::new();
            for Segment { index, thread, arc } in segments {
                let (frame, optics) = (thread.frame.numbers(), thread.optics.numbers());
                let numbers = [&frame[..], &optics, &arc].concat();
                let numbers: [f32; 12] = numbers.try_into().expect("12 numbers");
                for lane in 0..lanes {
                    let share = if lane == 0 { 1.0 } else { 0.0 };
                    Group::add(&mut groups, index, thread, share, numbers);
                }
            }
            SegmentGroup {
                group: groups.swap_remove(0),
                rule: rule.alone(),
                nodes: SharedNodes::new(rule, lanes),
            }
        };
        self.0.into_iter().map(group).collect()
    }
}

/// Of all threads; `None` where one of them is more than its parts side by side.
impl Parts {
    pub(crate) fn new(threads: &[ThreadTable], reweighting: Reweighting) -> Option<Self> {
        let parts = |thread: &ThreadTable| {
            let tangents = &thread.tangents;
            tangents.tilts().len() + tangents.segments().len()
        };
        if reweighting == Reweighting::Both || threads.iter().map(parts).sum::<usize>() > MOST {
            return None;
        }
        let mut parts = Self::default();
        let (mut grids, mut collected) = (Vec::new(), Collected::default());
        for (index, thread) in threads.iter().enumerate() {
            let frame = thread.frame.numbers();
            let optics = thread.optics.numbers();
            match &thread.segments {
                Segments::None => {}
                Segments::Direct(nodes) => {
                    collected.add(index, thread, nodes);
                }
                Segments::Grid(segments) => {
                    let grid = &segments.grid;
                    let coordinates = grid.coordinates.numbers();
                    let coordinates = coordinates.filter(|_| grid.content == Content::Both)?;
                    let units = grid
                        .axes
                        .each_ref()
                        .map(|axis| (1u32 << axis.depth()) as f32);
                    let numbers =
                        [&frame[..], &coordinates, &grid.integer_scale(), &units].concat();
                    let numbers = numbers.try_into().expect("14 numbers");
                    Group::add(&mut grids, index, thread, 1.0, numbers);
                }
                Segments::Curve(_) => return None,
            }
            for tilt in thread.tangents.tilts() {
                let at = [tilt.cos, tilt.sin];
                let numbers = [&frame[..], &optics, &at].concat();
                let numbers = numbers.try_into().expect("8 numbers");
                Group::add(&mut parts.tilts, index, thread, tilt.weight, numbers);
                let numbers = [frame[0], frame[1], at[0], at[1]];
                Group::add(&mut parts.facings, index, thread, tilt.weight, numbers);
            }
            for arc in thread.tangents.arcs() {
                let numbers = [&frame[..], &arc].concat();
                let numbers = numbers.try_into().expect("8 numbers");
                Group::add(&mut parts.arcs, index, thread, 1.0, numbers);
            }
        }
        parts.segments = collected.groups();
        parts.grids = grids
            .into_iter()
            .map(|group| GridGroup::new(group, threads))
            .collect();
        Some(parts)
    }
}

impl GridGroup {
    fn new(group: Group<14>, threads: &[ThreadTable]) -> Self {
        let (mut words, mut starts, mut strides) = (Vec::new(), [[0; PARTS]; 4], [[0; PARTS]; 4]);
        let (mut rims, mut is_partial) = (Collected::default(), false);
        for (lane, index) in group.threads.iter().enumerate() {
            let thread = &threads[*index];
            let Segments::Grid(segments) = &thread.segments else {
                continue;
            };
            if let Some(nodes) = &segments.rim {
                rims.add(lane, thread, nodes);
            }
            let grid = &segments.grid;
            is_partial |= grid.is_partial();
            for (axis, start) in grid.axes.iter().zip(&mut starts) {
                start[lane] = words.len() as u32;
                words.extend(axis.words());
            }
            for (to, stride) in strides.iter_mut().zip(grid.all_strides()) {
                to[lane] = stride;
            }
        }
        Self {
            group,
            words,
            starts,
            strides,
            is_partial,
            rims: rims.groups(),
        }
    }
}

/// Replaces the albedos of parts of these threads by others, where there are.
#[inline(always)]
pub(crate) fn dye(parts: &mut [[f32; PARTS]; 3], threads: &[usize], albedos: &[[f32; 3]]) {
    for (lane, thread) in threads.iter().enumerate() {
        if let Some(albedo) = albedos.get(*thread) {
            for (to, albedo) in parts.iter_mut().zip(albedo) {
                to[lane] = *albedo;
            }
        }
    }
}

/// Numbers of all lanes.
#[inline(always)]
pub(crate) fn load<V: Vector, const K: usize>(numbers: &[[f32; PARTS]; K]) -> [V; K] {
    let mut lanes = [V::zero(); K];
    let mut k = 0;
    // Inlined for certain, which `map` of arrays is not.
    while k < K {
        lanes[k] = V::load(&numbers[k]);
        k += 1;
    }
    lanes
}
