// The system's browser for the tests, with software rendering by default.
import { existsSync } from 'node:fs';
import { chromium } from 'playwright-core';

const PLACES = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

/** The path of the system's Chromium, or an error that says what to install. */
export function executable() {
  const found = PLACES.find((path) => path !== undefined && path !== '' && existsSync(path));
  if (found === undefined) throw new Error('no Chromium found: apt-get install chromium, or set CHROMIUM to its path');
  return found;
}

/** Time-out for everything that a page should do or show. */
const PATIENCE_MS = 1000 * Number(process.env.PATIENCE_S ?? 120);

/**
 * Starts a browser.
 * @param {{card?: boolean, more?: string[]}} how whether to render on a graphics card, if there is one; more options
 */
export function launch({ card = false, more = [] } = {}) {
  const drawing = card ? [] : ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
  return chromium.launch({
    timeout: PATIENCE_MS,
    executablePath: executable(),
    args: ['--no-sandbox', '--disable-dev-shm-usage', '--ignore-gpu-blocklist', ...drawing, ...more],
  });
}

/** A page with a long time-out, because software rendering is slow. */
export async function opened(browser, how) {
  const page = await browser.newPage(how);
  page.setDefaultTimeout(PATIENCE_MS);
  return page;
}

/** Returns a function that waits until a predicate on a page's state is true. */
export const patient = (page) => (what, isTrue, argument) => page.waitForFunction(isTrue, argument)
  .catch(() => { throw new Error(`the page never showed that ${what}`); });

/** Whether Leo's world is shown on the page. */
export function ready(page) {
  return page.waitForFunction(() => window.leo?.store.get('workspace') !== undefined && window.leo.pictures() > 1);
}

/**
 * Uses a page in its own browser. Errors of either, including errors of the page itself, are printed and set the exit
 * status.
 * @param {{browser?: object, page?: object}} how options of browser and page
 * @param {(page: import('playwright-core').Page, until: ReturnType<typeof patient>) => Promise<void>} use what is done
 */
export async function visit(how, use) {
  const browser = await launch(how.browser);
  const troubles = [];
  try {
    const page = await opened(browser, { viewport: { width: 1440, height: 900 }, ...how.page });
    page.on('pageerror', (error) => troubles.push(error.message));
    await use(page, patient(page));
    if (troubles.length > 0) throw new Error(`the page failed: ${troubles.join('; ')}`);
  } catch (error) {
    console.error([error.message, ...troubles].join('\n'));
    process.exitCode = 1;
  } finally {
    await browser.close();
  }
}
