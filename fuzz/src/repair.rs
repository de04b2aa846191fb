//! Table files with magic, version, lengths and checksums made right, so that a mutation reaches what is behind them.
//!
//! `src/table/FORMAT.md` says what is where.

/// With the version.
const MAGIC: &[u8] = b"\x89SATEEN\n\x03\0\0\0";
/// Zeros behind the last chunk.
const MARGIN: usize = 64;
const ZSTD_MAGIC: &[u8] = &[0x28, 0xb5, 0x2f, 0xfd];
const HEADER_LENGTH: usize = 12;
const HEADER_CRC: usize = 16;
const CHECKED_FROM: usize = 20;
const ALIGNMENT: usize = 64;
/// Metadata, and two grids for each of 64 threads, each with runs.
const MOST_CHUNKS: usize = 257;

/// A chunk's entry: offset, stored bytes, decoded bytes, CRC, codec.
const ENTRY: usize = 32;

/// A file in its parts.
struct File {
    /// From the start to the end of the header.
    header: Vec<u8>,
    /// Where in the header the entries of the chunks begin, if they were found.
    entries: Option<usize>,
    /// What the chunks hold.
    chunks: Vec<Vec<u8>>,
}

impl File {
    /// Takes apart what is at least like a table.
    fn of(bytes: &[u8]) -> Option<Self> {
        let length = number::<4>(bytes, HEADER_LENGTH)? as usize;
        let whole = bytes.len() / ALIGNMENT * ALIGNMENT;
        let length = (length / ALIGNMENT * ALIGNMENT).clamp(ALIGNMENT, whole.max(ALIGNMENT));
        let header = bytes.get(..length)?.to_vec();
        let count = (number::<4>(&header, CHECKED_FROM)? as usize).min(MOST_CHUNKS);
        let entries = first_entry(&header, count);
        let chunks = entries.map_or_else(Vec::new, |entries| {
            chunks(&header[entries..], count, &bytes[length..])
        });
        Some(Self {
            header,
            entries,
            chunks,
        })
    }

    /// The file, every length, offset and checksum right.
    fn bytes(mut self) -> Vec<u8> {
        self.header[..MAGIC.len()].copy_from_slice(MAGIC);
        let length = self.header.len();
        put(
            &mut self.header,
            HEADER_LENGTH,
            &(length as u32).to_le_bytes(),
        );
        let mut body = Vec::new();
        for (index, chunk) in self.chunks.iter().enumerate() {
            body.resize(body.len().next_multiple_of(ALIGNMENT), 0);
            if let Some(entries) = self.entries {
                let entry = entries + index * ENTRY;
                let offset = (length + body.len()) as u64;
                put(&mut self.header, entry, &offset.to_le_bytes());
                put(
                    &mut self.header,
                    entry + 8,
                    &(chunk.len() as u64).to_le_bytes(),
                );
                put(
                    &mut self.header,
                    entry + 24,
                    &crc32fast::hash(chunk).to_le_bytes(),
                );
            }
            body.extend(chunk);
        }
        body.extend([0; MARGIN]);
        let crc = crc32fast::hash(&self.header[CHECKED_FROM..]);
        put(&mut self.header, HEADER_CRC, &crc.to_le_bytes());
        self.header.extend(body);
        self.header
    }
}

/// `bytes` as a table file whose magic, version, lengths, offsets and checksums are right.
pub fn repaired(bytes: &[u8]) -> Option<Vec<u8>> {
    File::of(bytes).map(File::bytes)
}

/// The place of the first chunk's entry: the last that begins with the header's length, which is the chunk's offset, or else
/// where entries without padding behind them would begin.
fn first_entry(header: &[u8], count: usize) -> Option<usize> {
    let last = header.len().checked_sub(count * ENTRY)?;
    if count == 0 || last < CHECKED_FROM {
        return None;
    }
    let wanted = (header.len() as u64).to_le_bytes();
    let starts = |at: &usize| header[*at..*at + 8] == wanted;
    (CHECKED_FROM..=last).rev().find(starts).or(Some(last))
}

/// The chunks' bytes by the lengths of their entries; the last takes what is left before the margin. Bytes that were put before the first
/// frame, or into the header, are dropped.
fn chunks(entries: &[u8], count: usize, body: &[u8]) -> Vec<Vec<u8>> {
    let displaced = body
        .windows(ZSTD_MAGIC.len())
        .take(ALIGNMENT)
        .position(|window| window == ZSTD_MAGIC);
    let body = &body[displaced.unwrap_or(0)..];
    let body = body.strip_suffix(&[0; MARGIN]).unwrap_or(body);
    let mut chunks = Vec::new();
    let mut start = 0usize;
    for index in 0..count {
        let left = body.len().saturating_sub(start);
        let stored = number::<8>(entries, index * ENTRY + 8).unwrap_or(0);
        let stored = match index + 1 == count {
            true => left,
            false => usize::try_from(stored).unwrap_or(left).min(left),
        };
        chunks.push(body.get(start..start + stored).unwrap_or(&[]).to_vec());
        start = (start + stored).next_multiple_of(ALIGNMENT);
    }
    chunks
}

fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<u64> {
    let bytes = bytes.get(at..at.checked_add(N)?)?;
    Some(
        bytes
            .iter()
            .rev()
            .fold(0, |sum, byte| sum << 8 | u64::from(*byte)),
    )
}

fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    if let Some(place) = bytes.get_mut(at..at + value.len()) {
        place.copy_from_slice(value);
    }
}
