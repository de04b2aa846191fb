// The array of float4 that lookup.glsl reads besides the volume: src/shader/mod.rs has its layout.

import { arcsOf } from './sateen.js';

const HEADER = 2;
const THREAD = 7;

/** The parameters of a table (sateen.js) and its volume (volume.js). */
export function parametersOf(table, volume) {
  const array = [
    [table.gap, table.sigmaU, table.rhoScale, table.both ? 1 : 0],
    [...volume.size, table.threads.length],
  ];
  array.length = HEADER + THREAD * table.threads.length;
  const grids = volume.grids.values();
  table.threads.forEach((thread, index) => {
    const record = threadRecord(thread, grids, array);
    array.splice(HEADER + THREAD * index, THREAD, ...record);
  });
  return Float32Array.from(array.flat());
}

function threadRecord(thread, grids, array) {
  const { direction, coverage, albedo, kind, nodes, segments, gammaS, gammaV } = thread;
  const tilts = push(array, thread.tilts.map(([angle, weight]) => [Math.cos(angle), Math.sin(angle), weight, angle]));
  const arcs = pushArcs(array, arcsOf(segments));
  const record = [
    [exact(Math.cos(direction)), exact(Math.sin(direction)), coverage, kind],
    [...albedo, 0],
    // (η − 1)(η + 1) keeps the digits of an η near 1.
    [(thread.eta - 1) * (thread.eta + 1), thread.kd, gammaS, gammaV],
    [...tilts, ...arcs],
    [0, 0, 0, 0],
    [0, 0, 0, 0],
    [0, 0, 0, 0],
  ];
  if (nodes.length > 0) {
    const whole = pushArcs(array, segments.map(([from, to, weight]) => [from, to, weight / (to - from)]));
    record[4] = [...whole, ...push(array, nodes.map(([node, weight]) => [node, weight, 0, 0]))];
    // src/brdf/placed.rs
    const narrower = Math.min(gammaS, gammaV);
    const widest = Math.max(...segments.map(([from, to]) => to - from));
    const flags = [widest > 200 * narrower, gammaS > 8 * narrower, gammaV > 8 * narrower];
    record[5] = [0.5 * (3 + 0.5 * nodes.length), ...flags.map(Number)];
  }
  thread.grids.forEach((_, k) => {
    record[6][k] = pushGrid(array, grids.next().value);
  });
  return record;
}

/** Warp and weft are exact. */
function exact(x) {
  return Math.abs(x) < 1e-15 ? 0 : x;
}

/** Where they begin, and how many there are. */
function push(array, entries) {
  array.push(...entries);
  return [array.length - entries.length, entries.length];
}

function pushArcs(array, arcs) {
  const entries = arcs.flatMap(([from, to, density]) => [
    [Math.cos(from), Math.sin(from), Math.cos(to), Math.sin(to)],
    [Math.tan(0.5 * (to - from)), density, from, to],
  ]);
  const [start, count] = push(array, entries);
  return [start, count / 2];
}

function pushGrid(array, { grid, nodes, scale, firstSlab }) {
  const axes = nodes.map((axis) => pushWarp(array, axis));
  axes[3][3] = grid.rim;
  const head = [
    [grid.chart, Number(grid.endsFold), Number(grid.sidesFold), firstSlab],
    [...scale, nodes[2].places.length, nodes[3].places.length],
  ];
  return push(array, [...head, ...axes])[0];
}

/** What turns u into the number of a node: a + b u in each of 2^depth pieces. */
function pushWarp(array, { depth, places }) {
  const unit = 2 ** depth;
  const last = places.length - 1;
  const pieces = [];
  let node = 0;
  for (let piece = 0; piece < unit; piece++) {
    while (node < last && places[node + 1] <= piece) {
      node++;
    }
    const width = places[node + 1] - places[node];
    const isOutside = piece < places[0] || node === last;
    pieces.push(isOutside ? [node, 0] : [node - places[node] / width, unit / width]);
  }
  const two = [];
  for (let k = 0; k < pieces.length; k += 2) {
    two.push([...pieces[k], ...pieces[Math.min(k + 1, pieces.length - 1)]]);
  }
  return [push(array, two)[0], pieces.length, last, 0];
}
