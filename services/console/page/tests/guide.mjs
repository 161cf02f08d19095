// Follows the first steps on Leo's page as a newcomer with a phone: sits down, shows a task, lets Leo do it. Then it
// loads the page again, and asks for the steps in the help:
//
//   node tests/guide.mjs BASE_URL     the page of a running robot that was taught nothing
//   node tests/guide.mjs              a fake of Leo
//
// It waits for states of the page, never for a fixed time; it fails if a state does not come within PATIENCE_S
// (default 120).
import { ready, visit } from './browser.mjs';
import { serve } from './fake.mjs';

const PHONE = { viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true };

const own = process.argv[2] === undefined ? await serve(0) : null;
await visit({ page: PHONE }, async (page, until) => {
  const step = (title) => until(`the step is "${title}"`, (words) => !document.querySelector('#guide').hidden
    && document.querySelector('#guide-title').textContent.endsWith(words), title);
  const press = (sentence) => page.tap(`[data-sentence="${sentence}"]`);

  /** Drags a finger from one place to another. */
  async function drag(from, to) {
    const touch = await page.context().newCDPSession(page);
    const send = (type, touchPoints) => touch.send('Input.dispatchTouchEvent', { type, touchPoints });
    await send('touchStart', [from]);
    for (const k of [0.25, 0.5, 0.75, 1]) await send('touchMove', [{ x: from.x + k * (to.x - from.x), y: from.y + k * (to.y - from.y) }]);
    await send('touchEnd', []);
    await touch.detach();
  }

  /** Puts a peg into a hole that the teacher sees. */
  async function fill() {
    await page.evaluate(() => document.querySelector('#main-view').scrollIntoView({ block: 'start' }));
    const [peg, block] = await page.evaluate(() => {
      const things = Object.values(window.leo.under('thing/'));
      const free = things.filter((thing) => thing.role === 'peg' && thing.inserted !== true && thing.held === null);
      const hole = things.find((thing) => thing.hole && thing.filled !== true && thing.name.startsWith('green'));
      return [free.at(-1).name, hole.name];
    });
    const [from, to] = await page.evaluate((names) => names.map((name) => window.leo.screen(name)), [peg, block]);
    await drag(from, to);
    await until(`${peg} is in ${block}`, (name) => window.leo.thing(name)?.filled === true && window.leo.held() === null, block);
  }

  await page.goto(process.argv[2] ?? own.address);
  await ready(page);
  await step('Sit down');
  const eyes = await page.evaluate(() => window.leo.seat().eyes);
  await page.evaluate(() => document.querySelector('#main-view').scrollIntoView({ block: 'start' }));
  const { x, y, width } = await page.locator('#main-view').boundingBox();
  await drag({ x: x + 20, y: y + 20 }, { x: x + 20 + width / 4, y: y + 20 });
  await until('the head has moved', (before) => Math.hypot(...window.leo.seat().eyes.map((v, axis) => v - before[axis])) > 0.05, eyes);
  await page.tap('[data-view="seat"]');
  await page.tap('#guide-next');

  await step('Show a task');
  await page.reload();
  await ready(page);
  await step('Show a task');
  await page.tap('#menu');
  await page.selectOption('#lay', '0');
  await until('the table is laid', () => window.leo.store.get('workspace').mode === 'set-up');
  await page.tap('#menu');
  await until('Leo knows of all that lies there', () => {
    const objects = Object.values(window.leo.under('thing/')).filter((thing) => thing.kind === 'object');
    return objects.length > 0 && objects.every((thing) => thing.belief !== null);
  });
  await press('Leo, I can teach you to do …');
  await until('Leo watches', () => window.leo.store.get('workspace').mode === 'teaching');
  await fill();
  await until('Leo saw it', () => [...document.querySelectorAll('#log .saw')].some((line) => /green/.test(line.textContent)));
  await press('… is done');

  // By itself, because the task was shown.
  await step('Let Leo do it');
  await page.tap('#menu');
  await page.selectOption('#lay', String(await page.evaluate(() => window.leo.store.get('workspace').tables - 1)));
  await until('the new things lie there', () => {
    const { table, tables } = window.leo.store.get('workspace');
    const objects = Object.values(window.leo.under('thing/')).filter((thing) => thing.kind === 'object');
    return table === tables - 1 && objects.length > 0 && objects.every((thing) => thing.belief !== null);
  });
  await press('Leo, do …');
  await until('the steps are over, because Leo has performed', () => document.querySelector('#guide').hidden
    && document.querySelector('.performance strong') !== null);

  await page.reload();
  await ready(page);
  if (await page.isVisible('#guide')) throw new Error('the steps are shown again after their end');
  await page.tap('#help');
  await page.tap('#help-guide');
  await step('Sit down');
  await page.tap('#guide-skip');
  await until('the steps are skipped', () => document.querySelector('#guide').hidden && document.activeElement.id === 'help');
  if (process.env.PICTURE) await page.screenshot({ path: process.env.PICTURE });
});
await own?.close();
