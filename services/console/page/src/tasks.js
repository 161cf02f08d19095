// The task panel: the hypotheses of all perspectives side by side, the chosen rule, and the performances.
import { find, make } from './element.js';
import { asSeenBy, likelihood, plain } from './words.js';

const SHOWN = 4;
const SAME = 1e-6;
/** True of a demonstration that goes on, and of one that was cancelled. */
const NO_EXAMPLE = 'No demonstration is complete yet. At the end of one, say that it is done: then Leo weighs what you could have meant.';

/**
 * The hypotheses of one perspective, the best ones first, and whether the best are tied. Pure.
 * @param {any[]} hypotheses
 */
export function ranking(hypotheses) {
  const sorted = [...hypotheses].sort((a, b) => a.rank - b.rank || b.posterior - a.posterior);
  const best = sorted[0]?.posterior ?? 0;
  const leading = sorted.filter((each) => Math.abs(each.posterior - best) < SAME && best > 0);
  return {
    sorted,
    tied: leading.length > 1 ? leading.map((each) => each.name) : [],
  };
}

/**
 * The perspective of a key of hypotheses: "robot" is Leo's own, "human" the first teacher's. Pure.
 * @param {string} key
 * @returns {number[]} the agents, from the outermost inwards
 */
export function pathOf(key) {
  if (key === 'robot' || key === '0') return [];
  if (key === 'human') return [1];
  return [Number(key.replace(/\D+/g, '')) || 1];
}

/** @param {number} posterior */
export function percent(posterior) {
  if (posterior >= 0.9995) return '100 %';
  if (posterior > 0 && posterior < 0.0005) return '< 0.1 %';
  return `${(100 * posterior).toFixed(posterior >= 0.1 ? 0 : 1)} %`;
}

export class Tasks {
  #store;
  #panel = find('tasks');
  /** @type {Map<string, HTMLElement>} */
  #shown = new Map();

  /** @param {import('./store.js').Store} store */
  constructor(store) {
    this.#store = store;
    store.on('task/', (changes) => {
      for (const key of changes.keys()) this.#update(key);
      find('tasks-empty').hidden = this.#shown.size > 0;
    });
    store.on('robot', () => {
      for (const key of this.#shown.keys()) this.#update(key);
    });
  }

  /** @param {string} key */
  #update(key) {
    const task = this.#store.get(key);
    const old = this.#shown.get(key);
    if (task === undefined) {
      old?.remove();
      this.#shown.delete(key);
      return;
    }
    const next = this.#section(task);
    if (old === undefined) this.#panel.prepend(next);
    else old.replaceWith(next);
    this.#shown.set(key, next);
  }

  /** @param {any} task */
  #section(task) {
    const plural = task.examples === 1 ? 'demonstration' : 'demonstrations';
    const section = make('section', { class: 'task', data: { task: task.name } },
      make('header', {}, make('h3', { text: task.name }), make('span', { class: 'count', text: `${task.examples} ${plural}` })));
    if (task.rule !== null && task.rule !== undefined) section.append(this.#rule(task));
    if (task.examples === 0) section.append(make('p', { class: 'quiet', text: NO_EXAMPLE }));
    const views = make('div', { class: 'perspectives' });
    const keys = Object.keys(task.hypotheses ?? {}).sort((a, b) => pathOf(a).length - pathOf(b).length || a.localeCompare(b));
    for (const key of keys) views.append(this.#perspective(task, key));
    section.append(views);
    const performances = task.performances ?? [];
    performances.forEach((/** @type {any} */ each, /** @type {number} */ at) => section.append(performed(each, at === performances.length - 1)));
    return section;
  }

  /** @param {any} task */
  #rule(task) {
    const rule = make('p', { class: 'rule', data: { rule: task.rule.name, perspective: task.rule.perspective } },
      make('span', { class: 'key', text: 'Leo goes by' }), ' ', make('strong', { text: plain(task.rule.name) }),
      make('span', { class: 'whose', text: ` ${this.#whose(String(task.rule.perspective))}` }));
    if (!task.explanation) return rule;
    return make('div', {}, rule, make('p', { class: 'why', text: `“${task.explanation}”` }));
  }

  /** @param {string} key of a perspective */
  #whose(key) {
    const robot = this.#store.get('robot');
    return asSeenBy(pathOf(key), robot?.agents ?? {});
  }

  /** @param {any} task @param {string} key */
  #perspective(task, key) {
    const { sorted, tied } = ranking(task.hypotheses[key]);
    const list = make('ol', { class: 'hypotheses' });
    const rest = make('ol', { class: 'hypotheses' });
    sorted.forEach((each, at) => {
      const chosen = String(task.rule?.perspective) === key && task.rule?.name === each.name;
      (at < SHOWN ? list : rest).append(bar(each, task.examples, chosen, tied.includes(each.name)));
    });
    const box = make('div', { class: `perspective ${pathOf(key).length === 0 ? 'robot' : 'partner'}`, data: { perspective: key } },
      make('h4', { text: this.#whose(key) }), list);
    if (sorted.length === 0) box.append(make('p', { class: 'quiet', text: 'nothing yet' }));
    if (rest.children.length > 0) {
      box.append(make('details', {}, make('summary', { text: `${rest.children.length} less likely` }), rest));
    }
    return box;
  }
}

/**
 * @param {any} hypothesis
 * @param {number} examples
 * @param {boolean} chosen
 * @param {boolean} tied
 */
function bar({ name, posterior, tally }, examples, chosen, tied) {
  const fill = make('span', { class: 'fill' });
  fill.style.width = `${(100 * posterior).toFixed(1)}%`;
  const tags = [];
  if (chosen) tags.push(make('span', { class: 'tag chosen', text: 'chosen' }));
  if (tied) tags.push(make('span', { class: 'tag tied', text: 'equally likely' }));
  return make('li', { class: chosen ? 'chosen' : '', data: { hypothesis: name, posterior, tally } },
    make('span', { class: 'name' }, plain(name), ...tags),
    make('span', { class: 'bar', 'aria-hidden': 'true' }, fill),
    make('details', { class: 'figures' }, make('summary', { text: likelihood(posterior) }),
      make('span', { class: 'numbers', title: `posterior ${posterior}` },
        `${percent(posterior)}`, ' · explains ', make('span', { class: 'tally', text: `${tally}/${examples}` }), ' demonstrations')));
}

/** @param {any} performance @param {boolean} open */
function performed({ done, failed, result }, open) {
  const list = make('ul', {});
  for (const text of done ?? []) list.append(make('li', { class: 'done', text: plain(text) }));
  for (const text of failed ?? []) list.append(make('li', { class: 'failed', text: `failed: ${plain(text)}` }));
  return make('details', { class: 'performance', open, data: { result: result ?? '' } },
    make('summary', {}, 'Performed', result ? make('strong', { text: ` ${result}` }) : ' …'), list);
}
