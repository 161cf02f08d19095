// The scene of one perspective's beliefs, with its differences from Leo's own beliefs highlighted.
import { LineSegments2 } from 'three/examples/jsm/lines/LineSegments2.js';
import { LineSegmentsGeometry } from 'three/examples/jsm/lines/LineSegmentsGeometry.js';
import { Mesh } from 'three';
import { line, paint } from './paint.js';
import { distance } from './pose.js';
import { Room } from './room.js';
import { Solid } from './solid.js';
import { UNIT_BOX } from './shapes.js';

/** @typedef {import('./store.js').Store} Store */

/** A belief not perceived for longer than this is drawn as remembered, in seconds. */
const REMEMBERED_S = 0.6;
const MOVED_M = 0.03;

/**
 * One belief as it is drawn. Pure.
 * @typedef {{id: number, belief: any, mark: null | 'unknown' | 'different' | 'imagined' | 'unplaced',
 *   remembered: boolean, from: number[] | null}} Sketch
 */

/**
 * @param {[string, any][]} own the robot's own beliefs
 * @param {[string, any][]} theirs the beliefs of the perspective
 * @param {[string, any][]} divergences the differences from the robot's own beliefs
 * @returns {Sketch[]}
 */
export function sketch(own, theirs, divergences) {
  const kinds = new Map();
  const unknown = new Set();
  for (const [, divergence] of divergences) {
    if (divergence.other !== null && divergence.other !== undefined) kinds.set(divergence.other, divergence.kind);
    else if (divergence.robot !== null) unknown.add(divergence.robot);
  }
  const robots = new Map(own.map(([key, belief]) => [idOf(key), belief]));
  const sketches = /** @type {Sketch[]} */ ([]);
  for (const [key, belief] of theirs) {
    const id = idOf(key);
    const twin = robots.get(belief.twin);
    const mark = belief.p === null ? 'unplaced' : kinds.get(id) ?? null;
    const shown = belief.p === null ? { ...belief, p: twin?.p ?? null, q: twin?.q ?? null } : belief;
    const moved = mark === 'different' && twin?.p && distance(twin.p, belief.p) > MOVED_M;
    const remembered = (belief.unseen_s ?? 0) > REMEMBERED_S;
    sketches.push({ id, belief: shown, mark, remembered, from: moved ? twin.p : null });
  }
  for (const id of unknown) {
    const belief = robots.get(id);
    if (belief !== undefined) sketches.push({ id, belief, mark: 'unknown', remembered: false, from: null });
  }
  return sketches.filter(({ belief }) => belief.p !== null && belief.half !== null);
}

/** @param {string} key */
export function idOf(key) {
  return Number(key.slice(key.lastIndexOf('/') + 1));
}

export class Beliefs {
  /** @type {Map<string, {solid: Solid, form: string}>} */
  #solids = new Map();
  /** @type {Map<string, Mesh>} */
  #screens = new Map();
  /** @type {LineSegments2 | null} */
  #arrows = null;
  #store;
  /** What is drawn. @type {Sketch[]} */
  #sketches = [];
  perspective = 0;
  /** The selected belief of the robot. @type {number | null} */
  selected = null;

  /**
   * @param {Store} store
   * @param {{shadows: boolean}} how
   */
  constructor(store, { shadows }) {
    this.#store = store;
    this.scene = new Room({ shadows, background: 'stage' });
  }

  repaint() {
    this.scene.repaint();
  }

