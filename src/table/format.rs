//! Tables as bytes: `FORMAT.md` says what is where, this file reads and writes it.
//!
//! All checks are here. What [`Table::from_bytes`] returns can be evaluated without any.

#[cfg(target_has_atomic = "ptr")]
use alloc::sync::Arc;
use alloc::{
    borrow::{Cow, ToOwned},
    string::String,
    vec,
    vec::Vec,
};

use super::grid::PADDING;
use super::numbers::{self, Lender, Plain};
use super::rows::Run;
use super::{
    Axis, CHANNELS, Content, Encoding, Error, Grid, Grids, MAX_KNOTS, Numbers, Rows, Samples,
    Table, ThreadParameters, ThreadTable,
};
use crate::brdf::{Optics, Reweighting, limits};
use crate::chart::{Chart, Coordinates};

/// Major version of the format: readers refuse what they do not know.
pub const MAJOR: u16 = 2;
/// Minor version of the format.
pub const MINOR: u16 = 5;
/// The most memory that samples and metadata of one file may take, whatever its header says.
pub const MAX_DECODED_BYTES: u64 = 256 << 20;

/// The most bytes of metadata: twice a fabric's text, whose line breaks and quotes are escaped in it, and what else there
/// is to say.
const MAX_METADATA_BYTES: usize = 4 << 20;
/// RFC 8878: a block of zstd that decodes to anything has a header of three bytes, and content …
#[cfg(feature = "zstd")]
const BLOCK_BYTES: usize = 4;
/// … and it decodes to at most this.
#[cfg(feature = "zstd")]
const DECODED_BLOCK_BYTES: usize = 128 << 10;
const MAGIC: [u8; 8] = *b"\x89SATEEN\n";
/// Headers and chunks begin at multiples of this.
const ALIGNMENT: usize = 64;
/// Where the checksummed part of the header begins.
const CHECKED_FROM: usize = 20;
/// The minor version of files whose samples are looked up where they are: …
const MAPPED_MINOR: u16 = 5;
/// … so many zeros follow the last chunk, so that its last rows can be read whole, too.
const MARGIN: usize = 64;
const _: () = assert!(MARGIN >= PADDING * size_of::<f32>());
const MAX_HEADER_BYTES: usize = 16 << 20;
const MAX_THREADS: u32 = 64;
const MAX_PARTS: u32 = 4096;
const MAX_DIRECT_NODES: u32 = 64;

/// How a chunk's bytes are stored.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Codec {
    Stored,
    Zstd,
    /// zstd over the planes of [`split_planes`].
    ZstdPlanes,
}

struct Chunk {
    codec: Codec,
    offset: usize,
    stored_bytes: usize,
    decoded_bytes: usize,
    crc: u32,
}

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
        let (header, minor) = header_of(bytes)?;
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
        reader.zero(3)?;
        let sigma_u = reader.f32()?;
        if !limits::SIGMA_U.contains(&f64::from(sigma_u)) {
            return Err(reader.invalid("width of u"));
        }
        let rho_scale = match minor {
            0 => 1.0,
            _ => reader.f32()?,
        };
        // Rounded to an f32, the ends may be a little beyond.
        if !(0.99 * limits::RHO_SCALE.start()..=*limits::RHO_SCALE.end())
            .contains(&f64::from(rho_scale))
        {
            return Err(reader.invalid("scale of ρ"));
        }
        let thread_count = reader.count("number of threads", 0..=MAX_THREADS)?;
        let mut threads = Vec::new();
        for _ in 0..thread_count {
            threads.push(reader.thread(minor)?);
        }
        let grid_chunks: usize = threads.iter().map(|(_, grids)| grids.chunks()).sum();
        if chunk_count as usize != grid_chunks + 1 {
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
        let margin = if minor == MAPPED_MINOR { MARGIN } else { 0 };
        check_layout(bytes, header.len(), &chunks, margin)?;

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
        let mut loaded = Vec::new();
        for (parameters, grids) in threads {
            let grids = grids.try_map(|grid| {
                let mut next = || grid_chunks.next().ok_or(reader.invalid("number of chunks"));
                let samples = next()?;
                let runs = if grid.has_runs { Some(next()?) } else { None };
                grid.load(file, samples, runs)
            })?;
            loaded.push(ThreadTable::new(parameters, grids));
        }
        let gap = (1.0 - coverage).max(0.0) as f32;
        let mut table = Self::new(loaded, gap, sigma_u, rho_scale, reweighting);
        table.metadata = metadata;
        if minor != MAPPED_MINOR && table.format() != (MAJOR, minor) {
            return Err(Error::Invalid {
                what: "minor version",
                offset: 10,
            });
        }
        Ok(table)
    }
}

