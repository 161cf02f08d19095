// A server of another user at another port of the robot's host, which a browser visits after Leo's page:
//
//   node tests/other_port.mjs URL     the whole address of the page of a running robot, with the token
//
// It stops the robot. It waits for states of the page, never for a fixed time; it fails if a state does not come within
// PATIENCE_S (default 120).
import { createServer } from 'node:http';
import { WebSocket } from 'ws';
import { launch, opened, patient } from './browser.mjs';

const url = new URL(process.argv[2]);
const token = url.searchParams.get('token');
const clean = `${url.origin}/`;

function must(holds, what) {
  if (!holds) throw new Error(`${what} does not hold`);
}

/** What the other server received. @type {{url: string, headers: import('node:http').IncomingHttpHeaders}[]} */
const received = [];
const other = createServer((request, response) => {
  received.push({ url: request.url, headers: request.headers });
  response.setHeader('content-type', 'text/html');
  response.end('<title>other</title>');
});
await new Promise((done) => other.listen(0, '127.0.0.1', done));

/** The status of the robot's answer to a request with these header fields. */
const status = async (path, headers) => (await fetch(new URL(path, clean), { headers, redirect: 'manual' })).status;

/** The status of the robot's answer to the opening of a WebSocket; 101 if it opens. */
const upgraded = (path, headers) => new Promise((done, failed) => {
  const socket = new WebSocket(new URL(path, clean.replace('http', 'ws')), { headers });
  socket.on('unexpected-response', (_, response) => {
    done(response.statusCode);
    socket.terminate();
  });
  socket.on('open', () => {
    done(101);
    socket.terminate();
  });
  // A terminated socket reports an error as well.
  socket.on('error', failed);
});

const browser = await launch({ more: ['--disable-3d-apis'] });
try {
  const context = await browser.newContext();
  const page = await opened(context, {});
  const until = patient(page);
  const connected = () => until('it is connected', () => document.body.dataset.connection === 'connected'
    && window.leo.store.get('arming')?.stopped === false);
  await page.goto(url.href);
  await connected();

  await page.goto(`http://127.0.0.1:${other.address().port}/`);
  must(await page.evaluate(() => localStorage.length) === 0, 'that another port has a storage of its own');
  const { cookie } = received.find(({ url }) => url === '/').headers;
  must(new RegExp(`leo_${url.port}=[0-9a-f]{64}`).test(cookie), `that the other port receives the cookie: ${cookie}`);
  must(!JSON.stringify(received).includes(token), 'that the other port never receives the token');

  // The cookie is what it says: the files of the page come with it, and without it they do not.
  must(await status('/page.js', { cookie }) === 200, 'that the cookie is valid');
  must(await status('/page.js', {}) === 401, 'that the page needs the cookie');
  const value = cookie.split('=')[1];
  for (const headers of [{ cookie }, { cookie: `leo_${url.port}=${value}`, authorization: `Bearer ${value}` }]) {
    for (const path of ['/metrics', '/leo.urdf']) must(await status(path, headers) === 401, `that the cookie does not open ${path}`);
    for (const path of ['/live', `/live?token=${value}`]) must(await upgraded(path, headers) === 401, `that the cookie commands nothing at ${path}`);
  }
  must(await upgraded(`/live?token=${token}`, {}) === 101, 'that the token opens the same address');

  // The browser that was there still commands.
  await page.goto(clean);
  await connected();
  must(await page.evaluate(async () => (await window.leo.connection.ask('cancel')).ok), 'that the page commands after a reload');

  // Without the token in its storage, the page shows nothing, says why, and stops the robot.
  await page.evaluate(() => localStorage.clear());
  await page.reload();
  await until('the page says what it lacks', () => /leo run prints/.test(document.querySelector('#locked').textContent) && !document.querySelector('#locked').hidden);
  must(await page.evaluate(() => window.leo.store.get('arming') === undefined), 'that nothing is shown');
  await page.click('#stop-button');
  await until('the page says that the robot is stopped', () => /is raised/.test(document.querySelector('#toasts').textContent));

  // Another page of the browser opens the printed address: this one recovers.
  const second = await context.newPage();
  await second.goto(url.href);
  await until('it is connected again', () => document.body.dataset.connection === 'connected' && document.querySelector('#locked').hidden
    && window.leo.store.get('arming')?.stopped === true);
} catch (error) {
  console.error(error.message);
  process.exitCode = 1;
} finally {
  await browser.close();
  other.close();
}
