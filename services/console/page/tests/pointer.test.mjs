import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Mesh, MeshBasicMaterial, BoxGeometry, PerspectiveCamera } from 'three';
import { Pointer } from '../src/pointer.js';

/** A pointer over a thing in the middle of the picture, and the resulting actions. */
function over(thing) {
  const hear = {};
  const element = {
    addEventListener: (kind, listener) => (hear[kind] = listener),
    getBoundingClientRect: () => ({ left: 0, top: 0, width: 100, height: 100 }),
    setPointerCapture() {},
  };
  const camera = new PerspectiveCamera(50, 1, 0.01, 10);
  camera.position.set(0, -2, 1);
  camera.up.set(0, 0, 1);
  camera.lookAt(0, 0, 0);
  camera.updateMatrixWorld();
  const screen = new Mesh(new BoxGeometry(0.2, 0.2, 0.2), new MeshBasicMaterial());
  screen.userData.key = 'thing/3';
  screen.updateMatrixWorld();
  const echoes = new Map();
  const world = {
    pickable: () => [screen],
    pose: (key) => echoes.get(key) ?? { p: thing.p, q: thing.q },
    echo: (key, pose) => (pose === null ? echoes.delete(key) : echoes.set(key, pose)),
  };
  const asked = [];
  const done = [];
  const hand = {
    held: null,
    take: () => {
      hand.held = { thing };
      return true;
    },
    carry: (x, y, exact) => done.push(['carry', x, y, exact]),
    turn: (angle) => done.push(['turn', angle]),
    put: () => {
      hand.held = null;
      done.push(['put']);
    },
    cancel: () => {
      if (hand.held !== null) done.push(['cancel']);
      hand.held = null;
    },
  };
  new Pointer({
    element, camera, world, store: { get: () => thing }, hand, view: () => 'free', eyes: () => 1,
    seat: () => ({ eyes: [0, -2, 1], looks_at: [0, 0, 0] }), sit: (seat) => done.push(['sit', seat.eyes]), select() {}, hover() {}, movable: () => true, zoom() {},
    ask: async (what, content) => asked.push([what, content]),
  });
  const at = (kind, clientX, clientY, pointerId = 1, more = {}) => hear[kind]({ clientX, clientY, pointerId, button: 0, ...more });
  at('pointerdown', 50, 50);
  at('pointermove', 70, 50);
  /** The actions since the last call. */
  const since = () => done.splice(0);
  const kinds = () => since().map(([kind]) => kind);
  return { at, echoes, asked, since, kinds };
}

const WALL = { name: 'wall', kind: 'occluder', p: [0, 0, 0], q: [0, 0, 0, 1] };
const BLOCK = { name: 'red', kind: 'object', role: 'block', p: [0, 0, 0], q: [0, 0, 0, 1], half: [0.03, 0.03, 0.03] };

for (const [how, kind, pointer] of [['let go', 'pointerup', 1], ['cancelled', 'pointercancel', 1], ['given up for a second finger', 'pointerdown', 2]]) {
  test(`a screen whose drag is ${how} stays where Leo says it is`, async () => {
    const { at, echoes, asked } = over(WALL);
    assert.equal(echoes.size, 1);
    const shown = echoes.get('thing/3').p;
    at(kind, 70, 50, pointer);
    await new Promise(setImmediate);
    assert.equal(echoes.size, 0);
    assert.deepEqual(asked.at(-1), ['screen', { name: 'wall', at: shown }]);
  });
}

test('a thing follows the finger that took it, and is put down when that one is lifted, whatever others do', () => {
  const { at, since, kinds } = over(BLOCK);
  assert.deepEqual(kinds(), ['carry']);
  at('pointerdown', 90, 50, 2);
  at('pointermove', 90, 60, 2);
  assert.deepEqual(kinds(), ['turn']);
  // The first finger is lifted first: the thing stays there, and the second finger drags nothing.
  at('pointerup', 70, 50, 1);
  at('pointermove', 30, 60, 2);
  at('pointerup', 30, 60, 2);
  assert.deepEqual(since(), [['put']]);
});

test('the finger that took a thing carries it on after the second one has turned it', () => {
  const { at, since, kinds } = over(BLOCK);
  const [[, x, y]] = since();
  at('pointerdown', 90, 50, 2);
  at('pointermove', 90, 60, 2);
  at('pointerup', 90, 60, 2);
  kinds();
  at('pointermove', 70, 50, 1);
  assert.deepEqual(since(), [['carry', x, y, undefined]]);
  at('pointerup', 70, 50, 1);
  assert.deepEqual(kinds(), ['put']);
});

test('a third finger neither turns a thing by coming nor takes it over', () => {
  const { at, since, kinds } = over(BLOCK);
  at('pointerdown', 90, 50, 2);
  kinds();
  at('pointerdown', 70, 90, 3);
  at('pointermove', 70, 80, 3);
  // One of three fingers is lifted; the other two are a quarter turn away from before, and do not turn the thing.
  at('pointerup', 90, 50, 2);
  at('pointermove', 70, 80, 3);
  assert.ok(since().every(([kind, angle]) => kind === 'turn' && Math.abs(angle) < 1e-9));
  at('pointerup', 70, 50, 1);
  at('pointermove', 30, 60, 3);
  assert.deepEqual(kinds(), ['put']);
});

test('a finger that the browser takes away is not the one that holds the thing', () => {
  const { at, kinds } = over(BLOCK);
  at('pointerdown', 90, 50, 2);
  kinds();
  at('pointercancel', 90, 50, 2);
  assert.deepEqual(kinds(), []);
  at('pointercancel', 70, 50, 1);
  assert.deepEqual(kinds(), ['cancel']);
});

test('two fingers that are left of three move the eyes from where they are', () => {
  const { at, since, kinds } = over(WALL);
  at('pointerdown', 90, 50, 2);
  at('pointerdown', 50, 90, 3);
  at('pointermove', 50, 10, 3);
  at('pointerup', 70, 50, 1);
  kinds();
  at('pointermove', 50, 10, 3);
  const [[, near], [, turned]] = since();
  assert.deepEqual([near, turned].map((eyes) => eyes.map((metres) => Number(metres.toFixed(6)))), [[0, -2, 1], [0, -2, 1]]);
});

test('with Alt a thing is laid just there', () => {
  const { at, since } = over(BLOCK);
  since();
  at('pointermove', 72, 50, 1, { altKey: true });
  assert.equal(since()[0][3], true);
});
