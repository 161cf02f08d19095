import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Scene } from 'three';
import { Stage, camera } from '../src/stage.js';

test('a browser that cannot draw says so, and what is placed over the pictures still is', (t) => {
  t.mock.method(console, 'error', () => {});
  globalThis.ResizeObserver = class {
    observe() {}
  };
  globalThis.requestAnimationFrame = (draw) => draw();
  const rect = { left: 0, top: 0, bottom: 100, width: 100, height: 100 };
  const canvas = { getContext: () => null, addEventListener() {}, removeEventListener() {}, setAttribute() {}, getBoundingClientRect: () => rect, clientWidth: 100, clientHeight: 100, hidden: false };
  const told = [];
  const stage = new Stage(canvas, { software: false }, (why) => told.push(why));
  assert.deepEqual([told.length, canvas.hidden], [1, true]);
  assert.match(told[0], /WebGL/);
  const done = [];
  stage.add({ element: { getBoundingClientRect: () => rect }, scene: new Scene(), camera: camera(), aim: (aspect) => done.push(aspect), drawn: () => done.push('drawn') });
  assert.deepEqual(done, [1, 'drawn']);
  stage.resize();
  assert.equal(done.length, 4);
});
