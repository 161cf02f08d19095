// A button over each thing of the main view, for the keyboard and for screen readers.
import { make, write } from './element.js';
import { project } from './labels.js';
import { describe } from './words.js';

export class HitTargets {
  #list;
  #store;
  #world;
  #camera;
  /** @type {Map<string, HTMLButtonElement>} */
  #buttons = new Map();
  /** @type {WeakMap<HTMLElement, string>} */
  #places = new WeakMap();
  #caption = make('div', { class: 'caption', 'aria-hidden': 'true' });

  /**
   * @param {HTMLElement} list
   * @param {import('./store.js').Store} store
   * @param {import('./world.js').World} world
   * @param {import('three').PerspectiveCamera} camera
   */
  constructor(list, store, world, camera) {
    this.#list = list;
    this.#store = store;
    this.#world = world;
    this.#camera = camera;
    list.append(this.#caption);
    store.on('thing/', (changes) => {
      for (const key of changes.keys()) this.#update(key);
    });
  }

  /** Updates all buttons after the eyes of the seat have changed. */
  refresh() {
    for (const [key] of this.#store.under('thing/')) this.#update(key);
  }

  /**
   * Projects a world point into the picture, in pixels; `null` behind the camera.
   * @param {readonly number[]} p
   * @returns {{x: number, y: number} | null}
   */
  project(p) {
    return project(p, this.#camera, this.#list);
  }

  /** Moves the buttons over their things, after a picture. */
  place() {
    const names = this.#store.get('robot')?.agents ?? {};
    const marked = this.#world.hovered ?? this.#world.selected;
    let captioned = false;
    for (const [key, button] of this.#buttons) {
      const pose = this.#world.pose(key);
      const spot = pose === null ? null : this.project(pose.p);
      button.hidden = spot === null;
      if (spot === null) continue;
      const place = `translate(${spot.x.toFixed(1)}px, ${spot.y.toFixed(1)}px) translate(-50%, -50%)`;
      if (this.#places.get(button) !== place) {
        this.#places.set(button, place);
        button.style.transform = place;
      }
      if (key !== marked || pose === null) continue;
      const thing = this.#store.get(key);
      const top = this.project([pose.p[0], pose.p[1], pose.p[2] + (thing.half?.[2] ?? 0.1) + 0.015]) ?? spot;
      write(this.#caption, describe(thing, names));
      this.#caption.style.transform = `translate(${top.x.toFixed(1)}px, ${top.y.toFixed(1)}px) translate(-50%, -100%)`;
      captioned = true;
    }
    this.#caption.hidden = !captioned;
  }

  /** @param {string} key */
  button(key) {
    return this.#buttons.get(key) ?? null;
  }

  /** @param {string} key */
  #update(key) {
    const thing = this.#store.get(key);
    const old = this.#buttons.get(key);
    if (thing === undefined || (thing.kind === 'person' && thing.agent === this.#world.eyes)) {
      old?.remove();
      this.#buttons.delete(key);
      return;
    }
    const names = this.#store.get('robot')?.agents ?? {};
    const button = old ?? make('button', { type: 'button', class: 'mark', data: { key } });
    const words = describe(thing, names);
    if (button.ariaLabel !== words) button.ariaLabel = words;
    button.dataset.thing = thing.name;
    if (old === undefined) {
      this.#buttons.set(key, button);
      this.#list.append(button);
    }
  }
}
