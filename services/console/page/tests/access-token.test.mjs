import assert from 'node:assert/strict';
import { test } from 'node:test';
import { AccessToken } from '../src/access-token.js';

/** A browser's storage. */
const storage = () => {
  const items = new Map();
  return { getItem: (name) => items.get(name) ?? null, setItem: (name, value) => items.set(name, value), items };
};

/** A history that stores the shown address. */
const history = () => ({ replaceState(_state, _unused, address) { this.address = address; } });

test('the token of the address is kept for later pages and removed from the address', () => {
  const [kept, shown] = [storage(), history()];
  const first = new AccessToken(() => kept);
  first.take({ href: 'http://127.0.0.1:7780/?a=b&token=4f0c&c=d#e' }, shown);
  assert.deepEqual([first.value, shown.address], ['4f0c', 'http://127.0.0.1:7780/?a=b&c=d#e']);
  const [reloaded, next] = [new AccessToken(() => kept), history()];
  reloaded.take({ href: 'http://127.0.0.1:7780/' }, next);
  assert.deepEqual([reloaded.value, next.address], ['4f0c', undefined]);
  assert.deepEqual(reloaded.headers, { authorization: 'Bearer 4f0c' });
  // The address of a robot with a new token replaces the old one.
  new AccessToken(() => kept).take({ href: 'http://127.0.0.1:7780/?token=77aa' }, history());
  assert.deepEqual([...kept.items.values()], ['77aa']);
});

test('without a token no header is sent', () => {
  const token = new AccessToken(storage);
  assert.deepEqual([token.value, token.headers], [null, {}]);
});

test('where the browser forbids storage, the token lasts until a reload', () => {
  const forbidden = () => { throw new Error('forbidden'); };
  const [token, shown] = [new AccessToken(forbidden), history()];
  token.take({ href: 'http://127.0.0.1:7780/?token=4f0c' }, shown);
  assert.deepEqual([token.value, shown.address], ['4f0c', 'http://127.0.0.1:7780/']);
  assert.equal(new AccessToken(forbidden).value, null);
});

test('only a stored token counts as stored', () => {
  const kept = storage();
  new AccessToken(() => kept).take({ href: 'http://leo/?token=4f0c' }, history());
  const [key] = kept.items.keys();
  assert.deepEqual([AccessToken.isStored({ key, newValue: '4f0c' }), AccessToken.isStored({ key, newValue: null }), AccessToken.isStored({ key: 'other', newValue: 'a' })], [true, false, false]);
});
