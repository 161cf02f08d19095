import assert from 'node:assert/strict';
import { test } from 'node:test';
import { apart, colourName } from '../src/labels.js';
import { isHidden } from '../src/line-of-sight.js';
import { COLOURS } from './lesson.mjs';

test('a colour has the name of the nearest one of the lesson', () => {
  assert.equal(colourName([0.7, 0.1, 0.05], COLOURS), 'red');
  assert.equal(colourName([0.5, 0.35, 0.2], COLOURS), 'wood');
  assert.equal(colourName(null, COLOURS), null);
  assert.equal(colourName([1, 0, 0], []), null);
});

test('of equal labels that would cover each other one is left, and different ones stay', () => {
  const label = (key, text, x, y) => ({ key, text, spot: { x, y } });
  const row = [label(1, 'wood', 0, 0), label(2, 'wood', 20, 2), label(3, 'wood', 40, 2), label(4, 'red', 20, 2), label(5, 'wood', 20, 30)];
  assert.deepEqual(apart(row).map(({ key }) => key), [1, 3, 4, 5]);
  // The red one is above the row, by two heights, because one still touches the first.
  assert.equal(apart(row)[2].spot.y, -26);
});

test('a screen hides what is behind it, and nothing beside or before it', () => {
  const eye = [0, 1.5, 0.5];
  const screen = { p: [0, 0.5, 0.12], q: [0, 0, 0, 1], half: [0.16, 0.01, 0.125] };
  assert.ok(isHidden(eye, [0, 0.4, 0.06], screen));
  assert.ok(!isHidden(eye, [0.4, 0.4, 0.06], screen));
  assert.ok(!isHidden(eye, [0, 0.6, 0.06], screen));
  // A quarter turn makes it narrow for this eye.
  const turned = { ...screen, q: [0, 0, Math.SQRT1_2, Math.SQRT1_2] };
  assert.ok(isHidden(eye, [0.1, 0.4, 0.06], screen) && !isHidden(eye, [0.1, 0.4, 0.06], turned));
});
