// The time line of one object (Fig. 4 of the paper): for each perspective whether it was known, seen, and its states.
import { draw, find, make } from './element.js';
import { believes, plain } from './words.js';

const ROW = 23;
const BAR = 14;
const LABEL = 8;
/** Approximate width of a letter of a label, in pixels. */
const LETTER = 6.4;
const HATCHES = ['robot', 'partner'];

/**
 * Segments between the points of a track. Pure.
 * @param {any[]} points
 * @param {number} end
 * @returns {{from: number, to: number, known: boolean, seen: boolean, states: Record<string, number>, p: number[] | null}[]}
 */
export function segments(points, end) {
  return points.map((point, at) => ({
    from: point.t,
    to: Math.max(point.t, points[at + 1]?.t ?? end),
    known: point.known,
    seen: point.seen,
    states: point.states ?? {},
    p: point.p ?? null,
  }));
}

/** The states that hold, in words. @param {Record<string, number>} states */
export function stateWords(states) {
  return Object.entries(states).filter(([, degree]) => degree > 0.5).map(([name]) => name).join(', ');
}

/** @param {{known: boolean, seen: boolean, states: any}} segment */
export function segmentWords({ known, seen, states }) {
  if (!known) return 'does not know of it';
  const state = stateWords(states);
  return `${seen ? 'sees it' : 'remembers it'}${state === '' ? '' : `, ${state}`}`;
}

export class Timeline {
  #store;
  #picture = find('timeline');
  #words = find('timeline-words');
  #title = find('timeline-title');
  /** @type {number | null} */
  id = null;
  #waiting = false;

  /** @param {import('./store.js').Store} store */
  constructor(store) {
    this.#store = store;
    store.on(['history/', 'robot'], () => this.update());
    store.on('now', () => this.#soon());
    new ResizeObserver(() => this.update()).observe(this.#picture);
  }

  /** Redraws as time passes, twice a second. */
  #soon() {
    if (this.#waiting) return;
    this.#waiting = true;
    setTimeout(() => {
      this.#waiting = false;
      this.update();
    }, 500);
  }

  update() {
    const history = this.id === null ? undefined : this.#store.get(`history/${this.id}`);
    find('timeline-empty').hidden = history !== undefined;
    this.#title.textContent = plain(history?.words ?? '');
    if (history === undefined) {
      this.#picture.replaceChildren();
      this.#words.replaceChildren();
      delete this.#words.dataset.text;
      return;
    }
    const robot = this.#store.get('robot');
    const rows = history.tracks.map((/** @type {any} */ track) => {
      const perspective = robot?.perspectives?.find((/** @type {any} */ each) => each.number === track.perspective);
      const label = perspective === undefined ? `perspective ${track.perspective}` : believes(perspective, robot.agents ?? {});
      return { label, track };
    });
    const starts = rows.flatMap((/** @type {any} */ { track }) => track.points.slice(0, 1).map((/** @type {any} */ point) => point.t));
    const now = this.#store.get('now')?.t ?? 0;
    const [from, to] = [Math.min(now, ...starts), Math.max(now, Math.min(...starts) + 1)];
    this.#draw(rows, from, to);
    this.#tell(rows, to);
  }

  /** @param {{label: string, track: any}[]} rows @param {number} from @param {number} to */
  #draw(rows, from, to) {
    const width = Math.max(200, this.#picture.clientWidth - 20);
    const longest = Math.max(...rows.map(({ label }) => label.length));
    const left = Math.min(Math.max(160, LETTER * longest + LABEL), 0.4 * width);
    const x = (/** @type {number} */ t) => left + ((width - left - LABEL) * (t - from)) / Math.max(1e-6, to - from);
    const svg = draw('svg', { width, height: rows.length * ROW + 14, 'aria-hidden': 'true' });
    svg.append(...HATCHES.map(hatch));
    rows.forEach(({ label, track }, at) => {
      const y = at * ROW + (ROW - BAR) / 2;
      const kind = track.perspective === 0 ? 'robot' : 'partner';
      svg.append(text(0, y + BAR - 3, label, 'row'));
      const line = draw('line', { x1: x(from), x2: x(to), y1: y + BAR / 2, y2: y + BAR / 2, class: 'nothing' });
      svg.append(line);
      for (const segment of segments(track.points, to)) {
        if (!segment.known) continue;
        const [a, b] = [x(Math.max(from, segment.from)), x(segment.to)];
        const state = stateWords(segment.states);
        const look = `${kind} ${segment.seen ? 'seen' : 'remembered'} ${state === '' ? '' : 'state'}`;
        svg.append(draw('rect', { x: a, y, width: Math.max(1.5, b - a), height: BAR, rx: 2, class: look }));
        if (state !== '' && b - a > 7 * state.length + 8) svg.append(text(a + 5, y + BAR - 3.5, state, 'state'));
      }
    });
    const below = rows.length * ROW + 10;
    svg.append(text(x(from), below, `${from.toFixed(1)} s`, 'time'), text(x(to), below, `${to.toFixed(1)} s`, 'time end'));
    this.#picture.replaceChildren(svg);
  }

  /** @param {{label: string, track: any}[]} rows @param {number} end */
  #tell(rows, end) {
    const told = rows.map(({ label, track }) => {
      const parts = segments(track.points, end).map((each) => `from ${each.from.toFixed(1)} s ${segmentWords(each)}`);
      return `${label}: ${parts.join('; ') || 'does not know of it'}`;
    });
    if (this.#words.dataset.text === told.join()) return;
    this.#words.dataset.text = told.join();
    this.#words.replaceChildren(...told.map((line) => make('li', { text: line })));
  }
}

/** A pattern of stripes in a colour of the theme: what is remembered differs by more than its lightness. @param {string} kind */
function hatch(kind) {
  const size = 6;
  const stripe = draw('path', { d: `M0 ${size}L${size} 0`, class: `stripe ${kind}` });
  return draw('pattern', { id: `hatch-${kind}`, width: size, height: size, patternUnits: 'userSpaceOnUse' },
    draw('rect', { width: size, height: size, class: `ground ${kind}` }), stripe);
}

/** @param {number} x @param {number} y @param {string} content @param {string} kind */
function text(x, y, content, kind) {
  const element = draw('text', { x, y, class: kind });
  element.textContent = content;
  return element;
}
