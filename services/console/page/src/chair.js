// The first teacher's seat on this page: it follows the cells, and leads them while he moves it himself.
import { looksAt } from './pose.js';
import { Teller } from './teller.js';

/** @typedef {import('./seat.js').Seat} Seat */

/** So long after the last move of his own, the page believes itself before the cells. */
const LEADS_MS = 600;

/** Opposite Leo. @type {Seat} */
export const FIRST_SEAT = { eyes: [0, 1.5, 0.55], looks_at: [0, 0.75, 0] };

export class Chair {
  #changed;
  #led = -Infinity;
  #teller;
  /** @type {Seat} */
  seat = FIRST_SEAT;

  /**
   * @param {{ask: (what: string, content?: any) => Promise<any>}} leo
   * @param {import('./cells.js').Cells} cells
   * @param {() => void} changed
   */
  constructor(leo, cells, changed) {
    this.#changed = changed;
    this.#teller = new Teller(() => leo.ask('seat', { eyes: this.seat.eyes, looks_at: this.seat.looks_at }));
    cells.on('thing/', (changes) => {
      for (const thing of changes.values()) {
        if (thing?.kind !== 'person' || thing.agent !== 1 || !thing.p || !thing.q) continue;
        if (performance.now() - this.#led < LEADS_MS) continue;
        this.seat = { eyes: thing.p, looks_at: looksAt(thing.p, thing.q) };
        this.#changed();
      }
    });
  }

  /** Sits down elsewhere. @param {Seat} seat */
  move(seat) {
    this.seat = seat;
    this.#led = performance.now();
    this.#changed();
    this.#teller.tell();
  }
}
