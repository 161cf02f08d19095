// Tells Leo of something that changes all the time, not more often than is needed, and its last state for certain.

/** So often at most it is told. */
const EVERY_MS = 50;

export class Teller {
  #tell;
  #told = 0;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #later;

  /** @param {() => void} tell what is so when it is called */
  constructor(tell) {
    this.#tell = tell;
  }

  /** It has changed. */
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

  /** What is still to be told is told no more. */
  hush() {
    clearTimeout(this.#later);
  }
}
