// Uses Leo's page in a browser without WebGL:
//
//   node tests/blind.mjs BASE_URL     the page of a running robot
//   node tests/blind.mjs              a fake of Leo
//
// It waits for states of the page, never for a fixed time; it fails if a state does not come within PATIENCE_S
// (default 120).
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
  // Keyboard users can reach the things, drawn or not. A peg may be in the teacher's hand in the current demonstration;
  // then the page refuses it, and another peg is tried.
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
