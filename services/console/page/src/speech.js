// Speech recognition, if the browser supports it. It is optional: everything can be typed.

/** Messages for the browser's permanent errors; after one the button is useless. */
const REFUSALS = /** @type {Record<string, string>} */ ({
  network: 'This browser recognises speech by a service that it cannot reach',
  'not-allowed': 'This page may not use the microphone',
  'service-not-allowed': 'This browser does not recognise speech',
});

/**
 * Makes a button start speech recognition; hides it if the browser has none.
 * @param {HTMLButtonElement} button
 * @param {(text: string) => void} heard
 * @param {(why: string) => void} refused called when recognition turns out to be unavailable
 */
export function listening(button, heard, refused) {
  const scope = /** @type {any} */ (window);
  const Recognition = scope.SpeechRecognition ?? scope.webkitSpeechRecognition;
  if (Recognition === undefined || !window.isSecureContext) {
    button.hidden = true;
    return;
  }
  const recognition = new Recognition();
  recognition.lang = 'en-US';
  recognition.interimResults = false;
  let on = false;
  /** @param {boolean} now */
  const become = (now) => {
    on = now;
    button.setAttribute('aria-pressed', String(now));
  };
  recognition.onresult = (/** @type {any} */ event) => heard(event.results[0][0].transcript);
  recognition.onend = () => become(false);
  recognition.onerror = (/** @type {any} */ event) => {
    become(false);
    const why = REFUSALS[event.error];
    if (why === undefined) return;
    button.hidden = true;
    refused(`${why}: type what you want to say.`);
  };
  button.addEventListener('click', () => {
    if (on) recognition.stop();
    else {
      recognition.start();
      become(true);
    }
  });
}
