// A throttle: reports a changing state at a limited rate, and always its last value.

/** Minimum interval between two reports. */
const EVERY_MS = 50;

export class Throttle {
  #report;
  #reportedAt = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #timer;

  /** @param {() => void} report reports the current state */
  constructor(report) {
    this.#report = report;
  }

  /** The state has changed: reports it now, or when the interval is over. */
  report() {
    const wait = this.#reportedAt + EVERY_MS - performance.now();
    clearTimeout(this.#timer);
    if (wait > 0) {
      this.#timer = setTimeout(() => this.report(), wait);
      return;
    }
    this.#reportedAt = performance.now();
    this.#report();
  }

  /** Drops a pending report. */
  cancel() {
    clearTimeout(this.#timer);
  }
}
