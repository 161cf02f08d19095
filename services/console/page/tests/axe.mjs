// Checks Leo's page for WCAG 2.2 AA with axe-core, on a laptop and a phone, in both themes, with every panel and dialog:
//
//   node tests/axe.mjs BASE_URL     the page of a running robot
//   node tests/axe.mjs              a fake of Leo with one locked joint
//
// It waits for states of the page, never for a fixed time; it fails if a state does not come within PATIENCE_S
// (default 120).
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { patient, ready, visit } from './browser.mjs';
import { Fake, serve } from './fake.mjs';

const SIZES = [
  { name: 'laptop', viewport: { width: 1280, height: 800 } },
  { name: 'phone', viewport: { width: 390, height: 844 }, hasTouch: true, isMobile: true },
];
const TAGS = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'];
const DIALOGS = ['help-dialog', 'save-dialog', 'arm-dialog'];

const source = await readFile(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/** The violations in words. */
const violations = (page) => page.evaluate(async (tags) => {
  const { violations: found, passes } = await window.axe.run(document, { runOnly: { type: 'tag', values: tags } });
  if (passes.length === 0) throw new Error('axe-core checked nothing');
  return found.flatMap(({ id, help, nodes }) => nodes.map(({ target, failureSummary }) => `${id} (${help}): ${target.join(' ')}: ${failureSummary}`));
}, TAGS);

const fake = Object.assign(new Fake(), { armed: false, locked: true });
const own = process.argv[2] === undefined ? await serve(0, fake) : null;
await visit({}, async (first) => {
  const wrong = new Set();
  for (const { name, ...how } of SIZES) {
    for (const colorScheme of ['light', 'dark']) {
      const context = await first.context().browser().newContext({ ...how, colorScheme });
      const page = await context.newPage();
      const until = patient(page);
      await page.goto(process.argv[2] ?? own.address);
      await ready(page);
      // By the debugger, because the page's security policy admits no script of others.
      await page.evaluate(source);
      const check = async (state) => {
        for (const fault of await violations(page)) wrong.add(`${name}, ${colorScheme}, ${state}: ${fault}`);
      };
      await page.evaluate(() => document.querySelector('#help-guide').click());
      await page.evaluate(() => window.leo.connection.ask('play'));
      await until('a task was shown', () => document.querySelector('.task .bar') !== null);
      await until('Leo knows of a thing', () => Object.values(window.leo.under('thing/')).some((thing) => thing.kind === 'object' && thing.belief !== null));
      const known = await page.evaluate(() => Object.values(window.leo.under('thing/')).find((thing) => thing.kind === 'object' && thing.belief !== null).name);
      await page.locator(`.mark[data-thing="${known}"]`).focus();
      await page.keyboard.press('Space');
      await until('the time line of a thing', () => document.querySelector('#timeline svg') !== null);
      await page.$$eval('details', (all) => all.forEach((each) => (each.open = true)));
      await until('the processes', () => document.querySelector('#health-body tbody tr') !== null);
      await check('with every panel open');
      await page.evaluate(() => window.leo.connection.ask('clear'));
      await until('the palette', () => document.querySelector('#palette .chip')?.checkVisibility());
      if (await page.isVisible('#menu')) await page.click('#menu');
      await check('with a table to set');
      for (const id of DIALOGS) {
        await page.evaluate((dialog) => document.getElementById(dialog).showModal(), id);
        await until('the stop button is in the dialog', (dialog) => document.querySelector(`#${dialog} #stop`) !== null, id);
        await check(`#${id}`);
        await page.evaluate((dialog) => document.getElementById(dialog).close(), id);
      }
      await context.close();
    }
  }
  if (wrong.size > 0) throw new Error([...wrong].join('\n'));
});
await own?.close();
