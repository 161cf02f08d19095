// Short notes at the edge of the page: errors and confirmations.
import { make } from './element.js';

const STAYS_MS = 7000;

export class Toasts {
  #list;

  /** @param {HTMLElement} list a live region */
  constructor(list) {
    this.#list = list;
  }

  /** @param {string} text @param {'error' | 'note'} [kind] */
  show(text, kind = 'note') {
    const same = [...this.#list.children].find((child) => child.firstElementChild?.textContent === text);
    same?.remove();
    const toast = make('div', { class: `toast ${kind}`, role: kind === 'error' ? 'alert' : undefined },
      make('span', { text }),
      make('button', { type: 'button', 'aria-label': 'Close this note', text: '×', onclick: () => toast.remove() }));
    this.#list.append(toast);
    setTimeout(() => toast.remove(), STAYS_MS);
  }
}
