// Reads KTX2 files that `sateen export` wrote: a volume of RGBA16F, and the parameters as JSON under the key `sateen`.

import { KHR_SUPERCOMPRESSION_NONE, KHR_SUPERCOMPRESSION_ZSTD, read, VK_FORMAT_R16G16B16A16_SFLOAT } from 'ktx-parse';
import { ZSTDDecoder } from 'zstddec';

import { FileError } from './sateen.js';

const MAGIC = [0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a];

export function isKtx2(bytes) {
  return MAGIC.every((byte, k) => bytes[k] === byte);
}

/** { size, texels, parameters, names }. Throws FileError. */
export async function readKtx2(bytes) {
  const file = read(bytes);
  const text = file.keyValue.sateen;
  if (text === undefined) {
    throw new FileError('it is a KTX2 texture, but not one that `sateen export` wrote');
  }
  // Values end in a zero, which ktx-parse takes off those keys that it knows alone.
  const json = typeof text === 'string' ? text : new TextDecoder().decode(text);
  const said = JSON.parse(json.replace(/\0$/, ''));
  if (file.vkFormat !== VK_FORMAT_R16G16B16A16_SFLOAT || said.layout !== 'volume') {
    throw new FileError(`its texels are ${said.pixels}; this page takes those of \`sateen export --format ktx2\``);
  }
  const size = [file.pixelWidth, file.pixelHeight, file.pixelDepth];
  const count = 4 * size[0] * size[1] * size[2];
  const [level] = file.levels;
  let data = level.levelData;
  if (file.supercompressionScheme === KHR_SUPERCOMPRESSION_ZSTD) {
    const decoder = new ZSTDDecoder();
    await decoder.init();
    data = decoder.decode(data, level.uncompressedByteLength);
  } else if (file.supercompressionScheme !== KHR_SUPERCOMPRESSION_NONE) {
    throw new FileError('it is compressed in another way than by zstd');
  }
  if (data.length !== 2 * count) {
    throw new FileError('it is not complete');
  }
  // A copy begins where an array of 16 bits can.
  const texels = new Uint16Array(data.slice().buffer);
  const names = said.threads.map((thread) => thread.name);
  return { size, texels, parameters: Float32Array.from(said.parameters.flat()), names };
}
