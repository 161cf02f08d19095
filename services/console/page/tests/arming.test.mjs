import assert from 'node:assert/strict';
import { test } from 'node:test';
import { armingWords, lockLines } from '../src/arming.js';

const BLOCKED = { cause: 'blocked', meaning: 'something held it', remedy: 'remove it', count: 1, joints: ['elbow'] };
const STARTED = { cause: 'not-started', meaning: 'the motor process started', remedy: 'arm', count: 58, joints: [] };
const ARMED = { joints: 65, armed: 65, disarmed: [], locked: [], locks: 0, stopped: false };

test('a robot whose joints are all armed has nothing to press', () => {
  assert.deepEqual(armingWords(ARMED), { state: 'armed', parts: ['Armed: 65 joints'], canArm: false });
  assert.equal(armingWords(undefined).canArm, false);
});

test('what is locked stands first, with its cause', () => {
  const summary = { ...ARMED, armed: 6, disarmed: [STARTED], locked: [BLOCKED] };
  assert.deepEqual(armingWords(summary), {
    state: 'locked',
    parts: ['1 locked: something held it', '58 disarmed: the motor process started', '6 armed'],
    canArm: true,
  });
});

test('while the emergency stop is raised nothing can be armed', () => {
  const { state, parts, canArm } = armingWords({ ...ARMED, armed: 0, disarmed: [STARTED], stopped: true });
  assert.deepEqual([state, canArm], ['stopped', false]);
  assert.match(parts[0], /leo emergency-stop --release/);
});

test('before a lock is acknowledged its joints, its cause and the remedy are said', () => {
  assert.deepEqual(lockLines([BLOCKED]), ['elbow: something held it. To do: remove it.']);
});
