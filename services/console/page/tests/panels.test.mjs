import assert from 'node:assert/strict';
import { test } from 'node:test';
import { sketch } from '../src/beliefs.js';
import { spoken } from '../src/dialogue.js';
import { tableName } from '../src/lessons.js';
import { css } from '../src/palette.js';
import { pathOf, percent, ranking } from '../src/tasks.js';
import { segmentWords, segments, stateWords } from '../src/timeline.js';
import { agrees, asSeenBy, believes, describe, likelihood, plain, ruleWords, thoughtWords, toYou } from '../src/words.js';

const NAMES = { 0: 'Leo', 1: 'the teacher', 2: 'the other' };
const belief = (p, twin, more = {}) => ({ p, q: [0, 0, 0, 1], half: [0.03, 0.03, 0.03], rgb: [1, 0, 0], states: {}, unseen_s: 0, twin, ...more });

test('what he does not know of is drawn from the robot’s own belief', () => {
  const sketches = sketch([['belief/0/1', belief([0, 0, 0], null)]], [], [['divide/1/a', { kind: 'unknown', robot: 1, other: null }]]);
  assert.deepEqual(sketches.map(({ id, mark }) => [id, mark]), [[1, 'unknown']]);
});

test('what he believes where it is not points to where it is', () => {
  const own = [['belief/0/1', belief([0, 0, 0], null)]];
  const his = [['belief/1/9', belief([0.4, 0, 0], 1, { unseen_s: 3 })]];
  const [first] = sketch(own, his, [['divide/1/a', { kind: 'different', robot: 1, other: 9 }]]);
  assert.equal(first.mark, 'different');
  assert.deepEqual(first.from, [0, 0, 0]);
  assert.ok(first.remembered);
});

test('what he cannot place is drawn where the robot has it', () => {
  const [first] = sketch([['belief/0/1', belief([0.1, 0, 0], null)]], [['belief/1/9', belief(null, 1)]], []);
  assert.equal(first.mark, 'unplaced');
  assert.deepEqual(first.belief.p, [0.1, 0, 0]);
});

test('what nobody can place is not drawn', () => {
  assert.deepEqual(sketch([], [['belief/1/9', belief(null, null)]], []), []);
});

test('hypotheses stand in the order of their ranks, and ties are said', () => {
  const { sorted, tied } = ranking([{ name: 'b', rank: 2, posterior: 0.5 }, { name: 'a', rank: 1, posterior: 0.5 }, { name: 'c', rank: 3, posterior: 0 }]);
  assert.deepEqual(sorted.map(({ name }) => name), ['a', 'b', 'c']);
  assert.deepEqual(tied, ['a', 'b']);
  assert.deepEqual(ranking([{ name: 'a', rank: 1, posterior: 1 }, { name: 'b', rank: 2, posterior: 0 }]).tied, []);
  assert.deepEqual(ranking([]), { sorted: [], tied: [] });
});

test('a small posterior is not shown as none, nor a great one as certain', () => {
  assert.equal(percent(1), '100 %');
  assert.equal(percent(0.994), '99 %');
  assert.equal(percent(1e-5), '< 0.1 %');
  assert.equal(percent(0), '0.0 %');
});

test('a probability in words', () => {
  assert.deepEqual([1, 0.95, 0.7, 0.3, 0.029, 0].map(likelihood), ['almost certain', 'almost certain', 'likely', 'possible', 'unlikely', 'very unlikely']);
});

test('a name that ends with an adjective gets a noun, and no other name does', () => {
  assert.equal(plain('You do not know of the medium green long'), 'You do not know of the medium-sized green long thing');
  assert.equal(plain('all but medium red square'), 'all but medium-sized red square');
  for (const text of ['all but blue', 'long', 'for how long', 'red long thing']) assert.equal(plain(text), text);
});

test('rules and hypotheses of the log are words, whoever’s view they are of', () => {
  assert.equal(ruleWords('ALL (the teacher\'s view)', NAMES), 'all, as you could see it');
  assert.equal(ruleWords('ALL (the other\'s view)', NAMES), 'all, as the other could see it');
  assert.equal(ruleWords('ALL', NAMES), 'ALL');
  assert.deepEqual(thoughtWords('all   in Leo\'s own view: posterior 1.0000, tally 1/1', NAMES),
    { words: 'all, as Leo saw it', posterior: 1, figures: 'probability 1.0000, explains 1 of 1 demonstration' });
  assert.equal(thoughtWords('something else', NAMES), null);
});

