//! Volumes in texels of three channels: `mod.rs` says how they lie.

use half::f16;

use super::Error;
use crate::shader::grid_places;
use crate::volume::{GridVolume, MAX_SIDE, Volume};

/// What a texel holds, of which slabs take turns: √S and √V.
const TURNS: usize = 2;

/// Where things are.
pub(super) struct Threes {
    size: [usize; 3],
    pitch: usize,
    grids: Vec<Place>,
}

/// One grid in a volume, and in threes.
struct Place {
    /// Slabs of the volume: the first, per node of u₃, and how many nodes.
    first: usize,
    n2: usize,
    n3: usize,
    /// The first slab of the threes.
    first_three: usize,
}

impl Place {
    /// Threes of nodes.
    fn groups(&self) -> usize {
        (self.n3 / 2).max(1)
    }

    /// The slab and the first channel of a volume's texel that hold node `k` of u₃.
    fn node(&self, k: usize) -> (usize, usize) {
        let last_slab = self.n3.saturating_sub(2);
        if k > last_slab && self.n3 > 1 {
            (self.first + self.n2 * last_slab, 2)
        } else {
            (self.first + self.n2 * k, 0)
        }
    }
}

impl Threes {
    /// Of a volume, with sides that are multiples of `multiple`.
    pub(super) fn of(volume: &Volume, multiple: usize) -> Result<Self, Error> {
        let counts = |grid: &GridVolume| grid.nodes().each_ref().map(|nodes| nodes.count());
        let pitch = volume.grids().iter().map(|grid| counts(grid)[2]);
        let pitch = pitch.max().unwrap_or(1);
        let mut first_three = 0;
        let mut grids = Vec::new();
        for grid in volume.grids() {
            let [_, _, n2, n3] = counts(grid);
            let place = Place {
                first: grid.first_slab,
                n2,
                n3,
                first_three,
            };
            first_three += TURNS * pitch * place.groups();
            grids.push(place);
        }
        let depth = first_three.max(1);
        if depth > MAX_SIDE {
            return Err(Error::TooDeep(depth));
        }
        let [width, height, _] = volume.size();
        let [width, height] = [width, height].map(|side| side.next_multiple_of(multiple));
        Ok(Self {
            size: [width, height, depth],
            pitch,
            grids,
        })
    }

    pub(super) fn size(&self) -> [usize; 3] {
        self.size
    }

    pub(super) fn pitch(&self) -> usize {
        self.pitch
    }

    /// `[z][y][x]`; what is beside a grid repeats its last texels.
    pub(super) fn texels(&self, volume: &Volume) -> Vec<[f16; 3]> {
        let [width, height, depth] = self.size;
        let [last_x, last_y, _] = volume.size().map(|side| side - 1);
        let mut texels = Vec::with_capacity(width * height * depth);
        for place in &self.grids {
            for group in 0..place.groups() {
                let nodes = [0, 1, 2].map(|k| place.node((2 * group + k).min(place.n3 - 1)));
                for turn in 0..TURNS {
                    for c in 0..self.pitch {
                        let c = c.min(place.n2 - 1);
                        for y in 0..height {
                            for x in 0..width {
                                let (x, y) = (x.min(last_x), y.min(last_y));
                                texels.push(nodes.map(|(slab, channel)| {
                                    f16::from_f32(volume.texel(x, y, slab + c)[channel + turn])
                                }));
                            }
                        }
                    }
                }
            }
        }
        texels.resize(width * height * depth, [f16::ZERO; 3]);
        texels
    }

    /// What these texels say, laid out as `volume`.
    pub(super) fn volume(&self, volume: &Volume, texels: &[[f16; 3]]) -> Volume {
        let [width, height, _] = self.size;
        let [volume_width, volume_height, _] = volume.size();
        let mut all = Vec::with_capacity(volume.texels().len());
        for place in &self.grids {
            for k in 0..(place.n3 - 1).max(1) {
                for c in 0..place.n2 {
                    let slab = place.first_three + TURNS * self.pitch * (k / 2) + c;
                    for y in 0..volume_height {
                        for x in 0..volume_width {
                            let at = |turn: usize| {
                                texels[((slab + turn * self.pitch) * height + y) * width + x]
                            };
                            let (s, v, k) = (at(0), at(1), k % 2);
                            all.push([s[k], v[k], s[k + 1], v[k + 1]].map(f16::to_bits));
                        }
                    }
                }
            }
        }
        all.resize(volume.texels().len(), [0; 4]);
        volume.with_texels(all).expect("as many texels")
    }

    /// The parameters of the volume, with slabs where they are here.
    pub(super) fn parameters(&self, mut array: Vec<[f32; 4]>) -> Vec<[f32; 4]> {
        for (side, x) in array[1].iter_mut().zip(self.size) {
            *side = x as f32;
        }
        for (at, place) in grid_places(&array).into_iter().zip(&self.grids) {
            array[at][3] = place.first_three as f32;
            array[at + 1][2] = self.pitch as f32;
        }
        array
    }
}
