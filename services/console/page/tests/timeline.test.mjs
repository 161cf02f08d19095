import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Store } from '../src/store.js';

/** A minimal DOM for the timeline. */
function element() {
  return {
    dataset: {}, children: [], clientWidth: 800, setAttribute() {},
    append(...children) { this.children.push(...children); },
    replaceChildren(...children) { this.children = children; },
  };
}
const found = new Map();
globalThis.document = {
  createElement: element,
  createElementNS: element,
  getElementById: (id) => found.get(id) ?? found.set(id, element()).get(id),
};
globalThis.ResizeObserver = class { observe() {} };
const { Timeline } = await import('../src/timeline.js');

test('a thing that is selected again is told again', () => {
  const cells = new Store();
  const timeline = new Timeline(cells);
  const tracks = [{ perspective: 0, points: [{ t: 0, known: true, seen: true, states: {}, p: null }] }];
  const told = () => found.get('timeline-words').children.map(({ textContent }) => textContent);
  timeline.id = 7;
  cells.apply({ version: 1, fresh: true, cells: { now: { t: 1 }, 'history/7': { words: 'red square', tracks } } });
  assert.deepEqual(told(), ['perspective 0: from 0.0 s sees it']);
  timeline.id = null;
  timeline.update();
  assert.deepEqual(told(), []);
  timeline.id = 7;
  timeline.update();
  assert.deepEqual(told(), ['perspective 0: from 0.0 s sees it']);
});
