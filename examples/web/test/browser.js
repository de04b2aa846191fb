// What the tests share: the browser, the tool and pictures.

import { spawnSync } from 'node:child_process';
import { existsSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

import { chromium } from 'playwright-core';
import { PNG } from 'pngjs';

import { serve } from '../serve.js';

export const WEB = join(dirname(fileURLToPath(import.meta.url)), '..');
const ROOT = join(WEB, '../..');

/** Mesa's software renderer: that of Chromium itself, SwiftShader, takes minutes to compile what llvmpipe does in a second. */
const FLAGS = [
  '--no-sandbox',
  '--disable-quic',
  '--no-first-run',
  '--disable-background-networking',
  '--disable-component-update',
  '--disable-sync',
  '--use-angle=gl-egl',
  '--ignore-gpu-blocklist',
];

const isStrict = process.env.SATEEN_REQUIRE_ALL === '1';

/** What `node:test` takes as `skip`: why, or false; with SATEEN_REQUIRE_ALL=1 nothing is skipped. */
export function unless(isThere, what) {
  if (isThere || isStrict) {
    return false;
  }
  console.error(`SKIPPED: ${what} (SATEEN_REQUIRE_ALL=1 makes that an error)`);
  return what;
}

export const CHROMIUM = process.env.CHROMIUM ?? '/usr/bin/chromium';
export const skipBrowser = unless(existsSync(CHROMIUM), `there is no ${CHROMIUM}: apt-get install chromium`);

const target = process.env.CARGO_TARGET_DIR ?? join(ROOT, 'target');
export const TOOL = process.env.SATEEN ?? [join(target, 'release/sateen'), join(target, 'debug/sateen')].find(existsSync);
export const skipTool = skipBrowser || unless(TOOL !== undefined, 'there is no sateen: cargo build --release, or SATEEN=PATH');
const verbs = TOOL ? spawnSync(TOOL, ['--help'], { encoding: 'utf8' }).stdout : '';
export const skipExport = skipTool || unless(/^\s*export\b/m.test(verbs), 'this sateen does not export');

/** What the tool prints. */
export function sateen(...args) {
  const { status, stdout, stderr } = spawnSync(TOOL, ['--quiet', ...args], { encoding: 'utf8' });
  if (status !== 0) {
    throw new Error(`sateen ${args.join(' ')}: ${stderr}`);
  }
  return stdout;
}

/** A browser and the page's address. */
export async function open() {
  const server = await serve(0);
  const browser = await chromium.launch({ executablePath: CHROMIUM, args: FLAGS });
  const close = async () => {
    await browser.close();
    server.close();
  };
  return { browser, address: `http://localhost:${server.address().port}/`, close };
}

/** The page at some of its addresses, when it has drawn. What goes wrong in it is an error here. */
export async function show(context, address, query) {
  const page = await context.newPage();
  // Machines that build something else meanwhile are slow.
  page.setDefaultTimeout(120_000);
  page.faults = [];
  page.on('pageerror', (error) => page.faults.push(error.message));
  page.on('console', (message) => message.type() === 'error' && page.faults.push(message.text()));
  await page.goto(`${address}?${query}`);
  await drawn(page);
  return page;
}

export function drawn(page) {
  return page.waitForFunction(() => document.body.dataset.firstFrame !== undefined, null, { timeout: 120_000 });
}

/** Waits until what was asked for has been drawn, given how many frames there were before. */
export function drawnSince(page, frames) {
  return page.waitForFunction((frames) => Number(document.body.dataset.frames) > frames, frames, { timeout: 120_000 });
}

/** Waits until the cloth of that file has been drawn. */
export function shown(page, name) {
  return page.waitForFunction((name) => document.body.dataset.shown === name, name, { timeout: 120_000 });
}

export function frames(page) {
  return page.evaluate(() => Number(document.body.dataset.frames));
}

export async function picture(page) {
  return PNG.sync.read(await page.locator('canvas').screenshot());
}

/**
 * How far a picture of the page is from one of `sateen render`, in 255ths: the mean over all pixels, the mean and the most over those that
 * cloth covers wholly with all their neighbours, and how many of these are more than 8 apart.
 */
export function compare(seen, rendered) {
  if (seen.width !== rendered.width || seen.height !== rendered.height) {
    throw new Error(`${seen.width} × ${seen.height} against ${rendered.width} × ${rendered.height} pixels`);
  }
  let [all, inner, covered, most, far] = [0, 0, 0, 0, 0];
  const { width, height } = seen;
  const pixels = width * height;
  const alphaAt = (x, y) => rendered.data[4 * (y * width + x) + 3];
  const isInner = (k) => {
    const [x, y] = [k % width, Math.floor(k / width)];
    for (let v = Math.max(y - 1, 0); v <= Math.min(y + 1, height - 1); v++) {
      for (let u = Math.max(x - 1, 0); u <= Math.min(x + 1, width - 1); u++) {
        if (alphaAt(u, v) < 255) {
          return false;
        }
      }
    }
    return true;
  };
  for (let k = 0; k < pixels; k++) {
    const alpha = rendered.data[4 * k + 3];
    let [largest, sum] = [0, 0];
    for (let channel = 0; channel < 3; channel++) {
      // The page is black behind the cloth.
      const difference = Math.abs(seen.data[4 * k + channel] - (rendered.data[4 * k + channel] * alpha) / 255);
      all += difference / (3 * pixels);
      sum += difference;
      largest = Math.max(largest, difference);
    }
    if (isInner(k)) {
      covered++;
      inner += sum / 3;
      most = Math.max(most, largest);
      far += largest > 8 ? 1 : 0;
    }
  }
  return { all, inner: inner / covered, most, far, covered };
}
