// The page: what its controls, keys and files do. The address sets any of it:
//
//     ?table=tables/denim.sateen&shape=sphere&mode=table&light=30,0&samples=50&factor=4&exposure=0
//     &plain&size=256      the picture alone, with that many rows, framed as `sateen render` frames it

import { Mesh, OrthographicCamera, Scene, Spherical, Vector3, WebGLRenderer } from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

import { FileError, load } from './load.js';
import { Cloth, MAX_LIGHTS, MODES } from './material.js';
import { SHAPES } from './shapes.js';
import { Timer } from './timer.js';

const RADIANS = Math.PI / 180;
/** Room around the shape, and how far away the camera is; neither matters to what cloth looks like. */
const MARGIN = 1.08;
const DISTANCE = 10;
/** What an arrow key turns, degrees. */
const STEP = 5;
const MAX_FILE_BYTES = 256 << 20;
const MEASURED = 15;
/** Those of `sateen render curtain`: directions and strengths. */
const THREE_LIGHTS = [
  [-0.48, 0.36, 0.8, 0.8],
  [0.936, 0, 0.352, 0.4],
  [0, 0.28, 0.96, 0.3],
];

const panel = document.getElementById('panel');
const canvas = document.getElementById('view');
const controlsOf = panel.elements;
const query = new URLSearchParams(location.search);
const isPlain = query.has('plain');
document.body.classList.toggle('plain', isPlain);

const say = (id, text) => {
  document.getElementById(id).textContent = text;
};

function complain(text) {
  const message = document.getElementById('message');
  message.hidden = text === '';
  message.textContent = text;
  document.body.dataset.state = text === '' ? 'ready' : 'error';
}

class Viewer {
  #renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
  #scene = new Scene();
  #camera = new OrthographicCamera(-1, 1, 1, -1, 0.1, 2 * DISTANCE);
  #mesh = new Mesh();
  #geometries = new Map();
  #orbit;
  #isAsked = false;
  #isMeasuring = false;
  #shown = null;

  constructor(lookup) {
    this.cloth = new Cloth(lookup);
    this.timer = new Timer(this.#renderer.getContext());
    this.#mesh.frustumCulled = false;
    this.#scene.add(this.#mesh);
    this.#camera.position.set(0, 0, DISTANCE);
    this.#orbit = new OrbitControls(this.#camera, canvas);
    this.#orbit.addEventListener('change', () => this.ask());
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }

  get limits() {
    const gl = this.#renderer.getContext();
    return { side: gl.getParameter(gl.MAX_3D_TEXTURE_SIZE) };
  }

  resize() {
    const { half } = SHAPES[controlsOf.shape.value];
    let { clientWidth: width, clientHeight: height } = canvas.parentElement;
    if (isPlain) {
      height = Number(query.get('size') ?? 256);
      width = (height * half[0]) / half[1];
    }
    const ratio = isPlain ? 1 : Math.min(window.devicePixelRatio, 2);
    this.#renderer.setPixelRatio(ratio);
    this.#renderer.setSize(width, height, isPlain);
    const scale = (isPlain ? 1 : MARGIN) * Math.max(half[0] / width, half[1] / height);
    const camera = this.#camera;
    [camera.right, camera.top] = [scale * width, scale * height];
    [camera.left, camera.bottom] = [-camera.right, -camera.top];
    camera.updateProjectionMatrix();
    this.cloth.uniforms.divider.value = 0.5 * width * ratio;
    this.timer.reset();
    this.ask();
  }

  /** Takes the controls' values. */
  update() {
    const shape = controlsOf.shape.value;
    if (!this.#geometries.has(shape)) {
      this.#geometries.set(shape, SHAPES[shape].make());
    }
    const mode = controlsOf.mode.value;
    const shown = `${shape} ${mode} ${controlsOf.samples.value} ${controlsOf.light.value}`;
    if (shown !== this.#shown) {
      this.#shown = shown;
      this.timer.reset();
    }
    this.#mesh.geometry = this.#geometries.get(shape);
    this.#mesh.material = this.#material(mode);
    const { uniforms } = this.cloth;
    uniforms.samples.value = Number(controlsOf.samples.value);
    uniforms.factor.value = 2 ** Number(controlsOf.factor.value);
    uniforms.exposure.value = 2 ** Number(controlsOf.exposure.value);
    document.getElementById('labels').hidden = mode !== 'split';
    this.ask();
  }

  #material(mode) {
    return this.cloth.material(mode, controlsOf.light.value === 'three' ? MAX_LIGHTS : 1);
  }

