// Pictures of the page of a robot that runs, for who changes the page and for the docs: every panel opened, and every
// perspective; each for a laptop and for a tablet, in the light and in the dark:
//
//   node tests/shots.mjs BASE_URL [--into FOLDER] [NAME…]     those named so alone, such as `page open`
//
// The robot should have just been started with nothing that it remembers, play Task 1 and stay up. This waits for states
// of its page and never for a time. A picture of a page whose views are empty fails it, and so does a panel that no
// picture shows.
import { mkdir, writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { parseArgs } from 'node:util';
import { launch, opened, patient, ready } from './browser.mjs';

const { values: { into }, positionals: [base, ...named] } = parseArgs({ options: { into: { type: 'string', default: 'shots' } }, allowPositionals: true });
if (base === undefined) throw new Error('whose page? node tests/shots.mjs BASE_URL [--into FOLDER] [NAME…]');

const SIZES = [
  { name: '', viewport: { width: 1280, height: 800 } },
  { name: '-tablet', viewport: { width: 820, height: 1180 }, hasTouch: true },
];
const SCHEMES = [{ name: '', colorScheme: 'light' }, { name: '-dark', colorScheme: 'dark' }];
/** So many colours a view has at least that something is drawn in: every side of a thing is lit otherwise. */
const COLOURS = 50;

await mkdir(into, { recursive: true });
const browser = await launch();
const troubles = [];
/** What can be opened, by its name in the document, and whether a picture shows it so. @type {Map<string, boolean>} */
const panels = new Map();

const pages = [];
for (const { name, viewport, hasTouch } of SIZES) {
  const page = await opened(browser, { viewport, hasTouch });
  page.on('pageerror', (error) => troubles.push(`${name}: ${error.message}`));
  await page.goto(base);
  await ready(page);
  pages.push({ name, page, until: patient(page) });
}
const [{ page: laptop, until }] = pages;
for (const id of await laptop.$$eval('details[id], dialog[id]', (all) => all.map((each) => each.id))) panels.set(id, false);

/** Does something on each of the pages, one after the other. */
async function onEach(act) {
  for (const { page, until: shown } of pages) await act(page, shown);
}

/** Waits until all that was to be drawn is. */
const drawn = (page) => page.evaluate(async () => {
  const before = window.leo.pictures();
  window.leo.stage.request();
  while (window.leo.pictures() === before) await new Promise((done) => requestAnimationFrame(done));
  await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
});

/** How many colours are in the part of the canvas that is a view's. */
const colours = (page, view) => page.evaluate((selector) => {
  const canvas = document.querySelector('#canvas');
  const [place, part] = [canvas, document.querySelector(selector)].map((each) => each.getBoundingClientRect());
  const scale = canvas.width / place.width;
  const paper = new OffscreenCanvas(Math.round(scale * part.width), Math.round(scale * part.height)).getContext('2d');
  paper.drawImage(canvas, scale * (place.left - part.left), scale * (place.top - part.top));
  return new Set(new Uint32Array(paper.getImageData(0, 0, paper.canvas.width, paper.canvas.height).data.buffer)).size;
}, view);

/**
 * Every page as it is now.
 * @param {string} name
 * @param {{whole?: boolean, only?: typeof pages}} [how] whole: all of a page that is longer than its screen
 */
async function shoot(name, { whole = false, only = pages } = {}) {
  for (const { name: size, page } of only) {
    for (const { name: scheme, colorScheme } of SCHEMES) {
      await page.emulateMedia({ colorScheme });
      await drawn(page);
      for (const view of ['#main-view', '#mind-0', '#mind-1']) {
        const found = await colours(page, view);
        if (found < COLOURS) throw new Error(`${name}${size}${scheme}.png: ${view} has ${found} colours: nothing is drawn`);
      }
      const png = await page.screenshot({ fullPage: whole && size !== '' });
      if (named.length === 0 || named.includes(name)) await writeFile(join(into, `${name}${size}${scheme}.png`), png);
    }
    for (const id of await page.$$eval('details[open][id], dialog[open][id]', (all) => all.map((each) => each.id))) panels.set(id, true);
    await page.emulateMedia({ colorScheme: 'light' });
  }
}

/**
 * Clicks a thing where the page shows it, which selects it; again where the page had just lost Leo and took nothing up.
 * @param {import('playwright-core').Page} page @param {string} name @param {() => boolean} isSelected
 */
async function select(page, name, isSelected) {
  await page.evaluate(() => scrollTo(0, 0));
  for (let clicks = 0; clicks < 10 && !(await page.evaluate(isSelected)); clicks += 1) {
    await patient(page)('Leo is there', () => window.leo.connection.state === 'connected');
    const at = await page.evaluate((thing) => window.leo.screen(thing), name);
    await page.mouse.click(at.x, at.y);
    await drawn(page);
  }
  await patient(page)(`${name} is selected`, isSelected);
}

async function say(text) {
  const before = await laptop.evaluate(() => Object.values(window.leo.under('line/')).filter((line) => line.kind === 'said').length);
  await until('Leo hears', () => window.leo.connection.state === 'connected');
  await laptop.fill('#say', text);
  await laptop.press('#say', 'Enter');
  await until(`"${text}" was said`, (n) => Object.values(window.leo.under('line/')).filter((line) => line.kind === 'said').length > n, before);
}

/** What Leo saw so far. */
const sights = () => laptop.evaluate(() => Object.values(window.leo.under('line/')).filter((line) => line.kind === 'saw').length);

/** Lays a table of the lesson; whoever does so takes over from its script, and all stands still. @param {number} table */
async function lay(table) {
  await laptop.selectOption('#lay', String(table));
  await until(`table ${table} lies there`, (n) => window.leo.cells.get('workspace').table === n && window.leo.cells.get('workspace').mode === 'set-up', table);
  await until('Leo knows of all that lies there', () => {
    const objects = Object.values(window.leo.under('thing/')).filter((thing) => thing.kind === 'object');
    return objects.length > 0 && objects.every((thing) => thing.belief !== null);
  });
}

/** Has the teacher fill holes that he sees, until so many are filled. @param {number} holes */
async function fill(holes) {
  const filled = () => laptop.evaluate(() => Object.values(window.leo.under('thing/')).filter((thing) => thing.filled === true).length);
  while (await filled() < holes) {
    const [before, seen] = [await filled(), await sights()];
    const refused = await laptop.evaluate(async () => {
      const things = Object.values(window.leo.under('thing/'));
      const hole = things.find((thing) => thing.hole && !thing.filled && !thing.name.startsWith('blue'));
      const peg = things.find((thing) => thing.role === 'peg' && thing.inserted !== true);
      const taken = await window.leo.connection.ask('take', { thing: peg.name });
      return taken.error ?? (await window.leo.connection.ask('put', { at: [hole.p[0], hole.p[1], 0.2] })).error;
    });
    if (refused !== undefined) throw new Error(`a hole cannot be filled: ${refused}`);
    await until('a hole more is filled', (n) => Object.values(window.leo.under('thing/')).filter((thing) => thing.filled === true).length > n, before);
    await until('Leo saw that', (n) => Object.values(window.leo.under('line/')).filter((line) => line.kind === 'saw').length > n, seen);
  }
}

async function done() {
  const before = await laptop.evaluate(() => window.leo.cells.get('task/task 1')?.examples ?? 0);
  await say('Task 1 is done');
  await until('Leo has an example more', (n) => (window.leo.cells.get('task/task 1')?.examples ?? 0) > n, before);
}

/** Task 1 has been shown once and is half shown again: Leo knows of a block that the teacher does not see. */
async function halfway() {
  for (const table of [0, 1]) {
    await lay(table);
    await until('the teacher does not know of the blue square', () => [...document.querySelectorAll('#divides li[data-kind="unknown"]')].some((item) => item.textContent.includes('blue')));
    await say('Leo, I can teach you to do task 1');
    await fill(table === 0 ? 4 : 2);
    if (table === 0) await done();
  }
}

/** The task is taught, and Leo has done it with new things. */
async function performed() {
  await fill(4);
  await done();
  await lay(await laptop.evaluate(() => window.leo.cells.get('workspace').tables - 1));
  const before = await laptop.evaluate(() => window.leo.cells.get('task/task 1').performances.filter((each) => each.result).length);
  await say('Leo, do task 1');
  await until('Leo has performed', (n) => window.leo.cells.get('task/task 1').performances.filter((each) => each.result).length > n, before);
}

/** A table that is being set: a few things from the palette, and one of them selected. */
async function setUp() {
  await laptop.click('#clear');
  await until('the table is empty', () => window.leo.cells.get('workspace').mode === 'set-up'
    && Object.values(window.leo.under('thing/')).every((thing) => thing.kind === 'person'));
  for (const item of ['screen', 'red square', 'blue square', 'wood peg']) {
    const before = await laptop.evaluate(() => Object.keys(window.leo.under('thing/')).length);
    await laptop.click(`[data-add="${item}"]`);
    await until(`a ${item} lies on the table`, (n) => Object.keys(window.leo.under('thing/')).length > n, before);
  }
  await until('Leo knows of them', () => Object.keys(window.leo.under('belief/0/')).length >= 3);
}

try {
  await halfway();
  await onEach(async (page, shown) => {
    await shown('all that is half filled', () => window.leo.thing('green') !== undefined && document.querySelectorAll('#divides li').length > 0);
    await select(page, 'green', () => document.querySelector('#timeline svg') !== null);
  });
  await shoot('page', { whole: true });
  for (const view of ['leo', 'above', 'free']) {
    await laptop.click(`[data-view="${view}"]`);
    await shoot(`view-${view}`, { only: pages.slice(0, 1) });
  }
  await laptop.click('[data-view="seat"]');
  const perspectives = await laptop.$$eval('#perspectives [role=tab]', (tabs) => tabs.map((tab) => tab.dataset.perspective));
  const take = (perspective) => onEach(async (page, shown) => {
    await page.click(`#perspectives [data-perspective="${perspective}"]`);
    await shown('whose beliefs these are', (n) => document.querySelector(`#perspectives [data-perspective="${n}"]`).ariaSelected === 'true', perspective);
  });
  for (const perspective of perspectives.slice(1)) {
    await take(perspective);
    await shoot(`perspective-${perspective}`);
  }
  if (perspectives.length > 1) await take(perspectives[0]);

  await performed();
  await onEach(async (page, shown) => {
    await shown('what Leo did', () => document.querySelector('.performance') !== null);
    for (const id of panels.keys()) if (await page.$(`details#${id}:not([open])`)) await page.click(`#${id} > summary`);
    // What is in a panel comes anew with what Leo learns.
    await page.$$eval('details:not([id], [open])', (all) => all.forEach((each) => (each.open = true)));
    await shown('the processes and the buses', () => document.querySelectorAll('#health-body tbody tr').length > 5);
  });
  await shoot('open', { whole: true });
  await onEach((page) => page.$$eval('details[id]', (all) => all.forEach((each) => (each.open = false))));

  await setUp();
  await onEach(async (page, shown) => {
    await shown('what can be laid', () => document.querySelector('#palette').checkVisibility());
    // Nothing hides the one that is nearest.
    const near = () => Object.values(window.leo.under('thing/')).filter((thing) => thing.kind === 'object').sort((a, b) => b.p[1] - a.p[1])[0].name;
    await select(page, await page.evaluate(near), () => !document.querySelector('#remove').hidden);
  });
  await shoot('set-up');
  await onEach((page) => page.click('#save'));
  await shoot('save');

  // It asks about locked joints, of which this robot has none; arm.mjs opens it.
  panels.delete('arm-dialog');
  for (const [id, isShown] of panels) if (!isShown) throw new Error(`no picture shows #${id} opened`);
  if (troubles.length > 0) throw new Error(`the page failed: ${troubles.join('; ')}`);
} catch (error) {
  if (process.env.PICTURE) await laptop.screenshot({ path: process.env.PICTURE });
  console.error([error.message, ...troubles].join('\n'));
  process.exitCode = 1;
} finally {
  await browser.close();
}
