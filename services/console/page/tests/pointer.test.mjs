import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Mesh, MeshBasicMaterial, BoxGeometry, PerspectiveCamera } from 'three';
import { Pointer } from '../src/pointer.js';

/** A pointer over a screen in the middle of the picture, and what it did. */
function desk() {
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
  const thing = { name: 'wall', kind: 'occluder', p: [0, 0, 0], q: [0, 0, 0, 1] };
  const echoes = new Map();
  const world = {
    pickable: () => [screen],
    pose: (key) => echoes.get(key) ?? { p: thing.p, q: thing.q },
    echo: (key, pose) => (pose === null ? echoes.delete(key) : echoes.set(key, pose)),
  };
  const asked = [];
  new Pointer({
    element, camera, world, cells: { get: () => thing }, hand: { held: null, cancel() {} }, view: () => 'free', eyes: () => 1,
    seat: () => null, sit() {}, select() {}, hover() {}, movable: () => true, zoom() {},
    ask: async (what, content) => asked.push([what, content]),
  });
  const at = (kind, clientX, clientY, pointerId = 1) => hear[kind]({ clientX, clientY, pointerId, button: 0 });
  at('pointerdown', 50, 50);
  at('pointermove', 70, 50);
  assert.equal(echoes.size, 1);
  return { at, echoes, asked };
}

for (const [how, kind, pointer] of [['let go', 'pointerup', 1], ['cancelled', 'pointercancel', 1], ['given up for a second finger', 'pointerdown', 2]]) {
  test(`a screen whose drag is ${how} stays where Leo says it is`, async () => {
    const { at, echoes, asked } = desk();
    const shown = echoes.get('thing/3').p;
    at(kind, 70, 50, pointer);
    await new Promise(setImmediate);
    assert.equal(echoes.size, 0);
    assert.deepEqual(asked.at(-1), ['screen', { name: 'wall', at: shown }]);
  });
}
