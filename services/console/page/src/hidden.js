// The region of the table that an occluder hides from an eye: the occluder's shadow for a light at the eye. Pure.

/** @typedef {import('./pose.js').Point} Point */

const FAR_M = 4;

/**
 * The corner points of a box.
 * @param {{p: Point, half: Point, q?: import('./pose.js').Turn}} box upright
 * @param {number} angle its heading
 * @returns {Point[]}
 */
export function corners({ p, half }, angle) {
  const [c, s] = [Math.cos(angle), Math.sin(angle)];
  const points = /** @type {Point[]} */ ([]);
  for (const i of [-1, 1]) {
    for (const j of [-1, 1]) {
      for (const k of [-1, 1]) {
        const [x, y] = [i * half[0], j * half[1]];
        points.push([p[0] + c * x - s * y, p[1] + s * x + c * y, Math.max(0, p[2] + k * half[2])]);
      }
    }
  }
  return points;
}

/**
 * The region of the table's plane that a box hides from an eye, as a convex polygon, anticlockwise.
 * @param {Point} eye above the table
 * @param {Point[]} box its corners
 * @returns {[number, number][]} empty if nothing is hidden
 */
export function hiddenFrom(eye, box) {
  if (eye[2] <= 0.01) return [];
  const points = /** @type {[number, number][]} */ ([]);
  for (const corner of box) {
    const drop = eye[2] - corner[2];
    const [dx, dy] = [corner[0] - eye[0], corner[1] - eye[1]];
    const flat = Math.max(1e-6, Math.hypot(dx, dy));
    const reach = drop > 1e-3 ? eye[2] / drop : Infinity;
    const k = Math.min(reach, FAR_M / flat);
    points.push([eye[0] + k * dx, eye[1] + k * dy]);
  }
  return hull(points);
}

/**
 * The convex hull, anticlockwise (Andrew's monotone chain).
 * @param {[number, number][]} points
 * @returns {[number, number][]}
 */
export function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  /** @param {[number, number][]} run */
  const half = (run) => {
    const chain = /** @type {[number, number][]} */ ([]);
    for (const point of run) {
      while (chain.length > 1 && turn(chain[chain.length - 2], chain[chain.length - 1], point) <= 1e-12) chain.pop();
      chain.push(point);
    }
    chain.pop();
    return chain;
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** @param {[number, number]} a @param {[number, number]} b @param {[number, number]} c */
function turn(a, b, c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}
