// Keyboard control of the main view.
import { STEP_TURN } from './hand.js';
import { approached, orbited, turned } from './seat.js';

const STEP_M = 0.01;
const STRIDE_M = 0.05;
const STEP_SEAT = 0.06;
const STEP_GAZE = 0.04;
const STEP_NEAR = 1.06;

/** @type {Record<string, [number, number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
/** @type {Record<string, [number, number]>} */
const AROUND = { ...ARROWS, a: [-1, 0], d: [1, 0] };

/** @typedef {import('./pointer.js').Desk & {undo: () => void, remove: (key: string) => void, settle: () => void}} Desk */

export class Keys {
  #desk;
  /** The screen carried by the keyboard, and its initial position. @type {{name: string, at: number[]} | null} */
  #screen = null;
  #table = '';

  /** @param {Desk} desk */
  constructor(desk) {
    this.#desk = desk;
    desk.element.addEventListener('keydown', (event) => this.#press(event));
    desk.store.on('workspace', () => {
      const { lesson, table } = desk.store.get('workspace') ?? {};
      const now = `${lesson} ${table}`;
      // Another table may have a screen of the same name.
      if (now !== this.#table) this.forget();
      this.#table = now;
    });
    document.addEventListener('keydown', (event) => {
      // While the mouse carries something, the focus may be anywhere.
      const beside = !desk.element.contains(/** @type {Node} */ (event.target));
      if (beside && desk.hand.held !== null && ['Escape', 'q', 'e', 'Q', 'E'].includes(event.key)) this.#carry(event);
      const typing = event.target instanceof HTMLInputElement && event.target.type === 'text';
      if (event.key !== 'z' || !(event.ctrlKey || event.metaKey) || event.shiftKey || typing) return;
      event.preventDefault();
      desk.undo();
    });
  }

  /** @param {KeyboardEvent} event */
  #press(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const target = /** @type {HTMLElement} */ (event.target);
    if (target instanceof HTMLInputElement || target instanceof HTMLSelectElement) return;
    const key = target.closest('.mark') instanceof HTMLElement ? target.dataset.key ?? null : null;
    const done = this.#carry(event) || (key !== null && this.#thing(event, key)) || this.#seat(event);
    if (!done) return;
    event.preventDefault();
    event.stopPropagation();
  }

  /** Keys for the held object or screen. @param {KeyboardEvent} event */
  #carry(event) {
    const { ask, store, hand, world } = this.#desk;
    if (hand.held === null && this.#screen === null) return false;
    const arrow = ARROWS[event.key];
    if (arrow !== undefined) {
      const [x, y] = this.#across(arrow, event.shiftKey ? STRIDE_M : STEP_M);
      if (hand.held !== null) hand.carry(hand.held.at[0] + x, hand.held.at[1] + y);
      else if (this.#screen !== null) {
        const { name } = this.#screen;
        const key = store.thing(name);
        const pose = key === null ? null : world.pose(key);
        if (pose !== null) ask('screen', { name, at: [pose.p[0] + x, pose.p[1] + y, pose.p[2]] });
      }
      return true;
    }
    const turn = { q: 1, e: -1, Q: 1, E: -1 }[event.key];
    if (turn !== undefined) hand.turn(turn * STEP_TURN);
    else if (event.key === 'Enter' || event.key === ' ') this.#put();
    else if (event.key === 'Escape') this.#cancel();
    else return false;
    return true;
  }

  #put() {
    if (this.#desk.hand.held !== null) this.#desk.hand.put();
    this.forget();
  }

  #cancel() {
    this.#desk.hand.cancel();
    if (this.#screen !== null) this.#desk.ask('screen', this.#screen);
    this.forget();
  }

  /** Stops carrying a screen; it stays where it is. */
  forget() {
    this.#screen = null;
  }

  /** Keys for the focused object. @param {KeyboardEvent} event @param {string} key */
  #thing(event, key) {
    const { store, hand, movable, remove, select } = this.#desk;
    const { kind, name, p } = store.get(key) ?? {};
    if (event.key === 'Enter') {
      select(key);
      if (movable() && kind === 'object') hand.take(key);
      if (movable() && kind === 'occluder') this.#screen = { name, at: p };
    } else if (event.key === ' ') select(key);
    else if (event.key === 'Delete' || event.key === 'Backspace') remove(key);
    else if (event.key === 'Escape') select(null);
    else return false;
    return true;
  }

  /** Keys for the seat. @param {KeyboardEvent} event */
  #seat(event) {
    const { seat, sit, view, zoom } = this.#desk;
    if (event.key === 'Home') {
      this.#desk.settle();
      return true;
    }
    const near = { w: 1 / STEP_NEAR, '+': 1 / STEP_NEAR, '=': 1 / STEP_NEAR, s: STEP_NEAR, '-': STEP_NEAR }[event.key];
    if (near !== undefined) {
      if (view() === 'above') zoom(near);
      else if (view() !== 'leo') sit(approached(seat(), near));
      return true;
    }
    const around = AROUND[event.key];
    if (around === undefined || view() === 'leo' || view() === 'above') return false;
    if (event.shiftKey) sit(turned(seat(), -around[0] * STEP_GAZE, around[1] * STEP_GAZE));
    else sit(orbited(seat(), around[0] * STEP_SEAT, around[1] * STEP_SEAT));
    return true;
  }

  /** A step on the table, in the camera's directions. @param {[number, number]} arrow @param {number} length */
  #across([right, away], length) {
    const e = this.#desk.camera.matrixWorld.elements;
    const angle = Math.atan2(e[1], e[0]);
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    return [length * (c * right - s * away), length * (s * right + c * away)];
  }
}
