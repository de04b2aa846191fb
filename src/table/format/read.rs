//! Bytes as a table.
//!
//! All checks are here and in `header`. What [`Table::from_bytes`] returns can be evaluated without any.

#[cfg(target_has_atomic = "ptr")]
use alloc::sync::Arc;
use alloc::{string::String, vec::Vec};

use super::coding::{Chunk, Codec, RUN_WORDS, Words, checksum, decode, tile_words};
use super::header::{GridHeader, MAX_THREADS, Reader};
use super::{
    ALIGNMENT, CHECKED_FROM, DIMS_VIEWS, HAS_ALBEDO, HAS_HISTOGRAMS, MAGIC, MARGIN,
    MAX_DECODED_BYTES, VERSION,
};
use crate::brdf::{Reweighting, limits};
use crate::table::numbers::{self, Lender, Numbers};
use crate::table::rows::Run;
use crate::table::{
    Energy, Error, Grid, Grids, Rows, SAMPLED, Sampling, Table, ThreadTable, tiles_of,
};

/// The most bytes of metadata: twice a fabric's text, whose line breaks and quotes are escaped in it, and what else there
/// is to say.
const MAX_METADATA_BYTES: usize = 4 << 20;
const MAX_HEADER_BYTES: usize = 16 << 20;

impl Table {
    /// Reads a table and checks everything: version, checksums, sizes, ranges, that every number is finite.
    ///
    /// # Errors
    /// [`Error`] says what is wrong. Whatever a header claims, no more memory than three times [`MAX_DECODED_BYTES`] is
    /// asked for: decompressed planes, bytes and samples. A small file cannot ask for that much: zstd makes at most 32768
    /// bytes of one.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        Self::from_file(&File {
            bytes,
            lender: None,
        })
    }

    /// The same, but samples that are not compressed stay where they are, if they can be read there: what
    /// [`Table::to_mappable_bytes`] has written, at an address that is a multiple of 4 (memory maps begin at pages), on a
    /// little-endian machine. Other samples are copied, as [`Table::from_bytes`] does; [`Table::lent_bytes`] says how many
    /// are not.
    ///
    /// # Errors
    /// Those of [`Table::from_bytes`].
    pub fn from_static(bytes: &'static [u8]) -> Result<Self, Error> {
        Self::from_file(&File {
            bytes,
            lender: Some(Lender::Static),
        })
    }

    /// The same with bytes that are kept until the last of the table's clones is dropped: a memory map, or a buffer. (Whoever
    /// maps a file promises, as for any map, that nobody writes to it or shortens it meanwhile.)
    ///
    /// # Errors
    /// Those of [`Table::from_bytes`].
    #[cfg(target_has_atomic = "ptr")]
    pub fn from_shared(owner: Arc<dyn AsRef<[u8]> + Send + Sync>) -> Result<Self, Error> {
        Self::from_file(&File {
            // Asked once: another time it might give others.
            bytes: (*owner).as_ref(),
            lender: Some(Lender::Shared(owner.clone())),
        })
    }

    fn from_file(file: &File<'_>) -> Result<Self, Error> {
        let bytes = file.bytes;
        let header = header_of(bytes)?;
        let mut reader = Reader {
            bytes: header,
            offset: CHECKED_FROM,
        };
        let chunk_count = reader.u32()?;
        let reweighting = match reader.u8()? {
            0 => Reweighting::View,
            1 => Reweighting::Both,
            _ => return Err(reader.invalid("reweighting")),
        };
        let sampling = match reader.u8()? {
            0 => None,
            flags if flags & HAS_ALBEDO != 0 && flags < 2 * DIMS_VIEWS => Some(flags),
            _ => return Err(reader.invalid("what there is for sampling")),
        };
        reader.zero(2)?;
        let sigma_u = reader.f32()?;
        if !limits::SIGMA_U.contains(&f64::from(sigma_u)) {
            return Err(reader.invalid("width of u"));
        }
        let rho_scale = reader.f32()?;
        // Rounded to an f32, the ends may be a little beyond.
        if !(0.99 * limits::RHO_SCALE.start()..=*limits::RHO_SCALE.end())
            .contains(&f64::from(rho_scale))
        {
            return Err(reader.invalid("scale of ρ"));
        }
        let thread_count = reader.count("number of threads", 0..=MAX_THREADS)?;
        let mut threads = Vec::new();
        for _ in 0..thread_count {
            threads.push(reader.thread()?);
        }
        let grid_chunks: usize = threads.iter().map(|(_, grids)| grids.chunks()).sum();
        if chunk_count as usize != 1 + grid_chunks + usize::from(sampling.is_some()) {
            return Err(reader.invalid("number of chunks"));
        }
        let coverage: f64 = threads.iter().map(|(thread, _)| thread.coverage).sum();
        if coverage > 1.0 + 1e-6 {
            return Err(reader.invalid("sum of coverages"));
        }
        let mut chunks = Vec::new();
        for _ in 0..chunk_count {
            chunks.push(reader.chunk()?);
        }
        reader.zero(header.len() - reader.offset)?;
        check_layout(bytes, header.len(), &chunks)?;

        let mut grid_chunks = chunks.iter();
        let metadata_chunk = grid_chunks
            .next()
            .ok_or(reader.invalid("number of chunks"))?;
        if metadata_chunk.decoded_bytes > MAX_METADATA_BYTES {
            return Err(Error::Invalid {
                what: "length of the metadata",
                offset: metadata_chunk.offset,
            });
        }
        let metadata = decode(bytes, metadata_chunk, Words::None, "metadata")?;
        let metadata = String::from_utf8(metadata.into_owned()).map_err(|_| Error::Invalid {
            what: "metadata is not UTF-8",
            offset: metadata_chunk.offset,
        })?;
        let mut loaded: Vec<ThreadTable> = Vec::new();
        for (parameters, grids) in threads {
            let grids = grids.try_map(|grid| {
                let mut next = || grid_chunks.next().ok_or(reader.invalid("number of chunks"));
                let samples = next()?;
                let runs = if grid.has_runs { Some(next()?) } else { None };
                grid.load(file, samples, runs)
            })?;
            loaded.push(ThreadTable::new(parameters, grids));
        }
        if let Some(flags) = sampling {
            let chunk = grid_chunks
                .next()
                .ok_or(reader.invalid("number of chunks"))?;
            load_sampling(bytes, chunk, flags & HAS_HISTOGRAMS != 0, &mut loaded)?;
        }
        let gap = (1.0 - coverage).max(0.0) as f32;
        let mut table = Self::new(loaded, gap, sigma_u, rho_scale, reweighting);
        table.metadata = metadata;
        if sampling.is_some_and(|flags| flags & DIMS_VIEWS != 0) {
            table.energy = Energy::PerView;
        }
        Ok(table)
    }
}

