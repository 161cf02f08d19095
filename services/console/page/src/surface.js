// The material of surfaces: lit per pixel on a graphics card, and per vertex with software rendering, which takes
// a third of the time.
import { Color, DoubleSide, FrontSide, MeshLambertMaterial, ShaderMaterial } from 'three';

/** Vertex lighting: the sun of `Room`, and the sky. */
const VERTEX = `
  uniform vec3 tint;
  varying vec3 shade;
  vec3 shown(vec3 c) {
    return mix(1.055 * pow(c, vec3(0.41667)) - 0.055, 12.92 * c, vec3(lessThanEqual(c, vec3(0.0031308))));
  }
  void main() {
    vec4 place = modelMatrix * vec4(position, 1.0);
    vec3 up = normalize(mat3(modelMatrix) * normal);
    float sun = 0.605 * max(0.0, dot(up, vec3(0.27, 0.31, 0.91)));
    vec3 sky = mix(vec3(0.30, 0.28, 0.25), vec3(0.48), 0.5 * up.z + 0.5);
    vec3 base = tint;
    #ifdef USE_COLOR
      base *= color;
    #endif
    shade = shown(min(vec3(1.0), base * (sun + sky)));
    gl_Position = projectionMatrix * viewMatrix * place;
  }`;
const FRAGMENT = `
  uniform float opacity;
  varying vec3 shade;
  void main() { gl_FragColor = vec4(shade, opacity); }`;

let plain = false;

/** Chooses the lighting of materials created from now on. @param {boolean} software */
export function lightFor(software) {
  plain = software;
}

/**
 * @typedef {object} Surface a material whose colour and opacity can be set
 * @property {Color} tint
 */

/**
 * A material.
 * @param {{color?: Color | number, shaded?: boolean, opacity?: number, glass?: boolean, both?: boolean}} [how]
 *   `shaded`: the geometry has vertex colours; `both`: it is double-sided
 */
export function surface({ color = 0xffffff, shaded = false, opacity = 1, glass = opacity < 1, both = false } = {}) {
  const common = {
    vertexColors: shaded, transparent: glass, depthWrite: opacity === 1, side: both ? DoubleSide : FrontSide,
  };
  const tint = new Color(color);
  if (!plain) {
    const material = new MeshLambertMaterial({ ...common, color: tint, opacity });
    return Object.assign(material, { tint: material.color });
  }
  const uniforms = { tint: { value: tint }, opacity: { value: opacity } };
  const material = new ShaderMaterial({ ...common, uniforms, vertexShader: VERTEX, fragmentShader: FRAGMENT });
  return Object.assign(material, { tint });
}

/** @param {ReturnType<typeof surface>} material @param {number} opacity */
export function setOpacity(material, opacity) {
  material.opacity = opacity;
  material.transparent = opacity < 1;
  material.depthWrite = opacity === 1;
  if (material instanceof ShaderMaterial) material.uniforms.opacity.value = opacity;
}
