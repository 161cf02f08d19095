// Where the held object would land: in a hole, on the object below, or on the table. Pure.
import { distance, covers, heading, upright } from './pose.js';

/** @typedef {import('./pose.js').Point} Point */
/** @typedef {import('./pose.js').Turn} Turn */

/** Snapping distance of the page to a hole, a marker's place or a block's centre. */
const SNAP_M = 0.03;
/** Snapping distance of Leo's world, which applies in any case. */
const TAKEN_M = 0.02;

/**
 * @param {any} held a cell `thing/<n>`
 * @param {[number, number]} at
 * @param {number} angle its heading
 * @param {any[]} others the other things on the table
 * @param {boolean} exact whether the page's snapping is off
 * @returns {{p: Point, q: Turn, into: string | null}} `into`: the name of the object that receives it
 */
export function landing(held, at, angle, others, exact = false) {
  const near = (/** @type {any} */ thing) => distance(thing.p.slice(0, 2), at);
  const fits = others
    .filter((thing) => thing.kind === 'object' && thing.p && near(thing) < (exact ? TAKEN_M : SNAP_M) && takes(thing, held))
    .sort((a, b) => near(a) - near(b))[0];
  const [x, y] = fits === undefined ? at : [fits.p[0], fits.p[1]];
  const below = others.filter((thing) => thing.kind === 'object' && thing.p && covers(thing, x, y));
  const top = below.reduce((max, thing) => Math.max(max, thing.p[2] + thing.half[2]), 0);
  const inHole = fits !== undefined && held.role === 'peg' && fits.hole;
  const z = inHole ? fits.p[2] + fits.half[2] : top + held.half[2];
  return { p: [x, y, z], q: upright(angle), into: fits?.name ?? null };
}

/**
 * Whether a thing can receive another one in its hole or on its centre.
 * @param {any} thing
 * @param {any} held
 */
export function takes(thing, held) {
  if (held.role === 'peg') return thing.hole === true && thing.filled !== true;
  if (held.role === 'marker') return thing.markable === true && thing.marked !== true;
  const flat = (thing.shape?.[3] ?? 0) < 0.5;
  return thing.role === 'block' && flat && thing.half[0] < 2.5 * held.half[0];
}

/** The heading of a lying object. @param {any} thing */
export function headingOf(thing) {
  return thing.q ? heading(thing.q) : 0;
}
