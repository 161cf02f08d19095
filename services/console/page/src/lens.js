// Cameras: from the teacher's seat, through Leo's eyes, from above, and freely around the table.
import { Vector3 } from 'three';
import { looksAt } from './pose.js';

/** @typedef {import('three').PerspectiveCamera} Camera */
/** @typedef {import('./seat.js').Seat} Seat */
/** @typedef {{centre: [number, number], half: [number, number]}} Extent a region of the table */
/** @typedef {'seat' | 'leo' | 'above' | 'free'} Name */

/** Vertical field of view above and below the line of sight, as tangents: from Leo's face to the table's near edge. */
const ABOVE = 0.86;
const BELOW = 0.37;
const DEGREES = 180 / Math.PI;

export const VIEWS = /** @type {{name: Name, label: string}[]} */ ([
  { name: 'seat', label: 'Your eyes' },
  { name: 'leo', label: 'Leo’s eyes' },
  { name: 'above', label: 'From above' },
  { name: 'free', label: 'Free' },
]);

/** The initial seat of the free view. @returns {Seat} */
export function freeSeat() {
  return { eyes: [1.15, 1.75, 1.0], looks_at: [0, 0.62, 0.12] };
}

/**
 * Through the teacher's eyes. The view is shifted so that the line of sight lies below the centre of the picture;
 * it then contains both the table and Leo's face.
 * @param {Camera} camera
 * @param {Seat} seat
 * @param {number} aspect
 */
export function throughEyes(camera, seat, aspect) {
  const narrow = Math.max(1, 1.15 / aspect);
  shifted(camera, aspect, narrow * ABOVE, narrow * BELOW);
  camera.up.set(0, 0, 1);
  camera.position.set(...seat.eyes);
  camera.near = 0.02;
  camera.lookAt(...seat.looks_at);
}

/**
 * Through Leo's eyes.
 * @param {Camera} camera
 * @param {{p: any, q: any} | null | undefined} eye
 * @param {number} aspect
 */
export function throughLeo(camera, eye, aspect) {
  centred(camera, aspect, 62);
  camera.up.set(0, 0, 1);
  camera.near = 0.1;
  const p = eye?.p ?? [0, 0.06, 0.62];
  camera.position.set(...asPoint(p));
  camera.lookAt(...(eye?.q ? looksAt(asPoint(p), eye.q) : asPoint([0, 0.75, 0])));
}

/**
 * From above, with the table oriented as the teacher sees it.
 * @param {Camera} camera
 * @param {number} aspect
 * @param {number} near zoom; 1 shows the whole table
 */
export function fromAbove(camera, aspect, near) {
  // A distant camera with a narrow angle keeps the perspective shift of tall objects small.
  centred(camera, aspect, 16);
  const height = (Math.max(0.86, 1.02 / aspect) / Math.tan(8 / DEGREES)) * near;
  camera.position.set(0, 0.8, height);
  camera.up.set(0, -1, 0);
  camera.near = 0.1;
  camera.lookAt(0, 0.8, 0);
}

/** @param {Camera} camera @param {Seat} seat @param {number} aspect */
export function freely(camera, seat, aspect) {
  centred(camera, aspect, 40);
  camera.up.set(0, 0, 1);
  camera.near = 0.05;
  camera.position.set(...seat.eyes);
  camera.lookAt(...seat.looks_at);
}

/**
 * The beliefs: from the teacher's side, steeply from above, so that all beliefs are in the picture.
 * @param {Camera} camera
 * @param {Extent} extent
 * @param {number} aspect
 */
export function overTable(camera, { centre, half }, aspect) {
  centred(camera, aspect, 34);
  const deep = 0.66 * half[1] + 0.1;
  const far = Math.max(deep, (half[0] + 0.06) / aspect) / Math.tan(17 / DEGREES) + 0.35 * half[1];
  const at = new Vector3(centre[0], centre[1] + 0.04, 0.05);
  const direction = new Vector3(0, 0.7, 1).normalize();
  camera.position.copy(at).addScaledVector(direction, far);
  camera.up.set(0, 0, 1);
  camera.near = 0.1;
  camera.lookAt(at);
}

/** @param {Camera} camera @param {number} aspect @param {number} fov vertical, in degrees */
function centred(camera, aspect, fov) {
  camera.clearViewOffset();
  camera.fov = fov;
  camera.aspect = aspect;
  camera.updateProjectionMatrix();
}

/** @param {Camera} camera @param {number} aspect @param {number} above @param {number} below */
function shifted(camera, aspect, above, below) {
  const max = Math.max(above, below);
  const share = (above + below) / (2 * max);
  camera.fov = 2 * Math.atan(max) * DEGREES;
  camera.aspect = aspect * share;
  camera.setViewOffset(aspect, 1 / share, 0, above >= below ? 0 : 1 / share - 1, aspect, 1);
}

/** @param {readonly number[]} p @returns {[number, number, number]} */
function asPoint(p) {
  return [p[0], p[1], p[2]];
}
