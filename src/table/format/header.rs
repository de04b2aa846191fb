//! The header: what a file says of its threads, grids and chunks.

use alloc::{string::String, vec::Vec};

use super::coding::{Chunk, Codec};
use super::{COORDINATES, MAX_DECODED_BYTES, code_of};
use crate::brdf::{Optics, limits};
use crate::chart::{Coordinates, Rim};
use crate::table::{Axis, CHANNELS, Content, Error, Grids, MAX_KNOTS, ThreadParameters};

pub(super) const MAX_THREADS: u32 = 64;
const MAX_PARTS: u32 = 4096;
const MAX_DIRECT_NODES: u32 = 64;

/// A grid's part of the header.
pub(super) struct GridHeader {
    pub(super) coordinates: Coordinates,
    pub(super) content: Content,
    /// Whether it has not all coefficients: a chunk says which.
    pub(super) has_runs: bool,
    pub(super) scale: [f32; 2],
    pub(super) axes: [Axis; 4],
}

/// Reads the header's numbers one after the other, and checks them.
pub(super) struct Reader<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) offset: usize,
}

impl Reader<'_> {
    pub(super) fn invalid(&self, what: &'static str) -> Error {
        Error::Invalid {
            what,
            offset: self.offset,
        }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Error> {
        let end = self.offset + N;
        let taken = self
            .bytes
            .get(self.offset..end)
            .and_then(|bytes| bytes.try_into().ok());
        let taken = taken.ok_or(self.invalid("the header ends too soon"))?;
        self.offset = end;
        Ok(taken)
    }

    pub(super) fn u8(&mut self) -> Result<u8, Error> {
        self.take::<1>().map(|[byte]| byte)
    }

    pub(super) fn u16(&mut self) -> Result<u16, Error> {
        self.take().map(u16::from_le_bytes)
    }

    pub(super) fn u32(&mut self) -> Result<u32, Error> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Error> {
        self.take().map(u64::from_le_bytes)
    }

    pub(super) fn f32(&mut self) -> Result<f32, Error> {
        self.take().map(f32::from_le_bytes)
    }

    fn f64_where(&mut self, what: &'static str, valid: impl Fn(f64) -> bool) -> Result<f64, Error> {
        let x = self.take().map(f64::from_le_bytes)?;
        if x.is_finite() && valid(x) {
            Ok(x)
        } else {
            Err(self.invalid(what))
        }
    }

    pub(super) fn count(
        &mut self,
        what: &'static str,
        range: core::ops::RangeInclusive<u32>,
    ) -> Result<u32, Error> {
        let count = self.u32()?;
        if range.contains(&count) {
            Ok(count)
        } else {
            Err(self.invalid(what))
        }
    }

    /// Bytes that must be zero.
    pub(super) fn zero(&mut self, count: usize) -> Result<(), Error> {
        for _ in 0..count {
            if self.u8()? != 0 {
                return Err(self.invalid("reserved bytes are not zero"));
            }
        }
        Ok(())
    }

    fn size(&mut self) -> Result<usize, Error> {
        usize::try_from(self.u64()?).map_err(|_| self.invalid("a size exceeds the address space"))
    }

    pub(super) fn chunk(&mut self) -> Result<Chunk, Error> {
        let (offset, stored_bytes, decoded_bytes) = (self.size()?, self.size()?, self.size()?);
        let crc = self.u32()?;
        let codec = match self.u32()? {
            0 => Codec::Stored,
            1 => Codec::Zstd,
            2 => Codec::ZstdPlanes,
            _ => return Err(self.invalid("codec")),
        };
        if decoded_bytes as u64 > MAX_DECODED_BYTES {
            return Err(Error::TooLarge {
                bytes: decoded_bytes as u64,
            });
        }
        Ok(Chunk {
            codec,
            offset,
            stored_bytes,
            decoded_bytes,
            crc,
        })
    }

    pub(super) fn thread(&mut self) -> Result<(ThreadParameters, Grids<GridHeader>), Error> {
        let name_bytes = self.count("length of a thread's name", 1..=64)?;
        let mut name = String::new();
        for _ in 0..name_bytes {
            let byte = self.u8()?;
            if !byte.is_ascii_graphic() {
                return Err(self.invalid("a thread's name"));
            }
            name.push(char::from(byte));
        }
        self.zero(self.offset.next_multiple_of(4) - self.offset)?;
        let within = |limit: f64| move |x: f64| x.abs() <= limit;
        let unit = |x: f64| (0.0..=1.0).contains(&x);
        let direction = self.f64_where("direction of a thread", within(7.0))?;
        let coverage = self.f64_where("coverage", |x| x > 0.0 && limits::COVERAGE.contains(&x))?;
        let mut albedo = [0.0; 3];
        for channel in &mut albedo {
            *channel = self.f64_where("albedo", |x| limits::ALBEDO.contains(&x))?;
        }
        let optics = Optics::new(
            self.f64_where("eta", |x| limits::ETA.contains(&x))?,
            self.f64_where("k_d", unit)?,
            self.f64_where("gamma_s", |x| limits::GAMMA.contains(&x))?,
            self.f64_where("gamma_v", |x| limits::GAMMA.contains(&x))?,
        );
        let quarter = within(core::f64::consts::FRAC_PI_2 + 1e-9);
        let (mut tilts, mut segments) = (Vec::new(), Vec::new());
        for _ in 0..self.count("number of tilts", 0..=MAX_PARTS)? {
            tilts.push((
                self.f64_where("tilt", quarter)?,
                self.f64_where("weight of a tilt", unit)?,
            ));
        }
        for _ in 0..self.count("number of segments", 0..=MAX_PARTS)? {
            let from = self.f64_where("start of a segment", quarter)?;
            let to =
                self.f64_where("end of a segment", |x| quarter(x) && x as f32 > from as f32)?;
            segments.push((from, to, self.f64_where("weight of a segment", unit)?));
        }
        let weights = tilts
            .iter()
            .map(|tilt| tilt.1)
            .chain(segments.iter().map(|segment| segment.2));
        let is_curve = tilts.is_empty() && segments.is_empty();
        if !is_curve && (weights.sum::<f64>() - 1.0).abs() > 1e-6 {
            return Err(self.invalid("sum of a thread's weights"));
        }
        let mut nodes = Vec::new();
        let grids = match self.u32()? {
            0 if segments.is_empty() && !is_curve => Grids::None,
            1 if !segments.is_empty() => Grids::Segments(self.grid(&COORDINATES[..4])?),
            2 if !segments.is_empty() => {
                nodes = self.nodes()?;
                Grids::None
            }
            4 if !segments.is_empty() => {
                let rim = self.count("width of the rim", 1..=Rim::WIDEST.into())?;
                nodes = self.nodes()?;
                let mut grid = self.grid(&COORDINATES[..4])?;
                let rim = Rim::new(rim as u8).ok_or(self.invalid("width of the rim"))?;
                grid.coordinates = grid.coordinates.with_rim(rim);
                Grids::Segments(grid)
            }
            3 if is_curve => Grids::Curve {
                response: self.grid(&COORDINATES[..9])?,
                projection: self.grid(&COORDINATES)?,
            },
            _ => return Err(self.invalid("how segments are evaluated")),
        };
        Ok((
            ThreadParameters {
                name,
                direction,
                coverage,
                albedo,
                optics,
                tilts,
                segments,
                nodes,
            },
            grids,
        ))
    }

    /// Nodes and weights of direct evaluation, at least one.
    fn nodes(&mut self) -> Result<Vec<[f64; 2]>, Error> {
        let mut nodes = Vec::new();
        for _ in 0..self.count("number of nodes", 1..=MAX_DIRECT_NODES)? {
            nodes.push([
                self.f64_where("node", |x| x.abs() < 1.0)?,
                self.f64_where("weight of a node", |x| x > 0.0 && x <= 2.0)?,
            ]);
        }
        Ok(nodes)
    }

    /// A grid whose coordinates are among `known`.
    fn grid(&mut self, known: &[Coordinates]) -> Result<GridHeader, Error> {
        let codes = [self.u8()?, self.u8()?];
        let coordinates = known.iter().copied().find(|known| code_of(*known) == codes);
        let coordinates = coordinates.ok_or(self.invalid("coordinates"))?;
        self.zero(1)?;
        let flags = self.u8()?;
        if flags > 7 {
            return Err(self.invalid("what a grid leaves out"));
        }
        let content = match flags >> 1 {
            0 => Content::Both,
            1 => Content::Surface,
            2 => Content::Volume,
            _ => Content::Dyed,
        };
        let mut scale = [0.0; CHANNELS];
        for scale in &mut scale {
            *scale = self.f32()?;
            if !(*scale > 0.0 && scale.is_finite()) {
                return Err(self.invalid("scale"));
            }
        }
        let mut axes = Vec::new();
        for axis in 0..4 {
            let count = self.u16()? as usize;
            let depth = self.u8()?;
            let bends = match self.u8()? {
                0 => false,
                1 => true,
                _ => return Err(self.invalid("kink of an axis")),
            };
            if count > MAX_KNOTS {
                return Err(self.invalid("number of knots"));
            }
            let mut knots = Vec::new();
            for _ in 0..count {
                knots.push(self.u16()?);
            }
            self.zero(self.offset.next_multiple_of(4) - self.offset)?;
            let axis = match (axis < coordinates.rank(), &knots[..], depth) {
                (false, [0], 0) => Some(Axis::flat()),
                // All that is needed may be in the middle of an axis but the first, or at its lower end.
                (true, [place @ (0 | 1)], depth) if axis > 0 && u16::from(depth) == *place => {
                    Some(Axis::point(depth.into(), *place))
                }
                (true, ..) => Axis::new(depth.into(), knots, bends),
                (false, ..) => None,
            };
            let axis = axis.ok_or(self.invalid("knots of an axis"))?;
            if bends != axis.has_kink() {
                return Err(self.invalid("kink of an axis"));
            }
            axes.push(axis);
        }
        let axes = <[Axis; 4]>::try_from(axes).map_err(|_| self.invalid("axes"))?;
        Ok(GridHeader {
            coordinates,
            content,
            has_runs: flags & 1 == 1,
            scale,
            axes,
        })
    }
}
