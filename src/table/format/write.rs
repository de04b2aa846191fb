//! A table as bytes.

use alloc::{vec, vec::Vec};

#[cfg(feature = "bake")]
use rayon::prelude::*;

#[cfg(feature = "zstd")]
use super::coding::compress;
use super::coding::{Codec, RUN_WORDS, Words, checksum, tile_words};
use super::{
    ALIGNMENT, CHECKED_FROM, DIMS_VIEWS, HAS_ALBEDO, HAS_HISTOGRAMS, MAGIC, MARGIN, VERSION,
    code_of,
};
use crate::brdf::Reweighting;
use crate::table::{
    Content, Energy, Error, Grid, Rows, SegmentGrid, Segments, Table, ThreadParameters, ThreadTable,
};

/// How a chunk is stored that has these bytes.
type Code = fn(Vec<u8>, Words) -> Result<(Codec, Vec<u8>), Error>;

/// What a chunk is of.
enum Part<'a> {
    Metadata(&'a str),
    Tiles(&'a Grid),
    Runs(&'a Grid, &'a Rows),
    Sampling(&'a [ThreadTable]),
}

/// A chunk to be written.
struct Packed {
    codec: Codec,
    decoded_bytes: usize,
    stored: Vec<u8>,
}

impl Part<'_> {
    /// All that has to be done for a chunk, which takes no other: chunks may be packed side by side.
    fn packed(&self, code: Code) -> Result<Packed, Error> {
        let (bytes, words) = match self {
            Self::Metadata(text) => (text.as_bytes().to_vec(), Words::None),
            Self::Tiles(grid) => {
                let numbers = grid.tiles.stored().iter();
                let bytes = numbers.flat_map(|x| x.to_le_bytes()).collect();
                (bytes, tile_words(grid.content))
            }
            Self::Runs(grid, rows) => {
                let runs = rows.runs(&grid.axes);
                let numbers = runs.iter().flat_map(|run| [run.first, run.count]);
                (numbers.flat_map(u16::to_le_bytes).collect(), RUN_WORDS)
            }
            Self::Sampling(threads) => {
                let mut bytes = Vec::new();
                for sampling in threads.iter().filter_map(|thread| thread.sampling.as_ref()) {
                    sampling.put(&mut bytes);
                }
                (bytes, Words::None)
            }
        };
        let decoded_bytes = bytes.len();
        let (codec, stored) = code(bytes, words)?;
        Ok(Packed {
            codec,
            decoded_bytes,
            stored,
        })
    }
}

impl Table {
    /// The table as a file, `FORMAT.md`. The same table gives the same bytes.
    ///
    /// # Errors
    /// When zstd runs out of memory.
    #[cfg(feature = "zstd")]
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        self.to_file(compress)
    }

    /// The table as a file that is not compressed: [`Table::from_static`] looks its tiles up where they are, and it needs no zstd.
    pub fn to_mappable_bytes(&self) -> Vec<u8> {
        let store: Code = |bytes, _| Ok((Codec::Stored, bytes));
        self.to_file(store).expect("storing cannot fail")
    }

    fn to_file(&self, code: Code) -> Result<Vec<u8>, Error> {
        let mut parts = vec![Part::Metadata(&self.metadata)];
        for grid in self.threads.iter().flat_map(ThreadTable::grids) {
            parts.push(Part::Tiles(grid));
            parts.extend(grid.rows.iter().map(|rows| Part::Runs(grid, rows)));
        }
        if self.has_albedo() {
            parts.push(Part::Sampling(&self.threads));
        }
        // Side by side where there are workers.
        #[cfg(feature = "bake")]
        let parts = parts.par_iter();
        #[cfg(not(feature = "bake"))]
        let parts = parts.iter();
        let chunks: Vec<Packed> = parts
            .map(|part| part.packed(code))
            .collect::<Result<_, Error>>()?;

        let mut body = Vec::new();
        put_u32(&mut body, chunks.len());
        body.push(u8::from(self.reweighting == Reweighting::Both));
        body.push(self.sampling_flags());
        body.extend([0; 2]);
        body.extend(self.sigma_u.to_le_bytes());
        body.extend(self.rho_scale.to_le_bytes());
        put_u32(&mut body, self.threads.len());
        for thread in &self.threads {
            put_thread(&mut body, thread);
        }
        const CHUNK_ENTRY: usize = 32;
        let header_length =
            (CHECKED_FROM + body.len() + CHUNK_ENTRY * chunks.len()).next_multiple_of(ALIGNMENT);
        let mut end = header_length;
        for chunk in &chunks {
            let offset = end.next_multiple_of(ALIGNMENT);
            for size in [offset, chunk.stored.len(), chunk.decoded_bytes] {
                body.extend((size as u64).to_le_bytes());
            }
            body.extend(checksum(&chunk.stored).to_le_bytes());
            body.extend((chunk.codec as u32).to_le_bytes());
            end = offset + chunk.stored.len();
        }
        body.resize(header_length - CHECKED_FROM, 0);

        let mut bytes = Vec::with_capacity(end + MARGIN);
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        put_u32(&mut bytes, header_length);
        bytes.extend(checksum(&body).to_le_bytes());
        bytes.extend(body);
        for chunk in chunks {
            bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
            bytes.extend(chunk.stored);
        }
        bytes.extend([0; MARGIN]);
        Ok(bytes)
    }
}

