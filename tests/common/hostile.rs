//! Table files that nobody baked: right where a reader looks first, and wrong behind it.

use sateen::table::MAX_DECODED_BYTES;

/// A chunk as the header describes it.
#[derive(Debug, Clone)]
pub(crate) struct Chunk {
    pub(crate) codec: u32,
    pub(crate) decoded_bytes: u64,
    pub(crate) stored: Vec<u8>,
}

/// Chunks that are not compressed, compressed, and compressed in planes.
pub(crate) const STORED: u32 = 0;
pub(crate) const ZSTD: u32 = 1;
pub(crate) const PLANES: u32 = 2;

const ALIGNMENT: usize = 64;
const CHECKED_FROM: usize = 20;
const ENTRY: usize = 32;
/// Zeros behind the last chunk.
const MARGIN: usize = 64;

/// A file of these threads and chunks, the first of which is the metadata. Checksums, offsets and lengths are right.
pub(crate) fn file(threads: &[Vec<u8>], chunks: &[Chunk]) -> Vec<u8> {
    file_with(0, 0.35, threads, chunks)
}

/// The same with another projection in Q and another width of u.
pub(crate) fn file_with(
    reweighting: u8,
    sigma_u: f32,
    threads: &[Vec<u8>],
    chunks: &[Chunk],
) -> Vec<u8> {
    let mut body = Vec::new();
    body.extend((chunks.len() as u32).to_le_bytes());
    body.extend([reweighting, 0, 0, 0]);
    body.extend(sigma_u.to_le_bytes());
    // The scale of ρ.
    body.extend(1.0f32.to_le_bytes());
    body.extend((threads.len() as u32).to_le_bytes());
    body.extend(threads.concat());
    let header_length =
        (CHECKED_FROM + body.len() + ENTRY * chunks.len()).next_multiple_of(ALIGNMENT);
    let mut contents = Vec::new();
    for chunk in chunks {
        contents.resize(contents.len().next_multiple_of(ALIGNMENT), 0);
        let offset = (header_length + contents.len()) as u64;
        for size in [offset, chunk.stored.len() as u64, chunk.decoded_bytes] {
            body.extend(size.to_le_bytes());
        }
        body.extend(crc32fast::hash(&chunk.stored).to_le_bytes());
        body.extend(chunk.codec.to_le_bytes());
        contents.extend(&chunk.stored);
    }
    body.resize(header_length - CHECKED_FROM, 0);
    let mut bytes = b"\x89SATEEN\n\x03\0\0\0".to_vec();
    bytes.extend((header_length as u32).to_le_bytes());
    bytes.extend(crc32fast::hash(&body).to_le_bytes());
    bytes.extend(body);
    bytes.extend(contents);
    bytes.extend([0; MARGIN]);
    bytes
}

/// Makes the header's checksum right again.
pub(crate) fn repair_header(bytes: &mut [u8]) {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let crc = crc32fast::hash(&bytes[CHECKED_FROM..length]);
    bytes[16..20].copy_from_slice(&crc.to_le_bytes());
}

/// Where the entry of the first chunk (the metadata) begins: entries end the header, before its padding.
pub(crate) fn first_chunk_entry(bytes: &[u8]) -> usize {
    let length = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    // Its first field is its own offset: the header's length, the first aligned place.
    let wanted = (length as u64).to_le_bytes();
    (CHECKED_FROM..length - 8)
        .rev()
        .find(|at| bytes[*at..*at + 8] == wanted)
        .unwrap()
}

/// The stored bytes of a chunk, by its index.
pub(crate) fn chunk_range(bytes: &[u8], index: usize) -> std::ops::Range<usize> {
    let entry = first_chunk_entry(bytes) + ENTRY * index;
    let size =
        |at: usize| u64::from_le_bytes(bytes[entry + at..entry + at + 8].try_into().unwrap());
    size(0) as usize..(size(0) + size(8)) as usize
}

/// Makes the checksums of a chunk and of the header right again.
pub(crate) fn repair_chunk(bytes: &mut [u8], index: usize) {
    let crc = crc32fast::hash(&bytes[chunk_range(bytes, index)]);
    let entry = first_chunk_entry(bytes) + ENTRY * index;
    bytes[entry + 24..entry + 28].copy_from_slice(&crc.to_le_bytes());
    repair_header(bytes);
}

