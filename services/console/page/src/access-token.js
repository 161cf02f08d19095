// The robot's token: comes with the printed address, and permits reading and commands.

/** Where it is kept. Storage belongs to one port of a host, whereas a cookie is sent to all ports. */
const NAME = 'leo-token';

export class AccessToken {
  #storage;
  /** The token of this page's address. @type {string | null} */
  #opened = null;

  /** @param {() => Storage} storage throws if the browser forbids it; the token then lasts until a reload */
  constructor(storage) {
    this.#storage = storage;
  }

  /**
   * Keeps the token of the page's address, and removes it from the address.
   * @param {{href: string}} location
   * @param {{replaceState: (state: any, unused: string, address: string) => void}} history
   */
  take(location, history) {
    const address = new URL(location.href);
    this.#opened = address.searchParams.get('token');
    if (this.#opened === null) return;
    try {
      this.#storage().setItem(NAME, this.#opened);
    } catch {
      // The browser forbids storage.
    }
    address.searchParams.delete('token');
    history.replaceState(null, '', address.href);
  }

  /** The token, or `null` if this browser has none. */
  get value() {
    if (this.#opened !== null) return this.#opened;
    try {
      return this.#storage().getItem(NAME);
    } catch {
      return null;
    }
  }

  /** The header fields of a request with the token. @returns {Record<string, string>} */
  get headers() {
    const { value } = this;
    return value === null ? {} : { authorization: `Bearer ${value}` };
  }

  /**
   * Whether another page of this browser stored a token.
   * @param {{key: string | null, newValue: string | null}} event
   */
  static isStored(event) {
    return event.key === NAME && event.newValue !== null;
  }
}
