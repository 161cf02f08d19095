import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Cells } from '../src/cells.js';

// As much of a document as the keyboard uses.
class HTMLElement {
  dataset = { key: 'thing/1' };
  closest(selector) {
    return selector === '.mark' ? this : null;
  }
}
Object.assign(globalThis, { HTMLElement, HTMLInputElement: class {}, HTMLSelectElement: class {}, document: { addEventListener() {} } });
const { Keys } = await import('../src/keys.js');

const wall = (x) => ({ name: 'wall', kind: 'occluder', p: [x, 0.5, 0.1], q: [0, 0, 0, 1] });

/** A keyboard over a screen that Leo has moved since it was taken, and what it asked for. */
function carrying() {
  const cells = new Cells();
  const asked = [];
  let press = (/** @type {any} */ event) => event;
  const keys = new Keys({
    element: { addEventListener: (kind, listener) => (press = listener), contains: () => true },
    camera: { matrixWorld: { elements: [1, 0] } },
    cells,
    hand: { held: null, take() {}, turn() {}, cancel() {} },
    world: { pose: (key) => cells.get(key) },
    ask: (what, content) => asked.push([what, content]),
    movable: () => true, select() {}, view: () => 'above', zoom() {},
  });
  const apply = (changed) => cells.apply({ version: 1, fresh: false, cells: changed });
  const type = (key) => press({ key, target: new HTMLElement(), preventDefault() {}, stopPropagation() {} });
  apply({ workspace: { lesson: 'a', table: 0 }, 'thing/0': { name: 'red' }, 'thing/1': wall(0) });
  type('Enter');
  type('ArrowRight');
  assert.deepEqual(asked.pop(), ['screen', { name: 'wall', at: [0.01, 0.5, 0.1] }]);
  apply({ 'thing/1': wall(0.01) });
  return { keys, type, apply, asked };
}

test('Esc puts a screen back where it was taken, wherever it stands in the list', () => {
  const { type, apply, asked } = carrying();
  apply({ 'thing/0': wall(0.01), 'thing/1': null });
  type('Escape');
  assert.deepEqual(asked, [['screen', { name: 'wall', at: [0, 0.5, 0.1] }]]);
  type('Escape');
  assert.equal(asked.length, 1);
});

test('Enter leaves a screen where it is', () => {
  const { type, asked } = carrying();
  type('Enter');
  type('Escape');
  assert.deepEqual(asked, []);
});

test('a screen of a lesson that is over is not put back, nor one after Leo was lost', () => {
  const over = carrying();
  over.apply({ workspace: { lesson: 'b', table: 0 } });
  over.type('Escape');
  assert.deepEqual(over.asked, []);
  const lost = carrying();
  lost.keys.forget();
  lost.type('Escape');
  assert.deepEqual(lost.asked, []);
});
