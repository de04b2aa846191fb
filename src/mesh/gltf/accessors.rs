//! Numbers in buffers, every one within the bytes that there are.

use std::cell::Cell;

use super::entry;
use super::json::{Accessor, Root};
use crate::mesh::load::{MAX_CORNERS, MAX_REPEATED};

/// A file's JSON with its buffers.
pub(super) struct Data<'a> {
    pub(super) root: &'a Root,
    pub(super) buffers: &'a [Vec<u8>],
    /// The most corners of all triangles: what a small file repeats takes memory that it has not.
    pub(super) limit: usize,
    /// How many elements may still be read.
    left: Cell<usize>,
}

/// Elements that are read for each corner that a file may have: whatever names the same accessors again and again ends.
const READS: usize = 32;

/// How a component is stored.
#[derive(Clone, Copy)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(number: u32) -> Option<Self> {
        Some(match number {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number that `bytes` begin with, integers as shares of the largest if `normalized`.
    fn float(self, bytes: &[u8], normalized: bool) -> f32 {
        let share = |x: f32, largest: f32| match normalized {
            true => (x / largest).max(-1.0),
            false => x,
        };
        match self {
            Self::I8 => share(f32::from(bytes[0] as i8), 127.0),
            Self::U8 => share(f32::from(bytes[0]), 255.0),
            Self::I16 => share(f32::from(i16::from_le_bytes([bytes[0], bytes[1]])), 32767.0),
            Self::U16 => share(f32::from(u16::from_le_bytes([bytes[0], bytes[1]])), 65535.0),
            Self::U32 | Self::F32 => f32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }

    fn index(self, bytes: &[u8]) -> u32 {
        match self {
            Self::U8 => u32::from(bytes[0]),
            Self::U16 => u32::from(u16::from_le_bytes([bytes[0], bytes[1]])),
            _ => u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
        }
    }
}

/// Elements side by side, or `stride` apart; all are within the bytes.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        (0..self.count).map(|k| &self.bytes[k * self.stride..])
    }
}

impl<'a> Data<'a> {
    pub(super) fn new(root: &'a Root, buffers: &'a [Vec<u8>]) -> Self {
        let own: usize = buffers.iter().map(Vec::len).sum();
        let limit = MAX_CORNERS.min(MAX_REPEATED.max(own));
        Self {
            root,
            buffers,
            limit,
            left: Cell::new(READS * limit),
        }
    }

    /// Counts what is read.
    fn take(&self, count: usize) -> Result<(), String> {
        let left = self.left.get().checked_sub(count);
        self.left.set(left.ok_or(
            "its nodes and primitives name the same numbers too often; join them before you export it",
        )?);
        Ok(())
    }

    /// Vectors of an accessor of N floats, or of integers that stand for such (KHR_mesh_quantization).
    pub(super) fn vectors<const N: usize>(
        &self,
        index: usize,
        by: &str,
    ) -> Result<Vec<[f32; N]>, String> {
        let accessor = entry(&self.root.accessors, index, "accessor", by)?;
        let wrong = |why: String| format!("accessors[{index}]: {why}");
        let component = Component::of(accessor.component_type)
            .filter(|component| !matches!(component, Component::U32))
            .ok_or_else(|| {
                let number = accessor.component_type;
                wrong(format!("{by} cannot have component type {number}"))
            })?;
        check_shape(accessor, N).map_err(wrong)?;
        let size = component.size();
        // What is more than there are bytes for is told below.
        self.take(accessor.count.min(MAX_CORNERS))?;
        let vector = |bytes: &[u8]| {
            std::array::from_fn(|k| component.float(&bytes[k * size..], accessor.normalized))
        };
        let mut vectors: Vec<[f32; N]> = match accessor.buffer_view {
            Some(view) => {
                let place = (view, accessor.byte_offset);
                let elements = self.elements(place, accessor.count, N * size);
                elements.map_err(wrong)?.iter().map(vector).collect()
            }
            None if accessor.sparse.is_some() => {
                if accessor.count > MAX_CORNERS {
                    let message =
                        format!("its count of {} is more than {MAX_CORNERS}", accessor.count);
                    return Err(wrong(message));
                }
                vec![[0.0; N]; accessor.count]
            }
            None => return Err(wrong("it has no bufferView, and so no numbers".to_owned())),
        };
        if let Some(sparse) = &accessor.sparse {
            let values = (sparse.values.buffer_view, sparse.values.byte_offset);
            let values = self.elements(values, sparse.count, N * size);
            let places = (sparse.indices.buffer_view, sparse.indices.byte_offset);
            let places = self.indices_at(places, sparse.indices.component_type, sparse.count);
            let places = places.map_err(wrong)?;
            for (place, value) in places.into_iter().zip(values.map_err(wrong)?.iter()) {
                *vectors.get_mut(place as usize).ok_or_else(|| {
                    wrong(format!("its sparse index {place} is beyond its count"))
                })? = vector(value);
            }
        }
        Ok(vectors)
    }

