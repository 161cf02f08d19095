// The teacher's seat: the eyes lie on a sphere around the point that they look at. Pure.

/** @typedef {import('./pose.js').Point} Point */
/** @typedef {{eyes: Point, looks_at: Point}} Seat */

const LOWEST = 0.06;
const HIGHEST = 1.5;
const NEAREST_M = 0.35;
const FARTHEST_M = 4;
const LOWEST_EYES_M = 0.08;

/** @param {Seat} seat */
function polar({ eyes, looks_at }) {
  const [x, y, z] = [eyes[0] - looks_at[0], eyes[1] - looks_at[1], eyes[2] - looks_at[2]];
  const radius = Math.max(1e-6, Math.hypot(x, y, z));
  return { radius, around: Math.atan2(y, x), above: Math.asin(z / radius) };
}

/**
 * @param {{radius: number, around: number, above: number}} polar
 * @param {Point} centre
 * @returns {Seat}
 */
function from({ radius, around, above }, centre) {
  const flat = radius * Math.cos(above);
  return {
    eyes: [
      centre[0] + flat * Math.cos(around),
      centre[1] + flat * Math.sin(around),
      Math.max(LOWEST_EYES_M, centre[2] + radius * Math.sin(above)),
    ],
    looks_at: centre,
  };
}

/** @param {number} value @param {number} min @param {number} max */
const clamp = (value, min, max) => Math.min(max, Math.max(min, value));

/**
 * The seat orbited around the point looked at.
 * @param {Seat} seat
 * @param {number} around radians, anticlockwise seen from above
 * @param {number} above radians, upwards
 */
export function orbited(seat, around, above) {
  const was = polar(seat);
  const up = clamp(was.above + above, LOWEST, HIGHEST);
  return from({ ...was, around: was.around + around, above: up }, seat.looks_at);
}

/**
 * The seat moved nearer to the point looked at, or farther.
 * @param {Seat} seat
 * @param {number} factor of the distance
 */
export function approached(seat, factor) {
  const was = polar(seat);
  return from({ ...was, radius: clamp(was.radius * factor, NEAREST_M, FARTHEST_M) }, seat.looks_at);
}

/**
 * The head turned in place: the point looked at moves over the table.
 * @param {Seat} seat
 * @param {number} left radians
 * @param {number} up radians
 * @returns {Seat}
 */
export function turned(seat, left, up) {
  const { radius, around, above } = polar(seat);
  const direction = around + left;
  const pitch = clamp(above - up, 0.15, HIGHEST);
  const reach = Math.min(FARTHEST_M, seat.eyes[2] / Math.sin(pitch));
  const length = reach > 0 ? reach : radius;
  const flat = length * Math.cos(pitch);
  return {
    eyes: seat.eyes,
    looks_at: [
      seat.eyes[0] - flat * Math.cos(direction),
      seat.eyes[1] - flat * Math.sin(direction),
      seat.eyes[2] - length * Math.sin(pitch),
    ],
  };
}
