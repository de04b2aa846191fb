// A table's grids as one 3D texture of half floats: src/volume/mod.rs says what is where.
//
// `sateen export` plans nodes by the error of pairs of directions. Here they are planned by that of points of the box, which needs none
// of the models, at some more error for the same bytes.

const DEPTHS = [9, 7, 7, 7];
const MAX_SIDE = 2048;
const TEXEL_BYTES = 8;
/** How many halvings ahead a gain is looked for: half of a lobe within a cell gains nothing yet. */
const LOOK_AHEAD = 3;
/** Points that lines are drawn through. */
const POINTS = 192;
/** Errors are relative to a value and this share of the mean. */
const FLOOR = 0.05;
/** Added by one step along an axis that all grids share, so that a mirrored one can take it. */
const SHARED_STEP = 2;

/**
 * The volume of a table's grids: { size, texels, grids: [{ grid, nodes, scale, firstSlab }] }, as many bytes as allowed at most,
 * fewer where straight lines err less than `targetError` on average.
 */
export function volumeOf(grids, maxBytes = 8 << 20, targetError = 1e-3) {
  if (grids.length === 0) {
    return { size: [1, 1, 1], texels: new Uint16Array(4), grids: [] };
  }
  const planned = plan(grids, maxBytes, targetError);
  const count = (axes, k) => axes[k].places.length;
  const most = (k) => Math.max(...planned.map((axes) => count(axes, k)));
  const slabs = planned.map((axes) => count(axes, 2) * Math.max(count(axes, 3) - 1, 1));
  const size = [most(0), most(1), slabs.reduce((a, b) => a + b)];
  const texels = new Uint16Array(4 * size[0] * size[1] * size[2]);
  let firstSlab = 0;
  const placed = grids.map((grid, k) => {
    const slice = 4 * size[0] * size[1];
    const part = texels.subarray(slice * firstSlab, slice * (firstSlab + slabs[k]));
    const of = { grid, nodes: planned[k], scale: fill(grid, planned[k], size, part), firstSlab };
    firstSlab += slabs[k];
    return of;
  });
  return { size, texels, grids: placed };
}

// ---- Nodes

function plan(grids, maxBytes, targetError) {
  const ladders = grids.map((grid) => grid.axes.map((_, axis) => new Ladder(grid, axis)));
  const most = (axis) => Math.max(...ladders.map((axes) => axes[axis].places.length));
  const slabsOf = (axes) => axes[2].places.length * Math.max(axes[3].places.length - 1, 1);
  const error = () => ladders.flat().reduce((sum, ladder) => sum + ladder.error(), 0);
  for (;;) {
    const depth = ladders.reduce((sum, axes) => sum + slabsOf(axes), 0);
    const bytes = TEXEL_BYTES * most(0) * most(1) * depth;
    if (error() < targetError) {
      break;
    }
    let best = null;
    const consider = (gain, cost, slabs, halve) => {
      const fits = bytes * (1 + cost) <= maxBytes && slabs <= MAX_SIDE;
      if (fits && gain > 0 && (best === null || gain / cost > best.value)) {
        best = { value: gain / cost, halve };
      }
    };
    for (const axis of [0, 1]) {
      const count = most(axis) + SHARED_STEP;
      if (count <= MAX_SIDE) {
        const gain = ladders.reduce((sum, axes) => sum + axes[axis].best().rating * (count - axes[axis].places.length), 0);
        const halve = () => {
          for (const axes of ladders) {
            const ladder = axes[axis];
            while (ladder.places.length + ladder.step <= count && ladder.halve()) {
              // Until it is as fine as the others.
            }
          }
        };
        consider(gain, SHARED_STEP / most(axis), depth, halve);
      }
    }
    for (const axes of ladders) {
      for (const axis of [2, 3]) {
        const ladder = axes[axis];
        const others = slabsOf(axes) / Math.max(ladder.places.length - (axis - 2), 1);
        const slabs = ladder.step * others;
        consider(ladder.best().rating * ladder.step, slabs / depth, depth + slabs, () => ladder.halve());
      }
    }
    if (best === null) {
      break;
    }
    best.halve();
  }
  return ladders.map((axes) => axes.map((ladder) => ladder.nodes()));
}

/** Nodes along an axis, which halves one cell after another, and lines along it by which it finds the best. */
class Ladder {
  constructor(grid, axis) {
    const { knots } = grid.axes[axis];
    this.depth = DEPTHS[axis];
    const unit = 2 ** this.depth;
    const first = Math.floor(knots[0] * unit);
    const last = Math.ceil(knots[knots.length - 1] * unit);
    const middle = unit / 2;
    this.places = [...new Set([first, middle, last])].filter((place) => place >= first && place <= last);
    if (knots.length === 1) {
      this.places = [first];
    }
    // Points u and 1 − u of a mirrored axis are one at a face of the box, where different nodes would be a seam.
    const isMirrored = grid.chart < 2 && ((axis === 1 && grid.endsFold) || (axis === 2 && grid.sidesFold));
    this.isMirrored = isMirrored && first + last === unit && this.places.length > 1;
    this.step = this.isMirrored ? 2 : 1;
    this.lines = this.places.length > 1 ? linesOf(grid, axis, unit) : [];
    this.cells = this.places.slice(1).map((_, k) => this.cell(k));
  }

