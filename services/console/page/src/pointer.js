// Mouse, pen and touch control of the main view: picking, dragging, turning, and moving the seat.
import { Plane, Raycaster, Vector2, Vector3 } from 'three';
import { STEP_TURN } from './hand.js';
import { project } from './labels.js';
import { takes } from './landing.js';
import { distance } from './pose.js';
import { approached, orbited, turned } from './seat.js';

const DRAG_PX = 5;
/** Half of a finger's width: half of the 44 pixels that a control needs. */
const FINGER_PX = 22;
const TURN_PER_PX = 0.006;
const SCREEN_EVERY_MS = 50;

/**
 * What the pointer needs of the page.
 * @typedef {object} Desk
 * @property {HTMLElement} element
 * @property {import('three').PerspectiveCamera} camera
 * @property {import('./store.js').Store} store
 * @property {import('./world.js').World} world
 * @property {import('./hand.js').Hand} hand
 * @property {() => import('./lens.js').Name} view
 * @property {() => number} eyes the agent whose seat it is
 * @property {() => import('./seat.js').Seat} seat the seat that dragging moves
 * @property {(seat: import('./seat.js').Seat) => void} sit
 * @property {(what: string, content?: any) => Promise<any>} ask
 * @property {(key: string | null) => void} select
 * @property {(key: string | null) => void} hover
 * @property {() => boolean} movable whether things can be moved by hand
 * @property {(factor: number) => void} zoom for the view from above
 */

/** @typedef {{kind: 'thing' | 'screen' | 'person' | 'seat' | 'gaze', key: string | null, begun: boolean, start: Vector2,
 *   offset: [number, number], height: number, pointer: number}} Drag `pointer`: the id of the dragging pointer */

export class Pointer {
  #desk;
  #ray = new Raycaster();
  /** @type {Map<number, Vector2>} */
  #down = new Map();
  /** @type {Drag | null} */
  #drag = null;
  #pinch = 0;
  #twist = 0;
  #told = 0;
  #unseen = 0;

