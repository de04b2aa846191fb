// Reads .sateen files: src/table/FORMAT.md has every byte.

import { ZSTDDecoder } from 'zstddec';

/** What is wrong with a file, in words for whoever chose it. */
export class FileError extends Error {}

const MAGIC = [0x89, 0x53, 0x41, 0x54, 0x45, 0x45, 0x4e, 0x0a];
const MAX_DECODED_BYTES = 1 << 28;
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
  const [major, minor] = [header.u16(), header.u16()];
  if (major !== 2 || minor > 5) {
    throw new FileError(`it is of version ${major}.${minor} of the format, and this page knows 2.0 to 2.5`);
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
  const rhoScale = minor >= 1 ? header.f32() : 1;
  const threads = [];
  for (let count = header.count(64); count > 0; count--) {
    threads.push(readThread(header, minor));
  }
  const chunks = [];
  for (let k = 0; k < chunkCount; k++) {
    const [offset, stored, decoded] = [header.u64(), header.u64(), header.u64()];
    chunks.push({ offset, stored, decoded, crc: header.u32(), codec: header.u32() });
  }
  if (chunks.reduce((sum, chunk) => sum + chunk.decoded, 0) > MAX_DECODED_BYTES) {
    throw new FileError('it takes more memory than tables do');
  }
  const decoder = new ZSTDDecoder();
  await decoder.init();
  const decode = (chunk, word, channels) => {
    if (chunk === undefined || chunk.offset + chunk.stored > bytes.length) {
      throw new FileError('it is not complete');
    }
    const stored = bytes.subarray(chunk.offset, chunk.offset + chunk.stored);
    if (crc32(stored) !== chunk.crc) {
      throw new FileError('it is damaged');
    }
    const decoded = chunk.codec === 0 ? stored.slice() : decoder.decode(stored, chunk.decoded);
    return chunk.codec === 2 ? joinPlanes(decoded, word, channels) : decoded;
  };
  const grids = threads.flatMap((thread) => thread.grids);
  grids.forEach((grid, k) => {
    grid.coefficients = coefficients(grid, decode(chunks[k + 1], grid.word, 2));
  });
  const coverage = threads.reduce((sum, thread) => sum + thread.coverage, 0);
  const metadata = new TextDecoder().decode(decode(chunks[0], 1, 1));
  return { gap: Math.max(1 - coverage, 0), sigmaU, rhoScale, both, threads, metadata };
}

function readThread(header, minor) {
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
  const kind = header.u32();
  const nodes = kind === 2 ? rows(2) : [];
  const grids = [];
  for (let count = [0, 1, 0, 2][kind] ?? 0; count > 0; count--) {
    grids.push(readGrid(header, minor));
  }
  return { name, direction, coverage, albedo, eta, kd, gammaS, gammaV, tilts, segments, kind, nodes, grids };
}

function readGrid(header, minor) {
  const chart = header.u8();
  const bits = header.u8();
  const encoding = header.u8();
  if (header.u8() !== 0) {
    throw new FileError('it was baked for a part of all pairs alone; make a texture of it with `sateen export`, and show that');
  }
  if (chart > 3 || encoding > 4) {
    throw new FileError('its header is damaged');
  }
  const scale = [header.f32(), header.f32()];
  const isThread = chart < 2;
  const sidesFold = (bits & 2) === 0;
  const bends = isThread ? [true, false, true, !sidesFold] : [chart === 2, false, false, false];
  const axes = bends.map((implied) => {
    const count = header.u16();
    const depth = header.u8();
    const flag = header.u8();
    const knots = Array.from({ length: count }, () => header.u16());
    header.align(4);
    return new Axis(depth, knots, minor >= 3 ? flag === 1 : implied);
  });
  return {
    // As the parameters of shaders have them.
    chart,
    endsFold: isThread && (bits & 1) === 1,
    sidesFold: isThread ? sidesFold : chart === 3 && (bits & 1) === 1,
    isRoot: encoding >= 2,
    encoding,
    word: [4, 2, 4, 2, 1][encoding],
    scale,
    axes,
  };
}

/** Coefficients [u₃][u₂][u₁][u₀][channel], times their scales. */
function coefficients(grid, bytes) {
  const { encoding, word, scale, axes } = grid;
  const count = 2 * axes.reduce((product, axis) => product * axis.length, 1);
  if (bytes.length !== count * word) {
    throw new FileError('it is damaged');
  }
  const Numbers = [Float32Array, Int16Array, Float32Array, Int16Array, Int8Array][encoding];
  const unit = [1, 32767, 1, 32767, 127][encoding];
  const stored = new Numbers(bytes.buffer, bytes.byteOffset, count);
  const numbers = new Float32Array(count);
  for (let k = 0; k < count; k++) {
    numbers[k] = (stored[k] * scale[k & 1]) / unit;
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

/** From planes of the bytes of differences to numbers. */
function joinPlanes(planes, word, channels) {
  const count = planes.length / word;
  const bytes = new Uint8Array(planes.length);
  const view = new DataView(bytes.buffer);
  const last = new Uint32Array(channels);
  const set = [null, view.setUint8, view.setUint16, null, view.setUint32][word].bind(view);
  for (let i = 0; i < count; i++) {
    let difference = 0;
    for (let k = word - 1; k >= 0; k--) {
      difference = difference * 256 + planes[k * count + i];
    }
    last[i % channels] += difference;
    set(i * word, last[i % channels], true);
  }
  return bytes;
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
