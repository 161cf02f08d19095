// Measures Leo's page on phones, on a tablet and on a laptop zoomed to 200 %: no control covers another one or the
// picture, none is off the page, each can be pressed, and each is large enough for a finger where there are fingers.
// The colours of things have names there:
//
//   node tests/small.mjs BASE_URL     the page of a running robot
//   node tests/small.mjs              a fake of Leo
//
// It waits for states of the page, never for a fixed time; it fails if a state does not come within PATIENCE_S
// (default 120).
import { patient, ready, visit } from './browser.mjs';
import { serve } from './fake.mjs';

const SIZES = [
  { name: 'a small phone', viewport: { width: 320, height: 640 }, hasTouch: true, isMobile: true },
  { name: 'a phone', viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true },
  { name: 'a tablet', viewport: { width: 768, height: 1024 }, hasTouch: true, isMobile: true },
  { name: 'a laptop at 200 %', viewport: { width: 640, height: 400 }, deviceScaleFactor: 2 },
];
/** The smallest side of a target in CSS pixels: for fingers, and for mice. */
const TARGET = { finger: 44, mouse: 24 };
/** What stands beside each other, outside of the stop button, which is in front of all. */
const PARTS = ['h1', '#menu', '#help', '#connection', '#arming', '#views', '#acts', '#watch', '#guide', '#main-view', '#palette', '#talk > header', '#log-box', '#say', '#say-form .primary', '#sentences', '#mind-0', '#mind-1', '#time'];

/** Everything that is wrong with what is shown now, in words. */
const faults = (page, how) => page.evaluate(({ parts, smallest }) => {
  const found = [];
  const isShown = (element) => element.checkVisibility({ visibilityProperty: true });
  const place = (element) => {
    const { left, top, width, height } = element.getBoundingClientRect();
    return { left: left + scrollX, top: top + scrollY, right: left + scrollX + width, bottom: top + scrollY + height, width, height };
  };
  const name = (element) => element.id || element.dataset.sentence || element.textContent.trim() || element.tagName;
  if (document.documentElement.scrollWidth > innerWidth) found.push(`the page is ${document.documentElement.scrollWidth} px wide, of ${innerWidth}`);

  const stand = parts.map((selector) => [selector, document.querySelector(selector)]).filter(([, element]) => isShown(element));
  for (const [at, [one, element]] of stand.entries()) {
    const a = place(element);
    if (a.left < 0 || a.right > innerWidth + 0.5) found.push(`${one} is off the page: ${a.left} to ${a.right}`);
    for (const [other, its] of stand.slice(at + 1)) {
      const b = place(its);
      const [across, down] = [Math.min(a.right, b.right) - Math.max(a.left, b.left), Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top)];
      if (across > 0.5 && down > 0.5) found.push(`${one} and ${other} overlap by ${across} x ${down} px`);
    }
  }

  const stop = document.querySelector('#stop-button');
  for (const control of document.querySelectorAll('button, select, input, summary')) {
    if (!isShown(control) || control.closest('#marks') !== null) continue;
    const { width, height } = control.getBoundingClientRect();
    const least = control.matches('summary, input') ? height : Math.min(width, height);
    if (least < smallest) found.push(`${name(control)} is ${width} x ${height} px`);
    control.scrollIntoView({ block: 'center', inline: 'center' });
    const { left, top, right, bottom } = control.getBoundingClientRect();
    if (left < 0 || right > innerWidth + 0.5) found.push(`${name(control)} is off the page: ${left} to ${right}`);
    const hit = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
    if (hit === null || !(control.contains(hit) || hit.contains(control))) found.push(`${name(control)} is covered by ${hit === null ? 'nothing' : name(hit)}`);
    const button = stop.getBoundingClientRect();
    if (control !== stop && document.elementFromPoint((button.left + button.right) / 2, (button.top + button.bottom) / 2)?.closest('#stop') === null) found.push('the stop button is covered');
  }
  const { width, height } = stop.getBoundingClientRect();
  if (width < 100 || height < 44) found.push(`the stop button is ${width} x ${height} px`);
  scrollTo(0, 0);
  return [...new Set(found)];
}, how);

