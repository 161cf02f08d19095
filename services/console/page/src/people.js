// Who is at the table, and who left and may come back: the scene has only those who are there, the lesson all.

/** What somebody does: Leo is told who. A seat says itself whose it is. */
const ACTS = new Set(['say', 'take', 'leave', 'return', 'screen', 'undo']);

/**
 * What Leo is asked for, as somebody's act where it is one. Pure.
 * @param {string} what the word under `do`
 * @param {Record<string, any> | undefined} content
 * @param {number | null} teacher who acts on this page, `null` where it can only be one
 */
export function signed(what, content, teacher) {
  return teacher === null || !ACTS.has(what) ? content : { teacher, ...content };
}

export class People {
  #cells;
  /** @type {Set<number>} */
  #seen = new Set();
  #lesson = '';

  /** @param {import('./cells.js').Cells} cells */
  constructor(cells) {
    this.#cells = cells;
    cells.on(['thing/', 'workspace'], () => this.#update());
  }

  #update() {
    const { lesson, title } = this.#cells.get('workspace') ?? {};
    const now = `${lesson} ${title}`;
    if (now !== this.#lesson) this.#seen.clear();
    this.#lesson = now;
    for (const agent of this.#here()) this.#seen.add(agent);
  }

  #here() {
    const things = this.#cells.under('thing/').map(([, thing]) => thing);
    return things.filter(({ kind }) => kind === 'person').map(({ agent }) => agent);
  }

  /** Everyone whom the lesson has, and who was there since it was opened, by their numbers. */
  all() {
    const { simulated, people = [] } = this.#cells.get('workspace') ?? {};
    return [...new Set([...(simulated ? people : []), ...this.#seen])].sort((a, b) => a - b);
  }

  /** Whether somebody has left, or never came: of a real table nobody tells. @param {number} agent */
  isAway(agent) {
    return this.#cells.get('workspace')?.simulated === true && !this.#here().includes(agent);
  }
}
