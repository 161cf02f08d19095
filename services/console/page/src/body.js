// Leo's body: loaded from its URDF, posed by its joint positions.
import { CylinderGeometry, Group, SphereGeometry } from 'three';
import URDFLoader from 'urdf-loader';
import { surface } from './surface.js';

/** Links of the head, hidden in the view through Leo's eyes. */
const HEAD = 'head_pitch_link';
const NECK = ['neck_yaw_link', 'neck_pitch_link', 'neck_roll_link'];

/** @type {Map<number, ReturnType<typeof surface>>} */
const materials = new Map();

/** One shared material per colour. @param {import('three').Color} color */
function furs(color) {
  const key = color.getHex();
  const material = materials.get(key) ?? surface({ color });
  materials.set(key, material);
  return material;
}

const BALL = new SphereGeometry(1, 18, 12);
const ROUND = new CylinderGeometry(1, 1, 1, 18);

/** Replaces the loader's spheres of 1,800 vertices by coarser ones. @param {any} geometry */
function coarse(geometry) {
  if (geometry.type === 'SphereGeometry') return BALL;
  return geometry.type === 'CylinderGeometry' ? ROUND : geometry;
}

export class Body extends Group {
  /** @type {import('urdf-loader').URDFRobot | null} */
  #robot = null;
  /** @type {string[]} */
  #names = [];
  /** @type {(number | null)[]} */
  #angles = [];

  /**
   * Loads the body.
   * @param {string} address of the URDF
   * @param {Record<string, string>} headers of the request
   */
  async load(address, headers) {
    const answer = await fetch(address, { headers });
    if (!answer.ok) throw new Error(`${address}: ${answer.status}`);
    const robot = new URDFLoader().parse(await answer.text());
    robot.traverse((part) => {
      const mesh = /** @type {any} */ (part);
      if (mesh.isURDFCollider) mesh.visible = false;
      if (mesh.isMesh) {
        mesh.material = furs(mesh.material.color);
        mesh.geometry = coarse(mesh.geometry);
        mesh.castShadow = true;
      }
    });
    this.#robot = robot;
    this.add(robot);
    this.pose();
  }

  /**
   * @param {string[]} names in the order of the angles
   * @param {{p: number[], q: number[]}} base
   */
  stand(names, base) {
    this.#names = names;
    this.position.set(base.p[0], base.p[1], base.p[2]);
    this.quaternion.set(base.q[0], base.q[1], base.q[2], base.q[3]);
    this.pose();
  }

  /** @param {(number | null)[]} angles */
  move(angles) {
    this.#angles = angles;
    this.pose();
  }

  pose() {
    if (this.#robot === null) return;
    this.#names.forEach((name, at) => {
      const angle = this.#angles[at];
      if (angle !== null && angle !== undefined) this.#robot?.setJointValue(name, angle);
    });
  }

  /** @param {boolean} shown */
  showHead(shown) {
    for (const name of [HEAD, ...NECK]) {
      const link = this.#robot?.links[name];
      if (link !== undefined) link.visible = shown;
    }
  }
}
