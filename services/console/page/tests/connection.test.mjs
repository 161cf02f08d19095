import assert from 'node:assert/strict';
import { test } from 'node:test';
import { WebSocket, WebSocketServer } from 'ws';
import { Connection, liveAddress, waitBefore } from '../src/connection.js';

globalThis.WebSocket = WebSocket;

/** A server that answers with what it was asked, on a port. */
const server = (port, answer) => new Promise((done) => {
  const made = new WebSocketServer({ port, host: '127.0.0.1' }, () => done(made));
  made.on('connection', (socket) => {
    socket.send(JSON.stringify({ version: 1, fresh: true, cells: {} }));
    socket.on('message', (text) => answer(socket, JSON.parse(text)));
  });
});

const echo = (socket, message) => socket.send(JSON.stringify({ answer: message.id, ok: true, text: message.text }));

/** A connection, and a way to wait for its states. */
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

test('the token of the page goes on to the WebSocket', () => {
  const at = (search) => liveAddress({ protocol: 'http:', host: 'leo:7780', search });
  assert.equal(at(''), 'ws://leo:7780/live');
  assert.equal(at('?token=a%26b'), 'ws://leo:7780/live?token=a%26b');
  assert.equal(liveAddress({ protocol: 'https:', host: 'leo', search: '' }), 'wss://leo/live');
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