  /** The names of the believed colours, over what is drawn. @returns {import('./labels.js').Label[]} */
  labels() {
    const isAlone = (/** @type {any} */ belief) => (belief.states?.inserted ?? 0) <= 0.5;
    return this.#sketches.filter(({ belief }) => belief.colour && isAlone(belief)).map(({ id, belief, mark }) => {
      const [x, y, z] = belief.p;
      return { key: `${mark} ${id}`, text: belief.colour, p: [x, y, z + belief.half[2]] };
    });
  }

  /** Redraws from the store. */
  update() {
    const n = this.perspective;
    const own = this.#store.under('belief/0/');
    const theirs = n === 0 ? own : this.#store.under(`belief/${n}/`);
    const divergences = n === 0 ? [] : this.#store.under(`divide/${n}/`);
    const sketches = sketch(own, theirs, divergences);
    const left = new Set(this.#solids.keys());
    const ways = [];
    for (const each of sketches) {
      const key = `${each.mark === 'unknown' ? 'not ' : ''}${each.id}`;
      left.delete(key);
      this.#draw(key, each, n === 0 ? each.id : each.belief.twin);
      if (each.from !== null) ways.push(...lift(each.belief.p), ...lift(each.from));
    }
    for (const key of left) this.#drop(key);
    this.#sketches = sketches;
    this.#way(ways);
    this.#screen();
  }

  /** @param {string} key @param {Sketch} sketch_ @param {number | null} twin */
  #draw(key, { belief, mark, remembered }, twin) {
    const hole = 'filled' in (belief.states ?? {});
    const form = JSON.stringify([belief.half.map((/** @type {number} */ v) => v.toFixed(3)), belief.shape, belief.rgb, hole]);
    let drawn = this.#solids.get(key);
    if (drawn === undefined || drawn.form !== form) {
      this.#drop(key);
      drawn = { solid: new Solid({ half: belief.half, shape: belief.shape, rgb: belief.rgb, hole }), form };
      this.#solids.set(key, drawn);
      this.scene.add(drawn.solid);
    }
    const { solid } = drawn;
    solid.place(belief.p, belief.q);
    solid.look(mark === 'unknown' ? 'empty' : mark === 'unplaced' ? 'faded' : remembered ? 'ghost' : 'solid');
    const chosen = twin !== null && twin === this.selected;
    solid.rim(chosen ? 'focus' : mark === null || mark === 'unplaced' ? null : 'false');
    solid.outline(mark === 'unknown' ? 'false' : remembered || mark === 'unplaced' ? 'faint' : null);
  }

  /** An arrow from the believed position to the position that Leo believes. @param {number[]} points */
  #way(points) {
    if (this.#arrows !== null) {
      this.scene.remove(this.#arrows);
      this.#arrows.geometry.dispose();
      this.#arrows = null;
    }
    if (points.length === 0) return;
    this.#arrows = new LineSegments2(new LineSegmentsGeometry().setPositions(points), line('false', { dashed: true }));
    this.#arrows.computeLineDistances();
    this.scene.add(this.#arrows);
  }

  #screen() {
    const left = new Set(this.#screens.keys());
    for (const [key, thing] of this.#store.under('thing/')) {
      if (thing.kind !== 'occluder' || !thing.p) continue;
      left.delete(key);
      let mesh = this.#screens.get(key);
      if (mesh === undefined) {
        mesh = new Mesh(UNIT_BOX, paint([0.35, 0.36, 0.4], 'faded'));
        this.#screens.set(key, mesh);
        this.scene.add(mesh);
      }
      mesh.scale.set(2 * thing.half[0], 2 * thing.half[1], 2 * thing.half[2]);
      mesh.position.set(thing.p[0], thing.p[1], thing.p[2]);
      if (thing.q) mesh.quaternion.set(thing.q[0], thing.q[1], thing.q[2], thing.q[3]);
    }
    for (const key of left) {
      this.scene.remove(/** @type {Mesh} */ (this.#screens.get(key)));
      this.#screens.delete(key);
    }
  }

  /** @param {string} key */
  #drop(key) {
    const drawn = this.#solids.get(key);
    if (drawn === undefined) return;
    this.scene.remove(drawn.solid);
    drawn.solid.dispose();
    this.#solids.delete(key);
  }
}

/** @param {number[]} p */
function lift(p) {
  return [p[0], p[1], p[2] + 0.002];
}
