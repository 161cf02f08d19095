// The seat of the teacher of this page: follows the state, and overrides it while it is moved here.
import { looksAt } from './pose.js';
import { Throttle } from './throttle.js';

/** @typedef {import('./seat.js').Seat} Seat */

/** For this long after a move of its own, the page ignores the seat in the state. */
const LEADS_MS = 600;

/** The first teacher's seat, opposite Leo. @type {Seat} */
export const FIRST_SEAT = { eyes: [0, 1.5, 0.55], looks_at: [0, 0.75, 0] };

export class TeacherSeat {
  #store;
  #changed;
  #led = -Infinity;
  #throttle;
  /** The teacher whose seat it is. */
  agent = 1;
  /** @type {Seat} */
  seat = FIRST_SEAT;
  /** The seat before it was moved. @type {Seat} */
  home = FIRST_SEAT;

  /**
   * @param {{ask: (what: string, content?: any) => Promise<any>}} leo
   * @param {import('./store.js').Store} store
   * @param {() => void} changed
   */
  constructor(leo, store, changed) {
    this.#store = store;
    this.#changed = changed;
    this.#throttle = new Throttle(() => leo.ask('seat', { teacher: this.agent, eyes: this.seat.eyes, looks_at: this.seat.looks_at }));
    store.on('thing/', (changes) => {
      for (const thing of changes.values()) {
        if (thing?.agent !== this.agent || performance.now() - this.#led < LEADS_MS) continue;
        this.#follow(thing);
      }
    });
  }

  /** Switches to another teacher. @param {number} agent */
  take(agent) {
    if (agent === this.agent) return;
    this.agent = agent;
    this.#led = -Infinity;
    this.home = FIRST_SEAT;
    const [, person] = this.#store.under('thing/').find(([, thing]) => thing.kind === 'person' && thing.agent === agent) ?? [];
    this.#follow(person);
    if (agent !== 1) this.home = this.seat;
    this.#changed();
  }

  /** @param {any} person */
  #follow(person) {
    if (person?.kind !== 'person' || !person.p || !person.q) return;
    this.seat = { eyes: person.p, looks_at: looksAt(person.p, person.q) };
    this.#changed();
  }

  /** Moves the seat. @param {Seat} seat */
  move(seat) {
    this.seat = seat;
    this.#led = performance.now();
    this.#changed();
    this.#throttle.report();
  }
}
