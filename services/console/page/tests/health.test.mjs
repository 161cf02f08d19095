import assert from 'node:assert/strict';
import { test } from 'node:test';
import { busRow, dropWords, summary, troubleWords } from '../src/health.js';

const BUS = { name: 'torso', lost: false, joints: 9, quarantined: 1, exchanges: 500, skipped: 0, missed: 3, broken: 2, stale: 1, late_bytes: 0 };
const RUNS = { process: 'motor', state: 'running', restarts: 0 };

test('a bus shows its exchanges and every answer that was no use', () => {
  assert.deepEqual(busRow(BUS), ['torso', '500', '6', '1']);
});

test('a lost bus says so, and is trouble', () => {
  const lost = { ...BUS, lost: true };
  assert.deepEqual(busRow(lost), ['torso LOST', '500', '6', '1']);
  assert.deepEqual(summary([RUNS], [BUS, lost], []), { words: '1 process · 2 buses, 1 LOST', bad: true });
});

test('where all is well nothing is said of trouble', () => {
  assert.deepEqual(summary([RUNS, RUNS], [BUS], []), { words: '2 processes · 1 bus', bad: false });
  assert.deepEqual(summary([{ ...RUNS, state: 'dead' }], [], [{}]), { words: '1 process, 1 not running · 1 joint in trouble', bad: true });
});

test('after the end the page says that the robot was stopped, and that is no trouble', () => {
  const ended = { ...RUNS, process: 'motor', state: 'down' };
  // The page does not hear of the end of the console.
  const running = { ...RUNS, process: 'console' };
  for (const console of [running, { ...running, state: 'down' }]) {
    const dead = console === running ? 1 : 2;
    assert.deepEqual(summary([ended, console], [BUS], [], { ended: 65, emergency: 0 }), {
      words: `2 processes, ${dead} not running · 1 bus · the robot was stopped, torque of 65 joints is off`, bad: false });
  }
  assert.deepEqual(summary([RUNS], [BUS], [{}], { ended: 1, emergency: 0 }), {
    words: '1 process · 1 bus · 1 joint in trouble · the robot was stopped, torque of 1 joint is off', bad: true });
});

test('a process that does not run beside others that do is trouble, whatever joints were stopped', () => {
  const dead = { ...RUNS, process: 'belief', state: 'down' };
  assert.deepEqual(summary([RUNS, dead], [BUS], [], { ended: 1, emergency: 0 }), {
    words: '2 processes, 1 not running · 1 bus · the robot was stopped, torque of 1 joint is off', bad: true });
  assert.equal(summary([dead, dead], [BUS], [], { ended: 0, emergency: 0 }).bad, true);
});

test('an emergency stop is shown as wrong', () => {
  assert.deepEqual(summary([RUNS], [BUS], [], { ended: 0, emergency: 65 }), {
    words: '1 process · 1 bus · emergency stop, torque of 65 joints is off', bad: true });
});

test('a joint in trouble shows the states of its machines and why it is locked', () => {
  const joint = { joint: 'elbow', mode: 'limp', cause: 'blocked', link: 'answering', power: 'off', arming: 'locked', arming_cause: 'blocked', motion: 'idle' };
  assert.equal(troubleWords(joint), 'elbow: limp, blocked (link answering, power off, locked: blocked, idle)');
  assert.equal(troubleWords({ joint: 'elbow', mode: 'quarantined', cause: 'silent' }), 'elbow: quarantined, silent');
});

test('frames that a process need not read are skipped, and only those of belief and motor are lost', () => {
  assert.equal(dropWords({ process: 'learner', drops: 64420 }), '64420 skipped');
  assert.equal(dropWords({ process: 'belief', drops: 3 }), '3 lost');
  assert.equal(dropWords({ process: 'belief', drops: 0 }), '0');
  assert.equal(dropWords({ process: 'motor' }), '–');
});