test('perspectives of hypotheses by their names', () => {
  assert.deepEqual(['robot', 'human', 'partner 2'].map(pathOf), [[], [1], [2]]);
  assert.equal(asSeenBy([], NAMES), 'as Leo saw it');
  assert.equal(asSeenBy([1], NAMES), 'as you could see it');
  assert.equal(asSeenBy([2], NAMES), 'as the other could see it');
});

test('whose beliefs, however deep', () => {
  assert.equal(believes({ number: 0, agents: [] }, NAMES), 'Leo believes');
  assert.equal(believes({ number: 1, agents: [1] }, NAMES), 'Leo thinks you believe');
  assert.equal(believes({ number: 2, agents: [2] }, NAMES), 'Leo thinks the other believes');
  assert.equal(believes({ number: 3, agents: [1, 0] }, NAMES), 'Leo thinks you think Leo believes');
});

test('that a perspective differs in nothing is said only where it was compared', () => {
  const here = { present: true, beliefs: 0 };
  const [first, second, nested] = [{ number: 1, agents: [1] }, { number: 2, agents: [2] }, { number: 3, agents: [1, 0] }];
  assert.equal(agrees(first, here, NAMES), 'None: you know what Leo knows.');
  assert.equal(agrees(second, here, NAMES), 'None: the other knows what Leo knows.');
  assert.equal(agrees(first, { present: false, beliefs: 3 }, NAMES), 'None: you know what Leo knows.');
  assert.equal(agrees(first, { present: false, beliefs: 0 }, NAMES), '');
  assert.equal(agrees(nested, here, NAMES), `None: it is what ${believes({ agents: nested.agents.slice(0, -1) }, NAMES)}.`);
  assert.equal(agrees(first, undefined, NAMES), '');
  assert.equal(agrees(undefined, here, NAMES), '');
});

test('what is said of the teacher is said to him', () => {
  assert.equal(toYou('the teacher does not know of the blue square', 'the teacher'), 'You do not know of the blue square');
  assert.equal(toYou('the teacher is mistaken about the peg: inserted', 'the teacher'), 'You are mistaken about the peg: inserted');
  assert.equal(toYou('the other does not know of it', 'the teacher'), 'The other does not know of it');
});

test('a thing is described with what is to be said of it', () => {
  assert.equal(describe({ name: 'red', hole: true, filled: false, held: 1 }, NAMES), 'red, hole empty, in your hand');
  assert.equal(describe({ name: 'peg', inserted: true, held: null }, NAMES), 'peg, in a hole');
});

test('segments reach to the next point, the last one to the end', () => {
  const points = [{ t: 1, known: true, seen: true, states: {} }, { t: 3, known: true, seen: false, states: { filled: true } }];
  assert.deepEqual(segments(points, 5).map(({ from, to }) => [from, to]), [[1, 3], [3, 5]]);
});

test('a segment in words, from degrees as from yes and no', () => {
  assert.equal(stateWords({ filled: 0.98, marked: 0.1 }), 'filled');
  assert.equal(stateWords({ filled: true, marked: false }), 'filled');
  assert.equal(segmentWords({ known: true, seen: false, states: { filled: 1 } }), 'remembers it, filled');
  assert.equal(segmentWords({ known: false, seen: false, states: {} }), 'does not know of it');
});

test('speech loses the quotes in which it is told', () => {
  assert.equal(spoken({ kind: 'said', text: '"Leo, do task 1"' }), 'Leo, do task 1');
  assert.equal(spoken({ kind: 'saw', text: '"x"' }), '"x"');
});

test('the last table holds the new things', () => {
  assert.equal(tableName(0, 3), 'table 1');
  assert.equal(tableName(2, 3), 'the new things');
  assert.equal(tableName(0, 1), 'table 1');
});

test('linear light is shown as the screen wants it', () => {
  assert.equal(css([0, 1, 0.2158605]), 'rgb(0 255 128)');
});
