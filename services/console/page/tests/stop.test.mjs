import assert from 'node:assert/strict';
import { test } from 'node:test';
import { stop, stopButton } from '../src/stop.js';
import { furnish } from './document.mjs';

const said = (ok, words) => async () => ({ ok, text: async () => `${words}\n` });

test('what the server says of the stop is shown', async () => {
  assert.deepEqual(await stop(said(true, 'raised')), { ok: true, words: 'raised' });
  assert.deepEqual(await stop(said(false, 'NOT STOPPED')), { ok: false, words: 'NOT STOPPED' });
});

test('a stop that does not reach the server is tried once more, and never shown as one that did', async () => {
  const asked = [];
  const answers = [() => Promise.reject(new Error('reset')), said(true, 'raised')];
  const ask = (address, how) => {
    asked.push([address, how.method]);
    return answers.shift()();
  };
  assert.deepEqual(await stop(ask), { ok: true, words: 'raised' });
  assert.deepEqual(asked, [['/stop', 'POST'], ['/stop', 'POST']]);
  const { ok, words } = await stop(() => Promise.reject(new Error('reset')));
  assert.ok(!ok && words.startsWith('NOT STOPPED') && words.includes('reset') && words.includes('cut the power'), words);
});

test('the key of the button stops the robot once for each press, and no other key does', () => {
  const ids = furnish({ stop: 'form' });
  let press;
  Object.assign(document, { addEventListener: (_kind, hear) => (press = hear), querySelectorAll: () => [] });
  ids.stop.parentElement = document.body;
  let submitted = 0;
  ids.stop.requestSubmit = () => (submitted += 1);
  stopButton({ show() {} });
  const key = (name, repeat = false) => press({ key: name, repeat, preventDefault() {} });
  for (const other of ['F8', 'Escape', '9']) key(other);
  assert.equal(submitted, 0);
  key('F9');
  key('F9', true);
  assert.equal(submitted, 1);
});