/// A thread with its tilts (angle, weight) and segments (from, to, weight), and how these are evaluated.
pub(crate) fn thread(
    coverage: f64,
    tilts: &[[f64; 2]],
    segments: &[[f64; 3]],
    evaluation: &[u8],
) -> Vec<u8> {
    let [direction, albedo, eta, k_d, gamma_s, gamma_v] = [0.0, 0.5, 1.4, 0.1, 0.2, 0.4];
    let optics = [eta, k_d, gamma_s, gamma_v];
    let numbers = [&[direction, coverage], &[albedo; 3][..], &optics].concat();
    thread_with(&numbers, tilts, segments, evaluation)
}

/// The same with other numbers before the tilts: direction, coverage, three of albedo, η, k_d, γ_s, γ_v.
pub(crate) fn thread_with(
    numbers: &[f64],
    tilts: &[[f64; 2]],
    segments: &[[f64; 3]],
    evaluation: &[u8],
) -> Vec<u8> {
    let mut bytes = 4u32.to_le_bytes().to_vec();
    bytes.extend(b"warp");
    bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    for (count, parts) in [
        (tilts.len(), tilts.as_flattened()),
        (segments.len(), segments.as_flattened()),
    ] {
        bytes.extend((count as u32).to_le_bytes());
        bytes.extend(parts.iter().flat_map(|x| x.to_le_bytes()));
    }
    bytes.extend(evaluation);
    bytes
}

/// No segments.
pub(crate) fn nothing() -> Vec<u8> {
    0u32.to_le_bytes().to_vec()
}

/// Direct evaluation with one node.
pub(crate) fn one_node() -> Vec<u8> {
    nodes(&[[0.0, 2.0]])
}

