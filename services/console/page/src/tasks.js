// What Leo makes of the demonstrations: the hypotheses of every perspective side by side, the rule, and its performances.
import { find, make } from './element.js';
import { asSeenBy } from './words.js';

const SHOWN = 4;
const SAME = 1e-6;

/**
 * The hypotheses of one perspective as they are shown: the best ones first, and which of them are tied. Pure.
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

/** @param {number} posterior */
export function percent(posterior) {
  if (posterior >= 0.9995) return '100 %';
  if (posterior > 0 && posterior < 0.0005) return '< 0.1 %';
  return `${(100 * posterior).toFixed(posterior >= 0.1 ? 0 : 1)} %`;
}

export class Tasks {
  #cells;
  #panel = find('tasks');
  /** @type {Map<string, HTMLElement>} */
  #shown = new Map();

  /** @param {import('./cells.js').Cells} cells */
  constructor(cells) {
    this.#cells = cells;
    cells.on('task/', (changes) => {
      for (const key of changes.keys()) this.#update(key);
      find('tasks-empty').hidden = this.#shown.size > 0;
    });
    cells.on('robot', () => {
      for (const key of this.#shown.keys()) this.#update(key);
    });
  }

  /** @param {string} key */
  #update(key) {
    const task = this.#cells.get(key);
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
    const views = make('div', { class: 'perspectives' });
    for (const perspective of Object.keys(task.hypotheses ?? {}).sort((a, b) => Number(a) - Number(b))) {
      views.append(this.#perspective(task, Number(perspective)));
    }
    section.append(views);
    for (const performance of task.performances ?? []) section.append(performed(performance));
    return section;
  }

  /** @param {any} task */
  #rule(task) {
    const rule = make('p', { class: 'rule', data: { rule: task.rule.name, perspective: task.rule.perspective } },
      make('span', { class: 'key', text: 'Leo goes by' }), ' ', make('strong', { text: task.rule.name }),
      make('span', { class: 'whose', text: ` ${this.#whose(task.rule.perspective)}` }));
    if (!task.why) return rule;
    return make('div', {}, rule, make('p', { class: 'why', text: `“${task.why}”` }));
  }

  /** @param {number} number */
  #whose(number) {
    const robot = this.#cells.get('robot');
    const perspective = robot?.perspectives?.find((/** @type {any} */ each) => each.number === number);
    return asSeenBy(perspective ?? { number, agents: number === 0 ? [] : [number] }, robot?.agents ?? {});
  }

  /** @param {any} task @param {number} number */
  #perspective(task, number) {
    const { sorted, tied } = ranking(task.hypotheses[number]);
    const list = make('ol', { class: 'hypotheses' });
    const rest = make('ol', { class: 'hypotheses' });
    sorted.forEach((each, at) => {
      const chosen = task.rule?.perspective === number && task.rule?.name === each.name;
      (at < SHOWN ? list : rest).append(bar(each, task.examples, chosen, tied.includes(each.name)));
    });
    const box = make('div', { class: `perspective ${number === 0 ? 'robot' : 'partner'}`, data: { perspective: number } },
      make('h4', { text: this.#whose(number) }), list);
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
  if (tied) tags.push(make('span', { class: 'tag tied', text: 'tied' }));
  return make('li', { class: chosen ? 'chosen' : '', data: { hypothesis: name, posterior, tally } },
    make('span', { class: 'name' }, name, ...tags),
    make('span', { class: 'numbers', title: `posterior ${posterior}; consistent with ${tally} of ${examples}` },
      `${percent(posterior)}`, make('span', { class: 'tally', text: ` ${tally}/${examples}` })),
    make('span', { class: 'bar', 'aria-hidden': 'true' }, fill));
}

/** @param {any} performance */
function performed({ done, failed, result }) {
  const list = make('ul', {});
  for (const text of done ?? []) list.append(make('li', { class: 'done', text }));
  for (const text of failed ?? []) list.append(make('li', { class: 'failed', text: `failed: ${text}` }));
  return make('details', { class: 'performance', open: true, data: { result: result ?? '' } },
    make('summary', {}, 'Performed', result ? make('strong', { text: ` ${result}` }) : ' …'), list);
}