#[cfg(not(feature = "small"))]
use crc32fast::hash as checksum;

/// CRC-32 (IEEE), a byte at a time: a quarter as fast as crc32fast, whose tables have 16 KiB.
#[cfg(feature = "small")]
fn checksum(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut byte = 0;
        while byte < 256 {
            let mut crc = byte as u32;
            let mut bit = 0;
            while bit < 8 {
                crc = crc >> 1 ^ if crc & 1 == 1 { 0xedb8_8320 } else { 0 };
                bit += 1;
            }
            table[byte] = crc;
            byte += 1;
        }
        table
    };
    let step = |crc: u32, byte: &u8| crc >> 8 ^ TABLE[usize::from(crc as u8 ^ byte)];
    !bytes.iter().fold(!0, step)
}

/// A file's bytes, and what keeps them, if anything does.
struct File<'a> {
    bytes: &'a [u8],
    /// What keeps the bytes where they are, unchanged.
    lender: Option<Lender>,
}

impl File<'_> {
    /// A chunk's numbers where they are, if they can be.
    fn lend<T: Plain>(&self, chunk: &Chunk, count: usize) -> Option<Numbers<T>> {
        let lender = self
            .lender
            .as_ref()
            .filter(|_| chunk.codec == Codec::Stored)?;
        let bytes = self.bytes.get(chunk.offset..)?;
        #[expect(unsafe_code, reason = "numbers without a copy of them")]
        // SAFETY: the lender keeps the bytes as they are.
        unsafe {
            numbers::lend(bytes, count, lender)
        }
    }
}