/// Direct evaluation with these nodes and weights.
pub(crate) fn nodes(nodes: &[[f64; 2]]) -> Vec<u8> {
    let mut bytes = [2, nodes.len() as u32].map(u32::to_le_bytes).concat();
    bytes.extend(nodes.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    bytes
}

/// An axis of a grid: knots in units of 2^−depth, and whether functions bend at ½.
#[derive(Debug, Clone)]
pub(crate) struct Axis {
    pub(crate) depth: u8,
    pub(crate) knots: Vec<u16>,
    pub(crate) bends: bool,
}

impl Axis {
    /// Knots in units of 2⁻¹⁴, none of which is a kink.
    pub(crate) fn of(knots: Vec<u16>) -> Self {
        Self {
            depth: 14,
            knots,
            bends: false,
        }
    }

    /// So many knots from 0 to 1: cells of one width, of which the first ones are halved.
    pub(crate) fn halved(knots: u16) -> Self {
        let cells = knots - 1;
        let whole = 1 << cells.ilog2();
        let (width, halved) = ((1 << 14) / whole, cells - whole);
        let halves = (0..2 * halved).map(|k| k * (width / 2));
        Self::of(halves.chain((halved..=whole).map(|k| k * width)).collect())
    }

    /// How many coefficients it has.
    pub(crate) fn len(&self) -> usize {
        match self.knots.len() {
            1 => 1,
            knots => knots + 1 + usize::from(self.bends),
        }
    }

    /// First coefficients of its cells, ascending: at a kink one is skipped.
    pub(crate) fn firsts(&self) -> Vec<usize> {
        let middle = self
            .knots
            .iter()
            .position(|knot| 2 * *knot == 1 << self.depth);
        let cells = 0..self.knots.len().max(2) - 1;
        let skips = |cell: &usize| self.bends && middle.is_some_and(|middle| *cell >= middle);
        cells.map(|cell| cell + usize::from(skips(&cell))).collect()
    }

    /// The most that makes up a value: 3 coefficients, or 1.
    pub(crate) fn taps(&self) -> usize {
        self.len().min(3)
    }
}

/// Runs (first, count) of the tiles of a box of cells, `[u₃][u₂][u₁/2]`: from one cell of each axis to another, counted again from the
/// first behind the last.
pub(crate) fn box_of_runs(axes: &[Axis; 4], ends: [[u16; 2]; 4]) -> Vec<[u16; 2]> {
    let range = |axis: usize| {
        let mut firsts = axes[axis].firsts();
        if axis == 1 {
            // Of tiles.
            firsts = firsts.into_iter().map(|first| first / 2).collect();
        }
        let [a, b] = ends[axis].map(|cell| firsts[usize::from(cell) % firsts.len()]);
        let taps = match axis {
            1 => axes[1].len().min(2),
            _ => axes[axis].taps(),
        };
        a.min(b)..a.max(b) + taps
    };
    let [r0, r1, r2, r3] = [range(0), range(1), range(2), range(3)];
    let [_, n1, n2, n3] = axes.each_ref().map(Axis::len);
    let mut runs = Vec::new();
    for u3 in 0..n3 {
        for u2 in 0..n2 {
            for tile in 0..n1.div_ceil(2) {
                let is_within = r3.contains(&u3) && r2.contains(&u2) && r1.contains(&tile);
                runs.push(match is_within {
                    true => [r0.start as u16, r0.len() as u16],
                    false => [0; 2],
                });
            }
        }
    }
    runs
}

/// A grid in the highlight chart with so many knots on its axes.
pub(crate) fn grid(knots: [u16; 4]) -> Vec<u8> {
    grid_with([1, 0], 0, [1.0; 2], &knots.map(Axis::halved))
}

/// A grid of chart and fold, what it leaves out, scales, and axes.
pub(crate) fn grid_with(
    kind: [u8; 2],
    leaves_out: u8,
    scale: [f32; 2],
    axes: &[Axis; 4],
) -> Vec<u8> {
    let mut bytes = 1u32.to_le_bytes().to_vec();
    bytes.extend(kind);
    bytes.extend([0, leaves_out]);
    bytes.extend(scale.map(f32::to_le_bytes).concat());
    for axis in axes {
        bytes.extend((axis.knots.len() as u16).to_le_bytes());
        bytes.extend([axis.depth, u8::from(axis.bends)]);
        bytes.extend(axis.knots.iter().flat_map(|knot| knot.to_le_bytes()));
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

/// A grid that ends at a rim of so many hundredths, and nodes, as [`nodes`] has them, for what is beyond.
pub(crate) fn with_rim(hundredths: u32, nodes: &[u8], grid: &[u8]) -> Vec<u8> {
    let start = [4, hundredths].map(u32::to_le_bytes).concat();
    [&start, &nodes[4..], &grid[4..]].concat()
}

/// Bytes of the tiles of [`grid`].
pub(crate) fn grid_bytes(knots: [u16; 4]) -> u64 {
    tile_bytes(2, knots.map(|count| u64::from(count) + 1))
}

/// Bytes of tiles of so many channels and coefficients: two rows each.
pub(crate) fn tile_bytes(channels: u64, [n0, n1, n2, n3]: [u64; 4]) -> u64 {
    2 * channels * 2 * n0 * n1.div_ceil(2) * n2 * n3
}

/// One thread with a grid of so many knots, and its chunks.
pub(crate) fn table_of_grid(knots: [u16; 4], metadata: Chunk, samples: Chunk) -> Vec<u8> {
    let segments = [[-0.2, 0.3, 1.0]];
    file(
        &[thread(1.0, &[], &segments, &grid(knots))],
        &[metadata, samples],
    )
}

/// One thread of one tilt.
pub(crate) fn table_of_tilt(metadata: Chunk) -> Vec<u8> {
    file(&[thread(1.0, &[[0.1, 1.0]], &[], &nothing())], &[metadata])
}

/// No metadata.
pub(crate) fn empty() -> Chunk {
    stored(Vec::new())
}

pub(crate) fn stored(bytes: Vec<u8>) -> Chunk {
    Chunk {
        codec: STORED,
        decoded_bytes: bytes.len() as u64,
        stored: bytes,
    }
}

/// A frame of zstd that repeats a byte: every block of 4 bytes decodes to 128 KiB. It may record its decoded size.
pub(crate) fn bomb(blocks: usize, recorded: Option<u64>) -> Vec<u8> {
    let mut frame = vec![0x28, 0xb5, 0x2f, 0xfd];
    match recorded {
        // An 8-byte size, a window of 1 MiB.
        Some(size) => {
            frame.extend([0xc0, 0x50]);
            frame.extend(size.to_le_bytes());
        }
        None => frame.extend([0x00, 0x50]),
    }
    const RUN: u32 = 1 << 1;
    const SIZE: u32 = (128 << 10) << 3;
    for block in 1..=blocks {
        let last = u32::from(block == blocks);
        frame.extend(&(SIZE | RUN | last).to_le_bytes()[..3]);
        frame.push(0);
    }
    frame
}

/// Knots of a grid that takes exactly [`MAX_DECODED_BYTES`] …
pub(crate) const LARGEST: [u16; 4] = [127, 127, 63, 63];
/// … and of one that takes 2¹¹ of them.
pub(crate) const SMALL: [u16; 4] = [3, 3, 7, 3];

/// Small files that are to be refused before they have asked for much, by what is wrong with them.
pub(crate) fn small_hostile_files() -> Vec<(String, Vec<u8>)> {
    let mut files = bombs();
    let absurd = [1024; 4];
    let samples = |decoded_bytes: u64, stored: Vec<u8>| Chunk {
        codec: PLANES,
        decoded_bytes,
        stored,
    };
    for knots in [absurd, [1024, 1024, 1024, 2], LARGEST, [1024, 512, 7, 7]] {
        for decoded_bytes in [grid_bytes(knots), 16, MAX_DECODED_BYTES] {
            let chunk = samples(decoded_bytes, bomb(1, None));
            files.push((
                format!("{knots:?} knots that claim {decoded_bytes} bytes"),
                table_of_grid(knots, empty(), chunk),
            ));
        }
    }
    let longer = Chunk {
        decoded_bytes: 3,
        ..stored(vec![b'#'; 1 << 20])
    };
    let shorter = Chunk {
        decoded_bytes: MAX_DECODED_BYTES,
        ..stored(vec![b'#'; 64])
    };
    for (name, chunk) in [
        ("stored more than decoded", longer),
        ("stored less than decoded", shorter),
    ] {
        files.push((format!("metadata: {name}"), table_of_tilt(chunk.clone())));
        let table = table_of_grid(SMALL, empty(), chunk);
        files.push((format!("samples: {name}"), table));
    }
    files
}

/// Frames of zstd that decode to gigabytes, behind headers that claim little and much; and frames that do not, behind claims
/// that they do.
fn bombs() -> Vec<(String, Vec<u8>)> {
    const BLOCKS: usize = 1 << 15;
    let gigabytes = (BLOCKS as u64) << 17;
    let frames = [
        ("4 GiB, unrecorded", bomb(BLOCKS, None)),
        ("4 GiB, recorded", bomb(BLOCKS, Some(gigabytes))),
        ("4 GiB, recorded as 2 KiB", bomb(BLOCKS, Some(2048))),
        (
            "4 GiB in two frames",
            bomb(BLOCKS / 2, Some(gigabytes / 2)).repeat(2),
        ),
        (
            "128 KiB, recorded as the most",
            bomb(1, Some(MAX_DECODED_BYTES)),
        ),
        ("128 KiB, recorded as 4 GiB", bomb(1, Some(gigabytes))),
        ("128 KiB, unrecorded", bomb(1, None)),
    ];
    let mut files = Vec::new();
    for (name, frame) in frames {
        for decoded_bytes in [0, 16, 4 << 20, MAX_DECODED_BYTES, gigabytes, u64::MAX] {
            let chunk = Chunk {
                codec: ZSTD,
                decoded_bytes,
                stored: frame.clone(),
            };
            files.push((
                format!("metadata of {name}, {decoded_bytes} claimed"),
                table_of_tilt(chunk),
            ));
        }
        for knots in [SMALL, LARGEST] {
            for codec in [ZSTD, PLANES] {
                let chunk = Chunk {
                    codec,
                    decoded_bytes: grid_bytes(knots),
                    stored: frame.clone(),
                };
                files.push((
                    format!("samples of {name}, {knots:?} knots, codec {codec}"),
                    table_of_grid(knots, empty(), chunk),
                ));
            }
        }
    }
    files
}

/// As many threads as a table has, of as many parts as they have: ten megabytes of header.
pub(crate) fn full_header() -> Vec<u8> {
    const THREADS: usize = 64;
    const PARTS: usize = 4096;
    let weight = 0.5 / PARTS as f64;
    let place = |k: usize| 3.0 * k as f64 / PARTS as f64 - 1.5;
    let tilts: Vec<[f64; 2]> = (0..PARTS).map(|k| [place(k), weight]).collect();
    let segments: Vec<[f64; 3]> = (0..PARTS)
        .map(|k| [place(k), place(k) + 5e-4, weight])
        .collect();
    let thread = thread(1.0 / THREADS as f64, &tilts, &segments, &one_node());
    file(&vec![thread; THREADS], &[empty()])
}
