// Checks in a browser that the log of the dialogue follows its end when its box shrinks, and stays with a reader of
// older lines:
//
//   node tests/log.mjs BASE_URL     the page of a running robot
//   node tests/log.mjs              a fake of Leo
//
// It waits for states of the page, never for a fixed time; it fails if a state does not come within PATIENCE_S
// (default 120).
import { ready, visit } from './browser.mjs';
import { serve } from './fake.mjs';

const own = process.argv[2] === undefined ? await serve(0) : null;
await visit({ browser: { more: ['--disable-3d-apis'] }, page: { viewport: { width: 1440, height: 900 } } }, async (page, until) => {
  const say = async (text) => {
    const before = await page.evaluate(() => document.querySelectorAll('#log .line.leo').length);
    await page.fill('#say', text);
    await page.press('#say', 'Enter');
    await until(`Leo answers "${text}"`, (n) => document.querySelectorAll('#log .line.leo').length > n, before);
  };
  const isAtEnd = () => {
    const box = document.querySelector('#log-box');
    return box.scrollHeight > box.clientHeight + 100 && box.scrollHeight - box.scrollTop - box.clientHeight < 2;
  };
  const height = () => page.evaluate(() => document.querySelector('#log-box').clientHeight);

  await page.goto(process.argv[2] ?? own.address);
  await ready(page);
  for (let n = 0; n < 8; n += 1) await say('Why?');
  await until('the log is at its end', isAtEnd);
  // Another line of buttons and the open panel take room from the log.
  let before = await height();
  await page.fill('#task-name', 'a task with a long name of forty letters');
  await until('the log is smaller', (old) => document.querySelector('#log-box').clientHeight < old, before);
  await until('the log is at its end after the buttons have grown', isAtEnd);
  before = await height();
  await page.click('#health > summary');
  await until('the log is smaller still', (old) => document.querySelector('#log-box').clientHeight < old, before);
  await until('the log is at its end after a panel was opened', isAtEnd);
  await say('Why?');
  await until('the log is at its end after an answer', isAtEnd);

  await page.evaluate(() => (document.querySelector('#log-box').scrollTop = 0));
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  await say('Why?');
  if (await page.evaluate(() => document.querySelector('#log-box').scrollTop) > 0) throw new Error('a reader of older lines was moved');
});
await own?.close();
