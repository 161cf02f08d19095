// What divides a perspective from Leo's own, in words.
import { make } from './element.js';
import { toYou } from './words.js';

/**
 * @param {HTMLElement} list
 * @param {import('./cells.js').Cells} cells
 * @param {number} perspective
 * @param {(robot: number | null) => void} select
 */
export function listDivides(list, cells, perspective, select) {
  const names = cells.get('robot')?.agents ?? {};
  const divides = perspective === 0 ? [] : cells.under(`divide/${perspective}/`);
  const items = divides.map(([key, divide]) => {
    const aspects = (divide.aspects ?? []).map(aspectWords).join('; ');
    const button = make('button', { type: 'button', onclick: () => select(divide.robot) },
      make('span', { class: `sign ${divide.kind}`, 'aria-hidden': 'true' }), toYou(divide.words, names[1] ?? 'the teacher'));
    if (aspects !== '') button.append(make('small', { text: aspects }));
    return make('li', { data: { divide: key, kind: divide.kind } }, button);
  });
  const text = items.map((item) => item.textContent).join();
  if (list.dataset.text === text) return;
  list.dataset.text = text;
  list.replaceChildren(...items);
}

/** @param {any} aspect */
function aspectWords({ percept, robot, other }) {
  return `${percept}: ${other ?? 'nothing'}, to Leo ${robot ?? 'nothing'}`;
}
