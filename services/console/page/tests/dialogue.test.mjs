import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Store } from '../src/store.js';
import { Dialogue } from '../src/dialogue.js';
import { listDivergences } from '../src/divergences.js';
import { furnish, taken } from './document.mjs';

const line = (text) => ({ t: 1, who: null, kind: 'note', text });
const robot = { agents: { 0: 'Leo', 1: 'the teacher' } };

/** A dialogue with twelve lines, and a function to add more. */
function dialogue(t) {
  t.mock.timers.enable({ apis: ['setTimeout'] });
  globalThis.window = {};
  const observers = [];
  globalThis.ResizeObserver = class {
    constructor(hear) {
      observers.push(hear);
    }

    observe() {}
  };
  const ids = furnish({ log: 'ol', 'log-box': 'div', say: 'input', 'task-name': 'input', 'say-form': 'form', sentences: 'div', listen: 'button' });
  const cells = new Store();
  new Dialogue(cells, async () => ({}), { show() {} });
  const apply = (changed, fresh = false) => cells.apply({ version: 1, fresh, cells: changed });
  const all = Object.fromEntries(Array.from({ length: 12 }, (_, n) => [`line/${n}`, line(`line ${n}`)]));
  // In lexicographic order, as an object's keys may come: line/10 before line/9.
  const sorted = Object.fromEntries(Object.keys(all).sort().map((key) => [key, all[key]]));
  apply({ robot, ...sorted }, true);
  taken.length = 0;
  const texts = () => ids.log.children.map((item) => item.lastElementChild.textContent);
  return { ids, apply, sorted, texts, box: ids['log-box'], resize: () => observers.forEach((hear) => hear()) };
}

test('a line stands where its number says, in whatever order the lines come', (t) => {
  const { apply, texts } = dialogue(t);
  assert.deepEqual(texts(), Array.from({ length: 12 }, (_, n) => `line ${n}`));
  apply({ 'line/14': line('line 14'), 'line/13': line('line 13'), 'line/12': line('line 12') });
  assert.deepEqual(texts().slice(-3), ['line 12', 'line 13', 'line 14']);
});

test('the log follows its end after its box has shrunk', (t) => {
  const { box, apply, resize } = dialogue(t);
  Object.assign(box, { scrollHeight: 500, scrollTop: 300, clientHeight: 200 });
  box.listeners.scroll();
  box.clientHeight = 100;
  apply({ 'line/12': line('line 12') });
  assert.equal(box.scrollTop, 500);
  box.scrollTop = 400;
  resize();
  assert.equal(box.scrollTop, 500);
});

test('a reader of older lines stays there when lines come and when the box shrinks', (t) => {
  const { box, apply, resize } = dialogue(t);
  Object.assign(box, { scrollHeight: 500, scrollTop: 100, clientHeight: 200 });
  box.listeners.scroll();
  apply({ 'line/12': line('line 12') });
  box.clientHeight = 100;
  resize();
  assert.equal(box.scrollTop, 100);
});

test('the buttons name the task of the newest sentence, until the teacher names another', (t) => {
  const { ids, apply } = dialogue(t);
  const said = (text) => ({ t: 1, who: 'the teacher', kind: 'said', text: `"${text}"` });
  apply({ 'line/12': said('Leo, I can teach you to do task 2'), 'line/13': said('Why?') });
  assert.equal(ids['task-name'].value, 'task 2');
  assert.equal(ids.sentences.children[1].textContent, 'Task 2 is done');
  ids['task-name'].value = 'the tower';
  ids['task-name'].listeners.input();
  apply({ 'line/14': said('Leo, do task 1') });
  assert.equal(ids['task-name'].value, 'the tower');
});

test('events are told in words, and the figures of a hypothesis on demand', (t) => {
  const { apply, ids } = dialogue(t);
  apply({
    'line/12': { t: 1, who: null, kind: 'rule', text: 'ALL BUT BLUE (the teacher\'s view)' },
    'line/13': { t: 1, who: null, kind: 'thinks', text: 'all but blue                 in Leo\'s own view: posterior 0.9707, tally 2/2' },
  });
  const [rule, thought] = ids.log.children.slice(-2).map((item) => item.lastElementChild);
  assert.equal(rule.textContent, 'all but blue, as you could see it');
  assert.equal(thought.children[0].textContent, 'all but blue, as Leo saw it: almost certain');
  assert.equal(thought.children[1].textContent, 'probability 0.9707, explains 2 of 2 demonstrations');
});

test('a page that connects anew takes no line out of the dialogue that is still so', (t) => {
  const { ids, apply, sorted, texts } = dialogue(t);
  const before = [...ids.log.children];
  const { 'line/0': _first, ...rest } = sorted;
  apply({ robot, ...rest, 'line/5': line('another'), 'line/12': line('line 12') }, true);
  assert.equal(texts().join(), 'line 1,line 2,line 3,line 4,another,line 6,line 7,line 8,line 9,line 10,line 11,line 12');
  assert.deepEqual(taken, [before[0], before[5]]);
});

test('what was said before the page connected is not read out, and what is said then is', (t) => {
  const { apply, sorted, box } = dialogue(t);
  assert.equal(box.getAttribute('aria-live'), 'off');
  t.mock.timers.tick(1000);
  assert.equal(box.getAttribute('aria-live'), 'polite');
  apply({ 'line/12': line('line 12') });
  assert.equal(box.getAttribute('aria-live'), 'polite');
  apply({ robot, ...sorted }, true);
  assert.equal(box.getAttribute('aria-live'), 'off');
});

test('of what divides Leo and the teacher only what has changed is changed, and who is on it stays there', () => {
  const { list } = furnish({ list: 'ul' });
  const cells = new Store();
  const divide = (words, robot, aspects = []) => ({ words, kind: 'different', robot, other: null, aspects });
  const chosen = [];
  const apply = (changed) => {
    cells.apply({ version: 1, fresh: false, cells: changed });
    listDivergences(list, cells, 1, (id) => chosen.push(id));
  };
  apply({ robot, 'divide/1/a': divide('one', 1), 'divide/1/c': divide('three', 3) });
  const [one, three] = list.children;
  const [sign] = one.firstElementChild.children;
  const button = three.firstElementChild;
  taken.length = 0;
  apply({ 'divide/1/b': divide('two', 2), 'divide/1/c': divide('three', 4, [{ percept: 'filled', robot: 'filled', other: null }]) });
  assert.deepEqual(list.children.map((item) => item.dataset.divide), ['divide/1/a', 'divide/1/b', 'divide/1/c']);
  assert.deepEqual([list.children[0], list.children[2], three.firstElementChild], [one, three, button]);
  assert.ok(!taken.some((element) => [one, three, button, sign].includes(element)));
  assert.match(three.textContent, /Three.*filled: nothing, to Leo filled/);
  button.listeners.click();
  assert.deepEqual(chosen, [4]);
  apply({ 'divide/1/a': null });
  assert.deepEqual(list.children.map((item) => item.dataset.divide), ['divide/1/b', 'divide/1/c']);
  assert.equal(taken.at(-1), one);
});
