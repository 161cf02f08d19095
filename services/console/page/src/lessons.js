// The lesson that is on: which one, in which phase, and what can be done with it.
import { find, make, write } from './element.js';

const MODES = /** @type {Record<string, string>} */ ({
  script: 'The lesson plays',
  'set-up': 'You set the table',
  teaching: 'You teach',
});

/**
 * What to call a table of a lesson: the last one is the novel set.
 * @param {number} table from 0
 * @param {number} tables how many
 */
export function tableName(table, tables) {
  return tables > 1 && table === tables - 1 ? 'the new things' : `table ${table + 1}`;
}

/**
 * What to call a lesson in the list: those of one title by their names as well, and those that cannot be opened.
 * @param {{id: string, title: string, error?: string}[]} all
 * @param {number} at which of them
 */
export function lessonName(all, at) {
  const { id, title, error } = all[at];
  if (error !== undefined) return `${title}: cannot be opened`;
  const isAlone = all.every((other, place) => place === at || other.error !== undefined || other.title !== title);
  return isAlone || id === '' ? title : `${title} (${id})`;
}

/**
 * How a recording goes, in words.
 * @param {{seconds: number, bytes: number, dropped: number}} recording
 */
export function recordingWords({ seconds, bytes, dropped }) {
  const lost = dropped > 0 ? `, ${dropped} dropped` : '';
  return `Recording ${Math.round(seconds)} s, ${(bytes / 1e6).toFixed(1)} MB${lost}`;
}

/**
 * What a recording that has ended came to, in words.
 * @param {{file: string, dropped: number}} recording
 */
export function recordedWords({ file, dropped }) {
  const lost = dropped > 0 ? `; ${dropped} ${dropped === 1 ? 'frame was' : 'frames were'} dropped` : '';
  return `The recording is in ${file}${lost}`;
}

export class Lessons {
  #cells;
  #ask;
  #toasts;
  #saved = '';
  /** The file of the recording that runs, or is being ended. @type {string | null} */
  #running = null;
  /** The lesson that is open, as the picker calls it. */
  #open = '';

