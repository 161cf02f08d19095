// Whether a box hides a point from an eye. Pure.
import { heading } from './pose.js';

/** @typedef {import('./pose.js').Point} Point */

/**
 * Whether the segment from an eye to a point passes through an upright box (slab method).
 * @param {readonly number[]} eye
 * @param {readonly number[]} point
 * @param {{p: readonly number[], q: any, half: readonly number[]}} box
 */
export function isHidden(eye, point, { p, q, half }) {
  const angle = heading(q);
  const [from, to] = [eye, point].map((each) => turned(each, p, angle));
  let [enter, leave] = [0, 1];
  for (const axis of [0, 1, 2]) {
    const step = to[axis] - from[axis];
    if (Math.abs(step) < 1e-9) {
      if (Math.abs(from[axis]) > half[axis]) return false;
      continue;
    }
    const times = [(-half[axis] - from[axis]) / step, (half[axis] - from[axis]) / step].sort((a, b) => a - b);
    [enter, leave] = [Math.max(enter, times[0]), Math.min(leave, times[1])];
  }
  return enter < leave;
}

/** A point in the frame of a box. @param {readonly number[]} point @param {readonly number[]} p @param {number} angle */
function turned(point, p, angle) {
  const [x, y, z] = point.map((value, axis) => value - p[axis]);
  return [Math.cos(angle) * x + Math.sin(angle) * y, Math.cos(angle) * y - Math.sin(angle) * x, z];
}
