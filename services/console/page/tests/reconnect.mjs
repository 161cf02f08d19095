// Keeps Leo's page open while its server ends and restarts:
//
//   node tests/reconnect.mjs BASE_URL     the page of a robot that runs on this machine
//
// It kills the robot's console process, and prints `restart` once the page shows the state of the next one. Then the
// robot has to be stopped and started again at the same address by hand. It waits for states of the page, never for a
// fixed time; it fails if a state does not come within PATIENCE_S (default 120).
import { ready, visit } from './browser.mjs';

await visit({}, async (page, until) => {
  const served = () => page.evaluate(() => window.leo.store.get('process/console'));
  const now = () => page.evaluate(() => window.leo.store.get('now').t);
  /** Number of lost connections since the last call; polling the state could miss a short one. */
  const lost = () => page.evaluate(() => window.states.splice(0).filter((state) => state === 'lost').length);

  await page.goto(process.argv[2]);
  await ready(page);
  await until('it is connected to a console that runs', () => document.body.dataset.connection === 'connected'
    && window.leo.store.get('process/console')?.pid > 0 && window.leo.store.get('now') !== undefined);
  await page.evaluate(() => {
    window.states = [];
    new MutationObserver(() => window.states.push(document.body.dataset.connection))
      .observe(document.body, { attributes: true, attributeFilter: ['data-connection'] });
  });

  const { pid, restarts } = await served();
  const then = await now();
  process.kill(pid, 'SIGKILL');
  await until('it is connected to the next console', (before) => document.body.dataset.connection === 'connected'
    && window.leo.store.get('process/console')?.restarts > before, restarts);
  await until('time goes on', (before) => window.leo.store.get('now')?.t > before, then);
  if (await lost() === 0) throw new Error('the page did not say that Leo was lost');

  const { pid: second } = await served();
  console.log('restart');
  await until('it is connected to the next robot', (before) => document.body.dataset.connection === 'connected'
    && window.leo.store.get('process/console')?.restarts === 0 && window.leo.store.get('process/console').pid !== before
    && window.leo.store.get('workspace')?.simulated, second);
  if (await lost() === 0) throw new Error('the page did not say that Leo was lost');

  await page.click('#clear');
  await until('the table is empty', () => window.leo.store.get('workspace').mode === 'set-up'
    && Object.values(window.leo.under('thing/')).every((thing) => thing.kind === 'person'));
  await page.click('[data-add="red square"]');
  await until('a block lies there', () => window.leo.screen('red square') !== null && window.leo.thing('red square').held === null);
  // The new row of the block may move the picture: it is grabbed where it has stayed for ten frames.
  await until('the block stays where it is on the page', () => {
    const { x, y } = window.leo.screen('red square') ?? {};
    const last = window.lastSeen ?? {};
    window.lastSeen = { x, y, frames: x === last.x && y === last.y ? last.frames + 1 : 0 };
    return window.lastSeen.frames >= 10;
  });
  const before = await page.evaluate(() => window.leo.thing('red square').p);
  const [from, to] = await page.evaluate(([x, y]) => [window.leo.screen('red square'), window.leo.at(x - 0.2, y, 0.03)], before);
  await page.mouse.move(from.x, from.y);
  await page.mouse.down();
  await page.mouse.move((from.x + to.x) / 2, (from.y + to.y) / 2, { steps: 4 });
  await page.mouse.move(to.x, to.y, { steps: 4 });
  await page.mouse.up();
  await until('the block was carried there', ([x]) => {
    const { p, held } = window.leo.thing('red square');
    return held === null && p[0] < x - 0.1 && p[2] < 0.04;
  }, before);
});