  /**
   * @param {import('./cells.js').Cells} cells
   * @param {(what: string, content?: any) => Promise<any>} ask
   * @param {import('./toasts.js').Toasts} toasts
   */
  constructor(cells, ask, toasts) {
    this.#cells = cells;
    this.#ask = ask;
    this.#toasts = toasts;
    cells.on(['workspace', 'lessons'], () => this.#update());
    cells.on('recording', () => this.#recording());
    const lesson = /** @type {HTMLSelectElement} */ (find('lesson'));
    lesson.addEventListener('change', async () => {
      const why = lesson.selectedOptions[0]?.dataset.error;
      if (why !== undefined) toasts.show(why, 'error');
      const answer = why === undefined ? await ask('open', { lesson: lesson.value }) : { error: why };
      // What is open stays open, and stands there.
      if (answer.error !== undefined) this.#choose();
    });
    find('play').addEventListener('click', () => ask('play'));
    find('clear').addEventListener('click', () => ask('clear'));
    find('undo').addEventListener('click', () => ask('undo'));
    const lay = /** @type {HTMLSelectElement} */ (find('lay'));
    lay.addEventListener('change', () => {
      ask('lay', { table: Number(lay.value) });
      lay.value = '';
    });
    find('record').addEventListener('click', () => ask('record', { on: cells.get('recording')?.on !== true }));
    find('keep').addEventListener('click', async () => {
      const answer = await ask('keep');
      if (answer.ok) toasts.show(`The last minutes are in ${answer.file}`);
    });
    this.#saving();
  }

  #saving() {
    const dialog = /** @type {HTMLDialogElement} */ (find('save-dialog'));
    const title = /** @type {HTMLInputElement} */ (find('save-title'));
    find('save').addEventListener('click', () => {
      title.value = this.#cells.get('workspace')?.title ?? '';
      dialog.showModal();
      title.select();
    });
    find('save-form').addEventListener('submit', async (event) => {
      event.preventDefault();
      if (title.value.trim() === '') return;
      dialog.close();
      await this.#ask('save', { title: title.value.trim() });
    });
    find('save-cancel').addEventListener('click', () => dialog.close());
  }

  #update() {
    const workspace = this.#cells.get('workspace');
    const lessons = this.#cells.get('lessons') ?? [];
    if (workspace === undefined) return;
    this.#pick(lessons, workspace);
    const about = lessons.find((/** @type {any} */ each) => each.id === workspace.lesson);
    const lacks = workspace.lacks ?? about?.lacks;
    const lacking = lacks ? `For that, leo.toml has to say ${lacks}.` : '';
    write(find('watch'), [workspace.watch || about?.watch || '', lacking].filter(Boolean).join(' '));
    const table = workspace.table === null ? '' : `, ${tableName(workspace.table, workspace.tables)}`;
    write(find('mode'), workspace.simulated ? `${MODES[workspace.mode] ?? workspace.mode}${table}` : 'Leo watches the real table');
    document.body.dataset.mode = workspace.mode;
    document.body.dataset.simulated = String(workspace.simulated);
    for (const id of ['play', 'clear', 'lay', 'undo', 'save', 'lesson']) {
      /** @type {HTMLButtonElement} */ (find(id)).disabled = !workspace.simulated;
    }
    if (workspace.saved && workspace.saved !== this.#saved) this.#toasts.show(`Saved as ${workspace.saved}`);
    this.#saved = workspace.saved ?? '';
  }

  /** @param {any[]} lessons @param {any} workspace */
  #pick(lessons, workspace) {
    const lesson = /** @type {HTMLSelectElement} */ (find('lesson'));
    const whole = lessons.filter(({ error }) => error === undefined);
    const known = whole.find(({ id }) => id === workspace.lesson) ?? whole.find(({ title }) => title === workspace.title);
    const all = known === undefined ? [{ id: workspace.lesson, title: workspace.title }, ...lessons] : lessons;
    this.#open = known?.id ?? workspace.lesson;
    const said = JSON.stringify(all.map(({ id, title, error }) => [id, title, error]));
    const isNew = lesson.dataset.said !== said;
    if (isNew) {
      lesson.dataset.said = said;
      lesson.replaceChildren(...all.map(({ id, error }, at) => make('option', { value: id, text: lessonName(all, at), data: error === undefined ? {} : { error } })));
    }
    // Who is choosing is not disturbed, where there is still what he chooses of.
    if (isNew || document.activeElement !== lesson) this.#choose();
    const lay = /** @type {HTMLSelectElement} */ (find('lay'));
    if (lay.dataset.said === String(workspace.tables)) return;
    lay.dataset.said = String(workspace.tables);
    const tables = Array.from({ length: workspace.tables }, (_, n) => make('option', { value: n, text: `Lay ${tableName(n, workspace.tables)}` }));
    lay.replaceChildren(make('option', { value: '', text: 'Lay…' }), ...tables);
  }

  /** What is open is what is chosen. */
  #choose() {
    /** @type {HTMLSelectElement} */ (find('lesson')).value = this.#open;
  }

  #recording() {
    const recording = this.#cells.get('recording');
    const button = find('record');
    const on = recording?.on === true;
    button.setAttribute('aria-pressed', String(on));
    write(/** @type {Element} */ (button.querySelector('.label')), on ? recordingWords(recording) : 'Record');
    button.title = recording?.file ?? 'Write what happens into a file';
    if (recording?.error && button.dataset.error !== recording.error) this.#toasts.show(recording.error, 'error');
    button.dataset.error = recording?.error ?? '';
    // It is told once all of it is written: until then the file is that of the one before.
    const running = this.#running;
    this.#running = on ? recording.file : recording?.error ? null : running;
    if (on || running === null || recording?.file !== running) return;
    this.#running = null;
    this.#toasts.show(recordedWords(recording));
  }
}
