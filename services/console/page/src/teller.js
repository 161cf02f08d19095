// A throttle: reports a changing state at a limited rate, and always its last value.

/** Minimum interval between two reports. */
const EVERY_MS = 50;

export class Teller {
  #tell;
  #told = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #later;

  /** @param {() => void} tell reports the current state */
  constructor(tell) {
    this.#tell = tell;
  }

  /** The state has changed: reports it now, or when the interval is over. */
  tell() {
    const wait = this.#told + EVERY_MS - performance.now();
    clearTimeout(this.#later);
    if (wait > 0) {
      this.#later = setTimeout(() => this.tell(), wait);
      return;
    }
    this.#told = performance.now();
    this.#tell();
  }

  /** Drops a pending report. */
  hush() {
    clearTimeout(this.#later);
  }
}
