// Looks through the eyes of the second of two teachers on Leo's page, moves their head, and acts as them:
//
//   node tests/eyes.mjs BASE_URL     the page of a running robot
//
// It waits for states of the page, never for a fixed time; it fails if a state does not come within PATIENCE_S
// (default 120). If PICTURE is set, it saves a picture of that teacher's view there.
import { ready, visit } from './browser.mjs';

await visit({}, async (page, until) => {
  /** The position of a person's eyes. */
  const eyesOf = (agent) => page.evaluate((who) => Object.values(window.leo.under('thing/')).find((thing) => thing.agent === who)?.p, agent);

  await page.goto(process.argv[2]);
  await ready(page);
  const lesson = await page.evaluate(() => window.leo.store.get('lessons').find((each) => each.title.startsWith('Two teachers')).id);
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
  // While the first teacher is away, acts of the page are the second one's.
  await page.selectOption('#who', '1');
  await page.click('#leave');
  await until('the first teacher is away', () => document.querySelector('#leave').ariaPressed === 'true');
  await page.selectOption('#who', '2');
  await page.evaluate(() => {
    window.screens = () => Object.values(window.leo.under('thing/')).filter((thing) => thing.kind === 'occluder').map(({ p, half }) => ({ at: p, wide: half[0] }));
    window.far = (at) => Math.hypot(...window.screens()[2].at.map((coordinate, axis) => coordinate - at[axis]));
  });
  for (const [count, size] of ['narrow screen', 'screen', 'wide screen'].entries()) {
    await page.click(`[data-add="${size}"]`);
    await until(`a ${size} stands there`, (n) => window.screens().length === n, count + 1);
  }
  const [narrow, middling, wide] = await page.evaluate(() => window.screens());
  if (!(narrow.wide < middling.wide && middling.wide < wide.wide)) throw new Error('the screens are not of three sizes');
  await page.locator('.mark[data-thing="wide screen"]').focus();
  await page.keyboard.press('Enter');
  await page.keyboard.press('Shift+ArrowLeft');
  await until('the wide screen was pushed', (at) => window.far(at) > 0.04, wide.at);
  await page.keyboard.press('Enter');
  await page.keyboard.press('Control+z');
  await until('it stands where it stood', (at) => window.far(at) < 1e-3, wide.at);
  await page.click('#undo');
  await until('it is taken back', () => window.screens().length === 2);
  await page.selectOption('#who', '1');
  await page.click('#leave');
  await until('the first teacher is back', () => document.querySelector('#leave').ariaPressed === 'false');
  await page.selectOption('#who', '2');
  await until('the picture is the second one’s', () => {
    const [his] = Object.values(window.leo.under('thing/')).filter((thing) => thing.agent === 2);
    return his.p.every((coordinate, axis) => Math.abs(coordinate - window.leo.seat().eyes[axis]) < 1e-3);
  });
  if (process.env.PICTURE) await page.screenshot({ path: process.env.PICTURE });
  await page.selectOption('#who', '1');
  await until('the picture is the first teacher’s again', (p) => String(window.leo.seat().eyes) === String(p), first);
});
