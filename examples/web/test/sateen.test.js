// The readers alone, without a browser.

import assert from 'node:assert/strict';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';

import { FileError, load } from '../src/load.js';
import { sateen, skipExport, WEB } from './browser.js';

const folder = mkdtempSync(join(tmpdir(), 'sateen-viewer-'));
after(() => rmSync(folder, { recursive: true }));

const read = (path) => load(new Uint8Array(readFileSync(path)));

test('the tables of the page have threads with names and albedos', async () => {
  const denim = await read(join(WEB, 'tables/denim.sateen'));
  assert.deepEqual(denim.threads.map((thread) => thread.name), ['warp', 'weft']);
  assert.ok(Math.abs(denim.threads[0].albedo[2] - 0.07) < 1e-6);
  assert.equal(denim.texels.length, 4 * denim.size.reduce((a, b) => a * b));
  assert.ok(2 * denim.texels.length <= 8 << 20);
  const felt = await read(join(WEB, 'tables/felt.sateen'));
  assert.equal(felt.threads.length, 1);
});

test('a prefix of a table is none', async () => {
  const bytes = new Uint8Array(readFileSync(join(WEB, 'tables/felt.sateen')));
  for (let length = 0; length < bytes.length; length += 61) {
    await assert.rejects(load(bytes.subarray(0, length)), FileError, `${length}`);
  }
});

test('parameters are those that sateen exports', { skip: skipExport }, async () => {
  // One thread of each kind; the nodes of grids, and with them what comes behind, are planned in another way.
  for (const [fabric, whole] of [['tshirt-white', true], ['velvet', true], ['denim', false], ['felt', false]]) {
    const [table, texture] = [join(folder, `${fabric}.sateen`), join(folder, `${fabric}.ktx2`)];
    sateen('bake', fabric, '--preset', 'draft', '-o', table);
    sateen('export', table, '--format', 'ktx2', '--pairs', '64', '-o', texture);
    const [a, b] = [await read(table), await read(texture)];
    assert.deepEqual(a.threads.map((thread) => thread.name), b.threads.map((thread) => thread.name));
    const rows = whole ? a.parameters.length / 4 : 2 + 7 * a.threads.length;
    if (whole) {
      assert.equal(a.parameters.length, b.parameters.length);
    }
    for (let k = 0; k < 4 * rows; k++) {
      // Sizes of the volume, and where things are.
      const row = k >> 2;
      const isPlace = !whole && (row === 1 || (row >= 2 && (row - 2) % 7 >= 3 && (row - 2) % 7 !== 5));
      if (!isPlace) {
        assert.ok(Math.abs(a.parameters[k] - b.parameters[k]) <= 1e-6 * Math.max(1, Math.abs(b.parameters[k])), `${fabric}: ${row}`);
      }
    }
  }
});
