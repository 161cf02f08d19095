// Materials, shared by all things of one colour and look, and the colours of the page's theme.
import { BackSide, Color, MeshBasicMaterial } from 'three';
import { LineMaterial } from 'three/examples/jsm/lines/LineMaterial.js';
import { surface } from './surface.js';

/** @typedef {'solid' | 'faded' | 'ghost'} Look */

const OPACITY = { solid: 1, faded: 0.28, ghost: 0.5 };

/** @type {Map<string, ReturnType<typeof surface>>} */
const paints = new Map();
/** @type {Map<string, import('three').Material>} */
const lines = new Map();

/**
 * The material of a colour.
 * @param {readonly number[] | null} rgb linear
 * @param {Look} look
 */
export function paint(rgb, look = 'solid') {
  const colour = rgb ?? [0.4, 0.4, 0.4];
  const key = `${colour.map((value) => value.toFixed(3)).join()} ${look}`;
  let material = paints.get(key);
  if (material === undefined) {
    const color = new Color().setRGB(colour[0], colour[1], colour[2]);
    material = surface({ color, shaded: true, opacity: OPACITY[look] });
    paints.set(key, material);
  }
  return material;
}

/**
 * The material of a highlighting shell around a thing.
 * @param {string} name of a theme colour
 */
export function rim(name) {
  return kept(`rim ${name}`, () => new MeshBasicMaterial({ color: themed(name), side: BackSide }), name);
}

/**
 * The material of a missing thing: a flat fill inside a rim.
 * @param {string} name of a theme colour
 */
export function hollow(name) {
  return kept(`hollow ${name}`, () => new MeshBasicMaterial({ color: themed(name) }), name);
}

/**
 * The material of lines.
 * @param {string} name of a theme colour
 * @param {{width?: number, dashed?: boolean}} [how] width in metres
 */
export function line(name, { width = 0.004, dashed = false } = {}) {
  const make = () => new LineMaterial({
    color: themed(name).getHex(),
    linewidth: width,
    worldUnits: true,
    dashed,
    dashSize: 0.02,
    gapSize: 0.009,
  });
  return /** @type {LineMaterial} */ (kept(`line ${name} ${width} ${dashed}`, make, name));
}

/**
 * @param {string} key
 * @param {() => import('three').Material} create
 * @param {string} name
 */
function kept(key, create, name) {
  let material = lines.get(key);
  if (material === undefined) {
    material = create();
    material.userData.theme = name;
    lines.set(key, material);
  }
  return material;
}

/**
 * A colour of the page's theme: the custom property of that name.
 * @param {string} name
 */
export function themed(name) {
  const text = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  return new Color(text === '' ? '#888888' : text);
}

/** Updates the materials after the theme changed. */
export function repaint() {
  for (const material of lines.values()) {
    /** @type {any} */ (material).color.copy(themed(material.userData.theme));
  }
}
