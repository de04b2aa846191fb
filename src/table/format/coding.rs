//! Chunks: checksums, compression, and the planes that make numbers compress well.

use alloc::{
    borrow::{Cow, ToOwned},
    vec,
    vec::Vec,
};

use crate::table::{CHANNELS, Content, Error};

/// RFC 8878: a block of zstd that decodes to anything has a header of three bytes, and content …
#[cfg(feature = "zstd")]
const BLOCK_BYTES: usize = 4;
/// … and it decodes to at most this.
#[cfg(feature = "zstd")]
const DECODED_BLOCK_BYTES: usize = 128 << 10;

/// How a chunk's bytes are stored.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Codec {
    Stored,
    Zstd,
    /// zstd over the planes of [`split_planes`].
    ZstdPlanes,
}

/// Where a chunk is, and how.
pub(super) struct Chunk {
    pub(super) codec: Codec,
    pub(super) offset: usize,
    pub(super) stored_bytes: usize,
    pub(super) decoded_bytes: usize,
    pub(super) crc: u32,
}

#[cfg(not(feature = "small"))]
pub(super) use crc32fast::hash as checksum;

/// CRC-32 (IEEE), a byte at a time: a quarter as fast as crc32fast, whose tables have 16 KiB.
#[cfg(feature = "small")]
pub(super) fn checksum(bytes: &[u8]) -> u32 {
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

/// What numbers a chunk is of.
#[derive(Clone, Copy)]
pub(super) enum Words {
    /// None: it is text.
    None,
    /// Of so many bytes, each like the one so many before it.
    Of { bytes: usize, before: usize },
}

/// Of tiles: two bytes, each like that of the coefficient before, which is so many numbers before it as two rows have channels.
pub(super) fn tile_words(content: Content) -> Words {
    Words::Of {
        bytes: 2,
        before: 2 * content.channels(),
    }
}

/// Of a run in a file: two u16, each like that of the row before.
pub(super) const RUN_WORDS: Words = Words::Of {
    bytes: 2,
    before: 2,
};

/// A chunk's bytes, checked and decompressed; those that are not compressed are not copied.
pub(super) fn decode<'a>(
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
/// row and channel), wrapping, then all words' lowest bytes, all second bytes and so on.
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

/// Sums up the differences in the `N` planes, to the number so many, at most two per channel, `before`.
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
    let mut last = [T::default(); 2 * CHANNELS];
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

/// zstd's level: the files are written once and read often.
#[cfg(feature = "zstd")]
const LEVEL: i32 = 19;

/// A chunk as it is stored: its bytes by zstd, numbers by their planes.
///
/// # Errors
/// When zstd runs out of memory.
#[cfg(feature = "zstd")]
pub(super) fn compress(bytes: Vec<u8>, words: Words) -> Result<(Codec, Vec<u8>), Error> {
    let (codec, bytes) = match words {
        Words::None => (Codec::Zstd, bytes),
        Words::Of {
            bytes: word,
            before,
        } => (Codec::ZstdPlanes, split_planes(&bytes, word, before)),
    };
    let mut stored = vec![0; zstd_safe::compress_bound(bytes.len())];
    let length =
        zstd_safe::compress(&mut stored[..], &bytes, LEVEL).map_err(|_| Error::Decompression)?;
    stored.truncate(length);
    Ok((codec, stored))
}
