import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Store } from '../src/store.js';
import { Tasks } from '../src/tasks.js';
import { furnish } from './document.mjs';

/** The panel's text of one task. */
function shown(task) {
  const ids = furnish({ tasks: 'div', 'tasks-empty': 'p' });
  const store = new Store();
  new Tasks(store);
  const apply = (cells) => store.apply({ version: 1, fresh: false, cells });
  apply({ robot: { agents: { 0: 'Leo', 1: 'the teacher' } } });
  apply({ 'task/task 1': { name: 'task 1', hypotheses: {}, performances: [], ...task } });
  return ids.tasks.textContent;
}

test('a task without an example is not said to be watched, because its demonstration may be cancelled', () => {
  const text = shown({ examples: 0, demonstrations: [{ seen: {}, actions: [], counts: false }], rule: null });
  assert.match(text, /No demonstration is complete yet/);
  assert.doesNotMatch(text, /watches/);
});

test('a hypothesis is shown in words, with its figures in a disclosure', () => {
  const hypotheses = { human: [{ name: 'all but medium red square', posterior: 0.97, tally: 2, rank: 1 }] };
  const text = shown({ examples: 2, rule: { perspective: 'human', name: 'all but medium red square' }, hypotheses });
  assert.match(text, /all but medium-sized red squarechosen.*almost certain97 % · explains 2\/2 demonstrations/);
});
