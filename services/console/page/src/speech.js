// Listening, where the browser can: never needed, since everything can be typed.

/**
 * Makes a button listen; hides it where the browser cannot.
 * @param {HTMLButtonElement} button
 * @param {(text: string) => void} heard
 */
export function listening(button, heard) {
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
    // Without a network some browsers cannot recognise anything: then the button has no use.
    if (['network', 'not-allowed', 'service-not-allowed'].includes(event.error)) button.hidden = true;
  };
  button.addEventListener('click', () => {
    if (on) recognition.stop();
    else {
      recognition.start();
      become(true);
    }
  });
}
