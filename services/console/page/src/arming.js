// The arming strip: shows whether the joints may move, with the button that arms them.
import { find, make, write } from './element.js';

/** @typedef {{cause: string, meaning: string, remedy: string, count: number, joints: string[]}} Group */
/** @typedef {{joints: number, armed: number, disarmed: Group[], locked: Group[], locks: number, stopped: boolean}} ArmingSummary */

/** @param {Group[]} groups */
const sum = (groups) => groups.reduce((all, { count }) => all + count, 0);

/** @param {number} count */
const joints = (count) => (count === 1 ? '1 joint' : `${count} joints`);

/**
 * The summary as text: the parts of a line, the worst first, and their state. Pure.
 * @param {ArmingSummary | undefined} summary
 * @returns {{state: 'unknown' | 'stopped' | 'locked' | 'disarmed' | 'armed', parts: string[], canArm: boolean}}
 */
export function armingWords(summary) {
  if (summary === undefined) return { state: 'unknown', parts: ['The motor process has reported no joint'], canArm: false };
  const { armed, disarmed, locked, stopped } = summary;
  /** @param {string} word @param {Group[]} groups */
  const why = (word, groups) => `${sum(groups)} ${word}: ${groups.map(({ meaning }) => meaning).join('; ')}`;
  const parts = [];
  if (stopped) parts.push('The emergency stop is raised: release it with leo emergency-stop --release');
  if (locked.length > 0) parts.push(why('locked', locked));
  if (disarmed.length > 0) parts.push(why('disarmed', disarmed));
  if (armed > 0 || parts.length === 0) parts.push(armed === summary.joints ? `Armed: ${joints(armed)}` : `${armed} armed`);
  const state = stopped ? 'stopped' : locked.length > 0 ? 'locked' : disarmed.length > 0 ? 'disarmed' : 'armed';
  return { state, parts, canArm: !stopped && locked.length + disarmed.length > 0 };
}

/**
 * The lines of the dialog that acknowledges locks: one per cause, with its joints and its remedy. Pure.
 * @param {Group[]} groups
 */
export function lockLines(groups) {
  return groups.map(({ joints: names, count, meaning, remedy }) => {
    const which = names.length === 0 ? joints(count) : names.join(', ');
    return `${which}: ${meaning}. To do: ${remedy}.`;
  });
}

export class Arming {
  #store;
  #ask;
  #strip = find('arming');
  #button = /** @type {HTMLButtonElement} */ (find('arm'));
  #dialog = /** @type {HTMLDialogElement} */ (find('arm-dialog'));
  /** The lock count shown in the open dialog: only these locks are acknowledged. @type {number | null} */
  #shown = null;

  /**
   * @param {import('./store.js').Store} store
   * @param {(what: string, content?: any) => Promise<any>} ask
   */
  constructor(store, ask) {
    this.#store = store;
    this.#ask = ask;
    store.on('arming', () => this.#update());
    this.#button.addEventListener('click', () => this.#press());
    find('arm-cancel').addEventListener('click', () => this.#dialog.close());
    find('arm-others').addEventListener('click', () => this.#order({}));
    find('arm-form').addEventListener('submit', (event) => {
      event.preventDefault();
      if (this.#shown !== null) this.#order({ locks: this.#shown });
    });
    this.#update();
  }

  /** @returns {ArmingSummary | undefined} */
  get #summary() {
    return this.#store.get('arming');
  }

  #update() {
    const { state, parts, canArm } = armingWords(this.#summary);
    this.#strip.dataset.state = state;
    write(find('arming-words'), `${parts.join('. ')}.`);
    this.#button.hidden = !canArm;
  }

  #press() {
    const summary = this.#summary;
    if (summary === undefined) return;
    if (summary.locked.length === 0) {
      this.#order({});
      return;
    }
    this.#shown = summary.locks;
    find('arm-causes').replaceChildren(...lockLines(summary.locked).map((text) => make('li', { text })));
    find('arm-others').hidden = summary.disarmed.length === 0;
    this.#dialog.showModal();
    // Focus "cancel", so that pressing Enter twice acknowledges nothing.
    find('arm-cancel').focus();
  }

  /** @param {{locks?: number}} content */
  async #order(content) {
    this.#dialog.close();
    this.#shown = null;
    this.#button.disabled = true;
    await this.#ask('arm', content);
    this.#button.disabled = false;
  }
}
