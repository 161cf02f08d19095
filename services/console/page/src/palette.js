// The palette of things to add while the table is set up: drag one onto the table, or press it.
import { draw, find, make } from './element.js';

const DRAG_PX = 5;
const ROLES = ['block', 'peg', 'marker'];
/**
 * Screens by their half extents in metres. Screens across the table hide objects from a person opposite Leo,
 * screens along the table from a person at its side.
 */
const SCREENS = /** @type {{name: string, all: {name: string, half: [number, number, number]}[]}[]} */ ([
  {
    name: 'screen',
    all: [
      { name: 'narrow screen', half: [0.08, 0.01, 0.125] },
      { name: 'screen', half: [0.16, 0.01, 0.125] },
      { name: 'wide screen', half: [0.32, 0.01, 0.125] },
    ],
  },
  {
    name: 'side screen',
    all: [
      { name: 'narrow side screen', half: [0.01, 0.08, 0.125] },
      { name: 'side screen', half: [0.01, 0.16, 0.125] },
      { name: 'wide side screen', half: [0.01, 0.32, 0.125] },
    ],
  },
]);

/**
 * @typedef {object} Desk
 * @property {(event: PointerEvent) => [number, number] | null} aim the point of the table under a pointer, or `null`
 * @property {(item: Item | null, at?: [number, number]) => void} preview
 * @property {() => any[]} lying the things on the table
 * @property {(what: string, content?: any) => Promise<any>} ask
 */

/** @typedef {{kind: any, colour: any} | {screen: string, half: [number, number, number]}} Item */

/**
 * The free spot nearest to the table's centre. Pure.
 * @param {{p: number[], half: number[]}[]} lying
 * @param {number} room half of the required size, metres
 * @returns {[number, number]}
 */
export function freeSpot(lying, room) {
  const spots = /** @type {[number, number][]} */ ([]);
  for (let i = -5; i <= 5; i += 1) for (let j = -4; j <= 4; j += 1) spots.push([0.1 * i, 0.8 + 0.1 * j]);
  spots.sort((a, b) => Math.hypot(a[0], a[1] - 0.75) - Math.hypot(b[0], b[1] - 0.75));
  const free = spots.find(([x, y]) => lying.every(({ p, half }) => {
    const theirs = Math.hypot(half[0], half[1]);
    return Math.hypot(p[0] - x, p[1] - y) > theirs + room + 0.02;
  }));
  return free ?? [0, 0.75];
}

export class Palette {
  #desk;
  #list = find('palette-items');
  #said = '';

  /** @param {import('./store.js').Store} store @param {Desk} desk */
  constructor(store, desk) {
    this.#desk = desk;
    store.on('workspace', () => {
      const workspace = store.get('workspace');
      if (workspace !== undefined) this.#update(workspace.kinds ?? [], workspace.colours ?? []);
    });
  }

