// A thing in a scene: its coloured body, with an optional rim and outline.
import { Group, Mesh } from 'three';
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';
import { hollow, line, paint, rim } from './paint.js';
import { edgesOf, form } from './shapes.js';

/** @typedef {import('./pose.js').Point} Point */
/** @typedef {{half: Point, shape: number[] | null, rgb: number[] | null, hole: boolean}} Form */

const RIM_M = 0.0045;

export class Solid extends Group {
  #body;
  /** @type {Mesh | null} */
  #rim = null;
  /** @type {LineSegments2 | null} */
  #outline = null;
  #form;

  /** @param {Form} form_ */
  constructor({ half, shape, rgb, hole }) {
    super();
    this.half = half;
    this.rgb = rgb;
    this.#form = form(half, shape, hole);
    this.#body = new Mesh(this.#form, /** @type {import('three').Material} */ (paint(rgb)));
    this.#body.castShadow = true;
    this.#body.receiveShadow = true;
    this.add(this.#body);
  }

  /** @param {import('./paint.js').Look | 'empty'} look `empty`: only its rim */
  look(look) {
    this.#body.material = look === 'empty' ? hollow('table') : paint(this.rgb, look);
    this.#body.castShadow = look === 'solid';
  }

  /** @param {string | null} colour of the theme */
  rim(colour) {
    if (colour === null) {
      if (this.#rim !== null) this.#rim.visible = false;
      return;
    }
    if (this.#rim === null) {
      this.#rim = new Mesh(this.#form);
      const [x, y, z] = this.half;
      this.#rim.scale.set((x + RIM_M) / x, (y + RIM_M) / y, (z + RIM_M) / z);
      this.add(this.#rim);
    }
    this.#rim.material = rim(colour);
    this.#rim.visible = true;
  }

  /**
   * @param {string | null} colour of the theme
   * @param {boolean} [dashed]
   */
  outline(colour, dashed = false) {
    if (colour === null) {
      if (this.#outline !== null) this.#outline.visible = false;
      return;
    }
    if (this.#outline === null) {
      const geometry = new LineSegmentsGeometry().fromEdgesGeometry(/** @type {any} */ (edgesOf(this.#form)));
      this.#outline = new LineSegments2(geometry);
      this.#outline.computeLineDistances();
      this.add(this.#outline);
    }
    this.#outline.material = line(colour, { dashed, width: dashed ? 0.006 : 0.0035 });
    this.#outline.visible = true;
  }

  /** @param {readonly number[] | null} p @param {readonly number[] | null} q */
  place(p, q) {
    if (p !== null) this.position.set(p[0], p[1], p[2]);
    if (q !== null) this.quaternion.set(q[0], q[1], q[2], q[3]);
  }

  /** Frees what is not shared with other things. */
  dispose() {
    this.#outline?.geometry.dispose();
  }
}
