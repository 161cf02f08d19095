// Teaches Leo Task 1 on its own page with mouse, touch, keyboard, typed sentences and a spoken one, from an empty
// table. Then it teaches a task with ambiguous demonstrations. It prints what the page showed of both, the last one
// first, as one JSON document:
//
//   node tests/teach.mjs BASE_URL     the page of a running robot
//   node tests/teach.mjs              a fake of Leo
//
// It waits for states of the page, never for a fixed time; it fails if a state does not come within PATIENCE_S
// (default 120). If PICTURE is set, it then saves a picture of the page there. Speech recognition is mocked: a real
// browser sends audio to its vendor.
import { launch, opened, patient, ready } from './browser.mjs';
import { serve } from './fake.mjs';

const TASK = 'task 1';
const OPEN_TASK = 'task 2';

/** The two demonstrations: blocks by colour and place, the screen before the blue one, and the pegs' row. */
const TABLES = [
  { blocks: [['red', -0.3, 0.75], ['green', -0.1, 0.85], ['yellow', 0.12, 0.72], ['blue', 0.05, 0.4]], screen: [0.05, 0.51], pegs: [-0.3, -0.15, 0] },
  { blocks: [['yellow', -0.32, 0.85], ['red', -0.12, 0.75], ['green', 0.12, 0.85], ['blue', -0.05, 0.42]], screen: [-0.05, 0.53], pegs: [-0.3, -0.15, 0] },
];
const PEGS_Y = 1.08;
/** The novel set, within Leo's reach. */
const NOVEL = { blocks: [['blue', -0.26, 0.46], ['red', -0.09, 0.46], ['green', 0.08, 0.46], ['blue', 0.25, 0.46]], pegs: [-0.27, -0.09, 0.09, 0.27] };
const NOVEL_PEGS_Y = 0.3;

const base = process.argv[2];
const own = base === undefined ? await serve(0) : null;
const browser = await launch();
const page = await opened(browser, { viewport: { width: 1440, height: 900 }, hasTouch: true });
const troubles = [];
page.on('pageerror', (error) => troubles.push(error.message));

await page.addInitScript(() => {
  window.heard = [];
  window.SpeechRecognition = class {
    start() {
      const [text, error] = window.heard.shift() ?? ['', 'no-speech'];
      queueMicrotask(() => {
        if (error) this.onerror({ error });
        else this.onresult({ results: [[{ transcript: text }]] });
        this.onend();
      });
    }

    stop() {}
  };
});

const until = patient(page);

const objects = () => page.evaluate(() => Object.values(window.leo.under('thing/')).filter((thing) => thing.kind !== 'person').length);
const saw = () => page.evaluate(() => Object.values(window.leo.under('line/')).filter((line) => line.kind === 'saw').length);
const examples = (task) => page.evaluate((name) => window.leo.store.get(`task/${name}`)?.examples ?? 0, task);

async function drag(from, to) {
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move((from.x + to.x) / 2, (from.y + to.y) / 2, { steps: 4 });
  await page.mouse.move(to.x, to.y, { steps: 4 });
  await page.mouse.up();
}

async function middle(selector) {
  await page.locator(selector).scrollIntoViewIfNeeded();
  const box = await page.locator(selector).boundingBox();
  return { x: box.x + box.width / 2, y: box.y + box.height / 2 };
}

/** Drags something from the palette onto the table. Returns the name it is given. */
async function add(item, x, y) {
  const before = await page.evaluate(() => Object.values(window.leo.under('thing/')).map((thing) => thing.name));
  const chip = await middle(`[data-add="${item}"]`);
  await drag(chip, await page.evaluate(([px, py]) => window.leo.at(px, py, 0), [x, y]));
  await until(`a ${item} lies on the table`, (n) => Object.keys(window.leo.under('thing/')).length > n, before.length);
  return page.evaluate((names) => Object.values(window.leo.under('thing/')).map((thing) => thing.name).find((name) => !names.includes(name)), before);
}

async function clear() {
  await page.click('#clear');
  await until('the table is empty', () => window.leo.store.get('workspace').mode === 'set-up'
    && Object.values(window.leo.under('thing/')).every((thing) => thing.kind === 'person'));
}

async function say(text, enter = (words) => page.fill('#say', words)) {
  const before = await page.evaluate(() => Object.values(window.leo.under('line/')).filter((line) => line.kind === 'said').length);
  await enter(text);
  await page.press('#say', 'Enter');
  await until(`"${text}" was said`, (n) => Object.values(window.leo.under('line/')).filter((line) => line.kind === 'said').length > n, before);
}