/// The header's bytes, complete and unchanged, and the minor version.
fn header_of(bytes: &[u8]) -> Result<(&[u8], u16), Error> {
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
    let (major, minor) = (reader.u16()?, reader.u16()?);
    if major != MAJOR || minor > MINOR {
        return Err(Error::Version { major, minor });
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
    Ok((header, minor))
}

/// Chunks follow the header and each other, each at the next aligned offset, then so many zeros, and nothing follows them.
fn check_layout(
    bytes: &[u8],
    header_length: usize,
    chunks: &[Chunk],
    margin: usize,
) -> Result<(), Error> {
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
    let (expected, found) = (end as u64 + margin as u64, bytes.len() as u64);
    if found < expected {
        return Err(Error::Truncated { expected, found });
    }
    if bytes[end..].iter().take(margin).any(|byte| *byte != 0) {
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

/// What numbers a chunk is of.
#[derive(Clone, Copy)]
enum Words {
    /// None: it is text.
    None,
    /// Of so many bytes, each like the one so many before it.
    Of { bytes: usize, before: usize },
}

/// A chunk's bytes, checked and decompressed; those that are not compressed are not copied.
fn decode<'a>(
    bytes: &'a [u8],
    chunk: &Chunk,
    words: Words,
    part: &'static str,
) -> Result<Cow<'a, [u8]>, Error> {
    let stored = &bytes[chunk.offset..chunk.offset + chunk.stored_bytes];
    if checksum(stored) != chunk.crc {
        return Err(Error::Checksum { part });
    }
    let decoded = match (chunk.codec, words) {
        (Codec::Stored, _) => Cow::Borrowed(stored),
        (Codec::Zstd, _) => Cow::Owned(decompress(stored, chunk.decoded_bytes)?),
        (Codec::ZstdPlanes, Words::Of { bytes, before }) => {
            let planes = decompress(stored, chunk.decoded_bytes)?;
            Cow::Owned(join_planes(&planes, bytes, before))
        }
        (Codec::ZstdPlanes, Words::None) => {
            return Err(Error::Invalid {
                what: "codec of the metadata",
                offset: chunk.offset,
            });
        }
    };
    if decoded.len() == chunk.decoded_bytes {
        Ok(decoded)
    } else {
        Err(Error::Decompression)
    }
}

/// Decompresses what claims to be of `decoded_bytes`, which are asked for at once: so a claim that the stored bytes
/// cannot keep, or that is not what they say of themselves, is refused before.
#[cfg(feature = "zstd")]
fn decompress(stored: &[u8], decoded_bytes: usize) -> Result<Vec<u8>, Error> {
    let most = (stored.len() / BLOCK_BYTES).saturating_mul(DECODED_BLOCK_BYTES);
    let recorded = zstd_safe::get_frame_content_size(stored).ok().flatten();
    let is_one_frame = zstd_safe::find_frame_compressed_size(stored) == Ok(stored.len());
    if decoded_bytes > most || recorded != Some(decoded_bytes as u64) || !is_one_frame {
        return Err(Error::Decompression);
    }
    let mut decoded = vec![0; decoded_bytes];
    match zstd_safe::decompress(&mut decoded[..], stored) {
        Ok(length) if length == decoded_bytes => Ok(decoded),
        _ => Err(Error::Decompression),
    }
}

#[cfg(not(feature = "zstd"))]
fn decompress(_: &[u8], _: usize) -> Result<Vec<u8>, Error> {
    Err(Error::NoZstd)
}

/// Neighbouring numbers differ little: stores the difference of each little-endian `word` to the one so many `before` it (of the same
/// channel), wrapping, then all words' lowest bytes, all second bytes and so on.
#[cfg(feature = "zstd")]
fn split_planes(bytes: &[u8], word: usize, before: usize) -> Vec<u8> {
    let count = bytes.len() / word;
    let mut planes = vec![0; bytes.len()];
    for i in 0..count {
        let at = |i: usize| read_word(&bytes[i * word..(i + 1) * word]);
        let difference = at(i).wrapping_sub(if i < before { 0 } else { at(i - before) });
        for k in 0..word {
            planes[k * count + i] = difference.to_le_bytes()[k];
        }
    }
    planes
}

/// The inverse of [`split_planes`].
fn join_planes(planes: &[u8], word: usize, before: usize) -> Vec<u8> {
    match word {
        1 => join_words(
            planes,
            before,
            u8::from_le_bytes,
            u8::wrapping_add,
            u8::to_le_bytes,
        ),
        2 => join_words(
            planes,
            before,
            |[low, high]| u16::from_le_bytes([low, high]),
            u16::wrapping_add,
            u16::to_le_bytes,
        ),
        4 => join_words(
            planes,
            before,
            u32::from_le_bytes,
            u32::wrapping_add,
            u32::to_le_bytes,
        ),
        _ => planes.to_owned(),
    }
}

/// Sums up the differences in the `N` planes, to the number so many, at most [`CHANNELS`], `before`.
fn join_words<T: Copy + Default, const N: usize>(
    planes: &[u8],
    before: usize,
    from_bytes: impl Fn([u8; N]) -> T,
    add: impl Fn(T, T) -> T,
    to_bytes: impl Fn(T) -> [u8; N],
) -> Vec<u8> {
    let count = planes.len() / N;
    let planes: [&[u8]; N] = core::array::from_fn(|k| &planes[k * count..(k + 1) * count]);
    let mut bytes = vec![0; count * N];
    let mut last = [T::default(); CHANNELS];
    for (i, out) in bytes.chunks_exact_mut(N).enumerate() {
        let value = add(last[i % before], from_bytes(planes.map(|plane| plane[i])));
        last[i % before] = value;
        out.copy_from_slice(&to_bytes(value));
    }
    bytes
}

#[cfg(feature = "zstd")]
fn read_word(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |word, byte| word << 8 | u32::from(*byte))
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

/// A grid's part of the header.
struct GridHeader {
    coordinates: Coordinates,
    encoding: Encoding,
    content: Content,
    /// Whether it has not all coefficients: a chunk says which.
    has_runs: bool,
    scale: [f32; 2],
    axes: [Axis; 4],
}

impl GridHeader {
    fn load(self, file: &File<'_>, chunk: &Chunk, runs: Option<&Chunk>) -> Result<Grid, Error> {
        let bytes = file.bytes;
        let (word, channels) = (self.encoding.bytes(), self.content.channels());
        let runs = match runs {
            Some(chunk) => Some((self.load_runs(bytes, chunk)?, chunk.offset)),
            None => None,
        };
        let coefficients = match &runs {
            Some((runs, _)) => runs.iter().map(|run| u64::from(run.count)).sum(),
            // At most 1025⁴, and with channels and bytes 2⁴³.
            None => self
                .axes
                .iter()
                .map(|axis| axis.len() as u64)
                .product::<u64>(),
        };
        let expected = coefficients * (channels * word) as u64;
        if expected > MAX_DECODED_BYTES {
            return Err(Error::TooLarge { bytes: expected });
        }
        if expected != chunk.decoded_bytes as u64 {
            return Err(Error::Invalid {
                what: "size of samples",
                offset: chunk.offset,
            });
        }
        let rows = match runs {
            Some((runs, offset)) => Some(Rows::new(&runs, &self.axes, channels).ok_or(
                Error::Invalid {
                    what: "runs of coefficients",
                    offset,
                },
            )?),
            None => None,
        };
        let words = Words::Of {
            bytes: word,
            before: channels,
        };
        let decoded = decode(bytes, chunk, words, "samples")?;
        let samples = match self.encoding {
            Encoding::F32 | Encoding::SqrtF32 => {
                Samples::F32(numbers_of(file, chunk, &decoded, f32::from_le_bytes))
            }
            Encoding::I16 | Encoding::SqrtI16 => {
                Samples::I16(numbers_of(file, chunk, &decoded, i16::from_le_bytes))
            }
            Encoding::SqrtI8 => Samples::I8(numbers_of(file, chunk, &decoded, i8::from_le_bytes)),
        };
        if let Samples::F32(samples) = &samples
            && !samples.stored().iter().all(|x| (-1.0..=1.0).contains(x))
        {
            return Err(Error::Invalid {
                what: "a sample is not within ±1",
                offset: chunk.offset,
            });
        }
        let Self {
            coordinates,
            encoding,
            content,
            has_runs: _,
            scale,
            axes,
        } = self;
        Ok(Grid {
            coordinates,
            axes,
            encoding,
            content,
            scale,
            rows,
            samples,
        })
    }

    fn load_runs(&self, bytes: &[u8], chunk: &Chunk) -> Result<Vec<Run>, Error> {
        let rows: u64 = self.axes[1..]
            .iter()
            .map(|axis| axis.len() as u64)
            .product();
        if rows > MAX_ROWS {
            return Err(Error::TooLarge {
                bytes: rows.saturating_mul(RUN_BYTES),
            });
        }
        if rows * RUN_BYTES != chunk.decoded_bytes as u64 {
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

/// The most rows of a grid that has not all coefficients: what finds them takes some 60 bytes a row while it is made, which a file of a
/// few bytes could ask for.
const MAX_ROWS: u64 = 1 << 22;
/// A run in a file: two u16 …
const RUN_BYTES: u64 = 4;
/// … each like that of the row before.
const RUN_WORDS: Words = Words::Of {
    bytes: 2,
    before: 2,
};

/// What grids may be functions of: the first four are those of a straight thread's segments, which always look the same from
/// both sides, the first nine those of any response, and all those of a projection.
const COORDINATES: [Coordinates; 11] = [
    thread(Chart::Thesis, false, true),
    thread(Chart::Thesis, true, true),
    thread(Chart::Highlight, false, true),
    thread(Chart::Highlight, true, true),
    thread(Chart::Thesis, false, false),
    thread(Chart::Thesis, true, false),
    thread(Chart::Highlight, false, false),
    thread(Chart::Highlight, true, false),
    Coordinates::Isotropic,
    Coordinates::View { isotropic: false },
    Coordinates::View { isotropic: true },
];

const fn thread(chart: Chart, ends_fold: bool, sides_fold: bool) -> Coordinates {
    Coordinates::Thread {
        chart,
        ends_fold,
        sides_fold,
    }
}

/// The two bytes that stand for coordinates.
fn code_of(coordinates: Coordinates) -> [u8; 2] {
    match coordinates {
        Coordinates::Thread {
            chart,
            ends_fold,
            sides_fold,
        } => {
            let chart = match chart {
                Chart::Thesis => 0,
                Chart::Highlight => 1,
            };
            [chart, u8::from(ends_fold) + 2 * u8::from(!sides_fold)]
        }
        Coordinates::Isotropic => [2, 0],
        Coordinates::View { isotropic } => [3, u8::from(isotropic)],
    }
}

/// The little-endian numbers of a chunk that has these bytes, where they are or with the zeros that a grid's samples end with.
fn numbers_of<T: Plain + Default, const N: usize>(
    file: &File<'_>,
    chunk: &Chunk,
    decoded: &[u8],
    of: impl Fn([u8; N]) -> T,
) -> Numbers<T> {
    file.lend(chunk, decoded.len() / N).unwrap_or_else(|| {
        let numbers = decoded
            .chunks_exact(N)
            .map(|word| of(core::array::from_fn(|k| word[k])));
        numbers
            .chain(core::iter::repeat_n(T::default(), PADDING))
            .collect()
    })
}

struct Reader<'a> {
    bytes: &'a [u8],
    offset: usize,
}

impl Reader<'_> {
    fn invalid(&self, what: &'static str) -> Error {
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

    fn u8(&mut self) -> Result<u8, Error> {
        self.take::<1>().map(|[byte]| byte)
    }

    fn u16(&mut self) -> Result<u16, Error> {
        self.take().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Result<u32, Error> {
        self.take().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Error> {
        self.take().map(u64::from_le_bytes)
    }

    fn f32(&mut self) -> Result<f32, Error> {
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

    fn count(
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
    fn zero(&mut self, count: usize) -> Result<(), Error> {
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

    fn chunk(&mut self) -> Result<Chunk, Error> {
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

    fn thread(&mut self, minor: u16) -> Result<(ThreadParameters, Grids<GridHeader>), Error> {
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
        let is_curve = minor >= 2 && tilts.is_empty() && segments.is_empty();
        if !is_curve && (weights.sum::<f64>() - 1.0).abs() > 1e-6 {
            return Err(self.invalid("sum of a thread's weights"));
        }
        let mut nodes = Vec::new();
        let grids = match self.u32()? {
            0 if segments.is_empty() && !is_curve => Grids::None,
            1 if !segments.is_empty() => Grids::Segments(self.grid(&COORDINATES[..4], minor)?),
            2 if !segments.is_empty() => {
                for _ in 0..self.count("number of nodes", 1..=MAX_DIRECT_NODES)? {
                    nodes.push([
                        self.f64_where("node", |x| x.abs() < 1.0)?,
                        self.f64_where("weight of a node", |x| x > 0.0 && x <= 2.0)?,
                    ]);
                }
                Grids::None
            }
            3 if is_curve => Grids::Curve {
                response: self.grid(&COORDINATES[..9], minor)?,
                projection: self.grid(&COORDINATES, minor)?,
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

    /// A grid whose coordinates are among `known`.
    fn grid(&mut self, known: &[Coordinates], minor: u16) -> Result<GridHeader, Error> {
        let codes = [self.u8()?, self.u8()?];
        let coordinates = known.iter().copied().find(|known| code_of(*known) == codes);
        let coordinates = coordinates.ok_or(self.invalid("coordinates"))?;
        let encoding = match self.u8()? {
            0 => Encoding::F32,
            1 => Encoding::I16,
            2 => Encoding::SqrtF32,
            3 => Encoding::SqrtI16,
            4 => Encoding::SqrtI8,
            _ => return Err(self.invalid("encoding")),
        };
        let flags = self.u8()?;
        if flags > 7 || minor < 4 && flags != 0 {
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
        for (axis, implied) in implied_kinks(coordinates).into_iter().enumerate() {
            let count = self.u16()? as usize;
            let depth = self.u8()?;
            let bends = match (minor, self.u8()?) {
                (..3, 0) => None,
                (3.., 0) => Some(false),
                (3.., 1) => Some(true),
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
                (true, [place @ (0 | 1)], depth)
                    if minor >= 4 && axis > 0 && u16::from(depth) == *place =>
                {
                    Some(Axis::point(depth.into(), *place))
                }
                (true, ..) => Axis::new(depth.into(), knots, bends.unwrap_or(implied)),
                (false, ..) => None,
            };
            let axis = axis.ok_or(self.invalid("knots of an axis"))?;
            if bends.is_some_and(|bends| bends != axis.has_kink()) {
                return Err(self.invalid("kink of an axis"));
            }
            axes.push(axis);
        }
        let axes = <[Axis; 4]>::try_from(axes).map_err(|_| self.invalid("axes"))?;
        Ok(GridHeader {
            coordinates,
            encoding,
            content,
            has_runs: flags & 1 == 1,
            scale,
            axes,
        })
    }
}

/// The axes that bend at the knot ½ in tables before minor version 3, which do not say so.
fn implied_kinks(coordinates: Coordinates) -> [bool; 4] {
    match coordinates {
        Coordinates::Thread { sides_fold, .. } => [true, false, true, !sides_fold],
        Coordinates::Isotropic => [true, false, false, false],
        Coordinates::View { .. } => [false; 4],
    }
}

impl Grid {
    /// Whether its axes bend where those of tables before minor version 3 do.
    pub(super) fn has_implied_kinks(&self) -> bool {
        let implied = implied_kinks(self.coordinates);
        self.axes
            .iter()
            .zip(implied)
            .all(|(axis, implied)| axis.has_kink() == (implied && axis.has_middle()))
    }
}

mod write {
    use super::super::Segments;
    use super::*;

    /// zstd's level: the files are written once and read often.
    #[cfg(feature = "zstd")]
    const LEVEL: i32 = 19;

    /// How a chunk is made of bytes, numbers of some [`Words`] if any.
    type Pack = fn(Vec<u8>, Words) -> Result<(Codec, Vec<u8>), Error>;

    impl Table {
        /// The table as a file, `FORMAT.md`. The same table gives the same bytes.
        ///
        /// # Errors
        /// When zstd runs out of memory.
        #[cfg(feature = "zstd")]
        pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
            self.to_file(self.format().1, compress)
        }

        /// The table as a file that is not compressed, format 2.5: [`Table::from_static`] looks up its samples where they
        /// are, and it needs no zstd.
        pub fn to_mappable_bytes(&self) -> Vec<u8> {
            let store: Pack = |bytes, _| Ok((Codec::Stored, bytes));
            let mut bytes = self.to_file(MAPPED_MINOR, store).unwrap_or_default();
            bytes.extend([0; MARGIN]);
            bytes
        }

        fn to_file(&self, minor: u16, pack: Pack) -> Result<Vec<u8>, Error> {
            let grids: Vec<&Grid> = self.threads.iter().flat_map(ThreadTable::grids).collect();
            let mut contents = vec![(self.metadata.as_bytes().to_owned(), Words::None)];
            for grid in &grids {
                let words = Words::Of {
                    bytes: grid.encoding.bytes(),
                    before: grid.content.channels(),
                };
                contents.push((sample_bytes(&grid.samples), words));
                if let Some(rows) = &grid.rows {
                    let runs = rows.runs(&grid.axes);
                    let numbers = runs.iter().flat_map(|run| [run.first, run.count]);
                    let bytes = numbers.flat_map(u16::to_le_bytes).collect();
                    contents.push((bytes, RUN_WORDS));
                }
            }
            let contents = packed(contents, pack)?;

            let mut body = Vec::new();
            put_u32(&mut body, contents.len());
            body.push(u8::from(self.reweighting == Reweighting::Both));
            body.extend([0; 3]);
            body.extend(self.sigma_u.to_le_bytes());
            if minor > 0 {
                body.extend(self.rho_scale.to_le_bytes());
            }
            put_u32(&mut body, self.threads.len());
            for thread in &self.threads {
                put_thread(&mut body, thread, minor);
            }
            const CHUNK_ENTRY: usize = 32;
            let header_length = (CHECKED_FROM + body.len() + CHUNK_ENTRY * contents.len())
                .next_multiple_of(ALIGNMENT);
            let mut end = header_length;
            for (codec, decoded_bytes, stored) in &contents {
                let offset = end.next_multiple_of(ALIGNMENT);
                for size in [offset, stored.len(), *decoded_bytes] {
                    body.extend((size as u64).to_le_bytes());
                }
                body.extend(checksum(stored).to_le_bytes());
                body.extend((*codec as u32).to_le_bytes());
                end = offset + stored.len();
            }
            body.resize(header_length - CHECKED_FROM, 0);

            let mut bytes = Vec::with_capacity(end);
            bytes.extend(MAGIC);
            bytes.extend(MAJOR.to_le_bytes());
            bytes.extend(minor.to_le_bytes());
            put_u32(&mut bytes, header_length);
            bytes.extend(checksum(&body).to_le_bytes());
            bytes.extend(body);
            for (_, _, stored) in contents {
                bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
                bytes.extend(stored);
            }
            Ok(bytes)
        }
    }

    /// Every chunk as it is stored, and its length before; side by side where there are workers.
    fn packed(
        contents: Vec<(Vec<u8>, Words)>,
        pack: Pack,
    ) -> Result<Vec<(Codec, usize, Vec<u8>)>, Error> {
        let packed = |(bytes, words): (Vec<u8>, Words)| {
            let decoded_bytes = bytes.len();
            let (codec, stored) = pack(bytes, words)?;
            Ok((codec, decoded_bytes, stored))
        };
        #[cfg(feature = "bake")]
        {
            use rayon::prelude::*;
            contents.into_par_iter().map(packed).collect()
        }
        #[cfg(not(feature = "bake"))]
        contents.into_iter().map(packed).collect()
    }

    /// By zstd, numbers by their planes.
    #[cfg(feature = "zstd")]
    fn compress(bytes: Vec<u8>, words: Words) -> Result<(Codec, Vec<u8>), Error> {
        let (codec, bytes) = match words {
            Words::None => (Codec::Zstd, bytes),
            Words::Of {
                bytes: word,
                before,
            } => (Codec::ZstdPlanes, split_planes(&bytes, word, before)),
        };
        let mut stored = vec![0; zstd_safe::compress_bound(bytes.len())];
        let length = zstd_safe::compress(&mut stored[..], &bytes, LEVEL)
            .map_err(|_| Error::Decompression)?;
        stored.truncate(length);
        Ok((codec, stored))
    }

    fn sample_bytes(samples: &Samples) -> Vec<u8> {
        match samples {
            Samples::F32(samples) => bytes_of(samples, |x| x.to_le_bytes()),
            Samples::I16(samples) => bytes_of(samples, |x| x.to_le_bytes()),
            Samples::I8(samples) => bytes_of(samples, |x| x.to_le_bytes()),
        }
    }

    fn bytes_of<T, const N: usize>(samples: &Numbers<T>, of: impl Fn(&T) -> [u8; N]) -> Vec<u8> {
        samples.stored().iter().flat_map(of).collect()
    }

    fn put_u32(out: &mut Vec<u8>, x: usize) {
        // Counts and header lengths that from_bytes accepts are far below 2³².
        out.extend((x as u32).to_le_bytes());
    }

    fn put_f64(out: &mut Vec<u8>, x: f64) {
        out.extend(x.to_le_bytes());
    }

    fn put_thread(out: &mut Vec<u8>, thread: &ThreadTable, minor: u16) {
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
                put_u32(out, 1);
                put_grid(out, grid, minor);
            }
            Segments::Curve(grids) => {
                put_u32(out, 3);
                put_grid(out, &grids.response, minor);
                put_grid(out, &grids.projection, minor);
            }
            Segments::Direct(_) => {
                put_u32(out, 2);
                put_u32(out, nodes.len());
                for x in nodes.as_flattened() {
                    put_f64(out, *x);
                }
            }
        }
    }

    fn put_grid(out: &mut Vec<u8>, grid: &Grid, minor: u16) {
        out.extend(code_of(grid.coordinates));
        out.push(match grid.encoding {
            Encoding::F32 => 0,
            Encoding::I16 => 1,
            Encoding::SqrtF32 => 2,
            Encoding::SqrtI16 => 3,
            Encoding::SqrtI8 => 4,
        });
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
            out.push(u8::from(minor >= 3 && axis.has_kink()));
            for knot in axis.integer_knots() {
                out.extend(knot.to_le_bytes());
            }
            out.resize(out.len().next_multiple_of(4), 0);
        }
    }
}
