import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Store } from '../src/store.js';
import { Palette } from '../src/palette.js';
import { furnish } from './document.mjs';

/** A palette with a table on which a thing lies, and the requests sent. */
function palette(lying = []) {
  const ids = furnish({ 'palette-items': 'div' });
  const asked = [];
  const cells = new Store();
  new Palette(cells, { aim: () => null, preview() {}, lying: () => lying, ask: async (what, content) => asked.push([what, content]) });
  cells.apply({ version: 1, fresh: false, cells: { workspace: { kinds: [], colours: [] } } });
  const chips = ids['palette-items'].children.flatMap((row) => row.children).filter(({ tag }) => tag === 'button');
  const press = (name) => chips.find((chip) => chip.dataset.add === name).listeners.click();
  return { asked, chips, press };
}

test('there are screens of three sizes across the table and as many along it', () => {
  const { asked, chips, press } = palette();
  for (const chip of chips) press(chip.dataset.add);
  const halves = asked.map(([what, { half }]) => (assert.equal(what, 'screen'), half));
  const across = halves.filter(([x, y]) => x > y);
  const along = halves.filter(([x, y]) => y > x);
  assert.equal(new Set(across.map(([x]) => x)).size, 3);
  assert.deepEqual(along, across.map(([x, y, z]) => [y, x, z]));
  for (const [, { at, half }] of asked) assert.equal(at[2], half[2], 'it stands on the table');
});

test('a further screen of one size has another name, and stands beside the first one', () => {
  const first = { name: 'side screen', p: [0, 0.75, 0.125], half: [0.01, 0.16, 0.125] };
  const { asked, press } = palette([first]);
  press('side screen');
  const [[, { name, at, half }]] = asked;
  assert.equal(name, 'side screen 2');
  assert.ok(Math.hypot(at[0] - first.p[0], at[1] - first.p[1]) > 2 * half[1], `${at} is within the first one`);
});