impl Table {
    /// What it has for sampling, as in a file.
    fn sampling_flags(&self) -> u8 {
        u8::from(self.has_albedo()) * HAS_ALBEDO
            + u8::from(self.has_sampling()) * HAS_HISTOGRAMS
            + u8::from(self.energy == Energy::PerView) * DIMS_VIEWS
    }
}

fn put_u32(out: &mut Vec<u8>, x: usize) {
    // Counts and header lengths that from_bytes accepts are far below 2³².
    out.extend((x as u32).to_le_bytes());
}

fn put_f64(out: &mut Vec<u8>, x: f64) {
    out.extend(x.to_le_bytes());
}

fn put_thread(out: &mut Vec<u8>, thread: &ThreadTable) {
    let ThreadParameters {
        name,
        direction,
        coverage,
        albedo,
        optics,
        tilts,
        segments,
        nodes,
    } = &thread.parameters;
    put_u32(out, name.len());
    out.extend(name.bytes());
    // The body begins at CHECKED_FROM, a multiple of 4.
    out.resize(out.len().next_multiple_of(4), 0);
    for x in [*direction, *coverage].into_iter().chain(*albedo) {
        put_f64(out, x);
    }
    for x in [optics.eta, optics.k_d, optics.gamma_s, optics.gamma_v] {
        put_f64(out, x);
    }
    put_u32(out, tilts.len());
    for (angle, weight) in tilts {
        put_f64(out, *angle);
        put_f64(out, *weight);
    }
    put_u32(out, segments.len());
    for (from, to, weight) in segments {
        for x in [*from, *to, *weight] {
            put_f64(out, x);
        }
    }
    match &thread.segments {
        Segments::None => put_u32(out, 0),
        Segments::Grid(grid) => {
            let SegmentGrid { grid, rim } = &**grid;
            if rim.is_some() {
                put_u32(out, 4);
                put_u32(out, grid.coordinates.rim().hundredths().into());
                put_nodes(out, nodes);
            } else {
                put_u32(out, 1);
            }
            put_grid(out, grid);
        }
        Segments::Curve(grids) => {
            put_u32(out, 3);
            put_grid(out, &grids.response);
            put_grid(out, &grids.projection);
        }
        Segments::Direct(_) => {
            put_u32(out, 2);
            put_nodes(out, nodes);
        }
    }
}

fn put_nodes(out: &mut Vec<u8>, nodes: &[[f64; 2]]) {
    put_u32(out, nodes.len());
    for x in nodes.as_flattened() {
        put_f64(out, *x);
    }
}

fn put_grid(out: &mut Vec<u8>, grid: &Grid) {
    out.extend(code_of(grid.coordinates));
    out.push(0);
    let content = match grid.content {
        Content::Both => 0,
        Content::Surface => 1,
        Content::Volume => 2,
        Content::Dyed => 3,
    };
    out.push(content << 1 | u8::from(grid.rows.is_some()));
    for scale in grid.scale {
        out.extend(scale.to_le_bytes());
    }
    for axis in &grid.axes {
        out.extend((axis.integer_knots().len() as u16).to_le_bytes());
        out.push(axis.depth() as u8);
        out.push(u8::from(axis.has_kink()));
        for knot in axis.integer_knots() {
            out.extend(knot.to_le_bytes());
        }
        out.resize(out.len().next_multiple_of(4), 0);
    }
}
