// A scene with the table and its lighting.
import {
  BoxGeometry,
  DirectionalLight,
  Group,
  HemisphereLight,
  LineBasicMaterial,
  LineSegments,
  BufferGeometry,
  Float32BufferAttribute,
  Mesh,
  Scene,
} from 'three';
import { themed } from './paint.js';
import { surface } from './surface.js';

/** The table's borders and thickness, metres. */
export const TABLE = { x: [-0.95, 0.95], y: [0.1, 1.4], thick: 0.03 };
const CELL_M = 0.1;

/** A scene with a lit table. */
export class Room extends Scene {
  #top;
  #grid;
  #sun;

  /** @param {{shadows: boolean, background: string}} how */
  constructor({ shadows, background }) {
    super();
    this.backdrop = background;
    this.#top = new Mesh(
      new BoxGeometry(TABLE.x[1] - TABLE.x[0], TABLE.y[1] - TABLE.y[0], TABLE.thick),
      surface(),
    );
    this.#top.position.set(0, (TABLE.y[0] + TABLE.y[1]) / 2, -TABLE.thick / 2 - 0.0005);
    this.#top.receiveShadow = shadows;
    this.#grid = grid();
    this.#sun = new DirectionalLight(0xffffff, 1.9);
    this.#sun.position.set(0.7, 1.5, 2.2);
    this.#sun.target.position.set(0, 0.7, 0);
    if (shadows) this.#castShadows();
    this.sky = new HemisphereLight(0xffffff, 0xcfc6b8, 1.55);
    const table = new Group();
    table.add(this.#top, this.#grid);
    this.add(table, this.#sun, this.#sun.target, this.sky);
    this.repaint();
  }

  repaint() {
    this.background = themed(this.backdrop);
    this.#top.material.tint.copy(themed('table'));
    /** @type {LineBasicMaterial} */ (this.#grid.material).color.copy(themed('table-line'));
  }

  #castShadows() {
    const sun = this.#sun;
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    sun.shadow.radius = 3;
    sun.shadow.normalBias = 0.004;
    const camera = sun.shadow.camera;
    [camera.left, camera.right, camera.bottom, camera.top, camera.near, camera.far] = [-1.2, 1.2, -1.2, 1.2, 0.5, 4.5];
  }
}

/** Grid lines every ten centimetres, as a scale. */
function grid() {
  const points = [];
  for (let x = TABLE.x[0] + CELL_M / 2; x < TABLE.x[1]; x += CELL_M) points.push(x, TABLE.y[0], 0, x, TABLE.y[1], 0);
  for (let y = TABLE.y[0] + CELL_M; y < TABLE.y[1] - 0.01; y += CELL_M) points.push(TABLE.x[0], y, 0, TABLE.x[1], y, 0);
  const geometry = new BufferGeometry().setAttribute('position', new Float32BufferAttribute(points, 3));
  const lines = new LineSegments(geometry, new LineBasicMaterial());
  lines.position.z = 0.0002;
  return lines;
}
