// Arms the joints of a robot with the keyboard, on a page as narrow as a phone:
//
//   node tests/arm.mjs BASE_URL     the page of a running robot whose joints are disarmed
//   node tests/arm.mjs              a fake of Leo with one locked joint
//
// It waits for states of the page, never for a fixed time; it fails if a state does not come within PATIENCE_S
// (default 120).
import { visit } from './browser.mjs';
import { crowded, serve } from './fake.mjs';

const fake = crowded(0);
Object.assign(fake, { armed: false, locked: true });
const own = process.argv[2] === undefined ? await serve(0, fake) : null;
await visit({ browser: { more: ['--disable-3d-apis'] }, page: { viewport: { width: 390, height: 844 } } }, async (page, until) => {
  await page.goto(process.argv[2] ?? own.address);
  const stands = (state) => until(`the joints are ${state}`, (state) => document.querySelector('#arming').dataset.state === state, state);
  await stands(own === null ? 'disarmed' : 'locked');
  await until('the cause stands beside the button', () => /disarmed: the motor process started/.test(document.querySelector('#arming-words').textContent) && !document.querySelector('#arm').hidden);
  const fits = await page.evaluate(() => [...document.querySelectorAll('#arming, #arming *')].every((element) => {
    const { left, right } = element.getBoundingClientRect();
    return left >= 0 && right <= innerWidth;
  }));
  if (!fits) throw new Error('the strip is wider than the page');
  await page.locator('#arm').focus();
  await page.keyboard.press('Enter');
  if (own !== null) {
    await until('it is asked about the locked joint', () => document.querySelector('#arm-dialog').open && /left_elbow_pitch_joint: .*To do: remove/.test(document.querySelector('#arm-causes').textContent));
    // Pressing Enter once more acknowledges nothing.
    await page.keyboard.press('Enter');
    await until('the dialog is shut', () => !document.querySelector('#arm-dialog').open);
    if (fake.orders.length > 0) throw new Error('a second Enter ordered arming');
    await page.locator('#arm').focus();
    await page.keyboard.press('Enter');
    await page.locator('#arm-others').focus();
    await page.keyboard.press('Enter');
    await until('the others are armed', () => /64 armed/.test(document.querySelector('#arming-words').textContent) && !/disarmed/.test(document.querySelector('#arming-words').textContent));
    await page.locator('#arm').focus();
    await page.keyboard.press('Enter');
    await page.locator('#arm-acknowledge').focus();
    await page.keyboard.press('Enter');
  }
  await stands('armed');
  await until('there is nothing left to arm', () => document.querySelector('#arm').hidden);
  if (own !== null && JSON.stringify(fake.orders) !== '[null,1]') throw new Error(`the orders were ${JSON.stringify(fake.orders)}`);
});
await own?.close();
