// Reads .sateen files: src/table/FORMAT.md has every byte.

import { ZSTDDecoder } from 'zstddec';

/** What is wrong with a file, in words for whoever chose it. */
export class FileError extends Error {}

const MAGIC = [0x89, 0x53, 0x41, 0x54, 0x45, 0x45, 0x4e, 0x0a];
const VERSION = 3;
const MAX_DECODED_BYTES = 1 << 28;
/** Zeros behind the last chunk. */
const MARGIN = 64;
const HALF_PI = 0.5 * Math.PI;

export function isSateen(bytes) {
  return bytes.length >= 8 && MAGIC.every((byte, k) => bytes[k] === byte);
}

/**
 * The threads of a table, and of each the grids with all coefficients: { gap, sigmaU, rhoScale, both, threads, metadata }.
 * Throws FileError.
 */
export async function readSateen(bytes) {
  const header = new Reader(bytes);
  header.offset = 8;
  const version = header.u32();
  if (version !== VERSION) {
    throw new FileError(`it is of version ${version} of the format, and this page reads version ${VERSION}; bake the fabric anew`);
  }
  const length = header.u32();
  const crc = header.u32();
  if (length % 64 !== 0 || length < 64 || length > bytes.length) {
    throw new FileError('it is not complete');
  }
  if (crc32(bytes.subarray(20, length)) !== crc) {
    throw new FileError('its header is damaged');
  }
  header.end = length;
  const chunkCount = header.u32();
  const both = header.u8() === 1;
  header.offset += 3;
  const sigmaU = header.f32();
  const rhoScale = header.f32();
  const threads = [];
  for (let count = header.count(64); count > 0; count--) {
    threads.push(readThread(header));
  }
  const chunks = [];
  for (let k = 0; k < chunkCount; k++) {
    const [offset, stored, decoded] = [header.u64(), header.u64(), header.u64()];
    chunks.push({ offset, stored, decoded, crc: header.u32(), codec: header.u32() });
  }
  if (chunks.reduce((sum, chunk) => sum + chunk.decoded, 0) > MAX_DECODED_BYTES) {
    throw new FileError('it takes more memory than tables do');
  }
  const end = Math.max(...chunks.map((chunk) => chunk.offset + chunk.stored));
  if (bytes.length < end + MARGIN) {
    throw new FileError('it is not complete');
  }
  const decoder = new ZSTDDecoder();
  await decoder.init();
  const decode = (chunk, before) => {
    if (chunk === undefined) {
      throw new FileError('its header is damaged');
    }
    const stored = bytes.subarray(chunk.offset, chunk.offset + chunk.stored);
    if (crc32(stored) !== chunk.crc) {
      throw new FileError('it is damaged');
    }
    const decoded = chunk.codec === 0 ? stored.slice() : decoder.decode(stored, chunk.decoded);
    return chunk.codec === 2 ? joinPlanes(decoded, before) : decoded;
  };
  const grids = threads.flatMap((thread) => thread.grids);
  grids.forEach((grid, k) => {
    grid.coefficients = coefficients(grid, decode(chunks[k + 1], 2 * grid.channels));
  });
  const coverage = threads.reduce((sum, thread) => sum + thread.coverage, 0);
  const metadata = new TextDecoder().decode(decode(chunks[0], 0));
  return { gap: Math.max(1 - coverage, 0), sigmaU, rhoScale, both, threads, metadata };
}

function readThread(header) {
  const name = String.fromCharCode(...header.take(header.count(64)));
  header.align(4);
  const direction = header.f64();
  const coverage = header.f64();
  const albedo = [header.f64(), header.f64(), header.f64()];
  const [eta, kd, gammaS, gammaV] = [header.f64(), header.f64(), header.f64(), header.f64()];
  const rows = (numbers) => {
    const all = [];
    for (let count = header.count(4096); count > 0; count--) {
      all.push(Array.from({ length: numbers }, () => header.f64()));
    }
    return all;
  };
  const tilts = rows(2);
  const segments = rows(3);
  const code = header.u32();
  if (code > 4) {
    throw new FileError('its header is damaged');
  }
  // A grid with a rim is evaluated by nodes beyond: shaders take that for a grid.
  const rim = code === 4 ? 0.01 * header.u32() : 0;
  const kind = code === 4 ? 1 : code;
  const nodes = code === 2 || code === 4 ? rows(2) : [];
  const grids = [];
  for (let count = [0, 1, 0, 2][kind]; count > 0; count--) {
    grids.push(readGrid(header, rim));
  }
  return { name, direction, coverage, albedo, eta, kd, gammaS, gammaV, tilts, segments, kind, nodes, grids };
}

/** Which of S and V the channels of a grid are; of a grey thread S + A V is lit as S is. */
const CONTENTS = [[0, 1], [0], [1], [0]];

function readGrid(header, rim) {
  const chart = header.u8();
  const bits = header.u8();
  const zero = header.u8();
  const flags = header.u8();
  if (chart > 3 || zero !== 0 || flags > 7) {
    throw new FileError('its header is damaged');
  }
  if ((flags & 1) === 1) {
    throw new FileError('it was baked for a part of all pairs alone; make a texture of it with `sateen export`, and show that');
  }
  const scale = [header.f32(), header.f32()];
  const isThread = chart < 2;
  const sidesFold = (bits & 2) === 0;
  const axes = Array.from({ length: 4 }, () => {
    const count = header.u16();
    const depth = header.u8();
    const bends = header.u8() === 1;
    const knots = Array.from({ length: count }, () => header.u16());
    header.align(4);
    return new Axis(depth, knots, bends);
  });
  return {
    // As the parameters of shaders have them.
    chart,
    endsFold: isThread && (bits & 1) === 1,
    sidesFold: isThread ? sidesFold : chart === 3 && (bits & 1) === 1,
    rim,
    // Axes on which functions bend at ½.
    bends: isThread ? [true, true, true, !sidesFold] : [chart === 2, chart === 2, false, false],
    content: CONTENTS[flags >> 1],
    channels: CONTENTS[flags >> 1].length,
    scale,
    axes,
  };
}

