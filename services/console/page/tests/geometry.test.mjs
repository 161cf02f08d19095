import assert from 'node:assert/strict';
import { test } from 'node:test';
import { extent } from '../src/extent.js';
import { corners, hiddenFrom, hull } from '../src/hidden.js';
import { landing, takes } from '../src/landing.js';
import { covers, forward, heading, looksAt, upright } from '../src/pose.js';
import { freeSpot } from '../src/palette.js';
import { approached, orbited, turned } from '../src/seat.js';

const SEAT = { eyes: [0, 1.5, 0.55], looks_at: [0, 0.75, 0] };
const apart = (a, b) => Math.hypot(...a.map((value, axis) => value - b[axis]));
const near = (a, b, within = 1e-9) => assert.ok(apart([a].flat(), [b].flat()) < within, `${a} is not ${b}`);

const block = (name, x, y, z = 0.03, more = {}) => ({
  name, kind: 'object', role: 'block', p: [x, y, z], q: [0, 0, 0, 1], half: [0.03, 0.03, 0.03], shape: [0, 0, 0, 0], hole: true, filled: false, markable: false, ...more,
});
const PEG = { name: 'peg', kind: 'object', role: 'peg', p: [0, 0, 0.025], q: [0, 0, 0, 1], half: [0.011, 0.011, 0.025], shape: [1, 0, 1, 0] };

test('a heading comes back from its orientation', () => {
  for (const angle of [-3, -1, 0, 0.5, 2]) near(heading(upright(angle)), angle);
});

test('an eye looks at the table where its line of sight meets it', () => {
  // 45° down from +x.
  const q = [0, Math.sin(Math.PI / 8), 0, Math.cos(Math.PI / 8)];
  near(forward(q), [Math.SQRT1_2, 0, -Math.SQRT1_2]);
  near(looksAt([0, 0, 0.5], q), [0.5, 0, 0]);
});

test('a thing covers what is under it, turned as it is', () => {
  const bar = { p: [1, 1, 0], q: upright(Math.PI / 2), half: [0.1, 0.01, 0.01] };
  assert.ok(covers(bar, 1, 1.09));
  assert.ok(!covers(bar, 1.09, 1));
});

test('moving round keeps the distance and what is looked at', () => {
  const moved = orbited(SEAT, 0.7, 0.2);
  assert.deepEqual(moved.looks_at, SEAT.looks_at);
  near(apart(moved.eyes, moved.looks_at), apart(SEAT.eyes, SEAT.looks_at));
});

test('the seat goes neither below the table nor over its zenith, however far it is dragged', () => {
  for (const above of [-9, 9]) {
    const { eyes, looks_at } = orbited(SEAT, 0, above);
    assert.ok(eyes[2] >= 0.08);
    assert.ok(eyes[1] > looks_at[1], 'it has not gone over to the other side');
  }
});

test('nearer and farther have bounds', () => {
  near(apart(approached(SEAT, 1e-6).eyes, SEAT.looks_at), 0.35);
  near(apart(approached(SEAT, 1e6).eyes, SEAT.looks_at), 4);
});

test('a head that turns stays where it is and looks at the table', () => {
  const { eyes, looks_at } = turned(SEAT, 0.3, 0.1);
  assert.deepEqual(eyes, SEAT.eyes);
  assert.ok(Math.abs(looks_at[2]) < 1e-9);
  assert.notEqual(looks_at[0], 0);
});

test('a hull leaves out what lies within', () => {
  assert.deepEqual(hull([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5]]), [[0, 0], [1, 0], [1, 1], [0, 1]]);
});

test('a wall hides what is behind it, and not what is before it', () => {
  const wall = { p: [0, 1, 0.125], half: [0.2, 0.01, 0.125] };
  const region = hiddenFrom([0, 2, 0.5], corners(wall, 0));
  const inside = ([x, y]) => region.every(([ax, ay], at) => {
    const [bx, by] = region[(at + 1) % region.length];
    return (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= -1e-9;
  });
  assert.ok(inside([0, 0.6]), 'behind it, within the shadow: the wall is half as high as the eye');
  assert.ok(!inside([0, -0.2]), 'so far behind it that one looks over it');
  assert.ok(!inside([0, 1.3]));
  assert.ok(!inside([0.5, 0.6]));
});

test('a wall that is higher than the eye hides all that is behind it', () => {
  const region = hiddenFrom([0, 2, 0.2], corners({ p: [0, 1, 0.25], half: [0.2, 0.01, 0.25] }, 0));
  assert.ok(Math.min(...region.map(([, y]) => y)) < -1.5);
});

test('a peg near a hole goes into its middle', () => {
  const { p, into } = landing(PEG, [0.02, 0.01], 0, [block('red', 0, 0)]);
  assert.equal(into, 'red');
  near(p, [0, 0, 0.06]);
});

test('what is laid just there goes into a hole only where Leo’s world takes it in', () => {
  const beside = landing(PEG, [0.025, 0], 0, [block('red', 0, 0)], true);
  assert.deepEqual([beside.into, beside.p.slice(0, 2)], [null, [0.025, 0]]);
  assert.equal(landing(PEG, [0.025, 0], 0, [block('red', 0, 0)]).into, 'red');
  assert.equal(landing(PEG, [0.015, 0], 0, [block('red', 0, 0)], true).into, 'red');
});

test('a filled hole takes no peg: it comes to stand on top', () => {
  const full = block('red', 0, 0, 0.03, { filled: true });
  const { p, into } = landing(PEG, [0.01, 0], 0, [full]);
  assert.equal(into, null);
  near(p, [0.01, 0, 0.085]);
});

test('a block stacks onto the middle of the topmost block', () => {
  const { p, into } = landing(block('green', 1, 1), [0.01, 0.01], 0, [block('red', 0, 0), block('blue', 0, 0, 0.09)]);
  assert.notEqual(into, null);
  near(p, [0, 0, 0.15]);
});

test('beside everything it lies on the table', () => {
  near(landing(block('green', 1, 1), [0.3, 0.2], 0, [block('red', 0, 0)]).p, [0.3, 0.2, 0.03]);
});

test('a roof takes nothing', () => {
  assert.ok(!takes(block('roof', 0, 0, 0.03, { shape: [0, 0, 0, 1] }), block('red', 1, 1)));
});

test('what is added by a press lies free of all that is there', () => {
  const lying = [];
  for (let n = 0; n < 20; n += 1) {
    const [x, y] = freeSpot(lying, 0.043);
    for (const { p } of lying) assert.ok(Math.hypot(p[0] - x, p[1] - y) > 0.085, `${x}, ${y} is on another`);
    lying.push(block(`${n}`, x, y));
  }
});

test('the pictures of beliefs take in all that lies there, and keep still while it moves a little', () => {
  const region = extent([block('a', -0.3, 0.4), block('b', 0.3, 1.1)]);
  assert.ok(region.centre[0] - region.half[0] <= -0.33 && region.centre[1] + region.half[1] >= 1.13);
  assert.deepEqual(extent([block('a', -0.301, 0.401), block('b', 0.301, 1.101)]), region);
  assert.ok(extent([]).half[0] > 0);
});
