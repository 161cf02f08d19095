// A browser for the tests: the one of the system, drawing by software if nothing else is said.
import { existsSync } from 'node:fs';
import { chromium } from 'playwright-core';

const PLACES = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

/** The path of the system's Chromium, or an error that says what to install. */
export function executable() {
  const found = PLACES.find((path) => path !== undefined && path !== '' && existsSync(path));
  if (found === undefined) throw new Error('no Chromium found: apt-get install chromium, or set CHROMIUM to its path');
  return found;
}

/** How long anything is waited for that a page is to do or to show. */
const PATIENCE_MS = 1000 * Number(process.env.PATIENCE_S ?? 120);

/**
 * Starts a browser.
 * @param {{card?: boolean, more?: string[]}} how whether a graphics card draws, where there is one, and more options
 */
export function launch({ card = false, more = [] } = {}) {
  const drawing = card ? [] : ['--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
  return chromium.launch({
    timeout: PATIENCE_MS,
    executablePath: executable(),
    args: ['--no-sandbox', '--disable-dev-shm-usage', '--ignore-gpu-blocklist', ...drawing, ...more],
  });
}

/** A page of its own, which is waited for as everything is: a table that is drawn by software is long in coming. */
export async function opened(browser, how) {
  const page = await browser.newPage(how);
  page.setDefaultTimeout(PATIENCE_MS);
  return page;
}

/** What waits until a function of a page's state is true. */
export const patient = (page) => (what, isTrue, argument) => page.waitForFunction(isTrue, argument)
  .catch(() => { throw new Error(`the page never showed that ${what}`); });

/** Whether Leo's world is on the page. */
export function ready(page) {
  return page.waitForFunction(() => window.leo?.cells.get('workspace') !== undefined && window.leo.pictures() > 1);
}

/**
 * Uses a page in a browser of its own. What goes wrong with either, an error of the page itself included, is said,
 * and is the exit status.
 * @param {{browser?: object, page?: object}} how the options of both
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