  nodes() {
    let { depth, places } = this;
    if (places.length === 1) {
      return { depth: 0, places: [0] };
    }
    while (depth > 0 && places.every((place) => place % 2 === 0)) {
      depth--;
      places = places.map((place) => place / 2);
    }
    return { depth, places };
  }

  error() {
    return this.cells.reduce((sum, cell) => sum + cell.error, 0);
  }

  /** What halving the best cell gains per node, and which it is. */
  best() {
    const { cells, isMirrored } = this;
    const count = isMirrored ? cells.length / 2 : cells.length;
    let best = { rating: 0, cell: -1 };
    for (let cell = 0; cell < count; cell++) {
      const other = isMirrored ? cells.length - 1 - cell : cell;
      const rating = 0.5 * (cells[cell].rating + cells[other].rating);
      if (rating > best.rating) {
        best = { rating, cell };
      }
    }
    return best;
  }

  halve() {
    const { cell } = this.best();
    if (cell < 0) {
      return false;
    }
    if (this.isMirrored) {
      this.halveCell(this.cells.length - 1 - cell);
    }
    this.halveCell(cell);
    return true;
  }

  halveCell(k) {
    this.places.splice(k + 1, 0, (this.places[k] + this.places[k + 1]) / 2);
    this.cells.splice(k, 1, null, null);
    this.cells[k] = this.cell(k);
    this.cells[k + 1] = this.cell(k + 1);
  }

  cell(k) {
    const [from, to] = [this.places[k], this.places[k + 1]];
    const isLast = k + 2 === this.places.length;
    const lines = this.lines.filter((line) => line.at >= from && (line.at < to || isLast));
    const errorIn = (parts) => {
      const width = (to - from) / parts;
      let sum = 0;
      for (const line of lines) {
        const start = from + width * Math.min(Math.floor((line.at - from) / width), parts - 1);
        sum += errorOf(line, start, start + width);
      }
      return sum / this.lines.length;
    };
    const error = errorIn(1);
    let rating = 0;
    for (let parts = 2; parts <= 2 ** LOOK_AHEAD && (to - from) % parts === 0; parts *= 2) {
      rating = Math.max(rating, (error - errorIn(parts)) / (parts - 1));
    }
    return { error, rating };
  }
}

/** Lines along an axis through points of the box, with √S and √V at all places of the lattice. */
function linesOf(grid, axis, unit) {
  const lines = [];
  const others = [0, 1, 2, 3].filter((other) => other !== axis);
  const along = grid.axes[axis];
  const places = Array.from({ length: unit + 1 }, (_, k) => along.weights(k / unit));
  const strides = stridesOf(grid.axes);
  for (let index = 1; index <= POINTS; index++) {
    const u = grid.axes.map(({ knots }, k) => {
      const share = radicalInverse([2, 3, 5, 7][k], index);
      return knots[0] + (knots[knots.length - 1] - knots[0]) * share;
    });
    // The spline along the line.
    const row = new Float64Array(2 * along.length);
    const taps = others.map((other) => grid.axes[other].weights(u[other]));
    for (let a = 0; a < taps[0].weights.length; a++) {
      for (let b = 0; b < taps[1].weights.length; b++) {
        for (let c = 0; c < taps[2].weights.length; c++) {
          const weight = taps[0].weights[a] * taps[1].weights[b] * taps[2].weights[c];
          const start =
            (taps[0].first + a) * strides[others[0]] +
            (taps[1].first + b) * strides[others[1]] +
            (taps[2].first + c) * strides[others[2]];
          for (let k = 0; k < along.length; k++) {
            row[2 * k] += weight * grid.coefficients[start + k * strides[axis]];
            row[2 * k + 1] += weight * grid.coefficients[start + k * strides[axis] + 1];
          }
        }
      }
    }
    const at = ({ first, weights }, channel) => {
      let sum = 0;
      for (let tap = 0; tap < weights.length; tap++) {
        sum += weights[tap] * row[2 * (first + tap) + channel];
      }
      return Math.max(sum, 0);
    };
    const roots = new Float32Array(2 * places.length);
    for (let k = 0; k < places.length; k++) {
      roots[2 * k] = at(places[k], 0);
      roots[2 * k + 1] = at(places[k], 1);
    }
    const own = along.weights(u[axis]);
    lines.push({ at: u[axis] * unit, roots, truth: [at(own, 0) ** 2, at(own, 1) ** 2] });
  }
  const mean = [0, 1].map((channel) => lines.reduce((sum, line) => sum + line.truth[channel], 0) / POINTS);
  for (const line of lines) {
    line.over = line.truth.map((value, channel) => 0.5 / Math.max(value + FLOOR * mean[channel], 1e-30));
  }
  return lines;
}

/** What a straight line between two places errs at the point that a line goes through. Called a million times. */
function errorOf({ at, roots, truth, over }, from, to) {
  const t = (at - from) / (to - from);
  const s = (1 - t) * roots[2 * from] + t * roots[2 * to];
  const v = (1 - t) * roots[2 * from + 1] + t * roots[2 * to + 1];
  return over[0] * Math.abs(s * s - truth[0]) + over[1] * Math.abs(v * v - truth[1]);
}

