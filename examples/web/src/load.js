// From a file to what the shader takes, whichever of the two formats it has.

import { isKtx2, readKtx2 } from './ktx2.js';
import { parametersOf } from './parameters.js';
import { FileError, isSateen, readSateen } from './sateen.js';
import { volumeOf } from './volume.js';

export { FileError };

const HEADER = 2;
const THREAD = 7;

/**
 * { size, texels, parameters, threads }: the volume's sides and half floats, the array of float4, and of each thread its name, albedo and
 * where in the array that is. Throws FileError.
 */
export async function load(bytes) {
  try {
    return await cloth(bytes);
  } catch (error) {
    if (error instanceof FileError) {
      throw error;
    }
    // A damaged file may lead readers anywhere.
    throw new FileError(`it cannot be read (${error.message ?? error})`);
  }
}

async function cloth(bytes) {
  if (isSateen(bytes)) {
    const table = await readSateen(bytes);
    const volume = volumeOf(table.threads.flatMap((thread) => thread.grids));
    const names = table.threads.map((thread) => thread.name);
    return finished(volume.size, volume.texels, parametersOf(table, volume), names);
  }
  if (isKtx2(bytes)) {
    const { size, texels, parameters, names } = await readKtx2(bytes);
    return finished(size, texels, parameters, names);
  }
  throw new FileError('it is neither a table (.sateen) nor a texture of one (.ktx2)');
}

function finished(size, texels, parameters, names) {
  if (!parameters.every(Number.isFinite)) {
    throw new FileError('its parameters are damaged');
  }
  const threads = Array.from({ length: parameters[7] }, (_, index) => {
    const at = 4 * (HEADER + THREAD * index + 1);
    return { name: names[index] ?? `thread ${index + 1}`, at, albedo: [...parameters.subarray(at, at + 3)] };
  });
  return { size, texels, parameters, threads };
}