  /** @param {any[]} kinds @param {any[]} colours */
  #update(kinds, colours) {
    const said = JSON.stringify([kinds, colours]);
    if (said === this.#said) return;
    this.#said = said;
    const sorted = [...kinds].sort((a, b) => ROLES.indexOf(a.role) - ROLES.indexOf(b.role));
    const rows = sorted.map((kind) => {
      const chips = colours.map((colour) => this.#chip({ kind, colour }, `${colour.name} ${words(kind.name)}`, icon(kind, colour), colour.name));
      return make('div', { class: 'row', role: 'group', 'aria-label': words(kind.name) }, make('span', { text: words(kind.name) }), ...chips);
    });
    const screens = SCREENS.map(({ name, all }) => {
      const chips = all.map(({ name: called, half }) => this.#chip({ screen: called, half }, called, screenIcon(half)));
      return make('div', { class: 'row', role: 'group', 'aria-label': name }, make('span', { text: name }), ...chips);
    });
    this.#list.replaceChildren(...rows, ...screens);
  }

  /** @param {Item} item @param {string} name @param {Element} picture @param {string | null} [caption] of the colour */
  #chip(item, name, picture, caption = null) {
    const chip = make('button', { type: 'button', class: 'chip', 'aria-label': `Add a ${name}`, title: `${name}: drag it onto the table`, data: { add: name } }, picture, caption === null ? null : make('span', { text: caption }));
    /** @type {{x: number, y: number, dragged: boolean} | null} */
    let down = null;
    chip.addEventListener('pointerdown', (event) => {
      down = { x: event.clientX, y: event.clientY, dragged: false };
      chip.setPointerCapture(event.pointerId);
    });
    chip.addEventListener('pointermove', (event) => {
      if (down === null) return;
      down.dragged ||= Math.hypot(event.clientX - down.x, event.clientY - down.y) > DRAG_PX;
      const at = down.dragged ? this.#desk.aim(event) : null;
      this.#desk.preview(at === null ? null : item, at ?? undefined);
    });
    const end = (/** @type {PointerEvent} */ event) => {
      if (down?.dragged && event.type === 'pointerup') {
        const at = this.#desk.aim(event);
        if (at !== null) this.#add(item, at);
      }
      this.#desk.preview(null);
    };
    chip.addEventListener('pointerup', end);
    chip.addEventListener('pointercancel', end);
    chip.addEventListener('click', () => {
      if (down?.dragged !== true) this.#add(item, freeSpot(this.#desk.lying(), room(item)));
      down = null;
    });
    return chip;
  }

  /** @param {Item} item @param {[number, number]} at */
  #add(item, at) {
    if ('kind' in item) return this.#desk.ask('add', { kind: item.kind.name, colour: item.colour.name, at, heading: 0 });
    const taken = new Set(this.#desk.lying().map((thing) => thing.name));
    let name = item.screen;
    for (let n = 2; taken.has(name); n += 1) name = `${item.screen} ${n}`;
    return this.#desk.ask('screen', { name, at: [...at, item.half[2]], half: item.half });
  }
}

/** @param {Item} item */
function room(item) {
  const half = 'kind' in item ? item.kind.half : item.half;
  return Math.hypot(half[0], half[1]);
}

/** @param {string} name */
function words(name) {
  return name.replaceAll('_', ' ');
}

/** Linear light to sRGB. @param {number} value */
function encoded(value) {
  const shown = value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055;
  return Math.round(255 * Math.min(1, Math.max(0, shown)));
}

/** A linear colour as a CSS colour. @param {readonly number[]} rgb linear */
export function css(rgb) {
  return `rgb(${rgb.map(encoded).join(' ')})`;
}

/** @param {any} kind @param {any} colour */
function icon(kind, colour) {
  const [x, , z] = kind.half;
  const scale = 9 / Math.max(x, z, 0.026);
  const [w, h] = [Math.max(2, x * scale), Math.max(1.5, z * scale)];
  const fill = css(colour.rgb);
  const [, , round, tapered] = kind.shape;
  const svg = draw('svg', { viewBox: '-12 -12 24 24', width: 24, height: 24, 'aria-hidden': 'true' });
  if (tapered > 0.5) svg.append(draw('path', { d: `M${-w} ${h}H${w}L0 ${-h}Z`, fill }));
  else if (round > 0.75 && x >= z) svg.append(draw('ellipse', { rx: w, ry: Math.max(h, 0.6 * w), fill }));
  else if (round > 0.25 && round <= 0.75) {
    svg.append(draw('path', { d: `M${-w} ${h}V${-h}H${w}V${h}H${0.5 * w}A${0.5 * w} ${h} 0 0 0 ${-0.5 * w} ${h}Z`, fill }));
  } else svg.append(draw('rect', { x: -w, y: -h, width: 2 * w, height: 2 * h, rx: round > 0.75 ? Math.min(w, 3) : 1, fill }));
  if (kind.hole) svg.append(draw('circle', { r: 3, class: 'hole' }));
  return svg;
}

/** @param {[number, number, number]} half */
function screenIcon([across, along]) {
  const svg = draw('svg', { viewBox: '-12 -12 24 24', width: 24, height: 24, 'aria-hidden': 'true' });
  const width = 34 * across;
  // A screen along the table is drawn in oblique projection.
  const away = 24 * along;
  svg.append(along < across
    ? draw('rect', { x: -width, y: -7, width: 2 * width, height: 14, rx: 1, class: 'screen' })
    : draw('path', { d: `M${-away} ${away / 2 - 7}L${away} ${-away / 2 - 7}V${7 - away / 2}L${-away} ${7 + away / 2}Z`, class: 'screen' }));
  return svg;
}