function stridesOf(axes) {
  const strides = [2];
  for (let k = 0; k < 3; k++) {
    strides.push(strides[k] * axes[k].length);
  }
  return strides;
}

function radicalInverse(base, index) {
  let [sum, scale] = [0, 1];
  for (; index > 0; index = Math.floor(index / base)) {
    scale /= base;
    sum += scale * (index % base);
  }
  return sum;
}

// ---- Values

/** Writes the texels of a grid. Returns what 1 stands for in S and V. */
function fill(grid, nodes, [width, height], texels) {
  const rows = grid.axes.map((axis, k) => rowsOf(axis, nodes[k], grid.bends[k]));
  const [n0, n1, n2, n3] = rows.map((row) => row.length);
  const values = contract(grid.coefficients, grid.axes.map((axis) => axis.length), rows);
  const largest = [0, 0];
  for (let k = 0; k < values.length; k++) {
    values[k] = Math.max(values[k], 0);
    largest[k & 1] = Math.max(largest[k & 1], values[k]);
  }
  const over = largest.map((value) => (value > 0 ? 1 / value : 0));
  const halves = new Uint16Array(values.length);
  for (let k = 0; k < values.length; k++) {
    halves[k] = halfOf(values[k] * over[k & 1]);
  }
  let out = 0;
  for (let k = 0; k < Math.max(n3 - 1, 1); k++) {
    const next = Math.min(k + 1, n3 - 1);
    for (let c = 0; c < n2; c++) {
      for (let y = 0; y < height; y++) {
        const row = (d) => 2 * n0 * ((d * n2 + c) * n1 + Math.min(y, n1 - 1));
        const [here, there] = [row(k), row(next)];
        for (let x = 0; x < width; x++) {
          const at = 2 * Math.min(x, n0 - 1);
          texels[out++] = halves[here + at];
          texels[out++] = halves[here + at + 1];
          texels[out++] = halves[there + at];
          texels[out++] = halves[there + at + 1];
        }
      }
    }
  }
  return largest.map((value) => value * value);
}

/**
 * Of every node the first coefficient and the weights that make up its value. A function that bends one way lies on one side of the
 * chords between its values; nodes are moved by what it does on average beside them (src/volume/fill.rs), unless they are at an end or
 * where functions bend.
 */
function rowsOf(axis, { depth, places }, bends) {
  const at = places.map((place) => place / 2 ** depth);
  const isKink = (u) => u === 0.5 && bends;
  return at.map((u, k) => {
    const sums = new Map();
    const add = (u, share) => {
      const { first, weights } = axis.weights(u);
      weights.forEach((weight, tap) => sums.set(first + tap, (sums.get(first + tap) ?? 0) + share * weight));
    };
    add(u, 1);
    const isInner = k > 0 && k + 1 < at.length;
    if (isInner && !isKink(u)) {
      const all = at[k + 1] - at[k - 1];
      for (const [from, to] of [[at[k - 1], u], [u, at[k + 1]]]) {
        const share = ((2 / 3) * (to - from)) / all;
        add(from, -0.5 * share);
        add(to, -0.5 * share);
        add(0.5 * (from + to), share);
      }
    }
    const first = Math.min(...sums.keys());
    const weights = Array.from({ length: Math.max(...sums.keys()) + 1 - first }, (_, tap) => sums.get(first + tap) ?? 0);
    return { first, weights };
  });
}

/** Replaces coefficients by values, one axis after the other. */
function contract(coefficients, lengths, rows) {
  let values = coefficients;
  const counts = [...lengths];
  // Those first that have fewer nodes than coefficients: what is left for the others is less.
  for (const axis of [2, 1, 3, 0]) {
    const inner = 2 * counts.slice(0, axis).reduce((a, b) => a * b, 1);
    const outer = counts.slice(axis + 1).reduce((a, b) => a * b, 1);
    const next = new Float32Array(inner * rows[axis].length * outer);
    for (let o = 0; o < outer; o++) {
      rows[axis].forEach(({ first, weights }, row) => {
        const to = (o * rows[axis].length + row) * inner;
        for (let tap = 0; tap < weights.length; tap++) {
          const from = (o * counts[axis] + first + tap) * inner;
          const weight = weights[tap];
          for (let k = 0; k < inner; k++) {
            next[to + k] += weight * values[from + k];
          }
        }
      });
    }
    counts[axis] = rows[axis].length;
    values = next;
  }
  return values;
}

const FLOAT = new Float32Array(1);
const BITS = new Uint32Array(FLOAT.buffer);

/** The nearest half float of a number from 0 to 1. */
function halfOf(x) {
  FLOAT[0] = x;
  const bits = BITS[0];
  if (bits < 0x38800000) {
    return Math.round(x * 2 ** 24);
  }
  // To the nearest, to even if there are two.
  return (bits - 0x38000000 + 0x0fff + ((bits >>> 13) & 1)) >>> 13;
}