  #light() {
    const { uniforms } = this.cloth;
    const directions = uniforms.light_directions.value;
    // The camera is orthographic: the viewer is in the same direction everywhere.
    uniforms.viewer.value.copy(this.#camera.position).sub(this.#orbit.target).normalize();
    uniforms.light_strengths.value[0] = 1;
    if (controlsOf.light.value === 'camera') {
      directions[0].copy(uniforms.viewer.value);
    } else if (controlsOf.light.value === 'one') {
      const [azimuth, elevation] = [controlsOf.azimuth, controlsOf.elevation].map((input) => input.value * RADIANS);
      const level = Math.cos(elevation);
      directions[0].set(Math.sin(azimuth) * level, Math.sin(elevation), Math.cos(azimuth) * level);
    } else {
      THREE_LIGHTS.forEach(([x, y, z, strength], k) => {
        directions[k].set(x, y, z);
        uniforms.light_strengths.value[k] = strength;
      });
    }
  }

  /** Has the shader of what is to be shown compiled, beside what this page does meanwhile. */
  compile() {
    this.update();
    this.#renderer.compile(this.#scene, this.#camera);
  }

  draw() {
    this.#light();
    this.#renderer.render(this.#scene, this.#camera);
  }

  /** Draws before long, once however often it is asked. */
  ask() {
    if (this.#isAsked || this.#isMeasuring || !this.cloth.uniforms.volume.value) {
      return;
    }
    this.#isAsked = true;
    requestAnimationFrame(() => {
      this.#isAsked = false;
      this.timer.time(() => this.draw());
      if (document.body.dataset.firstFrame === undefined) {
        const gl = this.#renderer.getContext();
        gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
        document.body.dataset.firstFrame = Math.round(performance.now());
      }
      document.body.dataset.frames = Number(document.body.dataset.frames ?? 0) + 1;
      document.body.dataset.shown = this.cloth.name;
      this.#tell();
    });
  }

  #tell() {
    this.timer.poll();
    if (this.timer.isWaiting) {
      setTimeout(() => this.#tell(), 50);
    }
    if (this.timer.count > 0) {
      const { median, count, clock } = this.timer;
      say('time', `${median.toFixed(2)} ms, median of ${count} (${clock})`);
    }
  }

  turn(azimuth, elevation) {
    const offset = this.#camera.position.clone().sub(this.#orbit.target);
    const angles = new Spherical().setFromVector3(offset);
    angles.theta += azimuth * RADIANS;
    angles.phi -= elevation * RADIANS;
    angles.makeSafe();
    this.#camera.position.copy(this.#orbit.target).add(new Vector3().setFromSpherical(angles));
    this.#orbit.update();
    this.ask();
  }

  zoom(factor) {
    this.#camera.zoom = Math.min(Math.max(this.#camera.zoom * factor, 0.2), 50);
    this.#camera.updateProjectionMatrix();
    this.ask();
  }

  reset() {
    this.#camera.zoom = 1;
    this.#camera.position.set(0, 0, DISTANCE);
    this.#orbit.target.set(0, 0, 0);
    this.#camera.updateProjectionMatrix();
    this.#orbit.update();
    this.ask();
  }

