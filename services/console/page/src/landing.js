// Where what is in the hand would come to lie: into a hole, onto what is below, or on the table. Pure.
import { apart, covers, heading, upright } from './pose.js';

/** @typedef {import('./pose.js').Point} Point */
/** @typedef {import('./pose.js').Turn} Turn */

/** So near to a hole, a mark's place or a block's middle, the page helps to meet it. */
const SNAP_M = 0.03;
/** So near to it, Leo's world takes it in whatever the page does. */
const TAKEN_M = 0.02;

/**
 * @param {any} held a cell `thing/<n>`
 * @param {[number, number]} at
 * @param {number} angle its heading
 * @param {any[]} others the things that lie about
 * @param {boolean} exact whether it goes just there, and the page does not help
 * @returns {{p: Point, q: Turn, into: string | null}} `into`: the name of what takes it
 */
export function landing(held, at, angle, others, exact = false) {
  const near = (/** @type {any} */ thing) => apart(thing.p.slice(0, 2), at);
  const fits = others
    .filter((thing) => thing.kind === 'object' && thing.p && near(thing) < (exact ? TAKEN_M : SNAP_M) && takes(thing, held))
    .sort((a, b) => near(a) - near(b))[0];
  const [x, y] = fits === undefined ? at : [fits.p[0], fits.p[1]];
  const below = others.filter((thing) => thing.kind === 'object' && thing.p && covers(thing, x, y));
  const top = below.reduce((most, thing) => Math.max(most, thing.p[2] + thing.half[2]), 0);
  const inHole = fits !== undefined && held.role === 'peg' && fits.hole;
  const z = inHole ? fits.p[2] + fits.half[2] : top + held.half[2];
  return { p: [x, y, z], q: upright(angle), into: fits?.name ?? null };
}

/**
 * Whether a thing takes another into or onto its middle.
 * @param {any} thing
 * @param {any} held
 */
export function takes(thing, held) {
  if (held.role === 'peg') return thing.hole === true && thing.filled !== true;
  if (held.role === 'marker') return thing.markable === true && thing.marked !== true;
  const flat = (thing.shape?.[3] ?? 0) < 0.5;
  return thing.role === 'block' && flat && thing.half[0] < 2.5 * held.half[0];
}

/** The heading of a thing as it lies. @param {any} thing */
export function headingOf(thing) {
  return thing.q ? heading(thing.q) : 0;
}
