import assert from 'node:assert/strict';
import { test } from 'node:test';
import { firstStep, isDone } from '../src/guide.js';

test('the first steps are shown while nothing was taught, and go on where they were', () => {
  assert.equal(firstStep([], null, 'script'), 0);
  assert.equal(firstStep([{ examples: 0 }], '0', 'teaching'), 0);
  assert.equal(firstStep([{ examples: 2 }], null, 'script'), null);
  assert.equal(firstStep([{ examples: 2 }], '1', 'script'), 1);
  assert.equal(firstStep([], 'over', 'script'), null);
  assert.equal(firstStep([], 'nonsense', 'script'), 0);
});

test('what the script of the first lesson has taught was taught by nobody', () => {
  const shown = [{ counts: true }, { counts: true }, { counts: false }];
  assert.equal(firstStep([{ examples: 2, demonstrations: shown }], null, 'over'), 0);
  assert.equal(firstStep([{ examples: 2, demonstrations: shown }], null, 'teaching'), null);
  assert.equal(firstStep([{ examples: 3, demonstrations: shown }], null, 'script'), null);
});

test('a step ends by what the visitor does, and not by the script of the lesson', () => {
  const before = { mode: 'script', examples: 0, performed: 0 };
  assert.equal(isDone(1, before, { ...before, examples: 1 }), false);
  assert.equal(isDone(1, before, { ...before, mode: 'teaching', examples: 1 }), true);
  assert.equal(isDone(2, before, before), false);
  assert.equal(isDone(2, before, { ...before, performed: 1 }), true);
  assert.equal(isDone(0, before, { mode: 'teaching', examples: 1, performed: 1 }), false);
});