  /** Times table and direct integration in turn, so that both see the same machine. */
  async measure() {
    if (this.#isMeasuring || !this.cloth.uniforms.volume.value) {
      return;
    }
    this.#isMeasuring = true;
    say('measured', 'measuring …');
    const gl = this.#renderer.getContext();
    const modes = ['table', 'direct'];
    const timers = modes.map(() => new Timer(gl));
    const frame = () => new Promise(requestAnimationFrame);
    for (let k = -1; k < MEASURED; k++) {
      await frame();
      modes.forEach((mode, index) => {
        this.#mesh.material = this.#material(mode);
        // The first ones compile.
        k < 0 ? this.draw() : timers[index].time(() => this.draw());
      });
      timers.forEach((timer) => timer.poll());
    }
    for (let wait = 0; wait < 100 && timers.some((timer) => timer.isWaiting); wait++) {
      await frame();
      timers.forEach((timer) => timer.poll());
    }
    const [table, direct] = timers.map((timer) => timer.median);
    const { samples } = controlsOf;
    say(
      'measured',
      `table ${table.toFixed(2)} ms, direct integration with ${samples.value} midpoints ${direct.toFixed(2)} ms: ${(direct / table).toFixed(1)} times (medians of ${MEASURED}, ${timers[0].clock})`,
    );
    this.#isMeasuring = false;
    this.update();
  }
}

/** Shows what is in a file, or says why not and goes on showing what was there. */
async function open(viewer, name, bytes) {
  try {
    const cloth = await load(bytes);
    const { side } = viewer.limits;
    if (cloth.size.some((length) => length > side)) {
      throw new FileError(`its texture is ${cloth.size.join(' × ')}, and this machine's are at most ${side} a side; export it smaller`);
    }
    viewer.cloth.set(name, cloth);
    viewer.timer.reset();
    describe(viewer, cloth);
    complain('');
    viewer.update();
    return true;
  } catch (error) {
    if (!(error instanceof FileError)) {
      throw error;
    }
    complain(`${name} cannot be shown: ${error.message}.`);
    return false;
  }
}

async function openAddress(viewer, address) {
  const response = await fetch(address);
  if (!response.ok) {
    complain(`${address} cannot be shown: the server does not have it.`);
    return false;
  }
  return open(viewer, address, new Uint8Array(await response.arrayBuffer()));
}

async function openFile(viewer, file) {
  if (file.size > MAX_FILE_BYTES) {
    complain(`${file.name} cannot be shown: it is larger than tables are.`);
    return;
  }
  if (await open(viewer, file.name, new Uint8Array(await file.arrayBuffer()))) {
    const own = controlsOf.table.querySelector('option[value=""]');
    own.hidden = false;
    own.textContent = file.name;
    controlsOf.table.value = '';
  }
}

function describe(viewer, cloth) {
  const fetches = cloth.threads.reduce((sum, { at }) => sum + [0, 1, 0, 2][cloth.parameters[at - 1]], 0);
  const bytes = 2 * cloth.texels.length;
  const size = bytes < 1 << 20 ? `${(bytes / 1024).toFixed(1)} KiB` : `${(bytes / (1 << 20)).toFixed(1)} MiB`;
  const texture = fetches > 0 ? `a texture of ${cloth.size.join(' × ')}, ${size}, and ` : 'no texture; ';
  say('facts', `${texture}${cloth.parameters.length / 4} parameters; ${fetches === 1 ? 'one fetch' : `${fetches || 'no'} fetches`} per lookup`);
  const rows = cloth.threads.map((thread) => albedoRow(viewer, thread));
  document.getElementById('albedos').replaceChildren(...rows);
}

const srgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
const linear = (x) => (x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);

/** A colour and what it is multiplied by; as read, until one of them is touched. */
function albedoRow(viewer, thread) {
  const scale = Math.max(...thread.albedo, 1e-6);
  const hex = thread.albedo.map((x) => Math.round(255 * srgb(x / scale)).toString(16).padStart(2, '0'));
  const row = document.createElement('label');
  row.className = 'albedo';
  const name = document.createElement('span');
  name.textContent = `Albedo of ${thread.name}`;
  const colour = Object.assign(document.createElement('input'), { type: 'color', value: `#${hex.join('')}` });
  const times = Object.assign(document.createElement('input'), { type: 'number', min: 0, max: 1000, step: 'any', value: Number(scale.toPrecision(3)) });
  times.ariaLabel = `what the colour of ${thread.name} is multiplied by`;
  const dye = () => {
    const channels = [1, 3, 5].map((k) => linear(parseInt(colour.value.slice(k, k + 2), 16) / 255));
    viewer.cloth.dye(thread, channels.map((channel) => channel * (Number(times.value) || 0)));
    viewer.ask();
  };
  colour.addEventListener('input', dye);
  times.addEventListener('input', dye);
  row.append(name, colour, times);
  return row;
}

