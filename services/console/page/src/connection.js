// The WebSocket to Leo: reconnects, numbers requests, and resolves them with their answers.

const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 5000;
const ANSWER_WITHIN_SECONDS = 10;
/** Time-out of requests that write to the disk, which may be slow. */
const WRITTEN_WITHIN_SECONDS = 60;
const WRITES = new Set(['keep', 'record']);
/** Time without a message after which the connection counts as lost. Leo sends at least a heartbeat a second. */
const SILENT_SECONDS = 5;

/** @typedef {'connecting' | 'connected' | 'lost'} State */
/** @typedef {{answer: number, ok?: boolean, error?: string, thing?: string, [key: string]: any}} Answer */

/**
 * The WebSocket address for a page at `location`. A browser sends no header of a script with it.
 * @param {{protocol: string, host: string}} location
 * @param {string | null} token
 */
export function liveAddress(location, token) {
  const scheme = location.protocol === 'https:' ? 'wss:' : 'ws:';
  const query = token === null ? '' : `?token=${encodeURIComponent(token)}`;
  return `${scheme}//${location.host}/live${query}`;
}

/**
 * Whether the robot refuses to show anything to this page.
 * @param {Record<string, string>} headers with the token, if there is one
 */
export async function isLockedOut(headers) {
  try {
    return (await fetch('/leo.urdf', { method: 'HEAD', cache: 'no-store', headers })).status === 401;
  } catch {
    return false;
  }
}

/**
 * Wait before the `n`-th attempt: exponential back-off with an upper bound.
 * @param {number} n from 0
 */
export function waitBefore(n) {
  return Math.min(LONGEST_WAIT_MS, FIRST_WAIT_MS * 2 ** n);
}

export class Connection {
  #address;
  #hear;
  #tell;
  /** @type {WebSocket | null} */
  #socket = null;
  #attempts = 0;
  #next = 1;
  /** @type {Map<number, {done: (answer: Answer) => void, timer: ReturnType<typeof setTimeout>}>} */
  #asked = new Map();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #retry;
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  #silence;
  /** @type {State} */
  state = 'connecting';
  /** Whether Leo refuses commands on this connection. */
  isReadOnly = false;

  /**
   * @param {string} address of the WebSocket
   * @param {(message: any) => void} hear called with each state message
   * @param {(state: State) => void} tell called when the connection state or `isReadOnly` changes
   */
  constructor(address, hear, tell) {
    this.#address = address;
    this.#hear = hear;
    this.#tell = tell;
  }

  open() {
    clearTimeout(this.#retry);
    this.isReadOnly = false;
    const socket = new WebSocket(this.#address);
    this.#socket = socket;
    this.#listen(socket);
    socket.onmessage = (event) => {
      if (this.#socket !== socket) return;
      this.#attempts = 0;
      this.#listen(socket);
      this.#take(event.data);
    };
    socket.onopen = () => {
      if (this.#socket !== socket) return;
      this.#listen(socket);
      this.#become('connected');
    };
    socket.onclose = () => this.#lose(socket);
    // The event contains no reason, and the close event follows.
    socket.onerror = () => {};
  }

  /**
   * Closes the socket if no message arrives in time.
   * @param {WebSocket} socket
   * @param {number} [seconds] remaining
   */
  #listen(socket, seconds = SILENT_SECONDS) {
    clearTimeout(this.#silence);
    // Count down second by second: a page that was blocked itself processes pending messages in between.
    this.#silence = setTimeout(() => {
      if (seconds > 1) {
        this.#listen(socket, seconds - 1);
        return;
      }
      this.#lose(socket);
      // Without a network the close event may never come, so it is not awaited.
      socket.close();
    }, 1000);
  }

  /** @param {WebSocket} socket */
  #lose(socket) {
    if (this.#socket !== socket) return;
    this.#socket = null;
    clearTimeout(this.#silence);
    for (const id of [...this.#asked.keys()]) this.#answer({ answer: id, error: 'Leo is not answering' });
    this.#become('lost');
    this.#retry = setTimeout(() => this.open(), waitBefore(this.#attempts));
    this.#attempts += 1;
  }

  /** Closes it without reconnecting. */
  close() {
    clearTimeout(this.#retry);
    clearTimeout(this.#silence);
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
  }

  /**
   * Sends a request to Leo.
   * @param {string} what the value of `do`
   * @param {Record<string, any>} [content]
   * @returns {Promise<Answer>} never rejected: an error is part of the answer
   */
  ask(what, content = {}) {
    const id = this.#next;
    this.#next += 1;
    const socket = this.#socket;
    if (socket === null || socket.readyState !== WebSocket.OPEN) {
      return Promise.resolve({ answer: id, error: 'Leo is not connected' });
    }
    return new Promise((done) => {
      const seconds = WRITES.has(what) ? WRITTEN_WITHIN_SECONDS : ANSWER_WITHIN_SECONDS;
      const late = () => this.#answer({ answer: id, error: `Leo has not answered for ${seconds} seconds` });
      this.#asked.set(id, { done, timer: setTimeout(late, 1000 * seconds) });
      socket.send(JSON.stringify({ id, do: what, ...content }));
    });
  }

  /** @param {string} text */
  #take(text) {
    const message = JSON.parse(text);
    if ('answer' in message) this.#answer(message);
    else if ('cells' in message) this.#hear(message);
    else if (message.access === 'read') {
      this.isReadOnly = true;
      this.#tell(this.state);
    }
  }

  /** @param {Answer} answer */
  #answer(answer) {
    const asked = this.#asked.get(answer.answer);
    if (asked === undefined) return;
    this.#asked.delete(answer.answer);
    clearTimeout(asked.timer);
    asked.done(answer);
  }

  /** @param {State} state */
  #become(state) {
    if (this.state === state) return;
    this.state = state;
    this.#tell(state);
  }
}
