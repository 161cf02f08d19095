// Geometries of things, from how elongated, flat, round and tapered they are; shared by all things of one form.
import {
  BoxGeometry,
  BufferAttribute,
  CircleGeometry,
  ConeGeometry,
  CylinderGeometry,
  EdgesGeometry,
  ExtrudeGeometry,
  Shape,
} from 'three';
import { RoundedBoxGeometry } from 'three/examples/jsm/geometries/RoundedBoxGeometry.js';
import { mergeGeometries } from 'three/examples/jsm/utils/BufferGeometryUtils.js';

/** @typedef {import('three').BufferGeometry} Geometry */
/** @typedef {import('./pose.js').Point} Point */

const HOLE_RADIUS_M = 0.0135;
const HOLE_SHADE = 0.1;
/** Height of the hole's disc above the block; avoids z-fighting. */
const CLEAR_M = 0.0006;

/** @type {Map<string, Geometry>} */
const forms = new Map();
/** @type {Map<Geometry, Geometry>} */
const edges = new Map();

/**
 * The geometry of a thing, centred at the origin.
 * @param {Point} half its extents
 * @param {readonly number[] | null} shape [elongated, flat, round, tapered]
 * @param {boolean} hole whether there is one in the middle of its top
 * @returns {Geometry} shared: must not be changed
 */
export function form(half, shape, hole) {
  const key = JSON.stringify([half.map((value) => value.toFixed(4)), shape?.map((value) => value.toFixed(2)), hole]);
  let geometry = forms.get(key);
  if (geometry === undefined) {
    geometry = holed(solid(half, shape ?? [0, 0, 0, 0]), hole ? half[2] : null);
    forms.set(key, geometry);
  }
  return geometry;
}

/**
 * The edges of a form.
 * @param {Geometry} geometry of `form`
 */
export function edgesOf(geometry) {
  let found = edges.get(geometry);
  if (found === undefined) {
    found = new EdgesGeometry(geometry, 30);
    edges.set(geometry, found);
  }
  return found;
}

/** @param {Point} half @param {readonly number[]} shape @returns {Geometry} */
function solid([x, y, z], [, , round, tapered]) {
  if (tapered > 0.5) return round > 0.5 ? upended(new ConeGeometry(1, 2, 32), [x, y, z]) : gable([x, y, z]);
  if (round > 0.75) return upended(new CylinderGeometry(1, 1, 2, 28), [x, y, z]);
  if (round > 0.25) return bridge([x, y, z]);
  const bevel = Math.min(0.004, 0.2 * Math.min(x, y, z));
  return new RoundedBoxGeometry(2 * x, 2 * y, 2 * z, 1, bevel);
}

/** Rotates three's y axis to z, and scales. @param {Geometry} geometry @param {Point} half */
function upended(geometry, [x, y, z]) {
  return geometry.rotateX(Math.PI / 2).scale(x, y, z);
}

/** A gable roof. @param {Point} half */
function gable([x, y, z]) {
  const outline = new Shape().moveTo(-x, -z).lineTo(x, -z).lineTo(0, z).closePath();
  return across(outline, y);
}

/** A block with an arch underneath. @param {Point} half */
function bridge([x, y, z]) {
  const outline = new Shape().moveTo(-x, -z).lineTo(-0.5 * x, -z);
  outline.absellipse(0, -z, 0.5 * x, 1.1 * z, Math.PI, 0, true, 0);
  outline.lineTo(x, -z).lineTo(x, z).lineTo(-x, z).closePath();
  return across(outline, y);
}

/** Extrudes an outline in x and z along y. @param {Shape} outline @param {number} y */
function across(outline, y) {
  const geometry = new ExtrudeGeometry(outline, { depth: 2 * y, bevelEnabled: false, curveSegments: 12 });
  return geometry.rotateX(Math.PI / 2).translate(0, y, 0);
}

/**
 * Adds the hole as a dark disc to the geometry, so that a block needs one draw call.
 * @param {Geometry} geometry
 * @param {number | null} top
 */
function holed(geometry, top) {
  const body = shaded(geometry, 1);
  if (top === null) return body;
  const disc = new CircleGeometry(HOLE_RADIUS_M, 24).translate(0, 0, top + CLEAR_M);
  return mergeGeometries([body, shaded(disc, HOLE_SHADE)]) ?? body;
}

/** @param {Geometry} geometry @param {number} shade */
function shaded(geometry, shade) {
  const flat = geometry.index === null ? geometry : geometry.toNonIndexed();
  const count = flat.getAttribute('position').count;
  flat.setAttribute('color', new BufferAttribute(new Float32Array(3 * count).fill(shade), 3));
  for (const name of Object.keys(flat.attributes)) {
    if (!['position', 'normal', 'color'].includes(name)) flat.deleteAttribute(name);
  }
  flat.clearGroups();
  return flat;
}

/** A unit box, for occluders. */
export const UNIT_BOX = new BoxGeometry(1, 1, 1);
