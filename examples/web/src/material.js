// The shader: lookup.glsl as it is, after the two functions that it needs, and what makes radiance and a colour of it.

import {
  ClampToEdgeWrapping,
  Data3DTexture,
  DataTexture,
  DoubleSide,
  FloatType,
  GLSL3,
  HalfFloatType,
  LinearFilter,
  NearestFilter,
  RawShaderMaterial,
  RGBAFormat,
  Vector3,
} from 'three';

/** What is shown, by name. */
export const MODES = { table: 0, direct: 1, difference: 2, split: 3 };
export const MAX_LIGHTS = 3;
/** Parameters per row of their texture. */
const ROW = 256;

const VERTEX = `
precision highp float;
in vec3 position;
in vec3 normal;
in vec3 warp;
uniform mat4 modelViewMatrix;
uniform mat4 projectionMatrix;
out vec3 v_normal;
out vec3 v_warp;

void main() {
  v_normal = normal;
  v_warp = warp;
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}
`;

const BEFORE = `
precision highp float;
precision highp int;
uniform highp sampler2D parameters;
uniform highp sampler3D volume;

vec4 sateen_parameter(int index) {
  return texelFetch(parameters, ivec2(index % ${ROW}, index / ${ROW}), 0);
}

vec4 sateen_volume(vec3 uvw) {
  return textureLod(volume, uvw, 0.0);
}
`;

const AFTER = `
in vec3 v_normal;
in vec3 v_warp;
out vec4 colour;

// Unit vectors to the viewer and to the lights, and irradiance at normal incidence over pi.
uniform vec3 viewer;
uniform vec3 light_directions[${MAX_LIGHTS}];
uniform float light_strengths[${MAX_LIGHTS}];
uniform int samples;
uniform float exposure;
uniform float factor;
uniform float divider;

// As src/render: interpolated normals that look away are brought back to where they are just seen.
const float GRAZING = 1e-2;

vec3 rho(vec3 wi, vec3 wr, bool is_direct) {
  return is_direct ? sateen_direct_cos(wi, wr, samples) : sateen_eval_cos(wi, wr);
}

// The columns of the frame are warp, weft and normal in the world.
vec3 radiance(mat3 frame, bool is_direct) {
  vec3 wr = viewer * frame;
  vec3 sum = light_strengths[0] * rho(light_directions[0] * frame, wr, is_direct);
#if LIGHTS > 1
  for (int k = 1; k < LIGHTS; k++) {
    sum += light_strengths[k] * rho(light_directions[k] * frame, wr, is_direct);
  }
#endif
  return SATEEN_PI * sum;
}

vec3 srgb(vec3 x) {
  return mix(1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));
}

void main() {
  vec3 n = normalize(gl_FrontFacing ? v_normal : -v_normal);
  float towards = dot(n, viewer);
  if (towards < GRAZING) {
    n = normalize(n + (GRAZING - towards) * viewer);
  }
  vec3 t = normalize(v_warp - dot(v_warp, n) * n);
  mat3 frame = mat3(t, cross(n, t), n);
#if MODE == 0
  vec3 value = radiance(frame, false);
#elif MODE == 1
  vec3 value = radiance(frame, true);
#elif MODE == 2
  vec3 value = factor * abs(radiance(frame, false) - radiance(frame, true));
#else
  vec3 value = radiance(frame, gl_FragCoord.x > divider);
#endif
  colour = vec4(srgb(exposure * max(value, vec3(0.0))), 1.0);
}
`;

/** Materials of one cloth, one per mode and number of lights: what is not shown is not compiled. */
export class Cloth {
  #lookup;
  #materials = new Map();

  constructor(lookup) {
    this.#lookup = lookup;
    this.uniforms = {
      parameters: { value: null },
      volume: { value: null },
      viewer: { value: new Vector3(0, 0, 1) },
      light_directions: { value: Array.from({ length: MAX_LIGHTS }, () => new Vector3(0, 0, 1)) },
      light_strengths: { value: [1, 0, 0] },
      samples: { value: 50 },
      exposure: { value: 1 },
      factor: { value: 16 },
      divider: { value: 0 },
    };
  }

  /** Takes what load.js returns, and what it is called. */
  set(name, cloth) {
    this.name = name;
    this.uniforms.volume.value?.dispose();
    this.uniforms.parameters.value?.dispose();
    const volume = new Data3DTexture(cloth.texels, ...cloth.size);
    volume.format = RGBAFormat;
    volume.type = HalfFloatType;
    volume.minFilter = LinearFilter;
    volume.magFilter = LinearFilter;
    volume.wrapS = volume.wrapT = volume.wrapR = ClampToEdgeWrapping;
    volume.generateMipmaps = false;
    volume.unpackAlignment = 1;
    volume.needsUpdate = true;
    this.uniforms.volume.value = volume;

    const rows = Math.ceil(cloth.parameters.length / (4 * ROW));
    const padded = new Float32Array(4 * ROW * rows);
    padded.set(cloth.parameters);
    const parameters = new DataTexture(padded, ROW, rows, RGBAFormat, FloatType);
    parameters.minFilter = parameters.magFilter = NearestFilter;
    parameters.needsUpdate = true;
    this.uniforms.parameters.value = parameters;
  }

  /** Dyes a thread of `set`'s cloth: tables hold no albedo. */
  dye({ at }, albedo) {
    const texture = this.uniforms.parameters.value;
    texture.image.data.set(albedo, at);
    texture.needsUpdate = true;
  }

  /** The material that shows a mode under so many lights. */
  material(mode, lights) {
    const key = `${mode} ${lights}`;
    let material = this.#materials.get(key);
    if (material === undefined) {
      material = new RawShaderMaterial({
        glslVersion: GLSL3,
        defines: { MODE: MODES[mode], LIGHTS: lights },
        vertexShader: VERTEX,
        fragmentShader: BEFORE + this.#lookup + AFTER,
        uniforms: this.uniforms,
        side: DoubleSide,
      });
      this.#materials.set(key, material);
    }
    return material;
  }
}
