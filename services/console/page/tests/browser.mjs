// A browser for the tests: the one of the system, drawing by software.
import { existsSync } from 'node:fs';
import { chromium } from 'playwright-core';

const PLACES = [process.env.CHROMIUM, '/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

/** The path of the system's Chromium, or an error that says what to install. */
export function executable() {
  const found = PLACES.find((path) => path !== undefined && path !== '' && existsSync(path));
  if (found === undefined) throw new Error('no Chromium found: apt-get install chromium, or set CHROMIUM to its path');
  return found;
}

export function launch() {
  return chromium.launch({
    executablePath: executable(),
    args: ['--no-sandbox', '--disable-dev-shm-usage', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'],
  });
}

/** Whether Leo's world is on the page. */
export function ready(page) {
  return page.waitForFunction(() => window.leo?.cells.get('workspace') !== undefined && window.leo.pictures() > 1, null, { timeout: 60000 });
}
