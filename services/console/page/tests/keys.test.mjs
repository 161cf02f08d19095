import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Store } from '../src/store.js';

// A minimal DOM for the keyboard.
class HTMLElement {
  dataset = { key: 'thing/1' };
  closest(selector) {
    return selector === '.mark' ? this : null;
  }
}
Object.assign(globalThis, { HTMLElement, HTMLInputElement: class {}, HTMLSelectElement: class {}, document: { addEventListener() {} } });
const { Keys } = await import('../src/keys.js');

const wall = (x) => ({ name: 'wall', kind: 'occluder', p: [x, 0.5, 0.1], q: [0, 0, 0, 1] });

/** A keyboard with a screen that Leo has moved since it was taken, and the requests sent. */
function carrying() {
  const cells = new Store();
  const asked = [];
  let press = (/** @type {any} */ event) => event;
  const keys = new Keys({
    element: { addEventListener: (kind, listener) => (press = listener), contains: () => true },
    camera: { matrixWorld: { elements: [1, 0] } },
    store: cells,
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

/** A keyboard with the view from the seat opposite Leo, and nothing in the hand. */
function sitting(view) {
  let seat = { eyes: [0, 1.5, 0.55], looks_at: [0, 0.75, 0] };
  let press = (/** @type {any} */ event) => event;
  const desk = {
    element: { addEventListener: (kind, listener) => (press = listener), contains: () => true },
    store: new Store(), hand: { held: null }, movable: () => true,
    view: () => view, seat: () => seat, sit: (next) => (seat = next),
  };
  new Keys(desk);
  const type = (key, more) => press({ key, ...more, target: new HTMLElement(), preventDefault() {}, stopPropagation() {} });
  return { type, seat: () => seat };
}

test('arrows with Shift turn the eyes where they are, and without carry them round what they look at', () => {
  // A viewer who looks towards -y has +x on the left.
  for (const [key, axis, sign] of [['ArrowLeft', 0, 1], ['ArrowRight', 0, -1], ['ArrowUp', 1, -1], ['ArrowDown', 1, 1]]) {
    const { type, seat } = sitting('seat');
    const before = seat();
    type(key, { shiftKey: true });
    assert.deepEqual(seat().eyes, before.eyes, key);
    assert.ok(sign * (seat().looks_at[axis] - before.looks_at[axis]) > 0.01, `${key}: ${seat().looks_at}`);
    const turned = seat();
    type(key);
    assert.deepEqual(seat().looks_at, turned.looks_at, key);
    assert.notDeepEqual(seat().eyes, turned.eyes, key);
  }
});

test('nobody turns Leo’s eyes, or the map', () => {
  for (const view of ['leo', 'above']) {
    const { type, seat } = sitting(view);
    const before = seat();
    type('ArrowLeft', { shiftKey: true });
    assert.equal(seat(), before, view);
  }
});
