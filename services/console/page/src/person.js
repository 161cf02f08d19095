// A person in the scene: a head, and its field of view as a cone.
import {
  Group,
  Mesh,
  MeshBasicMaterial,
  SphereGeometry,
  DoubleSide,
  ConeGeometry,
} from 'three';
import { themed } from './paint.js';
import { surface } from './surface.js';

const HEAD_M = 0.075;
const CONE_M = 0.34;
const ball = new SphereGeometry(1, 24, 16);

export class Person extends Group {
  #skin = surface();
  #cone = new MeshBasicMaterial({ transparent: true, opacity: 0.09, side: DoubleSide, depthWrite: false });

  /**
   * @param {number} cone half angle of the field of view, radians
   * @param {string} colour of the theme
   */
  constructor(cone, colour) {
    super();
    this.colour = colour;
    const head = new Mesh(ball, this.#skin);
    head.scale.set(0.9 * HEAD_M, 0.8 * HEAD_M, HEAD_M);
    head.position.x = -0.6 * HEAD_M;
    head.castShadow = true;
    const white = surface();
    const dark = surface({ color: 0x222222 });
    for (const side of [-1, 1]) {
      const eye = new Mesh(ball, white);
      eye.scale.setScalar(0.021);
      eye.position.set(0.2 * HEAD_M, side * 0.032, 0.008);
      const pupil = new Mesh(ball, dark);
      pupil.scale.setScalar(0.011);
      pupil.position.set(0.2 * HEAD_M + 0.014, side * 0.032, 0.008);
      this.add(eye, pupil);
    }
    const depth = CONE_M * Math.cos(cone);
    const radius = CONE_M * Math.sin(cone);
    const mantle = new ConeGeometry(radius, depth, 40, 1, true).rotateZ(Math.PI / 2).translate(depth / 2, 0, 0);
    const field = new Mesh(mantle, this.#cone);
    this.add(head, field);
    this.field = [field];
    this.repaint();
  }

  repaint() {
    this.#skin.tint.copy(themed(this.colour));
    this.#cone.color.copy(themed(this.colour));
  }

  /** @param {readonly number[]} p @param {readonly number[]} q x axis along the line of sight */
  look(p, q) {
    this.position.set(p[0], p[1], p[2]);
    this.quaternion.set(q[0], q[1], q[2], q[3]);
  }
}
