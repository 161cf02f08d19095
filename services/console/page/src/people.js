// Who is at the table of the lesson, and who was and may come back: the scene has only those who are there.

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

  /** Everyone who was there since the lesson was opened, by their numbers. */
  all() {
    return [...this.#seen].sort((a, b) => a - b);
  }

  /** Whether somebody has left, or never came: of a real table nobody tells. @param {number} agent */
  isAway(agent) {
    return this.#cells.get('workspace')?.simulated === true && !this.#here().includes(agent);
  }
}
