// The people of the lesson. The scene contains only those at the table; the lesson lists all of them.

/** Requests that name the acting teacher. A request for a seat names its teacher itself. */
const ACTS = new Set(['say', 'take', 'leave', 'return', 'screen', 'undo']);

/**
 * The content of a request, with the acting teacher added if it is an act. Pure.
 * @param {string} what the value of `do`
 * @param {Record<string, any> | undefined} content
 * @param {number | null} teacher the acting teacher; `null` if there is only one
 */
export function signed(what, content, teacher) {
  return teacher === null || !ACTS.has(what) ? content : { teacher, ...content };
}

export class People {
  #store;
  /** @type {Set<number>} */
  #seen = new Set();
  #lesson = '';

  /** @param {import('./store.js').Store} store */
  constructor(store) {
    this.#store = store;
    store.on(['thing/', 'workspace'], () => this.#update());
  }

  #update() {
    const { lesson, title } = this.#store.get('workspace') ?? {};
    const now = `${lesson} ${title}`;
    if (now !== this.#lesson) this.#seen.clear();
    this.#lesson = now;
    for (const agent of this.#here()) this.#seen.add(agent);
  }

  #here() {
    const things = this.#store.under('thing/').map(([, thing]) => thing);
    return things.filter(({ kind }) => kind === 'person').map(({ agent }) => agent);
  }

  /** The numbers of all people of the lesson, and of those seen since it was opened. */
  all() {
    const { simulated, people = [] } = this.#store.get('workspace') ?? {};
    return [...new Set([...(simulated ? people : []), ...this.#seen])].sort((a, b) => a - b);
  }

  /** Whether a person is away from the table; always `false` on a real robot. @param {number} agent */
  isAway(agent) {
    return this.#store.get('workspace')?.simulated === true && !this.#here().includes(agent);
  }
}
