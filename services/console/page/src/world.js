// The scene of the actual world: things, screens, people and Leo's body, from the store.
import { Mesh } from 'three';
import { Body } from './body.js';
import { themed } from './paint.js';
import { Person } from './person.js';
import { Room } from './room.js';
import { UNIT_BOX } from './shapes.js';
import { Solid } from './solid.js';
import { setOpacity, surface } from './surface.js';
import { Occlusion } from './occlusion.js';

/** @typedef {import('./store.js').Store} Store */
/** @typedef {import('./pose.js').Point} Point */
/** @typedef {import('./pose.js').Turn} Turn */
/** @typedef {{p: Point, q: Turn}} Pose */

export class World {
  /** @type {Map<string, {object: any, form: string}>} */
  #shown = new Map();
  /** Poses of things that this page moves, until Leo's world has followed. @type {Map<string, Pose>} */
  #echoes = new Map();
  #store;
  #glass = surface({ both: true });
  /** @type {Solid | null} */
  #landing = null;
  body = new Body();
  occlusion = new Occlusion();
  /** @type {string | null} */
  selected = null;
  /** @type {string | null} */
  hovered = null;
  /** The agent whose eyes the seat is of; the first teacher by default. */
  eyes = 1;

  /**
   * @param {Store} store
   * @param {{shadows: boolean}} how
   * @param {() => void} changed
   */
  constructor(store, { shadows }, changed) {
    this.#store = store;
    this.scene = new Room({ shadows, background: 'stage' });
    this.scene.add(this.body, this.occlusion);
    this.repaint();
    store.on('thing/', (changes) => {
      for (const key of changes.keys()) this.#update(key);
      this.#cast();
      changed();
    });
    store.on('robot', () => {
      const robot = store.get('robot');
      if (robot !== undefined) this.body.stand(robot.joints, robot.base);
      for (const [key, thing] of store.under('thing/')) if (thing.kind === 'person') this.#update(key);
      changed();
    });
    store.on('joints', () => {
      this.body.move(store.get('joints') ?? []);
      changed();
    });
  }

  repaint() {
    this.scene.repaint();
    this.occlusion.repaint();
    this.#glass.tint.copy(themed('screen'));
    for (const { object } of this.#shown.values()) if (object instanceof Person) object.repaint();
  }

  /**
   * Adapts the scene to a view.
   * @param {'seat' | 'leo' | 'above' | 'free'} view
   */
  present(view) {
    const solid = view === 'seat';
    setOpacity(this.#glass, solid ? 1 : 0.34);
    this.body.showHead(view !== 'leo');
    this.occlusion.visible = view !== 'seat' && !this.occlusion.empty;
    for (const [key, { object }] of this.#shown) {
      if (!(object instanceof Person)) continue;
      object.visible = view !== 'seat' || this.#store.get(key)?.agent !== this.eyes;
      for (const part of object.field) part.visible = view !== 'seat';
    }
  }

  /** Changes the agent whose eyes the seat is of, and shades what they cannot see. @param {number} agent */
  lookAs(agent) {
    this.eyes = agent;
    this.#cast();
  }

  /** The pose in which a thing is drawn. @param {string} key @returns {Pose | null} */
  pose(key) {
    const echo = this.#echoes.get(key);
    if (echo !== undefined) return echo;
    const thing = this.#store.get(key);
    return thing?.p ? { p: thing.p, q: thing.q ?? [0, 0, 0, 1] } : null;
  }

  /** @param {string} key @param {Pose | null} pose `null`: the pose of the store again */
  echo(key, pose) {
    if (pose === null) this.#echoes.delete(key);
    else this.#echoes.set(key, pose);
    this.#update(key);
    this.#cast();
  }

  /** The objects that a ray can pick. @returns {any[]} */
  pickable() {
    return [...this.#shown.values()].map(({ object }) => object).filter((object) => object.visible);
  }

  /** Highlights the selected and the hovered thing. */
  mark() {
    for (const [key, { object }] of this.#shown) {
      if (!(object instanceof Solid)) continue;
      object.rim(key === this.selected ? 'focus' : key === this.hovered ? 'hover' : null);
    }
  }

  /**
   * Previews where the held object would land.
   * @param {{half: Point, shape: number[], rgb: number[], hole: boolean} | null} form
   * @param {Pose} [pose]
   */
  land(form, pose) {
    if (this.#landing !== null) {
      this.scene.remove(this.#landing);
      this.#landing.dispose();
      this.#landing = null;
    }
    if (form === null || pose === undefined) return;
    this.#landing = new Solid(form);
    this.#landing.look('ghost');
    this.#landing.outline('focus');
    this.#landing.place(pose.p, pose.q);
    this.scene.add(this.#landing);
  }

  /** @param {string} key */
  #update(key) {
    const thing = this.#store.get(key);
    const pose = this.pose(key);
    if (thing === undefined || pose === null) return this.#drop(key);
    const form = JSON.stringify([thing.kind, thing.half, thing.shape, thing.rgb, thing.hole, thing.agent]);
    let shown = this.#shown.get(key);
    if (shown === undefined || shown.form !== form) {
      this.#drop(key);
      shown = { object: this.#create(thing), form };
      shown.object.userData.key = key;
      this.#shown.set(key, shown);
      this.scene.add(shown.object);
      this.mark();
    }
    const { object } = shown;
    if (object instanceof Person) object.look(pose.p, pose.q);
    else {
      object.position.set(...pose.p);
      object.quaternion.set(...pose.q);
    }
  }

  /** @param {any} thing */
  #create(thing) {
    if (thing.kind === 'person') {
      const person = new Person(this.#store.get('robot')?.cone_rad ?? 1, thing.agent === 1 ? 'you' : 'other');
      return person;
    }
    if (thing.kind === 'occluder') {
      const screen = new Mesh(UNIT_BOX, this.#glass);
      screen.scale.set(2 * thing.half[0], 2 * thing.half[1], 2 * thing.half[2]);
      screen.castShadow = true;
      screen.renderOrder = 2;
      return screen;
    }
    return new Solid({ half: thing.half, shape: thing.shape, rgb: thing.rgb, hole: thing.hole === true });
  }

  /** @param {string} key */
  #drop(key) {
    const shown = this.#shown.get(key);
    if (shown === undefined) return;
    this.scene.remove(shown.object);
    if (shown.object instanceof Solid) shown.object.dispose();
    this.#shown.delete(key);
  }

  #cast() {
    let eye = null;
    const occluders = [];
    for (const [key, thing] of this.#store.under('thing/')) {
      const pose = this.pose(key);
      if (pose === null) continue;
      if (thing.kind === 'person' && thing.agent === this.eyes) eye = pose.p;
      if (thing.kind === 'occluder') occluders.push({ ...pose, half: thing.half });
    }
    this.occlusion.cast(eye, occluders);
  }
}
