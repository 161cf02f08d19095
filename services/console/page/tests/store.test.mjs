import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Store } from '../src/store.js';

const message = (cells, fresh = false) => ({ version: 1, fresh, cells });

test('a listener hears once per message, and only of its prefix', () => {
  const cells = new Store();
  const heard = [];
  cells.on('thing/', (changes) => heard.push([...changes]));
  cells.apply(message({ 'thing/1': 'a', 'thing/2': 'b', now: { t: 1 } }));
  cells.apply(message({ now: { t: 2 } }));
  assert.deepEqual(heard, [[['thing/1', 'a'], ['thing/2', 'b']]]);
});

test('null takes a cell away', () => {
  const cells = new Store();
  cells.apply(message({ 'thing/1': 'a' }));
  cells.apply(message({ 'thing/1': null }));
  assert.equal(cells.get('thing/1'), undefined);
  assert.deepEqual(cells.under('thing/'), []);
});

test('after a fresh message nothing is left of what was before, and listeners hear that it is gone', () => {
  const cells = new Store();
  cells.apply(message({ 'thing/1': 'a', 'thing/2': 'b' }));
  let heard = new Map();
  cells.on('thing/', (changes) => (heard = changes));
  cells.apply(message({ 'thing/2': 'c' }, true));
  assert.deepEqual([...heard], [['thing/1', undefined], ['thing/2', 'c']]);
});

test('cells come in the order of their numbers', () => {
  const cells = new Store();
  cells.apply(message({ 'line/10': 1, 'line/9': 1, 'line/100': 1 }));
  assert.deepEqual(cells.under('line/').map(([key]) => key), ['line/9', 'line/10', 'line/100']);
});

test('a thing is found by its name wherever it stands in the list', () => {
  const cells = new Store();
  cells.apply(message({ 'thing/0': { name: 'red square' }, 'thing/1': { name: 'green square' } }));
  assert.equal(cells.thing('green square'), 'thing/1');
  cells.apply(message({ 'thing/0': { name: 'green square' }, 'thing/1': null }));
  assert.equal(cells.thing('green square'), 'thing/0');
  assert.equal(cells.thing('red square'), null);
});