  /** @param {Desk} desk */
  constructor(desk) {
    this.#desk = desk;
    const { element } = desk;
    element.addEventListener('pointerdown', (event) => this.#press(event));
    element.addEventListener('pointermove', (event) => this.#move(event));
    element.addEventListener('pointerup', (event) => this.#release(event));
    element.addEventListener('pointercancel', (event) => this.#lose(event));
    element.addEventListener('pointerleave', () => this.#desk.hover(null));
    element.addEventListener('wheel', (event) => this.#wheel(event), { passive: false });
    element.addEventListener('contextmenu', (event) => event.preventDefault());
  }

  /**
   * The point at a height under a screen position.
   * @param {{clientX: number, clientY: number}} event
   * @param {number} height
   * @returns {[number, number] | null}
   */
  ground(event, height) {
    this.#aim(event);
    const hit = this.#ray.ray.intersectPlane(new Plane(new Vector3(0, 0, 1), -height), new Vector3());
    return hit === null || hit.length() > 6 ? null : [hit.x, hit.y];
  }

  /** @param {{clientX: number, clientY: number}} event */
  #aim(event) {
    const rect = this.#desk.element.getBoundingClientRect();
    const x = ((event.clientX - rect.left) / rect.width) * 2 - 1;
    const y = 1 - ((event.clientY - rect.top) / rect.height) * 2;
    this.#ray.setFromCamera(new Vector2(x, y), this.#desk.camera);
  }

  /**
   * The key of the thing under a screen position.
   * @param {{clientX: number, clientY: number}} event
   * @param {string | null} without
   */
  pick(event, without = null) {
    this.#aim(event);
    const targets = this.#desk.world.pickable().filter((object) => object.userData.key !== without);
    const keys = this.#ray.intersectObjects(targets, true).map((hit) => keyOf(hit.object));
    const things = keys.filter((key) => key !== null);
    if (this.#desk.view() === 'seat') return things[0] ?? null;
    // In the other views screens are transparent, so pick the thing behind.
    return things.find((key) => this.#desk.store.get(key)?.kind !== 'occluder') ?? things[0] ?? null;
  }

  /**
   * The thing under a finger: the nearest visible object within a finger's width, because a peg may be smaller.
   * @param {PointerEvent} event
   */
  #touch(event) {
    const { store, world, camera, element } = this.#desk;
    const exact = this.pick(event);
    if (exact !== null && store.get(exact)?.kind === 'object') return exact;
    const { left, top } = element.getBoundingClientRect();
    const near = store.under('thing/').flatMap(([key, { kind }]) => {
      const pose = kind === 'object' ? world.pose(key) : null;
      const spot = pose === null ? null : project(pose.p, camera, element);
      if (spot === null) return [];
      const at = { clientX: left + spot.x, clientY: top + spot.y };
      const far = Math.hypot(at.clientX - event.clientX, at.clientY - event.clientY);
      return far > FINGER_PX || this.pick(at) !== key ? [] : [{ key, far }];
    });
    return near.sort((a, b) => a.far - b.far)[0]?.key ?? exact;
  }

  /** @param {PointerEvent} event */
  #press(event) {
    const { element, hand, world, store, view, movable } = this.#desk;
    if (event.button === 1) return;
    element.setPointerCapture(event.pointerId);
    this.#down.set(event.pointerId, new Vector2(event.clientX, event.clientY));
    if (this.#down.size > 1) {
      if (this.#down.size === 2 && hand.held === null) this.#abandon();
      this.#grip();
      return;
    }
    if (hand.held !== null) hand.cancel();
    const start = new Vector2(event.clientX, event.clientY);
    const key = event.button === 2 || event.shiftKey ? null : event.pointerType === 'touch' ? this.#touch(event) : this.pick(event);
    const thing = key === null ? undefined : store.get(key);
    const pose = key === null ? null : world.pose(key);
    const base = { key: null, begun: false, start, offset: /** @type {[number, number]} */ ([0, 0]), height: 0, pointer: event.pointerId };
    if (thing === undefined || pose === null || !movable()) {
      const gaze = event.button === 2 || event.shiftKey;
      this.#drag = { ...base, key, kind: gaze ? 'gaze' : 'seat' };
      return;
    }
    const kind = thing.kind === 'object' ? 'thing' : thing.kind === 'occluder' ? 'screen' : 'person';
    if (kind === 'person' && view() === 'seat') {
      this.#drag = { ...base, kind: 'seat', key };
      return;
    }
    const height = kind === 'screen' ? 0 : pose.p[2];
    const ground = this.ground(event, height) ?? [pose.p[0], pose.p[1]];
    const offset = /** @type {[number, number]} */ ([pose.p[0] - ground[0], pose.p[1] - ground[1]]);
    this.#drag = { ...base, kind, key, offset, height };
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const last = this.#down.get(event.pointerId);
    if (last === undefined) {
      if (event.pointerType === 'mouse') this.#desk.hover(this.pick(event));
      return;
    }
    const now = new Vector2(event.clientX, event.clientY);
    const drag = this.#drag;
    if (drag === null) {
      this.#down.set(event.pointerId, now);
      if (this.#down.size === 2) this.#move2(last, now);
      return;
    }
    if (this.#down.size > 1) {
      this.#down.set(event.pointerId, now);
      this.#turn();
    }
    if (event.pointerId !== drag.pointer) return;
    if (!drag.begun) {
      if (now.distanceTo(drag.start) < DRAG_PX) return;
      drag.begun = true;
      if (drag.key !== null && drag.kind !== 'seat') this.#desk.select(drag.key);
      if (drag.kind === 'thing' && drag.key !== null && !this.#desk.hand.take(drag.key)) {
        this.#drag = null;
        return;
      }
    }
    this.#down.set(event.pointerId, now);
    this.#follow(drag, event, now.clone().sub(last));
  }

  /** @param {Drag} drag @param {PointerEvent} event @param {Vector2} step in pixels */
  #follow(drag, event, step) {
    const { hand, view, seat, sit } = this.#desk;
    if (drag.kind === 'thing') {
      const target = this.#target(event, drag);
      if (target !== null) hand.carry(...target, event.altKey);
    } else if (drag.kind === 'screen' || drag.kind === 'person') {
      const ground = this.ground(event, drag.height);
      if (ground !== null && drag.key !== null) {
        this.#slide(drag.key, ground[0] + drag.offset[0], ground[1] + drag.offset[1], false);
      }
    } else if (view() === 'seat' || view() === 'free') {
      const [around, above] = [-step.x * TURN_PER_PX, step.y * TURN_PER_PX];
      sit(drag.kind === 'gaze' ? turned(seat(), around / 2, above / 2) : orbited(seat(), around, above));
    }
  }

  /**
   * Where a pointer carries a thing to: the centre of a thing that can receive it, else the point under the pointer.
   * @param {PointerEvent} event
   * @param {Drag} drag
   * @returns {[number, number] | null}
   */
  #target(event, drag) {
    const { store, hand } = this.#desk;
    if (!event.altKey && hand.held !== null) {
      const over = this.pick(event, drag.key);
      const thing = over === null ? undefined : store.get(over);
      if (thing?.kind === 'object' && takes(thing, hand.held.thing)) return [thing.p[0], thing.p[1]];
    }
    const ground = this.ground(event, drag.height);
    return ground === null ? null : [ground[0] + drag.offset[0], ground[1] + drag.offset[1]];
  }

  /**
   * Moves a screen or another person's head.
   * @param {string} key
   * @param {number} x
   * @param {number} y
   * @param {boolean} last
   */
  #slide(key, x, y, last) {
    const { store, world, ask, hover } = this.#desk;
    const thing = store.get(key);
    const pose = world.pose(key);
    if (thing === undefined || pose === null) return world.echo(key, null);
    world.echo(key, { p: [x, y, pose.p[2]], q: pose.q });
    hover(key);
    if (!last && performance.now() - this.#told < SCREEN_EVERY_MS) return;
    this.#told = performance.now();
    const at = [x, y, pose.p[2]];
    const looks = () => this.#lookOf(key, at);
    const done = thing.kind === 'occluder'
      ? ask('screen', { name: thing.name, at })
      : ask('seat', { teacher: thing.agent, eyes: at, looks_at: looks() });
    if (last) done.then(() => world.echo(key, null));
  }

  /** The point that a moved head keeps looking at. @param {string} key @param {number[]} at */
  #lookOf(key, at) {
    const thing = this.#desk.store.get(key);
    const seat = this.#desk.seat();
    if (thing.agent === this.#desk.eyes() && this.#desk.view() !== 'free') return seat.looks_at;
    return distance(at, [0, 0.7, 0]) < 0.1 ? [0, 0.5, 0] : [0, 0.7, 0];
  }

  /** @param {PointerEvent} event */
  #release(event) {
    const drag = this.#drag;
    this.#down.delete(event.pointerId);
    if (drag?.pointer === event.pointerId) this.#drag = null;
    this.#grip();
    if (drag?.pointer !== event.pointerId) return;
    if (!drag.begun) return this.#desk.select(drag.key);
    if (drag.kind === 'thing') this.#desk.hand.put();
    this.#leave(drag);
  }

  /** Ends the drag of a screen or head: it stays there, and is drawn from the store again. @param {Drag} drag */
  #leave({ kind, key, begun }) {
    if (!begun || key === null || (kind !== 'screen' && kind !== 'person')) return;
    const pose = this.#desk.world.pose(key);
    if (pose !== null) this.#slide(key, pose.p[0], pose.p[1], true);
  }

  /** Cancels the drag. */
  #abandon() {
    const drag = this.#drag;
    this.#drag = null;
    if (drag?.kind === 'thing') this.#desk.hand.cancel();
    if (drag !== null) this.#leave(drag);
  }

  /** @param {PointerEvent} event */
  #lose(event) {
    this.#down.delete(event.pointerId);
    if (this.#drag?.pointer === event.pointerId) this.#abandon();
    this.#grip();
  }

  /** The two fingers of a turn or pinch, the dragging one first. @returns {Vector2[]} */
  #two() {
    const lead = this.#drag?.pointer;
    const led = [...this.#down].sort(([a], [b]) => Number(b === lead) - Number(a === lead));
    return led.slice(0, 2).map(([, place]) => place);
  }

  /** Restarts turn and pinch when a finger is added or lifted, so that neither jumps. */
  #grip() {
    if (this.#down.size < 2) return;
    const [a, b] = this.#two();
    this.#pinch = a.distanceTo(b);
    this.#twist = this.#angle();
  }

  /** The angle of the line through two fingers, clockwise on the page. */
  #angle() {
    const [a, b] = this.#two();
    return Math.atan2(b.y - a.y, b.x - a.x);
  }

  /** Turns the held thing with a second finger. */
  #turn() {
    const angle = this.#angle();
    const step = Math.atan2(Math.sin(angle - this.#twist), Math.cos(angle - this.#twist));
    this.#twist = angle;
    this.#desk.hand.turn(-step);
  }

  /**
   * Two-finger gestures: spreading zooms in, pinching zooms out, moving both turns the head.
   * @param {Vector2} last
   * @param {Vector2} now
   */
  #move2(last, now) {
    const [a, b] = [...this.#down.values()];
    const wide = a.distanceTo(b);
    if (wide > 10 && this.#pinch > 10) this.#nearer(this.#pinch / wide);
    this.#pinch = wide;
    const step = now.clone().sub(last).multiplyScalar(TURN_PER_PX / 4);
    const { view, seat, sit } = this.#desk;
    if (view() === 'seat' || view() === 'free') sit(turned(seat(), -step.x, step.y));
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    event.preventDefault();
    const { hand } = this.#desk;
    if (hand.held !== null) {
      this.#unseen += event.deltaY;
      if (Math.abs(this.#unseen) < 40) return;
      hand.turn(Math.sign(this.#unseen) * STEP_TURN);
      this.#unseen = 0;
      return;
    }
    this.#nearer(Math.exp(Math.max(-120, Math.min(120, event.deltaY)) * 0.0012));
  }

  /** @param {number} factor */
  #nearer(factor) {
    const { view, seat, sit, zoom } = this.#desk;
    if (view() === 'above') zoom(factor);
    else if (view() !== 'leo') sit(approached(seat(), factor));
  }
}

/** @param {any} object @returns {string | null} */
function keyOf(object) {
  for (let part = object; part !== null; part = part.parent) {
    if (part.userData.key !== undefined) return part.userData.key;
  }
  return null;
}
