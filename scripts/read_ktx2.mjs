// Reads the KTX2 files of scripts/readers.sh with ktx-parse.
import { readFileSync } from 'node:fs';
import assert from 'node:assert/strict';
import { read, VK_FORMAT_R16G16B16A16_SFLOAT, VK_FORMAT_E5B9G9R9_UFLOAT_PACK32, VK_FORMAT_BC6H_UFLOAT_BLOCK } from 'ktx-parse';

const folder = process.argv[2];
const raw = readFileSync(`${folder}/volume.bin`);
for (const [name, format, scheme, blockBytes] of [
    ['plain', VK_FORMAT_R16G16B16A16_SFLOAT, 0, 8],
    ['small', VK_FORMAT_R16G16B16A16_SFLOAT, 2, 8],
    ['rgb9e5', VK_FORMAT_E5B9G9R9_UFLOAT_PACK32, 2, 4],
    ['bc6h', VK_FORMAT_BC6H_UFLOAT_BLOCK, 2, 16],
]) {
    const file = read(readFileSync(`${folder}/${name}.ktx2`));
    const note = JSON.parse(Buffer.from(file.keyValue.sateen).toString().replace(/\0$/, ''));
    const size = [file.pixelWidth, file.pixelHeight, file.pixelDepth];
    assert.equal(file.vkFormat, format);
    assert.equal(file.supercompressionScheme, scheme);
    assert.deepEqual(size, note.size);
    assert.equal(file.levels.length, 1);
    assert.equal(file.dataFormatDescriptor[0].bytesPlane[0], blockBytes);
    const [width, height, depth] = size;
    const texelsPerBlock = name === 'bc6h' ? 16 : 1;
    assert.equal(file.levels[0].uncompressedByteLength, width * height * depth * blockBytes / texelsPerBlock);
    assert.equal(file.keyValue.KTXorientation, 'rdi');
    assert.ok(note.parameters.flat().every(Number.isFinite));
    if (scheme === 0) assert.ok(raw.equals(file.levels[0].levelData));
    console.log(`ktx-parse: ${name}.ktx2 is ${size.join(' × ')}, ${note.parameters.length} parameters, by ${file.keyValue.KTXwriter}`);
}
