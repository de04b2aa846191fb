// The page in a headless browser: against pictures of `sateen render`, and what it does with files, keys and fingers.

import assert from 'node:assert/strict';
import { copyFileSync, existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { after, before, test } from 'node:test';

import { PNG } from 'pngjs';

import { compare, drawnSince, frames, open, picture, sateen, show, shown, skipBrowser, skipExport, skipTool, WEB } from './browser.js';

/** Mean difference over what cloth covers, in 255ths: rounding alone makes a quarter of one. */
const MEAN = 0.4;
/** Both take the middle of a pixel, but where light just grazes a few see it and do not. */
const FAR = 0.001;
/** What the eye sees of the differences, on average, edges and all. */
const FLIP = 0.015;

let viewer;
let context;
const folder = mkdtempSync(join(tmpdir(), 'sateen-viewer-'));

before(async () => {
  if (!skipBrowser) {
    viewer = await open();
    context = await viewer.browser.newContext({ viewport: { width: 700, height: 360 } });
  }
});
after(async () => {
  await viewer?.close();
  rmSync(folder, { recursive: true });
});

async function drop(page, name, bytes) {
  await page.evaluate(
    ({ name, bytes }) => {
      const data = new DataTransfer();
      data.items.add(new File([Uint8Array.from(bytes)], name));
      window.dispatchEvent(Object.assign(new Event('drop', { cancelable: true }), { dataTransfer: data }));
    },
    { name, bytes: [...bytes] },
  );
}

/** Asserts that the page shows what `sateen render` does. */
async function assertAsRendered(t, page, shape, table, ...args) {
  const [path, seenPath] = [join(folder, `${shape}.png`), join(folder, 'page.png')];
  sateen('render', shape, table, '--size', '256', '--samples', '1', ...args, '-o', path);
  const seen = await picture(page);
  writeFileSync(seenPath, PNG.sync.write(seen));
  const flip = JSON.parse(sateen('compare', seenPath, path, '--json')).flip.mean;
  const found = compare(seen, PNG.sync.read(readFileSync(path)));
  t.diagnostic(
    `mean ${found.inner.toFixed(3)} of 255, at most ${found.most}, ${found.far} of ${found.covered} pixels more than 8; FLIP ${flip.toFixed(4)}`,
  );
  assert.ok(flip < FLIP, `FLIP ${flip}`);
  assert.ok(found.inner < MEAN && found.all < 2 * MEAN, JSON.stringify(found));
  assert.ok(found.far <= FAR * found.covered, JSON.stringify(found));
  assert.deepEqual(page.faults, []);
  await page.close();
}

for (const [shape, table, light, args] of [
  ['sphere', 'denim', '30,0', ['--light-deg', '30']],
  ['sphere', 'felt', '-50,20', ['--light-deg', '-50', '--light-elevation-deg', '20']],
  ['cylinders', 'denim', 'camera', []],
]) {
  test(`${table} on ${shape} is what sateen renders`, { skip: skipTool }, async (t) => {
    const query = `plain&size=256&shape=${shape}&light=${light}&table=tables/${table}.sateen`;
    const page = await show(context, viewer.address, query);
    await assertAsRendered(t, page, shape, join(WEB, `tables/${table}.sateen`), ...args);
  });
}

test('direct integration is what sateen renders by the same rule', { skip: skipTool }, async (t) => {
  const page = await show(context, viewer.address, 'plain&size=256&mode=direct&samples=16&light=30,0');
  const table = join(WEB, 'tables/denim.sateen');
  await assertAsRendered(t, page, 'sphere', table, '--evaluator', 'midpoint:16', '--light-deg', '30');
});

test('a texture that sateen exports looks like its table', { skip: skipExport }, async (t) => {
  const table = join(WEB, 'tables/denim.sateen');
  const path = join(folder, 'denim.ktx2');
  sateen('export', table, '--format', 'ktx2', '--pairs', '64', '-o', path);
  const page = await show(context, viewer.address, 'plain&size=256&light=30,0&table=tables/felt.sateen');
  await drop(page, 'denim.ktx2', readFileSync(path));
  await shown(page, 'denim.ktx2');
  await assertAsRendered(t, page, 'sphere', table, '--light-deg', '30');
});

test('a standard table is shown soon', { skip: skipTool }, async (t) => {
  const table = standardTable();
  const page = await show(context, viewer.address, 'light=30,0');
  const first = await page.evaluate(() => document.body.dataset.firstFrame);
  t.diagnostic(`first frame of the page, draft table: ${first} ms after its address was asked for`);
  const start = performance.now();
  await page.setInputFiles('input[type=file]', table);
  await shown(page, basename(table));
  t.diagnostic(`standard table, from file to frame: ${Math.round(performance.now() - start)} ms`);
  assert.equal(await page.locator('#message').isVisible(), false);
  await page.close();
});

/** Baked once. */
function standardTable() {
  const cache = join(WEB, 'node_modules/.cache/sateen');
  const path = join(cache, 'denim-standard.sateen');
  if (!existsSync(path)) {
    mkdirSync(cache, { recursive: true });
    sateen('bake', 'denim', '-o', join(folder, 'denim-standard.sateen'));
    copyFileSync(join(folder, 'denim-standard.sateen'), path);
  }
  return path;
}

test('files that are none are told in words, and what was shown stays', { skip: skipBrowser }, async () => {
  const page = await show(context, viewer.address, 'light=30,0&table=tables/felt.sateen');
  const shown = await picture(page);
  const table = readFileSync(join(WEB, 'tables/denim.sateen'));
  const damaged = Uint8Array.from(table);
  damaged[damaged.length - 100] ^= 1;
  const newer = Uint8Array.from(table);
  newer[8] = 4;
  const ktx2 = Uint8Array.from([0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a, ...new Array(200).fill(7)]);
  for (const [name, bytes, words] of [
    ['photo.png', Uint8Array.from([1, 2, 3]), /photo\.png cannot be shown: it is neither a table/],
    ['empty.sateen', new Uint8Array(), /neither/],
    ['short.sateen', table.subarray(0, table.length / 2), /not complete/],
    ['stub.sateen', table.subarray(0, 30), /not complete/],
    ['bits.sateen', damaged, /damaged/],
    ['new.sateen', newer, /version 4 .* reads version 3/],
    ['stub.ktx2', ktx2, /stub\.ktx2 cannot be shown/],
  ]) {
    await drop(page, name, bytes);
    await page.waitForFunction((name) => document.getElementById('message').textContent.startsWith(name), name);
    const message = await page.locator('#message').innerText();
    assert.match(message, words);
    assert.ok(await page.locator('#message').isVisible());
  }
  assert.equal(compare(await picture(page), shown).most, 0);
  // A good one takes the message away.
  await drop(page, 'denim.sateen', table);
  await page.waitForFunction(() => document.body.dataset.state === 'ready');
  assert.equal(await page.locator('#message').isVisible(), false);
  assert.equal(await page.locator('select[name=table]').evaluate((list) => list.selectedOptions[0].text), 'denim.sateen');
  assert.deepEqual(page.faults, []);
  await page.close();
});

/** How much of the picture an action changes, in 255ths. */
async function changeBy(page, action) {
  const earlier = await picture(page);
  const count = await frames(page);
  await action();
  await drawnSince(page, count);
  return compare(await picture(page), earlier).all;
}

test('keys turn, light and switch', { skip: skipBrowser }, async () => {
  const page = await show(context, viewer.address, 'light=30,0&samples=4');
  const front = await picture(page);
  for (const key of ['ArrowLeft', 'ArrowUp', 'Shift+ArrowRight', '+', '2', '3', '1', 'x', 's', 'd', 't', 'c', 'c', 'r']) {
    assert.ok((await changeBy(page, () => page.keyboard.press(key))) > 0.02, key);
  }
  // All but the light, which is now 5° further.
  assert.equal(await page.locator('input[name=azimuth]').inputValue(), '35');
  await changeBy(page, () => page.keyboard.press('Shift+ArrowLeft'));
  assert.equal(compare(await picture(page), front).most, 0);
  assert.deepEqual(page.faults, []);
  await page.close();
});

test('albedos dye the cloth', { skip: skipBrowser }, async () => {
  const page = await show(context, viewer.address, 'light=30,0');
  const change = await changeBy(page, () => page.locator('.albedo input[type=color]').first().fill('#ff0000'));
  assert.ok(change > 0.1, `${change}`);
  await page.close();
});

test('table and direct integration are timed', { skip: skipBrowser }, async (t) => {
  const page = await show(context, viewer.address, 'plain&size=96&light=30,0&samples=8');
  await page.keyboard.press('m');
  const measured = page.locator('#measured');
  await page.waitForFunction(() => document.getElementById('measured').textContent.includes('times'), null, { timeout: 120_000 });
  t.diagnostic(await measured.textContent());
  assert.match(await measured.textContent(), /table [\d.]+ ms, direct integration with 8 midpoints [\d.]+ ms/);
  assert.match(await page.locator('#time').textContent(), /[\d.]+ ms, median of \d+/);
  await page.close();
});

test('fingers turn the cloth on a phone, where all is readable', { skip: skipBrowser }, async () => {
  const phone = await viewer.browser.newContext({ viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true });
  const page = await show(phone, viewer.address, 'light=30,0');
  const devtools = await phone.newCDPSession(page);
  const touch = (type, ...points) => devtools.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(([x, y]) => ({ x, y })) });
  const change = await changeBy(page, async () => {
    await touch('touchStart', [200, 200]);
    await touch('touchMove', [240, 220]);
    await touch('touchMove', [280, 230]);
    await touch('touchEnd');
  });
  assert.ok(change > 0.5, `${change}`);
  const width = await page.evaluate(() => document.documentElement.scrollWidth);
  assert.ok(width <= 390, `${width}`);
  const { height } = await page.locator('canvas').boundingBox();
  assert.ok(height > 300);
  assert.deepEqual(page.faults, []);
  await phone.close();
});

test('the least that it takes shows a cloth', { skip: skipBrowser }, async () => {
  const page = await show(context, `${viewer.address}minimal.html`, '');
  const { width, height, data } = await picture(page);
  const middle = 4 * (Math.floor(height / 2) * width + Math.floor(width / 2));
  assert.ok(data[middle] > 60 && data[middle] < 250, `${data[middle]}`);
  assert.equal(data[0], data[1]);
  assert.deepEqual(page.faults, []);
  await page.close();
});