/** By the microphone, after a first attempt without a result; the recognised text can be checked before it is sent. */
async function speak(text) {
  await page.evaluate((words) => { window.heard = [['', 'no-speech'], [words]]; }, text);
  await page.click('#listen');
  await until('the microphone is off again', () => document.querySelector('#listen').ariaPressed === 'false' && window.heard.length === 1);
  await page.click('#listen');
  await until(`"${text}" was heard`, (words) => document.querySelector('#say').value === words, text);
  if (await page.getAttribute('#listen', 'aria-pressed') !== 'false') throw new Error('the microphone stays on');
}

/** A microphone that turns out to be unusable shows a message and is hidden. */
async function cannotHear() {
  await page.evaluate(() => { window.heard = [['', 'network']]; });
  await page.click('#listen');
  await until('nothing will be heard', () => document.querySelector('#listen').hidden && document.querySelector('#toasts').textContent.includes('type what you want'));
}

/** Puts a peg into the block's hole by mouse, by touch or by keyboard. */
const ways = {
  async mouse(peg, block) {
    const [from, to] = await page.evaluate((names) => names.map((name) => window.leo.screen(name)), [peg, block]);
    await drag(from, to);
  },
  async finger(peg, block) {
    const [from, to] = await page.evaluate((names) => names.map((name) => window.leo.screen(name)), [peg, block]);
    const touch = await page.context().newCDPSession(page);
    const send = (type, points) => touch.send('Input.dispatchTouchEvent', { type, touchPoints: points.map(({ x, y }) => ({ x, y })) });
    await send('touchStart', [from]);
    for (const k of [0.25, 0.5, 0.75, 1]) await send('touchMove', [{ x: from.x + k * (to.x - from.x), y: from.y + k * (to.y - from.y) }]);
    await send('touchEnd', []);
    await touch.detach();
  },
  async keyboard(peg, block) {
    await page.locator(`.mark[data-thing="${peg}"]`).focus();
    await page.keyboard.press('Enter');
    await until(`${peg} is in the hand`, (name) => window.leo.held() === name, peg);
    const [a, b] = await page.evaluate((names) => names.map((name) => window.leo.thing(name).p), [peg, block]);
    // Seen from the teacher's side, right is -x and away is -y; a stride is 5 cm.
    const right = Math.round((a[0] - b[0]) / 0.05);
    const away = Math.round((a[1] - b[1]) / 0.05);
    for (let n = 0; n < Math.abs(right); n += 1) await page.keyboard.press(right > 0 ? 'Shift+ArrowRight' : 'Shift+ArrowLeft');
    for (let n = 0; n < Math.abs(away); n += 1) await page.keyboard.press(away > 0 ? 'Shift+ArrowUp' : 'Shift+ArrowDown');
    await page.keyboard.press('Enter');
  },
};

async function fill(peg, block, way) {
  const before = await saw();
  await ways[way](peg, block);
  await until(`${peg} is in ${block}`, (name) => window.leo.thing(name)?.filled === true && window.leo.held() === null, block);
  await until(`Leo saw that ${block} was filled`, (n) => Object.values(window.leo.under('line/')).filter((line) => line.kind === 'saw').length > n, before);
}

async function demonstrate({ blocks, screen, pegs }) {
  await clear();
  const names = {};
  await add('screen', ...screen);
  for (const [colour, x, y] of blocks) names[colour] = await add(`${colour} square`, x, y);
  const holes = [];
  for (const x of pegs) holes.push(await add('wood peg', x, PEGS_Y));
  const lying = await objects();
  await add('wood peg', 0.2, 1.0);
  await page.keyboard.press('Control+z');
  await until('the last peg is taken back', (n) => Object.values(window.leo.under('thing/')).filter((thing) => thing.kind !== 'person').length === n, lying);
  await until('Leo knows of all things', (n) => Object.keys(window.leo.under('belief/0/')).length >= n, blocks.length + pegs.length);
  await until('the teacher does not know of the blue square', () => [...document.querySelectorAll('#divergences li[data-kind="unknown"]')].some((item) => item.textContent.includes('blue')));
  const shown = await page.$eval('#divergences', (list) => list.textContent);
  await say(`Leo, I can teach you to do ${TASK}`);
  const fills = blocks.filter(([colour]) => colour !== 'blue').map(([colour]) => names[colour]);
  const hands = ['mouse', 'finger', 'keyboard'];
  for (const [at, block] of fills.entries()) await fill(holes[at], block, hands[at % hands.length]);
  await done(TASK);
  return shown;
}

