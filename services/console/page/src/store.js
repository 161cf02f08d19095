// The page's copy of Leo's state: a key-value store with listeners per key prefix.

/** @typedef {Map<string, any>} Changes the changed values by key; `undefined` for a removed key */

export class Store {
  /** @type {Map<string, any>} */
  #values = new Map();
  /** @type {{prefix: string, hear: (changes: Changes) => void}[]} */
  #listeners = [];
  version = 0;
  /** Whether the last message was the full state instead of a delta. */
  fresh = false;

  /**
   * The value of a key, or `undefined`.
   * @param {string} key
   */
  get(key) {
    return this.#values.get(key);
  }

  /**
   * All entries whose keys begin with a prefix, in numeric order.
   * @param {string} prefix
   * @returns {[string, any][]}
   */
  under(prefix) {
    const found = [...this.#values].filter(([key]) => key.startsWith(prefix));
    return found.sort(([a], [b]) => a.localeCompare(b, 'en', { numeric: true }));
  }

  /**
   * The key of the object with a name. Keys change as objects come and go.
   * @param {string} name
   */
  thing(name) {
    for (const [key, value] of this.#values) if (key.startsWith('thing/') && value.name === name) return key;
    return null;
  }

  /**
   * Calls `hear` once per message in which a value under the prefix changed.
   * @param {string | string[]} prefixes
   * @param {(changes: Changes) => void} hear
   */
  on(prefixes, hear) {
    for (const prefix of [prefixes].flat()) this.#listeners.push({ prefix, hear });
  }

  /**
   * Applies a message.
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
