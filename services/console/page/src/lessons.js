// The lesson panel: the open lesson and its mode, recordings, and the lesson's controls.
import { find, make, write } from './element.js';

const MODES = /** @type {Record<string, string>} */ ({
  script: 'The lesson plays',
  over: 'The lesson has ended',
  'set-up': 'You set the table',
  teaching: 'You teach',
});

/**
 * The name of a lesson's table: the last one holds the novel objects.
 * @param {number} table from 0
 * @param {number} tables number of tables
 */
export function tableName(table, tables) {
  return tables > 1 && table === tables - 1 ? 'the new things' : `table ${table + 1}`;
}

/**
 * A lesson's entry in the list. Lessons of equal titles show their names as well; broken ones are marked.
 * @param {{id: string, title: string, error?: string}[]} all
 * @param {number} at index of the lesson
 */
export function lessonName(all, at) {
  const { id, title, error } = all[at];
  if (error !== undefined) return `${title}: cannot be opened`;
  const isAlone = all.every((other, place) => place === at || other.error !== undefined || other.title !== title);
  return isAlone || id === '' ? title : `${title} (${id})`;
}

/**
 * The state of a running recording, in words.
 * @param {{seconds: number, bytes: number, dropped: number}} recording
 */
export function recordingWords({ seconds, bytes, dropped }) {
  const lost = dropped > 0 ? `, ${dropped} dropped` : '';
  return `Recording ${Math.round(seconds)} s, ${(bytes / 1e6).toFixed(1)} MB${lost}`;
}

/**
 * The result of a finished recording, in words.
 * @param {{file: string, dropped: number}} recording
 */
export function recordedWords({ file, dropped }) {
  const lost = dropped > 0 ? `; ${dropped} ${dropped === 1 ? 'frame was' : 'frames were'} dropped` : '';
  return `The recording is in ${file}${lost}`;
}

export class Lessons {
  #store;
  #ask;
  #toasts;
  #saved = '';
  /** The file of the recording that is running or ending. @type {string | null} */
  #running = null;
  /** The picker's id of the open lesson. */
  #open = '';

  /**
   * @param {import('./store.js').Store} store
   * @param {(what: string, content?: any) => Promise<any>} ask
   * @param {import('./toasts.js').Toasts} toasts
   */
  constructor(store, ask, toasts) {
    this.#store = store;
    this.#ask = ask;
    this.#toasts = toasts;
    store.on(['workspace', 'lessons'], () => this.#update());
    store.on('recording', () => this.#recording());
    const lesson = /** @type {HTMLSelectElement} */ (find('lesson'));
    lesson.addEventListener('change', async () => {
      const why = lesson.selectedOptions[0]?.dataset.error;
      if (why !== undefined) toasts.show(why, 'error');
      const answer = why === undefined ? await ask('open', { lesson: lesson.value }) : { error: why };
      // On an error the open lesson stays selected.
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
    find('record').addEventListener('click', () => ask('record', { on: store.get('recording')?.on !== true }));
    find('keep').addEventListener('click', async () => {
      const answer = await ask('keep');
      if (answer.ok) toasts.show(`The last minutes are in ${answer.file}`);
    });
    // On a phone the controls are shown on demand.
    const menu = find('menu');
    menu.addEventListener('click', () => menu.setAttribute('aria-expanded', String(menu.getAttribute('aria-expanded') !== 'true')));
    this.#saving();
  }

  #saving() {
    const dialog = /** @type {HTMLDialogElement} */ (find('save-dialog'));
    const title = /** @type {HTMLInputElement} */ (find('save-title'));
    find('save').addEventListener('click', () => {
      title.value = this.#store.get('workspace')?.title ?? '';
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
    const workspace = this.#store.get('workspace');
    const lessons = this.#store.get('lessons') ?? [];
    if (workspace === undefined) return;
    this.#pick(lessons, workspace);
    const about = lessons.find((/** @type {any} */ each) => each.id === workspace.lesson);
    const lacks = workspace.lacks ?? about?.lacks;
    const lacking = lacks ? `This lesson needs ${lacks} in leo.toml.` : '';
    // The lesson's caption is about its own tables, not about one that a person has laid.
    const caption = workspace.table === null && workspace.simulated ? '' : workspace.watch || about?.watch || '';
    const words = [caption, lacking].filter(Boolean).join(' ');
    write(find('watch'), words);
    find('watch').hidden = words === '';
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
    // Do not disturb an open picker, unless its options changed.
    if (isNew || document.activeElement !== lesson) this.#choose();
    const lay = /** @type {HTMLSelectElement} */ (find('lay'));
    if (lay.dataset.said === String(workspace.tables)) return;
    lay.dataset.said = String(workspace.tables);
    const tables = Array.from({ length: workspace.tables }, (_, n) => make('option', { value: n, text: `Lay ${tableName(n, workspace.tables)}` }));
    lay.replaceChildren(make('option', { value: '', text: 'Lay…' }), ...tables);
  }

  /** Selects the open lesson in the picker. */
  #choose() {
    /** @type {HTMLSelectElement} */ (find('lesson')).value = this.#open;
  }

  #recording() {
    const recording = this.#store.get('recording');
    const button = find('record');
    const on = recording?.on === true;
    button.setAttribute('aria-pressed', String(on));
    write(/** @type {Element} */ (button.querySelector('.label')), on ? recordingWords(recording) : 'Record');
    button.title = recording?.file ?? 'Write what happens into a file';
    if (recording?.error && button.dataset.error !== recording.error) this.#toasts.show(recording.error, 'error');
    button.dataset.error = recording?.error ?? '';
    // The result is shown once everything is written; until then `file` is that of the previous recording.
    const running = this.#running;
    this.#running = on ? recording.file : recording?.error ? null : running;
    if (on || running === null || recording?.file !== running) return;
    this.#running = null;
    this.#toasts.show(recordedWords(recording));
  }
}