/** Coefficients [u₃][u₂][u₁][u₀][S or V], times their scales, of tiles [u₃][u₂][u₁/2][u₀][channel][2]. */
function coefficients({ channels, content, scale, axes }, bytes) {
  const [n0, n1, n2, n3] = axes.map((axis) => axis.length);
  const tiles = Math.ceil(n1 / 2);
  if (bytes.length !== 4 * channels * n0 * tiles * n2 * n3) {
    throw new FileError('it is damaged');
  }
  const stored = new DataView(bytes.buffer, bytes.byteOffset, bytes.length);
  const numbers = new Float32Array(2 * n0 * n1 * n2 * n3);
  let out = 0;
  for (let plane = 0; plane < n2 * n3; plane++) {
    for (let row = 0; row < n1; row++) {
      const tile = 2 * channels * n0 * (tiles * plane + (row >> 1)) + (row & 1);
      for (let k = 0; k < n0; k++) {
        for (let channel = 0; channel < channels; channel++) {
          const c = stored.getInt16(2 * (tile + 2 * (channels * k + channel)), true);
          numbers[out + content[channel]] = (c / 32767) * scale[channel];
        }
        out += 2;
      }
    }
  }
  return numbers;
}

/** Quadratic splines between knots along one coordinate. */
class Axis {
  constructor(depth, knots, hasKink) {
    this.knots = knots.map((knot) => knot / 2 ** depth);
    const last = knots.length - 1;
    const middle = this.knots.indexOf(0.5);
    this.kink = hasKink && middle > 0 && middle < last ? middle : -1;
    this.length = last === 0 ? 1 : knots.length + 1 + (this.kink >= 0 ? 1 : 0);
  }

  /** The first coefficient that counts at u, and the weights from it on. */
  weights(u) {
    const { knots, kink } = this;
    const last = knots.length - 1;
    if (last === 0) {
      return { first: 0, weights: [1] };
    }
    let cell = 0;
    while (cell + 1 < last && knots[cell + 1] <= u) {
      cell++;
    }
    const width = (k) => knots[k + 1] - knots[k];
    const isEnd = (knot) => knot === 0 || knot === last || knot === kink;
    const h = width(cell);
    const before = isEnd(cell) ? 0 : width(cell - 1);
    const after = isEnd(cell + 1) ? 0 : width(cell + 1);
    const t = Math.min(Math.max((u - knots[cell]) / h, 0), 1);
    const falling = (h / (before + h)) * (1 - t) * (1 - t);
    const rising = (h / (h + after)) * t * t;
    const first = cell + (kink >= 0 && cell >= kink ? 1 : 0);
    return { first, weights: [falling, 1 - falling - rising, rising] };
  }
}

/** From planes of the bytes of differences, each to the number so many `before`, to numbers of two bytes. */
function joinPlanes(planes, before) {
  const count = planes.length / 2;
  const numbers = new Uint16Array(count);
  for (let i = 0; i < count; i++) {
    numbers[i] = planes[i] + 256 * planes[count + i] + (i < before ? 0 : numbers[i - before]);
  }
  const bytes = new DataView(new ArrayBuffer(planes.length));
  numbers.forEach((number, i) => bytes.setUint16(2 * i, number, true));
  return new Uint8Array(bytes.buffer);
}

class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.offset = 0;
    this.end = bytes.length;
  }

  #next(bytes) {
    const offset = this.offset;
    this.offset += bytes;
    if (this.offset > this.end) {
      throw new FileError('it is not complete');
    }
    return offset;
  }

  take(bytes) {
    const offset = this.#next(bytes);
    return this.bytes.subarray(offset, offset + bytes);
  }

  align(bytes) {
    this.offset = Math.ceil(this.offset / bytes) * bytes;
  }

  count(most) {
    const count = this.u32();
    if (count > most) {
      throw new FileError('its header is damaged');
    }
    return count;
  }

  u8() {
    return this.view.getUint8(this.#next(1));
  }
  u16() {
    return this.view.getUint16(this.#next(2), true);
  }
  u32() {
    return this.view.getUint32(this.#next(4), true);
  }
  u64() {
    return Number(this.view.getBigUint64(this.#next(8), true));
  }
  f32() {
    return this.view.getFloat32(this.#next(4), true);
  }
  f64() {
    return this.view.getFloat64(this.#next(8), true);
  }
}

const CRC_TABLE = Uint32Array.from({ length: 256 }, (_, byte) => {
  let crc = byte;
  for (let bit = 0; bit < 8; bit++) {
    crc = crc & 1 ? (crc >>> 1) ^ 0xedb88320 : crc >>> 1;
  }
  return crc;
});

function crc32(bytes) {
  let crc = ~0;
  for (const byte of bytes) {
    crc = CRC_TABLE[(crc ^ byte) & 255] ^ (crc >>> 8);
  }
  return ~crc >>> 0;
}

/** Ends and density of the parts of at most 90° that segments are made of. */
export function arcsOf(segments) {
  return segments.flatMap(([from, to, weight]) => {
    const parts = Math.max(Math.ceil((to - from) / HALF_PI), 1);
    const end = (k) => from + (to - from) * (k / parts);
    return Array.from({ length: parts }, (_, k) => [end(k), end(k + 1), weight / (to - from)]);
  });
}