async function done(task) {
  const before = await examples(task);
  await say(`${task} is done`);
  await until('Leo has an example more', ([name, n]) => (window.leo.store.get(`task/${name}`)?.examples ?? 0) > n, [task, before]);
}

/** Two demonstrations that no rule explains both: rules that fit one of them tie, or rank lower. */
async function leaveOpen() {
  await clear();
  const holes = [await add('red square', -0.2, 0.75), await add('green square', 0.1, 0.75)];
  const pegs = [await add('wood peg', -0.2, PEGS_Y), await add('wood peg', 0.1, PEGS_Y)];
  await until('Leo knows of all things', (n) => Object.keys(window.leo.under('belief/0/')).length >= n, holes.length + pegs.length);
  for (const [at, hole] of holes.entries()) {
    await say(`Leo, I can teach you to do ${OPEN_TASK}`);
    await fill(pegs[at], hole, 'mouse');
    await done(OPEN_TASK);
  }
}

async function perform() {
  await clear();
  for (const [colour, x, y] of NOVEL.blocks) await add(`${colour} square`, x, y);
  for (const x of NOVEL.pegs) await add('wood peg', x, NOVEL_PEGS_Y);
  await until('Leo knows of all things', (n) => Object.keys(window.leo.under('belief/0/')).length >= n, NOVEL.blocks.length + NOVEL.pegs.length);
  const before = await page.evaluate((name) => window.leo.store.get(`task/${name}`).performances.filter((each) => each.result).length, TASK);
  // In the format of speech recognisers.
  await say(`leo do ${TASK}`, speak);
  await until('Leo has performed', ([name, n]) => window.leo.store.get(`task/${name}`).performances.filter((each) => each.result).length > n, [TASK, before]);
}

/** What the page shows of the tasks, read from its document. */
const account = () => page.evaluate(() => [...document.querySelectorAll('.task')].map((task) => {
  const text = (selector, within = task) => within.querySelector(selector)?.textContent.trim() ?? null;
  const perspectives = [...task.querySelectorAll('.perspective')].map((box) => [box.dataset.perspective, {
    heading: text('h4', box),
    hypotheses: [...box.querySelectorAll('[data-hypothesis]')].map((item) => ({
      name: item.dataset.hypothesis,
      percent: item.querySelector('.numbers').firstChild.textContent,
      posterior: Number(item.dataset.posterior),
      tally: text('.tally', item),
      chosen: item.querySelector('.chosen') !== null,
      tied: item.querySelector('.tied') !== null,
    })),
  }]);
  const performances = [...task.querySelectorAll('.performance')].map((box) => ({
    result: box.dataset.result,
    done: [...box.querySelectorAll('li.done')].map((item) => item.textContent),
    failed: [...box.querySelectorAll('li.failed')].map((item) => item.textContent),
  }));
  return {
    name: text('h3'),
    count: text('.count'),
    rule: task.querySelector('.rule')?.dataset.rule ?? null,
    whose: text('.rule .whose'),
    why: text('.why'),
    perspectives: Object.fromEntries(perspectives),
    performances,
  };
}));

try {
  await page.goto(base ?? own.address);
  await ready(page);
  const divergences = [];
  for (const table of TABLES) divergences.push(await demonstrate(table));
  await perform();
  await cannotHear();
  await leaveOpen();
  const tasks = await account();
  const said = await page.$eval('#log', (log) => log.textContent);
  if (troubles.length > 0) throw new Error(`the page failed: ${troubles.join('; ')}`);
  console.log(JSON.stringify({ tasks, said, divergences }, null, 2));
} catch (error) {
  if (process.env.PICTURE) await page.screenshot({ path: process.env.PICTURE });
  const toasts = await page.$$eval('.toast span', (all) => all.map((each) => each.textContent)).catch(() => []);
  const lines = await page.evaluate(() => Object.values(window.leo?.under('line/') ?? {}).slice(-8).map((line) => `${line.kind}: ${line.text}`)).catch(() => []);
  console.error([error.message, ...troubles, ...toasts.map((text) => `a note said: ${text}`), ...lines].join('\n'));
  process.exitCode = 1;
} finally {
  await browser.close();
  await own?.close();
}