/// Reads what there is of every thread for sampling.
fn load_sampling(
    bytes: &[u8],
    chunk: &Chunk,
    has_histograms: bool,
    threads: &mut [ThreadTable],
) -> Result<(), Error> {
    let invalid = |what| Error::Invalid {
        what,
        offset: chunk.offset,
    };
    let has_histogram = |index: usize| has_histograms && index < SAMPLED;
    let sizes = (0..threads.len()).map(|index| Sampling::bytes(has_histogram(index)));
    let expected: usize = sizes.sum();
    if expected != chunk.decoded_bytes {
        return Err(invalid("size of what there is for sampling"));
    }
    let decoded = decode(bytes, chunk, Words::None, "sampling")?;
    let mut rest = &*decoded;
    for (index, thread) in threads.iter_mut().enumerate() {
        let some;
        (some, rest) = rest.split_at(Sampling::bytes(has_histogram(index)));
        let sampling = Sampling::get(some, has_histogram(index));
        thread.sampling = Some(sampling.ok_or(invalid("what there is for sampling"))?);
    }
    Ok(())
}

/// A file's bytes, and what keeps them, if anything does.
struct File<'a> {
    bytes: &'a [u8],
    /// What keeps the bytes where they are, unchanged, for as long as there is a clone of it:
    ///
    /// - [`Lender::Static`]: they are `&'static`.
    /// - [`Lender::Shared`]: they were borrowed from what the `Arc` owns, by `&self`. As long as there is a clone of the `Arc`, its owner is
    ///   neither moved nor dropped, and nobody can get `&mut` of it, for which `Arc` would have to be the only one. Others may
    ///   have `&` of it, but no safe type may take back or change what it lent by `&self` while that borrow could
    ///   still last; that nobody can see that ours has ended does not matter to it. So the bytes stay as if they were borrowed.
    lender: Option<Lender>,
}

