// The cells of Leo's state that the page holds: keys to values, and who wants to hear of which.

/** @typedef {Map<string, any>} Changes what changed, by key; `undefined` where a cell is gone */

export class Cells {
  /** @type {Map<string, any>} */
  #values = new Map();
  /** @type {{prefix: string, hear: (changes: Changes) => void}[]} */
  #listeners = [];
  version = 0;
  /** Whether the message that was taken in last holds all that there is, and not what changed. */
  fresh = false;

  /**
   * The value under a key, or `undefined`.
   * @param {string} key
   */
  get(key) {
    return this.#values.get(key);
  }

  /**
   * All cells whose keys begin with a prefix, in the order of their numbers.
   * @param {string} prefix
   * @returns {[string, any][]}
   */
  under(prefix) {
    const found = [...this.#values].filter(([key]) => key.startsWith(prefix));
    return found.sort(([a], [b]) => a.localeCompare(b, 'en', { numeric: true }));
  }

  /**
   * The key of the thing of a name: what stands under a key changes whenever things come and go.
   * @param {string} name
   */
  thing(name) {
    for (const [key, value] of this.#values) if (key.startsWith('thing/') && value.name === name) return key;
    return null;
  }

  /**
   * Calls `hear` once per message in which a cell under the prefix changed.
   * @param {string | string[]} prefixes
   * @param {(changes: Changes) => void} hear
   */
  on(prefixes, hear) {
    for (const prefix of [prefixes].flat()) this.#listeners.push({ prefix, hear });
  }

  /**
   * Takes a message of cells in.
   * @param {{version: number, fresh: boolean, cells: Record<string, any>}} message
   */
  apply(message) {
    /** @type {Changes} */
    const changes = new Map();
    if (message.fresh) {
      for (const key of this.#values.keys()) changes.set(key, undefined);
      this.#values.clear();
    }
    for (const [key, value] of Object.entries(message.cells)) {
      if (value === null) {
        this.#values.delete(key);
        changes.set(key, undefined);
      } else {
        this.#values.set(key, value);
        changes.set(key, value);
      }
    }
    this.version = message.version;
    this.fresh = message.fresh;
    this.#tell(changes);
  }

  /** @param {Changes} changes */
  #tell(changes) {
    /** @type {Map<(changes: Changes) => void, Changes>} */
    const heard = new Map();
    for (const { prefix, hear } of this.#listeners) {
      for (const [key, value] of changes) {
        if (!key.startsWith(prefix)) continue;
        const theirs = heard.get(hear) ?? new Map();
        heard.set(hear, theirs.set(key, value));
      }
    }
    for (const [hear, theirs] of heard) hear(theirs);
  }
}
