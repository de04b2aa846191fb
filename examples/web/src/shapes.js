// What the cloth lies on: position, normal and warp of every vertex, as src/render has them, so that pictures can be compared. The camera
// looks along −z, half the height of its picture is 1.

import { BufferAttribute, BufferGeometry } from 'three';

/** By name: the geometry, and half the width and height of its picture. */
export const SHAPES = {
  sphere: { make: sphere, half: [1, 1] },
  cylinders: { make: cylinders, half: [2, 1] },
  curtain: { make: curtain, half: [1, 1] },
};

/** Rows × columns cells of a sheet; `at` gives { position, normal, warp } for shares of both. */
function sheet(rows, columns, at) {
  const vertices = [];
  for (let row = 0; row <= rows; row++) {
    for (let column = 0; column <= columns; column++) {
      vertices.push(at(row / rows, column / columns));
    }
  }
  const indices = [];
  for (let row = 0; row < rows; row++) {
    for (let column = 0; column < columns; column++) {
      const a = row * (columns + 1) + column;
      const c = a + columns + 1;
      indices.push(a, c, a + 1, a + 1, c, c + 1);
    }
  }
  return { vertices, indices };
}

function geometryOf(...sheets) {
  const geometry = new BufferGeometry();
  const vertices = sheets.flatMap((sheet) => sheet.vertices);
  for (const [name, key] of [['position', 'position'], ['normal', 'normal'], ['warp', 'warp']]) {
    const numbers = Float32Array.from(vertices.flatMap((vertex) => vertex[key]));
    geometry.setAttribute(name, new BufferAttribute(numbers, 3));
  }
  let before = 0;
  const indices = sheets.flatMap((sheet) => {
    const start = before;
    before += sheet.vertices.length;
    return sheet.indices.map((index) => index + start);
  });
  geometry.setIndex(indices);
  return geometry;
}

/** The warp points right at the pole that faces +z, and is carried from there along great circles (src/render/shape.rs). */
function sphere() {
  const RADIUS = 0.96;
  return geometryOf(
    sheet(64, 96, (u, v) => {
      const [theta, phi] = [Math.PI * u, 2 * Math.PI * v];
      const [sin, cos] = [Math.sin(theta), Math.cos(theta)];
      const [c, s] = [Math.cos(phi), Math.sin(phi)];
      const normal = [sin * c, sin * s, cos];
      const warp = [1 - (1 - cos) * c * c, -(1 - cos) * c * s, -sin * c];
      return { position: normal.map((x) => RADIUS * x), normal, warp };
    }),
  );
}

/** Three tubes, the warp along the axis, around, and rising at 45° to the right. */
function cylinders() {
  const [RADIUS, SPACING] = [0.6, 4 / 3];
  const turns = [Math.PI / 2, 0, Math.PI / 4];
  return geometryOf(
    ...turns.map((turn, index) =>
      sheet(1, 128, (u, v) => {
        const angle = Math.PI * (2 * v - 1);
        const [sin, cos] = [Math.sin(angle), Math.cos(angle)];
        const [around, up] = [Math.cos(turn), Math.sin(turn)];
        return {
          position: [SPACING * (index - 1) + RADIUS * sin, 1 - 2 * u, RADIUS * cos],
          normal: [sin, 0, cos],
          warp: [around * cos, up, -around * sin],
        };
      }),
    ),
  );
}

/** Pleated cloth whose warp hangs down, seen a little from above (src/render/drape.rs). */
function curtain() {
  const [PLEATS, DEPTH, HEIGHT, FROM_ABOVE, MARGIN, STEPS] = [7, 0.0162, 0.9, 0.12, 0.96, 4000];
  const TURN = 2 * Math.PI;
  const theta = (s, v) => TURN * PLEATS * (s + 0.04 * Math.sin(TURN * 1.5 * s + 0.7 * v));
  const z = (s, v) => DEPTH * (1 - 0.25 * v) * Math.cos(theta(s, v));
  // Across, the cloth does not stretch: x is what is left of its length.
  const [rail, hem] = [0, 1].map((v) => {
    const sums = [0];
    for (let k = 0; k < STEPS; k++) {
      const slope = (z((k + 1) / STEPS, v) - z(k / STEPS, v)) * STEPS;
      sums.push(sums[k] + Math.sqrt(Math.max(1 - slope * slope, 0)) / STEPS);
    }
    return (s) => {
      const at = Math.min(Math.max(s * STEPS, 0), STEPS - 1e-9);
      const k = Math.floor(at);
      return sums[k] + (sums[k + 1] - sums[k]) * (at - k) - 0.5 * sums[STEPS];
    };
  });
  const at = (u, s) => [rail(s) + (hem(s) - rail(s)) * u, -HEIGHT * u, z(s, u)];
  const [sin, cos] = [Math.sin(FROM_ABOVE), Math.cos(FROM_ABOVE)];
  const tilted = ([x, y, z]) => [x, cos * y - sin * z, sin * y + cos * z];
  const slope = (a, b) => tilted(b.map((x, k) => (x - a[k]) / 1e-4));
  const cloth = sheet(40, 320, (u, s) => {
    const warp = slope(at(u - 5e-5, s), at(u + 5e-5, s));
    const weft = slope(at(u, s - 5e-5), at(u, s + 5e-5));
    return { position: tilted(at(u, s)), normal: unit(cross(warp, weft)), warp };
  });
  const range = [0, 1, 2].map((k) => {
    const all = cloth.vertices.map(({ position }) => position[k]);
    return [all.reduce((a, b) => Math.min(a, b)), all.reduce((a, b) => Math.max(a, b))];
  });
  const scale = MARGIN * Math.min(...range.slice(0, 2).map(([low, high]) => 2 / (high - low)));
  for (const vertex of cloth.vertices) {
    vertex.position = vertex.position.map((x, k) => scale * (x - 0.5 * (range[k][0] + range[k][1])));
  }
  return geometryOf(cloth);
}

function cross([a, b, c], [d, e, f]) {
  return [b * f - c * e, c * d - a * f, a * e - b * d];
}

function unit(v) {
  const length = Math.hypot(...v);
  return v.map((x) => x / length);
}