impl File<'_> {
    /// A chunk's numbers where they are, if they can be.
    fn lend(&self, chunk: &Chunk, count: usize) -> Option<Numbers> {
        let lender = self
            .lender
            .as_ref()
            .filter(|_| chunk.codec == Codec::Stored)?;
        let bytes = self.bytes.get(chunk.offset..)?;
        #[expect(unsafe_code, reason = "numbers without a copy of them")]
        // SAFETY: `bytes` are part of `self.bytes`, which the lender keeps as they are: see [`File::lender`].
        unsafe {
            numbers::lend(bytes, count, lender)
        }
    }
}

/// The header's bytes, complete and unchanged.
fn header_of(bytes: &[u8]) -> Result<&[u8], Error> {
    let magic = &bytes[..bytes.len().min(MAGIC.len())];
    if magic.is_empty() || magic != &MAGIC[..magic.len()] {
        return Err(Error::NotATable);
    }
    let truncated = |expected: usize| Error::Truncated {
        expected: expected as u64,
        found: bytes.len() as u64,
    };
    let start = bytes.get(..CHECKED_FROM).ok_or(truncated(CHECKED_FROM))?;
    let mut reader = Reader {
        bytes: start,
        offset: MAGIC.len(),
    };
    let version = reader.u32()?;
    if version != VERSION {
        return Err(Error::Version { version });
    }
    let length = reader.u32()? as usize;
    if !(ALIGNMENT..=MAX_HEADER_BYTES).contains(&length) || !length.is_multiple_of(ALIGNMENT) {
        return Err(Error::Invalid {
            what: "header length",
            offset: 12,
        });
    }
    let crc = reader.u32()?;
    let header = bytes.get(..length).ok_or(truncated(length))?;
    if checksum(&header[CHECKED_FROM..]) != crc {
        return Err(Error::Checksum { part: "header" });
    }
    Ok(header)
}

/// Chunks follow the header and each other, each at the next aligned offset, then so many zeros, and nothing follows them.
fn check_layout(bytes: &[u8], header_length: usize, chunks: &[Chunk]) -> Result<(), Error> {
    let not_zero = |offset: usize| Error::Invalid {
        what: "padding is not zero",
        offset,
    };
    let mut end = header_length;
    for chunk in chunks {
        let start = end.next_multiple_of(ALIGNMENT);
        if chunk.offset != start {
            return Err(Error::Invalid {
                what: "chunk offset",
                offset: chunk.offset,
            });
        }
        let padding = bytes.get(end..start).unwrap_or(&[]);
        if padding.iter().any(|byte| *byte != 0) {
            return Err(not_zero(end));
        }
        end = start.saturating_add(chunk.stored_bytes);
        if end > bytes.len() {
            return Err(Error::Truncated {
                expected: end as u64,
                found: bytes.len() as u64,
            });
        }
    }
    let (expected, found) = (end as u64 + MARGIN as u64, bytes.len() as u64);
    if found < expected {
        return Err(Error::Truncated { expected, found });
    }
    if bytes[end..].iter().take(MARGIN).any(|byte| *byte != 0) {
        return Err(not_zero(end));
    }
    if found > expected {
        return Err(Error::TrailingBytes { expected, found });
    }
    let decoded: u64 = chunks.iter().map(|chunk| chunk.decoded_bytes as u64).sum();
    if decoded > MAX_DECODED_BYTES {
        return Err(Error::TooLarge { bytes: decoded });
    }
    Ok(())
}

