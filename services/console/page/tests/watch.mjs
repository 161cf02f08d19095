// Leo's page without the token, at a robot that shows it without (`read_without_token = "page"`):
//
//   node tests/watch.mjs URL     the address of the page of a running robot
//
// It stops the robot. It waits for states of the page, never for a fixed time; it fails if a state does not come within
// PATIENCE_S (default 120).
import { visit } from './browser.mjs';

const { origin } = new URL(process.argv[2]);
await visit({ browser: { more: ['--disable-3d-apis'] }, page: { viewport: { width: 390, height: 844 } } }, async (page, until) => {
  await page.goto(origin);
  await until('it shows the robot', () => window.leo?.store.get('arming')?.stopped === false);
  await until('it says how to command the robot', () => !document.querySelector('#locked').hidden && /may only watch.*leo run prints/.test(document.querySelector('#locked').textContent));
  const { error } = await page.evaluate(() => window.leo.connection.ask('undo'));
  if (!/leo run/.test(error)) throw new Error(`the page commanded the robot: ${error}`);
  await page.click('#stop-button');
  await until('the robot is stopped', () => window.leo.store.get('arming')?.stopped === true);
});
