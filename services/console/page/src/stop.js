// The stop button: raises the emergency stop by HTTP, independent of the WebSocket.
import { find } from './element.js';

const ELSE = 'use leo emergency-stop on the robot’s machine, its emergency stop button, or cut the power';
const TRIES = 2;
/** A key that no text field and no other part of the page uses. The button shows it. */
const STOP_KEY = 'F9';

/**
 * Asks the server to stop the robot, and returns its answer. Retries once if the server closed the connection.
 * @param {(address: string, how: object) => Promise<{ok: boolean, text: () => Promise<string>}>} ask `fetch`
 * @returns {Promise<{ok: boolean, words: string}>}
 */
export async function stop(ask) {
  let why = '';
  for (let tried = 0; tried < TRIES; tried += 1) {
    try {
      const answer = await ask('/stop', { method: 'POST' });
      return { ok: answer.ok, words: (await answer.text()).trim() };
    } catch (error) {
      why = error instanceof Error ? error.message : String(error);
    }
  }
  return { ok: false, words: `NOT STOPPED: Leo is not answering (${why}): ${ELSE}` };
}

/**
 * Makes the button and its key stop the robot. While a modal dialog is open, the button moves into it.
 * Without this script the button submits its form.
 * @param {import('./toasts.js').Toasts} toasts
 */
export function stopButton(toasts) {
  const form = find('stop');
  const home = /** @type {HTMLElement} */ (form.parentElement);
  const next = form.nextElementSibling;
  form.addEventListener('submit', async (event) => {
    event.preventDefault();
    const { ok, words } = await stop((address, how) => fetch(address, how));
    toasts.show(words, ok ? 'note' : 'error');
  });
  // Before any other handler, whatever has the focus.
  document.addEventListener('keydown', (event) => {
    if (event.key !== STOP_KEY) return;
    event.preventDefault();
    if (!event.repeat) /** @type {HTMLFormElement} */ (form).requestSubmit();
  }, { capture: true });
  for (const dialog of document.querySelectorAll('dialog')) {
    const follow = () => (dialog.open ? dialog.append(form) : home.insertBefore(form, next));
    new MutationObserver(follow).observe(dialog, { attributeFilter: ['open'] });
  }
}
