// The dialogue: the log of utterances and events, and the buttons and field for speaking.
import { find, make } from './element.js';
import { listening } from './speech.js';
import { capital, likelihood, plain, ruleWords, thoughtWords, toYou } from './words.js';

/** The usual sentences; `…` stands for the task's name. */
const SENTENCES = [
  { text: 'Leo, I can teach you to do …', group: 'teach' },
  { text: '… is done', group: 'teach' },
  { text: 'Leo, do …', group: 'teach' },
  { text: 'Like this', group: 'mend' },
  { text: 'No', group: 'mend' },
  { text: 'Not that one', group: 'mend' },
  { text: 'What did you learn?', group: 'ask' },
  { text: 'Why?', group: 'ask' },
  { text: 'What do you think I see?', group: 'ask' },
];

const LABELS = /** @type {Record<string, string>} */ ({
  sees: 'sees', saw: 'saw', thinks: 'thinks', rule: 'rule', why: 'because', does: 'does',
  done: 'done', failed: 'failed', result: 'result', note: 'note', knows: 'knows',
});

/** Delay after a full state until the live region is read aloud again. */
const HUSHED_MS = 300;
/** The log's end counts as in view within this distance. */
const END_PX = 40;

/**
 * The task that a sentence begins or asks for. Pure.
 * @param {string} text
 * @returns {string | null}
 */
export function taskOf(text) {
  return /(?:teach you to do|^leo,? do) (.+?)[.!]?$/i.exec(text.trim())?.[1] ?? null;
}

/**
 * A line's text without the quotes around an utterance.
 * @param {{kind: string, text: string}} line
 */
export function spoken({ kind, text }) {
  return kind === 'said' ? text.replace(/^"(.*)"$/s, '$1') : text;
}

export class Dialogue {
  #store;
  #say;
  #log = find('log');
  #box = find('log-box');
  #field = /** @type {HTMLInputElement} */ (find('say'));
  #task = /** @type {HTMLInputElement} */ (find('task-name'));
  /** @type {Map<string, HTMLElement>} */
  #lines = new Map();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #hushed;
  /** Whether the newest line is in view; it then stays so when lines come and when the box changes its size. */
  #isAtEnd = true;
  /** Whether the teacher has named the task on this page. */
  #isNamed = false;

  /**
   * @param {import('./store.js').Store} store
   * @param {(text: string) => Promise<any>} say
   * @param {import('./toasts.js').Toasts} toasts
   */
  constructor(store, say, toasts) {
    this.#store = store;
    this.#say = say;
    store.on('line/', (changes) => this.#update(changes));
    this.#box.addEventListener('scroll', () => this.#look());
    new ResizeObserver(() => this.#follow()).observe(this.#box);
    find('say-form').addEventListener('submit', (event) => {
      event.preventDefault();
      this.#speak(this.#field.value);
    });
    const buttons = find('sentences');
    for (const { text, group } of SENTENCES) {
      const button = make('button', { type: 'button', class: `sentence ${group}`, data: { sentence: text } });
      button.addEventListener('click', () => this.#speak(this.#filled(text)));
      buttons.append(button);
    }
    this.#task.addEventListener('input', () => {
      this.#isNamed = true;
      this.#label();
    });
    this.#label();
    const microphone = /** @type {HTMLButtonElement} */ (find('listen'));
    listening(microphone, (text) => {
      this.#field.value = text;
      this.#field.focus();
    }, (why) => {
      toasts.show(why);
      this.#field.focus();
    });
  }

  /** @param {string} text */
  #filled(text) {
    const task = this.#task.value.trim() || 'task 1';
    return capital(text.replace('…', task));
  }