function showValues() {
  const units = { samples: (x) => x, factor: (x) => 2 ** x, exposure: (x) => x, azimuth: (x) => `${x}°`, elevation: (x) => `${x}°` };
  for (const [name, text] of Object.entries(units)) {
    controlsOf[name].parentElement.querySelector('output').textContent = text(controlsOf[name].value);
  }
}

function moveLight(azimuth, elevation) {
  controlsOf.light.value = 'one';
  const turned = Number(controlsOf.azimuth.value) + azimuth;
  controlsOf.azimuth.value = ((turned + 540) % 360) - 180;
  controlsOf.elevation.value = Number(controlsOf.elevation.value) + elevation;
}

function onKey(viewer, event) {
  // Lists and fields have their own use of keys.
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches('input, select')) {
    return;
  }
  const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
  const shapes = Object.keys(SHAPES);
  const modes = { t: 'table', d: 'direct', x: 'difference', s: 'split' };
  const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  if (key in arrows) {
    const [x, y] = arrows[key].map((way) => way * STEP);
    event.shiftKey ? moveLight(x, y) : viewer.turn(x, y);
  } else if (shapes[key - 1]) {
    controlsOf.shape.value = shapes[key - 1];
    viewer.resize();
  } else if (key in modes) {
    controlsOf.mode.value = modes[key];
  } else if (key === 'c') {
    controlsOf.light.value = controlsOf.light.value === 'camera' ? 'one' : 'camera';
  } else if (key === 'r') {
    viewer.reset();
  } else if (key === 'm') {
    viewer.measure();
  } else if ('+=-_'.includes(key)) {
    viewer.zoom('+='.includes(key) ? 1.1 : 1 / 1.1);
  } else {
    return;
  }
  event.preventDefault();
  showValues();
  viewer.update();
}

/** Sets the controls as the address says. */
function takeAddress() {
  for (const name of ['table', 'shape', 'mode', 'samples', 'factor', 'exposure']) {
    if (query.has(name)) {
      controlsOf[name].value = query.get(name);
    }
  }
  if (!(controlsOf.shape.value in SHAPES) || !(controlsOf.mode.value in MODES)) {
    controlsOf.shape.value = 'sphere';
    controlsOf.mode.value = 'table';
  }
  const light = query.get('light');
  if (light === 'camera' || light === 'three') {
    controlsOf.light.value = light;
  } else if (light !== null) {
    [controlsOf.azimuth.value, controlsOf.elevation.value] = light.split(',');
  }
}

function listen(viewer) {
  panel.addEventListener('submit', (event) => event.preventDefault());
  panel.addEventListener('input', (event) => {
    const { name } = event.target;
    if (name === 'table') {
      openAddress(viewer, event.target.value);
    } else if (name === 'file' && event.target.files.length > 0) {
      openFile(viewer, event.target.files[0]);
    } else if (name === 'azimuth' || name === 'elevation') {
      controlsOf.light.value = 'one';
    }
    showValues();
    if (name === 'shape') {
      viewer.resize();
    }
    viewer.update();
  });
  controlsOf.measure.addEventListener('click', () => viewer.measure());
  window.addEventListener('keydown', (event) => onKey(viewer, event));
  window.addEventListener('dragover', (event) => {
    event.preventDefault();
    document.body.classList.add('dropping');
  });
  window.addEventListener('dragleave', () => document.body.classList.remove('dropping'));
  window.addEventListener('drop', (event) => {
    event.preventDefault();
    document.body.classList.remove('dropping');
    const [file] = event.dataTransfer.files;
    if (file) {
      openFile(viewer, file);
    }
  });
}

async function start() {
  if (!document.createElement('canvas').getContext('webgl2')) {
    complain('This browser does not show WebGL 2, which it takes.');
    return;
  }
  takeAddress();
  showValues();
  const address = query.get('table') ?? controlsOf.table.value;
  const lookup = fetch('lookup.glsl').then((response) => response.text());
  const viewer = new Viewer(await lookup);
  listen(viewer);
  viewer.resize();
  const opened = openAddress(viewer, address);
  viewer.compile();
  await opened;
}

start();