impl Grids<GridHeader> {
    /// How many chunks they have.
    fn chunks(&self) -> usize {
        let of = |grid: &GridHeader| 1 + usize::from(grid.has_runs);
        match self {
            Self::None => 0,
            Self::Segments(grid) => of(grid),
            Self::Curve {
                response,
                projection,
            } => of(response) + of(projection),
        }
    }
}

impl<G> Grids<G> {
    /// The same with every grid made another, in the order of the file.
    fn try_map<T>(self, mut of: impl FnMut(G) -> Result<T, Error>) -> Result<Grids<T>, Error> {
        Ok(match self {
            Self::None => Grids::None,
            Self::Segments(grid) => Grids::Segments(of(grid)?),
            Self::Curve {
                response,
                projection,
            } => Grids::Curve {
                response: of(response)?,
                projection: of(projection)?,
            },
        })
    }
}

impl GridHeader {
    fn load(self, file: &File<'_>, chunk: &Chunk, runs: Option<&Chunk>) -> Result<Grid, Error> {
        let bytes = file.bytes;
        let runs = match runs {
            Some(chunk) => Some((self.load_runs(bytes, chunk)?, chunk.offset)),
            None => None,
        };
        let coefficients = match &runs {
            Some((runs, _)) => runs.iter().map(|run| u64::from(run.count)).sum(),
            // At most 1026⁴/2, and with rows, channels and bytes 2⁴³.
            None => self.tiles() * self.axes[0].len() as u64,
        };
        let expected = 2 * Grid::numbers_of(self.content, coefficients);
        if expected > MAX_DECODED_BYTES {
            return Err(Error::TooLarge { bytes: expected });
        }
        if expected != chunk.decoded_bytes as u64 {
            return Err(Error::Invalid {
                what: "size of tiles",
                offset: chunk.offset,
            });
        }
        let rows = match runs {
            Some((runs, offset)) => Some(
                Rows::new(&runs, &self.axes, self.content.channels()).ok_or(Error::Invalid {
                    what: "runs of coefficients",
                    offset,
                })?,
            ),
            None => None,
        };
        let decoded = decode(bytes, chunk, tile_words(self.content), "tiles")?;
        let number = |[low, high]: &[u8; 2]| i16::from_le_bytes([*low, *high]);
        let copied = || numbers::own(decoded.as_chunks().0.iter().map(number));
        let lent = file.lend(chunk, decoded.len() / 2);
        Ok(Grid {
            coordinates: self.coordinates,
            content: self.content,
            scale: self.scale,
            rows,
            tiles: lent.unwrap_or_else(copied),
            axes: self.axes,
        })
    }

    /// How many tiles there are, with all coefficients or not.
    fn tiles(&self) -> u64 {
        let [_, n1, n2, n3] = self.axes.each_ref().map(|axis| axis.len() as u64);
        tiles_of(n1 as usize) as u64 * n2 * n3
    }

    fn load_runs(&self, bytes: &[u8], chunk: &Chunk) -> Result<Vec<Run>, Error> {
        let tiles = self.tiles();
        if tiles > MAX_TILES {
            return Err(Error::TooLarge {
                bytes: tiles.saturating_mul(RUN_BYTES),
            });
        }
        if tiles * RUN_BYTES != chunk.decoded_bytes as u64 {
            return Err(Error::Invalid {
                what: "size of runs",
                offset: chunk.offset,
            });
        }
        let decoded = decode(bytes, chunk, RUN_WORDS, "runs")?;
        let number = |[low, high]: [u8; 2]| u16::from_le_bytes([low, high]);
        let run = |[a, b, c, d]: &[u8; 4]| Run {
            first: number([*a, *b]),
            count: number([*c, *d]),
        };
        Ok(decoded.as_chunks().0.iter().map(run).collect())
    }
}

/// The most tiles of a grid that has not all coefficients: what finds them takes some 60 bytes a tile while it is made, which a file of a
/// few bytes could ask for.
const MAX_TILES: u64 = 1 << 21;
/// A run in a file: two u16.
const RUN_BYTES: u64 = 4;
