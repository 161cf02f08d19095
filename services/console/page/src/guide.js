// The first steps of a newcomer: sit down, show a task, let Leo do it; and the help, which lists them again.
import { find, make, write } from './element.js';
import { remember, remembered } from './memory.js';

const KEY = 'leo-first-steps';
/** Remembered of a visitor who has finished or skipped the steps. */
const OVER = 'over';

export const STEPS = [
  {
    title: 'Sit down',
    text: 'The picture is what you see. Drag its background to move your head. What Leo thinks you can see changes at once: compare the two pictures of beliefs.',
  },
  {
    title: 'Show a task',
    text: 'Press “Leo, I can teach you to do task 1” in the dialogue. Then drag things in the picture, such as pegs into holes. At the end press “Task 1 is done”.',
  },
  {
    title: 'Let Leo do it',
    text: 'Choose “Lay the new things” at the top, on a phone in the menu. Then press “Leo, do task 1” in the dialogue. Ask “Why?” to hear the reason.',
  },
];

/**
 * The step at which a visitor begins; `null` if they need none. A path that was begun goes on after a reload. What the
 * script of the robot's first lesson has taught does not count. Pure.
 * @param {{examples: number, demonstrations?: {counts: boolean}[]}[]} tasks
 * @param {string | null} kept what the browser remembers of the visitor
 * @param {string} mode of the table
 * @returns {number | null}
 */
export function firstStep(tasks, kept, mode) {
  if (kept === OVER) return null;
  const begun = Number(kept ?? 0);
  if (begun > 0 && begun < STEPS.length) return begun;
  const isScript = mode === 'script' || mode === 'over';
  const ofScript = (/** @type {{counts: boolean}[]} */ demonstrations) => (isScript ? demonstrations.filter(({ counts }) => counts).length : 0);
  return tasks.some(({ examples, demonstrations }) => examples > ofScript(demonstrations ?? [])) ? null : 0;
}

/**
 * Whether the visitor has done what a step asks for. Pure.
 * @param {number} step
 * @param {{mode: string | undefined, examples: number, performed: number}} before when the step began
 * @param {{mode: string | undefined, examples: number, performed: number}} now
 */
export function isDone(step, before, now) {
  // What the lesson's script does is no act of the visitor.
  if (step === 1) return now.mode === 'teaching' && now.examples > before.examples;
  return step === 2 && now.performed > before.performed;
}

export class Guide {
  #store;
  #box = find('guide');
  /** The shown step. @type {number | null} */
  #step = null;
  #before;
  #isDecided = false;

  /** @param {import('./store.js').Store} store */
  constructor(store) {
    this.#store = store;
    this.#before = this.#standing();
    store.on('workspace', () => this.#decide());
    store.on(['task/', 'workspace'], () => this.#advance());
    find('guide-next').addEventListener('click', () => this.#show((this.#step ?? 0) + 1, true));
    find('guide-skip').addEventListener('click', () => this.#show(STEPS.length, true));
    this.#helping();
  }

  #helping() {
    const dialog = /** @type {HTMLDialogElement} */ (find('help-dialog'));
    find('help-steps').replaceChildren(...STEPS.map(({ title, text }) => make('li', {}, make('strong', { text: `${title}. ` }), text)));
    find('help').addEventListener('click', () => dialog.showModal());
    find('help-guide').addEventListener('click', () => {
      dialog.close();
      this.#show(0, true);
    });
  }

  /** Decides once whether the visitor needs the steps. */
  #decide() {
    // Without a simulator nothing can be moved on the page; while Leo starts it is not there yet.
    if (this.#isDecided || this.#store.get('workspace')?.simulated !== true) return;
    this.#isDecided = true;
    const first = firstStep(this.#tasks(), remembered(KEY), this.#store.get('workspace').mode);
    if (first !== null) this.#show(first, false);
  }

  #advance() {
    if (this.#step !== null && isDone(this.#step, this.#before, this.#standing())) this.#show(this.#step + 1, false);
  }

  /** @param {number} step @param {boolean} focus whether the visitor asked for it */
  #show(step, focus) {
    const isOver = step >= STEPS.length;
    this.#step = isOver ? null : step;
    this.#before = this.#standing();
    remember(KEY, isOver ? OVER : String(step));
    this.#box.hidden = isOver;
    if (isOver) {
      if (focus) find('help').focus();
      return;
    }
    const { title, text } = STEPS[step];
    write(find('guide-title'), `Step ${step + 1} of ${STEPS.length}: ${title}`);
    write(find('guide-text'), text);
    write(find('guide-next'), step === STEPS.length - 1 ? 'Done' : 'Next');
    if (focus) find('guide-title').focus();
  }

  /** @returns {any[]} */
  #tasks() {
    return this.#store.under('task/').map(([, task]) => task);
  }

  #standing() {
    const tasks = this.#tasks();
    const ended = tasks.flatMap(({ performances }) => performances ?? []).filter(({ result }) => result);
    return {
      mode: this.#store.get('workspace')?.mode,
      examples: tasks.reduce((sum, { examples }) => sum + examples, 0),
      performed: ended.length,
    };
  }
}
