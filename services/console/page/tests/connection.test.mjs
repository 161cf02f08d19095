import assert from 'node:assert/strict';
import { test } from 'node:test';
import { WebSocket, WebSocketServer } from 'ws';
import { Connection, isLockedOut, liveAddress, waitBefore } from '../src/connection.js';

globalThis.WebSocket = WebSocket;

/** A server that echoes requests, on a port. */
const server = (port, answer) => new Promise((done) => {
  const made = new WebSocketServer({ port, host: '127.0.0.1' }, () => done(made));
  made.on('connection', (socket) => {
    socket.send(JSON.stringify({ version: 1, fresh: true, cells: {} }));
    socket.on('message', (text) => answer(socket, JSON.parse(text)));
  });
});

const echo = (socket, message) => socket.send(JSON.stringify({ answer: message.id, ok: true, text: message.text }));

/** A connection, with a way to wait for its states. */
function connected(port) {
  const states = [];
  const waiting = [];
  const connection = new Connection(`ws://127.0.0.1:${port}/live`, () => {}, (state) => {
    states.push(state);
    waiting.splice(0).forEach((look) => look());
  });
  const become = (wanted) => new Promise((done) => {
    const look = () => (connection.state === wanted ? done() : waiting.push(look));
    look();
  });
  return { connection, states, become };
}

const close = async (made) => {
  for (const socket of made.clients) socket.terminate();
  await new Promise((done) => made.close(done));
};

test('the WebSocket is at the host of the page, with the token if there is one, and encrypted where the page is', () => {
  assert.equal(liveAddress({ protocol: 'http:', host: 'leo:7780' }, '4f0c'), 'ws://leo:7780/live?token=4f0c');
  assert.equal(liveAddress({ protocol: 'https:', host: 'leo' }, null), 'wss://leo/live');
});

test('a page is locked out where the server says so, and not where it is away', async (t) => {
  const fetched = globalThis.fetch;
  t.after(() => (globalThis.fetch = fetched));
  const headers = { authorization: 'Bearer 4f0c' };
  for (const [status, locked] of [[401, true], [200, false], [403, false]]) {
    globalThis.fetch = async (address, how) => {
      assert.deepEqual([address, how.headers], ['/leo.urdf', headers]);
      return { status };
    };
    assert.equal(await isLockedOut(headers), locked);
  }
  globalThis.fetch = () => Promise.reject(new Error('away'));
  assert.equal(await isLockedOut(headers), false);
});

test('attempts come ever more slowly, up to a bound', () => {
  const waits = Array.from({ length: 12 }, (_, n) => waitBefore(n));
  assert.ok(waits.every((wait, at) => at === 0 || wait >= waits[at - 1]));
  assert.equal(waits[0], 250);
  assert.equal(waits.at(-1), 5000);
});

test('answers find who asked, in whatever order they come', async () => {
  const asked = [];
  const made = await server(0, (socket, message) => {
    asked.push(message);
    if (asked.length === 2) asked.reverse().forEach((each) => echo(socket, each));
  });
  const { connection, become } = connected(made.address().port);
  connection.open();
  await become('connected');
  const answers = await Promise.all([connection.ask('say', { text: 'a' }), connection.ask('say', { text: 'b' })]);
  assert.deepEqual(answers.map(({ text }) => text), ['a', 'b']);
  connection.close();
  await close(made);
});

test('what is asked while Leo is away is answered with an error at once', async () => {
  const { connection } = connected(1);
  assert.match((await connection.ask('say', { text: 'a' })).error, /not connected/);
});

test('it comes back by itself after the console began anew, and what was asked then has an error', async () => {
  let made = await server(0, () => {});
  const { port } = made.address();
  const { connection, states, become } = connected(port);
  connection.open();
  await become('connected');
  const unanswered = connection.ask('say', { text: 'a' });
  await close(made);
  assert.match((await unanswered).error, /not answering/);
  await become('lost');
  made = await server(port, echo);
  await become('connected');
  assert.equal((await connection.ask('say', { text: 'b' })).text, 'b');
  assert.deepEqual(states, ['connected', 'lost', 'connected']);
  connection.close();
  await close(made);
});