/** Touches the edge of a thing, beside its picture, and moves it. */
async function touch(page, until) {
  await page.evaluate(() => document.querySelector('#main-view').scrollIntoView({ block: 'start' }));
  const peg = await page.evaluate(() => Object.values(window.leo.under('thing/')).filter((thing) => thing.role === 'peg' && thing.inserted !== true).sort((a, b) => b.p[1] - a.p[1])[0].name);
  const from = await page.evaluate((thing) => window.leo.screen(thing), peg);
  const client = await page.context().newCDPSession(page);
  const send = (type, points) => client.send('Input.dispatchTouchEvent', { type, touchPoints: points });
  const start = { x: from.x + 14, y: from.y };
  const before = await page.evaluate((thing) => window.leo.thing(thing).p, peg);
  await send('touchStart', [start]);
  for (const k of [1, 2, 3, 4]) await send('touchMove', [{ x: start.x, y: start.y - 8 * k }]);
  await send('touchEnd', []);
  await until(`${peg} was moved by a finger`, ([thing, p]) => window.leo.held() === null && Math.abs(window.leo.thing(thing).p[1] - p[1]) > 0.02, [peg, before]);
  await client.detach();
  // The caption belongs to this peg, and not to one of the same name on another table.
  await until(`${peg} has a caption`, (thing) => document.querySelector('.caption').checkVisibility() && document.querySelector('.caption').textContent.startsWith(thing), peg);
  await page.evaluate(() => window.leo.connection.ask('lay', { table: 1 }));
  await until('the next table lies there', () => window.leo.store.get('workspace').table === 1 && window.leo.thing('peg 1') !== undefined);
  await until('nothing there has a caption', () => !document.querySelector('.caption').checkVisibility());
}

/** The colours have names in the pictures, but the teacher is not told of the block behind the screen; a button hides them. */
async function names(page, until) {
  const are = (view, expected) => until(`the colours of ${view} are ${expected}`, ([selector, words]) => {
    const shown = [...document.querySelectorAll(`${selector} .labels span`)].map((label) => label.textContent);
    return [...new Set(shown)].sort().join() === words;
  }, [view, expected]);
  await are('#main-view', 'green,red,wood,yellow');
  await are('#mind-0', 'blue,green,red,wood,yellow');
  await page.click('#labels');
  await are('#main-view', '');
  await are('#mind-0', '');
  await page.click('#labels');
  await are('#mind-0', 'blue,green,red,wood,yellow');
}

const own = process.argv[2] === undefined ? await serve(0) : null;
await visit({}, async (first) => {
  const wrong = [];
  for (const { name, ...how } of SIZES) {
    const context = await first.context().browser().newContext(how);
    const page = await context.newPage();
    const until = patient(page);
    const smallest = how.hasTouch ? TARGET.finger : TARGET.mouse;
    const measure = async (state) => {
      for (const fault of await faults(page, { parts: PARTS, smallest })) wrong.push(`${name}, ${state}: ${fault}`);
    };
    await page.goto(process.argv[2] ?? own.address);
    await ready(page);
    await page.evaluate(() => document.querySelector('#help-guide').click());
    await until('the first steps are there', () => !document.querySelector('#guide').hidden);
    await measure('at first');
    await page.click('#guide-skip');
    await page.evaluate(() => window.leo.connection.ask('clear'));
    await until('the table is empty', () => Object.values(window.leo.under('thing/')).every((thing) => thing.kind === 'person'));
    await page.evaluate(() => window.leo.connection.ask('lay', { table: 0 }));
    await until('the table is set', () => document.querySelector('#palette').checkVisibility()
      && Object.values(window.leo.under('thing/')).some((thing) => thing.role === 'peg' && thing.inserted === false));
    if (await page.isVisible('#menu')) {
      await page.click('#menu');
      await until('the menu is open', () => document.querySelector('#clear').checkVisibility());
    }
    await measure('with a table to set');
    await names(page, until);
    if (how.hasTouch) await touch(page, until);
    if (process.env.PICTURE) await page.screenshot({ path: `${process.env.PICTURE}-${how.viewport.width}.png`, fullPage: true });
    await context.close();
  }
  if (wrong.length > 0) throw new Error(wrong.join('\n'));
});
await own?.close();
