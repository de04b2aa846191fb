//! Needs as bytes: what a recording is kept in.
//!
//! | offset | size | what |
//! |---|---|---|
//! | 0 | 8 | magic `89 4E 45 45 44 53 0D 0A` (`\x89NEEDS\r\n`) |
//! | 8 | 4 | version, 1 |
//! | 12 | 4 | bins along each side of the square, 64 |
//! | 16 | 4 | CRC-32 (IEEE) of what follows |
//! | 20 | 512 | a bit per bin of directions that are wi and wr at once |
//! | 532 | n × 516 | by ascending bin of wi with any: u32 bin, then 512 bytes with a bit per bin of wr |
//!
//! Numbers are little-endian; bit k of byte j is bin 8 j + k.

use alloc::vec::Vec;
use core::fmt;

use super::bins::{BINS, RESOLUTION, WORDS};
use super::{Directions, Needs};

const MAGIC: [u8; 8] = *b"\x89NEEDS\r\n";
const VERSION: u32 = 1;
const START: usize = 20;
const BYTES: usize = 8 * WORDS;

/// The most bytes that needs take.
pub const MAX_NEEDS_BYTES: usize = START + BYTES + BINS * (size_of::<u32>() + BYTES);

/// Why bytes are no needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum NeedsError {
    /// The magic is not there.
    NotNeeds,
    /// It is of another version or resolution.
    Version,
    /// Bytes are missing, too many or changed.
    Damaged,
}

impl fmt::Display for NeedsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotNeeds => "it is no recording of needs",
            Self::Version => {
                "it was recorded in another format than this version reads; record it again"
            }
            Self::Damaged => "it is damaged; record it again",
        })
    }
}

impl core::error::Error for NeedsError {}

impl Needs {
    /// The needs as a file. The same needs give the same bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut body = Vec::new();
        put(&mut body, self.collocated.words());
        for bin in 0..BINS {
            let row = &self.pairs[bin * WORDS..][..WORDS];
            if row.iter().any(|word| *word != 0) {
                body.extend((bin as u32).to_le_bytes());
                put(&mut body, row);
            }
        }
        let mut bytes = Vec::with_capacity(START + body.len());
        bytes.extend(MAGIC);
        bytes.extend(VERSION.to_le_bytes());
        bytes.extend(RESOLUTION.to_le_bytes());
        bytes.extend(crc32fast::hash(&body).to_le_bytes());
        bytes.extend(body);
        bytes
    }

    /// Reads a file of needs.
    ///
    /// # Errors
    /// [`NeedsError`] says what is wrong.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, NeedsError> {
        if !bytes.starts_with(&MAGIC) {
            return Err(NeedsError::NotNeeds);
        }
        let number = |at: usize| -> Option<u32> {
            let bytes = bytes.get(at..at + 4)?;
            Some(u32::from_le_bytes(bytes.try_into().ok()?))
        };
        let damaged = NeedsError::Damaged;
        if number(8).ok_or(damaged)? != VERSION || number(12).ok_or(damaged)? != RESOLUTION {
            return Err(NeedsError::Version);
        }
        let body = bytes.get(START..).ok_or(damaged)?;
        if number(16) != Some(crc32fast::hash(body)) {
            return Err(damaged);
        }
        let (collocated, rows) = body.split_at_checked(BYTES).ok_or(damaged)?;
        let mut needs = Self::none();
        needs.collocated = Directions::from_words(&words(collocated).collect::<Vec<u64>>());
        let (rows, rest) = rows.as_chunks::<{ 4 + BYTES }>();
        if !rest.is_empty() {
            return Err(damaged);
        }
        let mut next = 0;
        for row in rows {
            let (bin, bits) = row.split_at(4);
            let bin = bin.try_into().map_or(u32::MAX, u32::from_le_bytes) as usize;
            if bin < next || bin >= BINS || bits.iter().all(|byte| *byte == 0) {
                return Err(damaged);
            }
            next = bin + 1;
            for (word, bits) in needs.pairs[bin * WORDS..].iter_mut().zip(words(bits)) {
                *word = bits;
            }
        }
        Ok(needs)
    }
}

fn put(out: &mut Vec<u8>, words: &[u64]) {
    out.extend(words.iter().flat_map(|word| word.to_le_bytes()));
}

fn words(bytes: &[u8]) -> impl Iterator<Item = u64> + '_ {
    bytes
        .as_chunks()
        .0
        .iter()
        .map(|word| u64::from_le_bytes(*word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn needs_survive_being_bytes_and_damage_is_noticed() {
        let mut needs = Needs::none();
        needs.add_pair([0.36, 0.48, 0.8], [-0.48, -0.6, 0.64]);
        needs.add_pair([0.0, 0.6, 0.8], [0.0, 0.6, 0.8]);
        let bytes = needs.to_bytes();
        assert_eq!(Needs::from_bytes(&bytes), Ok(needs));
        for length in 0..bytes.len() {
            assert!(Needs::from_bytes(&bytes[..length]).is_err(), "{length}");
        }
        let mut changed = bytes;
        for bit in 0..8 * changed.len() {
            changed[bit / 8] ^= 1 << (bit % 8);
            assert!(Needs::from_bytes(&changed).is_err(), "bit {bit}");
            changed[bit / 8] ^= 1 << (bit % 8);
        }
    }
}
