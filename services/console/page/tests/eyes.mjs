// Looks through the eyes of the second of two teachers on Leo's page, and moves his head:
//
//   node tests/eyes.mjs BASE_URL     the page of a robot that runs
//
// It waits for states of the page and never for a time; a state that does not come within PATIENCE_S (default 120)
// fails it. PICTURE, if that is set, is a picture of what he sees.
import { launch, opened, patient, ready } from './browser.mjs';

const browser = await launch();
const page = await opened(browser, { viewport: { width: 1440, height: 900 } });
const troubles = [];
page.on('pageerror', (error) => troubles.push(error.message));

const until = patient(page);
/** Where somebody's eyes are. */
const eyesOf = (agent) => page.evaluate((who) => Object.values(window.leo.under('thing/')).find((thing) => thing.agent === who)?.p, agent);

try {
  await page.goto(process.argv[2]);
  await ready(page);
  const lesson = await page.evaluate(() => window.leo.cells.get('lessons').find((each) => each.title.startsWith('Two teachers')).id);
  await page.selectOption('#lesson', lesson);
  await until('there are two teachers', () => Object.values(window.leo.under('thing/')).filter((thing) => thing.kind === 'person').length === 2);
  await page.click('#clear');
  await page.selectOption('#who', '2');
  await until('his seat is the one of the picture', () => {
    const [his] = Object.values(window.leo.under('thing/')).filter((thing) => thing.agent === 2);
    return his.p.every((coordinate, axis) => Math.abs(coordinate - window.leo.seat().eyes[axis]) < 1e-3);
  });
  const named = await page.textContent('#views [data-view=seat]');
  if (named === 'Your eyes') throw new Error('the view is still called his who had it first');
  const [first, second] = [await eyesOf(1), await eyesOf(2)];
  await page.focus('#marks .mark');
  await page.keyboard.press('ArrowLeft');
  await until('his head has moved', (before) => {
    const [his] = Object.values(window.leo.under('thing/')).filter((thing) => thing.agent === 2);
    return Math.hypot(...his.p.map((coordinate, axis) => coordinate - before[axis])) > 0.01;
  }, second);
  if (String(await eyesOf(1)) !== String(first)) throw new Error('the first teacher has moved too');
  if (process.env.PICTURE) await page.screenshot({ path: process.env.PICTURE });
  await page.selectOption('#who', '1');
  await until('the picture is the first teacher’s again', (p) => String(window.leo.seat().eyes) === String(p), first);
  if (troubles.length > 0) throw new Error(`the page failed: ${troubles.join('; ')}`);
} catch (error) {
  console.error([error.message, ...troubles].join('\n'));
  process.exitCode = 1;
} finally {
  await browser.close();
}
