// The token, its cookie and the stop button in a browser, with a running robot:
//
//   node tests/token.mjs URL     the whole address of its page, with the token
//
// It stops the robot. It waits for states of the page, never for a fixed time; it fails if a state does not come within
// PATIENCE_S (default 120).
import { createServer } from 'node:http';
import { launch, opened, patient } from './browser.mjs';

const url = new URL(process.argv[2]);
const token = url.searchParams.get('token');
const clean = `${url.origin}/`;
const cookieName = `leo_${url.port}`;

function must(holds, what) {
  if (!holds) throw new Error(`${what} does not hold`);
}

const browser = await launch({ more: ['--disable-3d-apis'] });
// A page of another site, in the same browser.
const elsewhere = createServer((_, response) => {
  response.setHeader('content-type', 'text/html');
  response.end(`<a id="link" href="${url}">Leo</a><form id="form" method="post" action="${clean}stop"></form>`);
});
await new Promise((done) => elsewhere.listen(0, 'localhost', done));
const other = `http://localhost:${elsewhere.address().port}/`;

/** Whether the stop button is fully visible and receives clicks there. */
const isPressable = (page) => page.evaluate(() => {
  const button = document.querySelector('#stop-button');
  const { left, right, top, bottom, width, height } = button.getBoundingClientRect();
  const isThere = left >= 0 && right <= innerWidth && top >= 0 && bottom <= innerHeight && width >= 100 && height >= 44;
  return isThere && document.elementFromPoint((left + right) / 2, (top + bottom) / 2) === button;
});

/** Waits until a page has access and shows the robot; without drawing. */
const ready = (page) => page.waitForFunction(() => document.body.dataset.connection === 'connected'
  && window.leo?.store.get('arming') !== undefined);

try {
  const visitor = await (await browser.newContext({ viewport: { width: 390, height: 844 } })).newPage();
  for (const address of [clean, `${clean}?token=${'0'.repeat(32)}`]) {
    const answer = await visitor.goto(address);
    must(answer.status() === 401, `that ${address} is refused`);
    must(/leo run/.test(await visitor.textContent('main')), 'that a visitor is told what to do');
    must(await isPressable(visitor), 'that a visitor sees the stop button');
    const rows = await visitor.evaluate(() => ['h1', 'p', '#stop', 'a'].map((part) => document.querySelector(`main ${part}`).getBoundingClientRect()));
    must(rows.every(({ top }, at) => at === 0 || top >= rows[at - 1].bottom), 'that one part is below the other');
  }

  const context = await browser.newContext();
  const page = await opened(context, {});
  const until = patient(page);
  await page.goto(url.href);
  await ready(page);
  must(page.url() === clean, `that the token is not in the address: ${page.url()}`);
  const cookie = (await context.cookies()).find(({ name }) => name === cookieName);
  must(cookie?.httpOnly && cookie.sameSite === 'Strict' && cookie.path === '/' && !cookie.value.includes(token), `that the cookie is safe: ${JSON.stringify(cookie)}`);
  must(await page.evaluate(() => document.cookie) === '', 'that no script sees the cookie');
  await page.goto(clean);
  await ready(page);

  // A second page of the same browser commands too.
  const second = await context.newPage();
  await second.goto(clean);
  await ready(second);
  must(await second.evaluate(async () => (await window.leo.connection.ask('cancel')).ok), 'that a second page commands');
  await second.close();

  // The page of another site cannot command, although this browser has the cookie.
  const foreign = await context.newPage();
  await foreign.goto(other);
  must(await foreign.evaluate((address) => new Promise((done) => {
    const socket = new WebSocket(address.replace('http', 'ws'));
    socket.onopen = () => done(false);
    socket.onerror = () => done(true);
  }), `${clean}live`), 'that a page of another site gets no connection');
  await foreign.evaluate((address) => fetch(address, { method: 'POST', mode: 'no-cors', credentials: 'include' }), `${clean}stop`);
  const [answered] = await Promise.all([foreign.waitForNavigation(), foreign.evaluate(() => document.querySelector('#form').submit())]);
  must(answered.status() === 403, 'that a page of another site cannot stop the robot');
  must(await page.evaluate(() => window.leo.store.get('arming')?.stopped === false), 'that the robot was not stopped');

  // A link on another site still opens the page.
  const led = await (await browser.newContext()).newPage();
  await led.goto(other);
  await led.click('#link');
  await led.waitForURL(clean);
  await ready(led);
  await led.context().close();

  for (const [width, height] of [[1440, 900], [820, 1180], [390, 844]]) {
    await page.setViewportSize({ width, height });
    await page.evaluate(() => window.scrollTo(0, 0));
    must(await page.evaluate(() => {
      const stop = document.querySelector('#stop-button').getBoundingClientRect();
      const apart = ({ left, right, top, bottom }) => right <= stop.left || left >= stop.right || bottom <= stop.top || top >= stop.bottom;
      return [...document.querySelectorAll('#head button, #head select')].every((part) => apart(part.getBoundingClientRect()));
    }), `that the stop button covers no other one, at ${width} x ${height}`);
    await page.evaluate(() => window.scrollTo(0, document.documentElement.scrollHeight));
    must(await isPressable(page), `that the stop button is always there, at ${width} x ${height}`);
    await page.evaluate(() => document.querySelector('#save-dialog').showModal());
    await until('the button is in the dialog', () => document.querySelector('#save-dialog #stop') !== null);
    must(await isPressable(page), `that the stop button works beside a dialog, at ${width} x ${height}`);
    await page.evaluate(() => document.querySelector('#save-dialog').close());
    await until('the button is in its place', () => document.querySelector('dialog #stop') === null);
  }

  // The stop button works without the token.
  await visitor.click('#stop-button');
  await visitor.waitForFunction(() => /is raised/.test(document.querySelector('main').textContent));
  await until('all joints are stopped', () => document.querySelector('#arming').dataset.state === 'stopped');
  must(await isPressable(visitor), 'that the stop button stays');
  // The key of the button works in text fields, too.
  await page.focus('#say');
  await page.keyboard.press('F9');
  await until('the page says what came of its button', () => /was raised before/.test(document.querySelector('#toasts').textContent));
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
} finally {
  await browser.close();
  elsewhere.close();
}
