// Pictures of the page, for who changes it: node tests/shots.mjs [--into FOLDER] [BASE_URL]
import { mkdir } from 'node:fs/promises';
import { join } from 'node:path';
import { launch, opened, ready } from './browser.mjs';
import { serve } from './fake.mjs';

const into = process.argv.includes('--into') ? process.argv[process.argv.indexOf('--into') + 1] : 'shots';
const base = process.argv.find((word) => word.startsWith('http'));

const SHOTS = [
  { name: 'laptop', width: 1280, height: 800 },
  { name: 'dark', width: 1280, height: 800, dark: true },
  { name: 'tablet', width: 820, height: 1180, touch: true },
];

await mkdir(into, { recursive: true });
const fake = base === undefined ? await serve(0) : null;
const browser = await launch();
for (const { name, width, height, dark, touch } of SHOTS) {
  const page = await opened(browser, { viewport: { width, height }, colorScheme: dark ? 'dark' : 'light', hasTouch: touch === true });
  page.on('pageerror', (error) => console.error(`${name}: ${error.message}`));
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && console.error(`${name}: ${message.text()}`));
  await page.goto(base ?? fake.address);
  await ready(page);
  if (fake !== null && name === 'laptop') await page.waitForFunction(() => window.leo.under('task/')['task/task 1']?.examples > 0);
  await page.waitForFunction(() => document.querySelectorAll('#log li').length > 0);
  const thing = await page.evaluate(() => window.leo.screen('green'));
  if (thing !== null) await page.mouse.click(thing.x, thing.y);
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  await page.screenshot({ path: join(into, `${name}.png`), fullPage: name === 'tablet' });
  if (name === 'laptop') {
    for (const view of ['leo', 'above', 'free']) {
      await page.click(`[data-view="${view}"]`);
      await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
      await page.screenshot({ path: join(into, `view-${view}.png`) });
    }
    await page.click('[data-view="seat"]');
    if (fake !== null) {
      await page.click('#clear');
      await page.waitForSelector('#palette', { state: 'visible' });
      await page.screenshot({ path: join(into, 'set-up.png') });
      fake.fake.play();
    }
  }
  await page.close();
}
await browser.close();
await fake?.close();