  #label() {
    for (const button of find('sentences').children) {
      button.textContent = this.#filled(/** @type {HTMLElement} */ (button).dataset.sentence ?? '');
    }
  }

  /** @param {string} text */
  async #speak(text) {
    if (text.trim() === '') return;
    const answer = await this.#say(text.trim());
    if (answer.error !== undefined) return;
    if (this.#field.value.trim() === text.trim()) this.#field.value = '';
    const task = taskOf(text);
    if (task === null) return;
    this.#isNamed = true;
    this.#name(task);
  }

  /** @param {string} task */
  #name(task) {
    if (this.#task.value === task) return;
    this.#task.value = task;
    this.#label();
  }

  /** Takes the task from the newest sentence that begins or asks for one: a page may be opened in the middle of it. */
  #recall() {
    if (this.#isNamed || document.activeElement === this.#task) return;
    const spokenOf = this.#store.under('line/').map(([, line]) => (line.kind === 'said' ? taskOf(spoken(line)) : null)).filter((task) => task !== null);
    const last = spokenOf.at(-1);
    if (last !== undefined) this.#name(last);
  }

  /** Notes where the reader is. A box that has changed its size follows first. */
  #look() {
    const { scrollHeight, scrollTop, clientHeight } = this.#box;
    this.#isAtEnd = scrollHeight - scrollTop - clientHeight < END_PX;
  }

  #follow() {
    if (this.#isAtEnd) this.#box.scrollTop = this.#box.scrollHeight;
  }

  /** @param {import('./store.js').Changes} changes */
  #update(changes) {
    if (this.#store.fresh) this.#hush();
    for (const [key, line] of changes) {
      const there = this.#lines.get(key);
      const said = line === undefined ? '' : JSON.stringify([line, this.#names()]);
      if (there !== undefined && there.dataset.said === said) continue;
      there?.remove();
      this.#lines.delete(key);
      if (line === undefined) continue;
      const item = this.#item(key, line);
      item.dataset.said = said;
      this.#lines.set(key, item);
      this.#place(item);
    }
    this.#recall();
    this.#follow();
  }

  /** Mutes the live region: lines from before the page was connected are not read aloud. */
  #hush() {
    this.#box.setAttribute('aria-live', 'off');
    clearTimeout(this.#hushed);
    this.#hushed = setTimeout(() => this.#box.setAttribute('aria-live', 'polite'), HUSHED_MS);
  }

  /** Inserts a line by its serial; a message may contain lines in any order. @param {HTMLElement} item */
  #place(item) {
    const serial = (/** @type {Element} */ each) => Number(/** @type {HTMLElement} */ (each).dataset.serial);
    let before = this.#log.lastElementChild;
    while (before !== null && serial(before) > serial(item)) before = before.previousElementSibling;
    if (before === null) this.#log.prepend(item);
    else before.after(item);
  }

  /** @returns {Record<number, string>} */
  #names() {
    return this.#store.get('robot')?.agents ?? {};
  }

  /** @param {string} key @param {any} line */
  #item(key, line) {
    const names = this.#names();
    const said = line.kind === 'said';
    const who = line.who === names[1] ? 'You' : line.who === null ? '' : capital(line.who ?? '');
    const side = !said ? 'event' : line.who === names[0] ? 'leo' : line.who === names[1] ? 'you' : 'other';
    const apart = line.kind === 'knows' && !/ agree | no longer /.test(line.text) ? 'apart' : '';
    const item = make('li', { class: `line ${side} ${line.kind} ${apart}`, data: { serial: key.slice(5), kind: line.kind } });
    if (said) item.append(make('span', { class: 'who', text: who }), make('p', { text: spoken(line) }));
    else item.append(make('span', { class: 'what', text: LABELS[line.kind] ?? line.kind }), told(line, names));
    item.title = `${Number(line.t).toFixed(2)} s`;
    return item;
  }
}

/**
 * An event in words; the figures of a hypothesis are shown on demand.
 * @param {{kind: string, text: string}} line
 * @param {Record<string, string>} names
 */
function told({ kind, text }, names) {
  if (kind === 'knows') return make('p', { text: plain(toYou(text, names[1] ?? '')) });
  if (kind === 'rule') return make('p', { text: ruleWords(text, names) });
  const thought = kind === 'thinks' ? thoughtWords(text, names) : null;
  if (thought === null) return make('p', { text: plain(text) });
  const { words, posterior, figures } = thought;
  return make('details', {}, make('summary', { text: `${words}: ${likelihood(posterior)}` }), make('p', { text: figures }));
}
