// The list of differences between a perspective and Leo's own beliefs, in words.
import { make } from './element.js';
import { plain, toYou } from './words.js';

/**
 * Updates a list. Unchanged items keep their elements, and with them the focus; they are not read aloud again.
 * @param {HTMLElement} list
 * @param {import('./store.js').Store} store
 * @param {number} perspective
 * @param {(robot: number | null) => void} select
 */
export function listDivergences(list, store, perspective, select) {
  const names = store.get('robot')?.agents ?? {};
  const divergences = perspective === 0 ? [] : store.under(`divide/${perspective}/`);
  const there = new Map([...list.children].map((item) => [/** @type {HTMLElement} */ (item).dataset.divide, /** @type {HTMLElement} */ (item)]));
  for (const [at, [key, divide]] of divergences.entries()) {
    const item = there.get(key) ?? make('li', { data: { divide: key } }, make('button', { type: 'button', onclick: () => select(store.get(key)?.robot ?? null) }));
    there.delete(key);
    const words = plain(toYou(divide.words, names[1] ?? 'the teacher'));
    const aspects = (divide.aspects ?? []).map(aspectWords).join('; ');
    const said = JSON.stringify([divide.kind, words, aspects]);
    if (item.dataset.said !== said) {
      item.dataset.said = said;
      item.dataset.kind = divide.kind;
      item.firstElementChild?.replaceChildren(make('span', { class: `sign ${divide.kind}`, 'aria-hidden': 'true' }), words,
        ...(aspects === '' ? [] : [make('small', { text: aspects })]));
    }
    if (list.children[at] !== item) list.insertBefore(item, list.children[at] ?? null);
  }
  for (const gone of there.values()) gone.remove();
}

/** @param {any} aspect */
function aspectWords({ percept, robot, other }) {
  return `${percept}: ${other ?? 'nothing'}, to Leo ${robot ?? 'nothing'}`;
}
