// Positions and directions in the world frame: metres, radians, z up. Pure.

/** @typedef {[number, number, number]} Point */
/** @typedef {[number, number, number, number]} Turn a quaternion [x, y, z, w] */

/**
 * The heading of an orientation: anticlockwise about z, from +x.
 * @param {Turn} q
 */
export function heading([x, y, z, w]) {
  return Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));
}

/**
 * The upright orientation with a heading.
 * @param {number} angle
 * @returns {Turn}
 */
export function upright(angle) {
  return [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
}

/**
 * Direction of an orientation's x axis; for an eye its line of sight.
 * @param {Turn} q
 * @returns {Point}
 */
export function forward([x, y, z, w]) {
  return [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)];
}

/**
 * The point of the table (z = 0) that an eye looks at; a point one metre ahead if it looks past the table.
 * @param {Point} p
 * @param {Turn} q
 * @returns {Point}
 */
export function looksAt(p, q) {
  const f = forward(q);
  const reach = f[2] < -0.05 ? Math.min(3, -p[2] / f[2]) : 1;
  return [p[0] + reach * f[0], p[1] + reach * f[1], p[2] + reach * f[2]];
}

/**
 * @param {readonly number[]} a
 * @param {readonly number[]} b
 */
export function distance(a, b) {
  return Math.hypot(...a.map((value, axis) => value - b[axis]));
}

/**
 * Whether a point of the table's plane lies under a thing's box, taking its heading into account.
 * @param {{p: Point, q: Turn, half: Point}} thing
 * @param {number} x
 * @param {number} y
 */
export function covers(thing, x, y) {
  const angle = heading(thing.q);
  const [dx, dy] = [x - thing.p[0], y - thing.p[1]];
  const along = Math.cos(angle) * dx + Math.sin(angle) * dy;
  const across = Math.cos(angle) * dy - Math.sin(angle) * dx;
  return Math.abs(along) <= thing.half[0] && Math.abs(across) <= thing.half[1];
}
