// The regions of the table that the teacher cannot see. They are by construction invisible from the teacher's seat.
import { BufferGeometry, Float32BufferAttribute, Mesh, MeshBasicMaterial } from 'three';
import { corners, hiddenFrom } from './hidden.js';
import { themed } from './paint.js';
import { heading } from './pose.js';
import { TABLE } from './room.js';

export class Occlusion extends Mesh {
  constructor() {
    super(new BufferGeometry(), new MeshBasicMaterial({ transparent: true, opacity: 0.16, depthWrite: false }));
    this.position.z = 0.0012;
    this.renderOrder = 1;
    this.empty = true;
    this.repaint();
  }

  repaint() {
    /** @type {MeshBasicMaterial} */ (this.material).color.copy(themed('you'));
  }

  /**
   * @param {import('./pose.js').Point | null} eye
   * @param {{p: any, q: any, half: any}[]} occluders
   */
  cast(eye, occluders) {
    const points = [];
    for (const { p, q, half } of eye === null ? [] : occluders) {
      const region = clip(hiddenFrom(/** @type {any} */ (eye), corners({ p, half }, heading(q))));
      for (let at = 1; at + 1 < region.length; at += 1) {
        for (const [x, y] of [region[0], region[at], region[at + 1]]) points.push(x, y, 0);
      }
    }
    // @ts-expect-error: the base class has set it
    const old = /** @type {BufferGeometry} */ (this.geometry);
    old.dispose();
    this.geometry = new BufferGeometry().setAttribute('position', new Float32BufferAttribute(points, 3));
    this.empty = points.length === 0;
  }
}

/** Clips a polygon to the table (Sutherland-Hodgman). @param {[number, number][]} polygon */
function clip(polygon) {
  const borders = [
    { axis: 0, bound: TABLE.x[0], sign: 1 },
    { axis: 0, bound: TABLE.x[1], sign: -1 },
    { axis: 1, bound: TABLE.y[0], sign: 1 },
    { axis: 1, bound: TABLE.y[1], sign: -1 },
  ];
  let points = polygon;
  for (const { axis, bound, sign } of borders) {
    /** @param {[number, number]} point */
    const inside = (point) => sign * (point[axis] - bound) >= 0;
    const kept = /** @type {[number, number][]} */ ([]);
    points.forEach((point, at) => {
      const next = points[(at + 1) % points.length];
      if (inside(point)) kept.push(point);
      if (inside(point) !== inside(next)) {
        const k = (bound - point[axis]) / (next[axis] - point[axis]);
        kept.push([point[0] + k * (next[0] - point[0]), point[1] + k * (next[1] - point[1])]);
      }
    });
    points = kept;
  }
  return points;
}
