// The colour of each thing as a word over its picture: red, green and wood look alike to many people.
import { Vector3 } from 'three';
import { make, write } from './element.js';
import { distance } from './pose.js';

/** @typedef {{key: string, text: string, p: readonly number[]}} Label */

const projected = new Vector3();
/** Approximate size of a label in pixels: of a letter, around the text, and the height. */
const [LETTER, AROUND, HEIGHT] = [6, 8, 14];
const MAX_ROWS = 3;

/**
 * The name of the colour nearest to a linear colour. Pure.
 * @param {readonly number[] | null | undefined} rgb
 * @param {{name: string, rgb: readonly number[]}[]} colours
 * @returns {string | null}
 */
export function colourName(rgb, colours) {
  if (!rgb) return null;
  const [nearest] = colours.map(({ name, rgb: its }) => ({ name, far: distance(its, rgb) })).sort((a, b) => a.far - b.far);
  return nearest?.name ?? null;
}

/**
 * Projects a world point into a picture, in pixels; `null` behind the camera.
 * @param {readonly number[]} p
 * @param {import('three').Camera} camera
 * @param {HTMLElement} element
 * @returns {{x: number, y: number} | null}
 */
export function project(p, camera, element) {
  projected.set(p[0], p[1], p[2]).project(camera);
  if (projected.z > 1 || projected.z < -1) return null;
  const { clientWidth, clientHeight } = element;
  return { x: ((projected.x + 1) / 2) * clientWidth, y: ((1 - projected.y) / 2) * clientHeight };
}

/**
 * The labels without those that would cover one of the same text, as in a row of pegs. Others are moved up. Pure.
 * @template {{text: string, spot: {x: number, y: number}}} T
 * @param {T[]} labels
 * @returns {T[]}
 */
export function apart(labels) {
  const kept = /** @type {T[]} */ ([]);
  for (const label of labels) {
    const { x } = label.spot;
    let { y } = label.spot;
    const covers = (/** @type {T} */ { text, spot }) => Math.abs(spot.x - x) < (LETTER * (text.length + label.text.length)) / 2 + AROUND
      && Math.abs(spot.y - y) < HEIGHT;
    if (kept.some((other) => other.text === label.text && covers(other))) continue;
    for (let row = 0; row < MAX_ROWS && kept.some(covers); row += 1) y -= HEIGHT;
    kept.push({ ...label, spot: { x, y } });
  }
  return kept;
}

export class Labels {
  #element;
  #camera;
  #list = make('div', { class: 'labels', 'aria-hidden': 'true' });
  /** @type {Map<string, HTMLElement>} */
  #shown = new Map();

  /**
   * @param {HTMLElement} element the view
   * @param {import('three').Camera} camera
   */
  constructor(element, camera) {
    this.#element = element;
    this.#camera = camera;
    element.append(this.#list);
  }

  /** Places the labels, after a picture. @param {Label[]} labels */
  place(labels) {
    const left = new Set(this.#shown.keys());
    for (const { key, text, spot } of apart(labels.flatMap(({ key, text, p }) => {
      const spot = project(p, this.#camera, this.#element);
      return spot === null ? [] : [{ key, text, spot }];
    }))) {
      left.delete(key);
      let label = this.#shown.get(key);
      if (label === undefined) {
        label = make('span', { data: { key } });
        this.#shown.set(key, label);
        this.#list.append(label);
      }
      write(label, text);
      const place = `translate(${spot.x.toFixed(1)}px, ${spot.y.toFixed(1)}px) translate(-50%, -100%)`;
      if (label.style.transform !== place) label.style.transform = place;
    }
    for (const key of left) {
      this.#shown.get(key)?.remove();
      this.#shown.delete(key);
    }
  }
}