    /// Indices of vertices.
    pub(super) fn indices(&self, index: usize, by: &str) -> Result<Vec<u32>, String> {
        let accessor = entry(&self.root.accessors, index, "accessor", by)?;
        let wrong = |why: String| format!("accessors[{index}]: {why}");
        check_shape(accessor, 1).map_err(wrong)?;
        let (Some(view), None) = (accessor.buffer_view, &accessor.sparse) else {
            let message = "indices must have a bufferView, and not be sparse";
            return Err(wrong(message.to_owned()));
        };
        let place = (view, accessor.byte_offset);
        self.indices_at(place, accessor.component_type, accessor.count)
            .map_err(wrong)
    }

    fn indices_at(
        &self,
        place: (usize, usize),
        component: u32,
        count: usize,
    ) -> Result<Vec<u32>, String> {
        let is_index = |component: &Component| {
            matches!(component, Component::U8 | Component::U16 | Component::U32)
        };
        let known = Component::of(component)
            .filter(is_index)
            .ok_or_else(|| format!("indices cannot have component type {component}"))?;
        let elements = self.elements(place, count, known.size())?;
        self.take(count)?;
        Ok(elements.iter().map(|bytes| known.index(bytes)).collect())
    }

    /// `count` elements of `size` bytes from an offset in a buffer view.
    fn elements(
        &self,
        (view, offset): (usize, usize),
        count: usize,
        size: usize,
    ) -> Result<Elements<'_>, String> {
        let by = "it";
        let found = entry(&self.root.buffer_views, view, "bufferView", by)?;
        let by = format!("bufferViews[{view}]");
        let buffer = entry(self.buffers, found.buffer, "buffer", &by)?;
        let end = found.byte_offset.checked_add(found.byte_length);
        let bytes = end.and_then(|end| buffer.get(found.byte_offset..end));
        let bytes = bytes.ok_or_else(|| format!("{by} goes beyond its buffer"))?;
        let stride = found.byte_stride.unwrap_or(size);
        if stride < size {
            return Err(format!(
                "its elements of {size} bytes do not fit {by}'s byteStride of {stride}"
            ));
        }
        let needed = match count.checked_sub(1) {
            Some(before) => before
                .checked_mul(stride)
                .and_then(|start| start.checked_add(size)),
            None => Some(0),
        };
        let bytes = bytes.get(offset..).unwrap_or_default();
        if needed.is_none_or(|needed| needed > bytes.len()) {
            return Err(format!("its {count} elements go beyond {by}"));
        }
        Ok(Elements {
            bytes,
            stride,
            count,
        })
    }
}

fn check_shape(accessor: &Accessor, components: usize) -> Result<(), String> {
    let shape = ["SCALAR", "VEC2", "VEC3", "VEC4"][components - 1];
    if accessor.shape == shape {
        Ok(())
    } else {
        Err(format!(
            "its type is {}, and must be {shape}",
            accessor.shape
        ))
    }
}