/** A connection with mock sockets and a mock clock. */
function faked(t) {
  const sockets = [];
  class Socket {
    static OPEN = 1;
    readyState = 0;
    isShut = false;
    constructor() {
      sockets.push(this);
    }
    send() {}
    // Without a network, closing takes an arbitrary time.
    close() {
      this.isShut = true;
    }
    open() {
      this.readyState = Socket.OPEN;
      this.onopen();
    }
  }
  t.mock.timers.enable({ apis: ['setTimeout'] });
  globalThis.WebSocket = Socket;
  t.after(() => {
    globalThis.WebSocket = WebSocket;
  });
  const states = [];
  const heard = [];
  const connection = new Connection('ws://leo/live', (message) => heard.push(message.version), (state) => states.push(state));
  connection.open();
  const say = (socket, version) => socket.onmessage({ data: JSON.stringify({ version, fresh: false, cells: {} }) });
  /** Advances time; the page runs each timer when it is due. */
  const pass = (ms) => {
    for (let passed = 0; passed < ms; passed += 1) t.mock.timers.tick(1);
  };
  /** Advances time while the page is blocked; afterwards it runs one of the due timers. */
  const stall = (ms) => t.mock.timers.tick(ms);
  return { connection, sockets, states, heard, say, pass, stall };
}

test('a Leo that says nothing for some seconds is lost and looked for anew, and one that speaks is not', async (t) => {
  const { connection, sockets, states, heard, say, pass } = faked(t);
  sockets[0].open();
  for (let second = 0; second < 60; second += 1) {
    say(sockets[0], second);
    pass(1000);
  }
  assert.deepEqual([states, sockets.length], [['connected'], 1]);
  const unanswered = connection.ask('say', { text: 'a' });
  pass(4000);
  assert.deepEqual([states, sockets[0].isShut], [['connected', 'lost'], true]);
  assert.match((await unanswered).error, /not answering/);
  pass(waitBefore(0));
  sockets[1].open();
  // Late events of the first socket are ignored.
  say(sockets[0], 100);
  sockets[0].onclose();
  say(sockets[1], 101);
  assert.deepEqual([states, heard.slice(-2)], [['connected', 'lost', 'connected'], [59, 101]]);
  connection.close();
  pass(60000);
  assert.equal(sockets.length, 2);
});

test('a connection says that it may only read, and forgets it when it is lost', (t) => {
  const { connection, sockets, states, pass } = faked(t);
  sockets[0].open();
  assert.equal(connection.isReadOnly, false);
  sockets[0].onmessage({ data: '{"access":"read"}' });
  assert.deepEqual([connection.isReadOnly, states], [true, ['connected', 'connected']]);
  sockets[0].onclose();
  pass(waitBefore(0));
  sockets[1].open();
  assert.equal(connection.isReadOnly, false);
  connection.close();
});

test('a page that was busy for long hears what came meanwhile before it thinks of Leo as lost', (t) => {
  const { connection, sockets, states, say, stall, pass } = faked(t);
  sockets[0].open();
  say(sockets[0], 1);
  stall(30000);
  assert.deepEqual(states, ['connected']);
  say(sockets[0], 2);
  pass(4999);
  assert.deepEqual(states, ['connected']);
  pass(1);
  assert.deepEqual(states, ['connected', 'lost']);
  connection.close();
});

test('a Leo that does not answer the attempt to connect is tried anew, ever more slowly', (t) => {
  const { connection, sockets, states, pass } = faked(t);
  pass(5000);
  assert.deepEqual([states, sockets[0].isShut, sockets.length], [['lost'], true, 1]);
  pass(waitBefore(0));
  assert.equal(sockets.length, 2);
  // A connection that opens and then stays silent is lost as well.
  sockets[1].open();
  pass(5000);
  pass(waitBefore(1) - 1);
  assert.equal(sockets.length, 2);
  pass(1);
  assert.equal(sockets.length, 3);
  connection.close();
});

test('what is to be written down is waited for longer than what is only to be done', async (t) => {
  const { connection, sockets, say, pass } = faked(t);
  sockets[0].open();
  const answers = {};
  for (const what of ['say', 'keep', 'record']) connection.ask(what).then((answer) => (answers[what] = answer.error));
  const seconds = (count) => {
    for (let second = 0; second < count; second += 1) {
      say(sockets[0], second);
      pass(1000);
    }
    return new Promise(setImmediate);
  };
  await seconds(59);
  assert.deepEqual(answers, { say: 'Leo has not answered for 10 seconds' });
  await seconds(1);
  const late = 'Leo has not answered for 60 seconds';
  assert.deepEqual(answers, { say: 'Leo has not answered for 10 seconds', keep: late, record: late });
  connection.close();
});
