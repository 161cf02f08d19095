// Uses Leo's page in a browser that cannot draw:
//
//   node tests/blind.mjs BASE_URL     the page of a robot that runs
//   node tests/blind.mjs              a fake of Leo
//
// It waits for states of the page and never for a time; a state that does not come within PATIENCE_S (default 120)
// fails it.
import { ready, visit } from './browser.mjs';
import { serve } from './fake.mjs';

const own = process.argv[2] === undefined ? await serve(0) : null;
await visit({ browser: { more: ['--disable-3d-apis'] } }, async (page, until) => {
  await page.goto(process.argv[2] ?? own.address);
  await until('it is connected', () => document.body.dataset.connection === 'connected');
  await ready(page);
  await until('the reason is said', () => !document.querySelector('#blind').hidden && /WebGL/.test(document.querySelector('#blind').textContent) && document.querySelector('#canvas').hidden);
  await page.fill('#say', 'What did you learn?');
  await page.press('#say', 'Enter');
  await until('what was said stands in the dialogue', () => document.querySelector('#log').textContent.includes('What did you learn?'));
  // Who works by the keyboard has the things before him, drawn or not.
  // Of the pegs one may be in the hand of somebody who shows something just now: then
  // the page says so, and it is another's turn.
  for (let turn = 0; ; turn++) {
    const free = (turn) => {
      const pegs = Object.values(window.leo.under('thing/')).filter((thing) => thing.role === 'peg' && thing.held === null);
      const peg = pegs[turn % pegs.length];
      const mark = peg && document.querySelector(`.mark[data-thing="${peg.name}"]`);
      return mark && !mark.hidden ? peg.name : null;
    };
    const name = await (await page.waitForFunction(free, turn)).jsonValue();
    await page.locator(`.mark[data-thing="${name}"]`).focus();
    const told = await page.evaluate(() => document.querySelector('#toasts').textContent);
    await page.keyboard.press('Enter');
    await until(`${name} is in the hand, or why it is not`, ([name, told]) => window.leo.held() === name || document.querySelector('#toasts').textContent !== told, [name, told]);
    if (await page.evaluate((name) => window.leo.held() === name, name)) break;
  }
  await page.keyboard.press('Escape');
});
await own?.close();
