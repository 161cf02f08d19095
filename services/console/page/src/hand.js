// The teacher's hand: takes, carries and puts down an object. What it holds is drawn at once, before Leo's answer.
import { landing, headingOf } from './landing.js';
import { upright } from './pose.js';
import { Throttle } from './throttle.js';

/** @typedef {import('./pose.js').Point} Point */
/** @typedef {{ask: (what: string, content?: any) => Promise<any>}} Leo */

const LIFT_M = 0.05;
export const STEP_TURN = Math.PI / 12;

/**
 * @typedef {object} Held
 * @property {string} key of the cell
 * @property {any} thing the object when it was taken
 * @property {[number, number]} at where it is carried
 * @property {number} angle its heading
 * @property {boolean} exact whether snapping to holes is off
 * @property {Promise<any>} taken
 */

export class Hand {
  #leo;
  #store;
  #world;
  #changed;
  /** @type {Held | null} */
  held = null;
  #throttle = new Throttle(() => this.#tell());

  /**
   * @param {Leo} leo
   * @param {import('./store.js').Store} store
   * @param {import('./world.js').World} world
   * @param {() => void} changed
   */
  constructor(leo, store, world, changed) {
    this.#leo = leo;
    this.#store = store;
    this.#world = world;
    this.#changed = changed;
  }

  /** @param {string} key of an object's cell @returns {boolean} */
  take(key) {
    const thing = this.#store.get(key);
    const pose = this.#world.pose(key);
    if (this.held !== null || thing?.kind !== 'object' || pose === null) return false;
    const held = {
      key,
      thing: { ...thing, p: pose.p, q: pose.q },
      at: /** @type {[number, number]} */ ([pose.p[0], pose.p[1]]),
      angle: headingOf({ q: pose.q }),
      exact: false,
      taken: this.#leo.ask('take', { thing: thing.name }),
    };
    this.held = held;
    held.taken.then((answer) => {
      if (answer.error !== undefined && this.held === held) this.#drop();
    });
    this.#show(false);
    return true;
  }

  /** @param {number} x @param {number} y @param {boolean} [exact] */
  carry(x, y, exact = false) {
    if (this.held === null) return;
    this.held.at = [x, y];
    this.held.exact = exact;
    this.#show(true);
  }

  /** @param {number} angle anticlockwise, seen from above */
  turn(angle) {
    if (this.held === null) return;
    this.held.angle += angle;
    this.#show(true);
  }

  /** Releases the object at the previewed place. */
  async put() {
    const held = this.held;
    if (held === null) return;
    const where = this.landing();
    this.#throttle.cancel();
    this.held = null;
    this.#world.land(null);
    if (where !== null) this.#world.echo(held.key, { p: where.p, q: where.q });
    const at = where === null ? this.#height([...held.at, 0]) : where.p;
    const answer = await this.#leo.ask('put', { at, heading: held.angle });
    if (answer.error !== undefined) await this.#leo.ask('cancel');
    this.#world.echo(held.key, null);
    this.#changed();
  }

  cancel() {
    if (this.held === null) return;
    this.#leo.ask('cancel');
    this.#drop();
  }

  /** Where the object would land now. */
  landing() {
    if (this.held === null) return null;
    const { key, thing, at, angle, exact } = this.held;
    const others = this.#store.under('thing/').filter(([other]) => other !== key).map(([, other]) => other);
    return landing(thing, at, angle, others, exact);
  }

  #drop() {
    const held = this.held;
    this.#throttle.cancel();
    this.held = null;
    this.#world.land(null);
    if (held !== null) this.#world.echo(held.key, null);
    this.#changed();
  }

  /** @param {boolean} tell */
  #show(tell) {
    const where = this.landing();
    if (this.held === null || where === null) return;
    const [x, y, z] = this.#height(where.p);
    this.#world.echo(this.held.key, { p: [x, y, z], q: upright(this.held.angle) });
    this.#world.land(this.held.thing, where);
    this.#changed();
    if (tell) this.#throttle.report();
  }

  /** @param {Point} p @returns {Point} */
  #height([x, y, z]) {
    return [x, y, z + LIFT_M];
  }

  /** Sends the current position. */
  #tell() {
    const pose = this.held === null ? null : this.#world.pose(this.held.key);
    if (this.held === null || pose === null) return;
    this.#leo.ask('carry', { at: pose.p, heading: this.held.angle });
  }
}
