import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Store } from '../src/store.js';
import { People, signed } from '../src/people.js';

const person = (agent) => ({ kind: 'person', agent });
const workspace = (lesson, simulated = true) => ({ lesson, title: '', simulated });

/** Two people at the table of a lesson. */
function table() {
  const cells = new Store();
  const people = new People(cells);
  const apply = (changed) => cells.apply({ version: 1, fresh: false, cells: changed });
  apply({ workspace: workspace('two'), 'thing/0': { kind: 'object' }, 'thing/1': person(2), 'thing/2': person(1) });
  return { people, apply };
}

test('who left is away, and can still be chosen', () => {
  const { people, apply } = table();
  assert.deepEqual([people.all(), people.isAway(2)], [[1, 2], false]);
  apply({ 'thing/1': person(1), 'thing/2': null });
  assert.deepEqual([people.all(), people.isAway(2), people.isAway(1)], [[1, 2], true, false]);
  apply({ 'thing/1': person(1), 'thing/2': person(2) });
  assert.equal(people.isAway(2), false);
});

test('who left before the page was opened can come back', () => {
  const cells = new Store();
  const people = new People(cells);
  const opened = { ...workspace('two'), people: [1, 2] };
  cells.apply({ version: 1, fresh: false, cells: { workspace: opened, 'thing/1': person(1) } });
  assert.deepEqual([people.all(), people.isAway(2)], [[1, 2], true]);
  // On a real robot only the people seen are known.
  cells.apply({ version: 1, fresh: false, cells: { workspace: { ...opened, simulated: false } } });
  assert.deepEqual(people.all(), [1]);
});

test('another lesson has people of its own', () => {
  const { people, apply } = table();
  apply({ workspace: workspace('one'), 'thing/1': person(1), 'thing/2': null });
  assert.deepEqual(people.all(), [1]);
});

test('of a real table, and before anything is known, nobody is said to be away', () => {
  const { people, apply } = table();
  apply({ workspace: workspace('', false), 'thing/1': null, 'thing/2': null });
  assert.equal(people.isAway(1), false);
  assert.equal(new People(new Store()).isAway(1), false);
});

test('whatever somebody does is sent as his, where there is more than one, and as whoever is named', () => {
  for (const what of ['say', 'take', 'leave', 'return', 'screen', 'undo']) {
    assert.deepEqual(signed(what, { name: 'wall' }, 2), { teacher: 2, name: 'wall' }, what);
    assert.deepEqual(signed(what, undefined, null), undefined, what);
  }
  assert.deepEqual(signed('undo', undefined, 2), { teacher: 2 });
  assert.deepEqual(signed('seat', { teacher: 1 }, 2), { teacher: 1 });
  // Clearing the table needs no acting person.
  assert.deepEqual(signed('clear', undefined, 2), undefined);
});
