// The names of the colours in the pictures, and the button that switches them.
import { find } from './element.js';
import { colourName } from './labels.js';
import { isHidden } from './line-of-sight.js';
import { remember, remembered } from './memory.js';

const KEY = 'leo-colour-names';

export class ColourNames {
  #store;
  #button = find('labels');

  /**
   * @param {import('./store.js').Store} store
   * @param {() => void} changed
   */
  constructor(store, changed) {
    this.#store = store;
    if (remembered(KEY) === 'off') this.#button.setAttribute('aria-pressed', 'false');
    this.#button.addEventListener('click', () => {
      this.#button.setAttribute('aria-pressed', String(!this.areShown));
      remember(KEY, this.areShown ? 'on' : 'off');
      changed();
    });
  }

  get areShown() {
    return this.#button.getAttribute('aria-pressed') === 'true';
  }

  /**
   * The labels of the things in the main view. From the teacher's seat a thing behind a screen has none.
   * @param {import('./world.js').World} world
   * @param {import('./lens.js').Name} view
   * @param {readonly number[]} eye
   * @returns {import('./labels.js').Label[]}
   */
  things(world, view, eye) {
    const colours = this.#store.get('workspace')?.colours ?? [];
    const all = this.#store.under('thing/').flatMap(([key, thing]) => {
      const pose = world.pose(key);
      return pose === null ? [] : [{ key, thing, pose }];
    });
    const screens = view === 'seat' ? all.filter(({ thing }) => thing.kind === 'occluder') : [];
    return all.flatMap(({ key, thing, pose }) => {
      // A peg in a hole would cover the name of its block.
      const text = thing.kind === 'object' && thing.inserted !== true ? colourName(thing.rgb, colours) : null;
      const p = [pose.p[0], pose.p[1], pose.p[2] + (thing.half?.[2] ?? 0)];
      const isSeen = screens.every((screen) => !isHidden(eye, p, { ...screen.pose, half: screen.thing.half }));
      return text === null || !isSeen ? [] : [{ key, text, p }];
    });
  }
}
