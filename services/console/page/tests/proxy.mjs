// Serves the current build of the page in front of a running robot: node tests/proxy.mjs ROBOT_URL [--port 8788]
import { createServer } from 'node:http';
import { fileURLToPath } from 'node:url';
import { WebSocket, WebSocketServer } from 'ws';
import { bundle } from '../build.mjs';

/**
 * @param {string} robot the whole address of its page, with the token
 * @param {number} port 0: any that is free
 */
export async function before(robot, port) {
  const files = await bundle();
  const token = new URL(robot).searchParams.get('token');
  const headers = token === null ? {} : { authorization: `Bearer ${token}` };
  const pages = { '/': ['text/html; charset=utf-8', files['index.html']], '/page.js': ['text/javascript', files['page.js']], '/page.css': ['text/css', files['page.css']] };
  const server = createServer(async (request, response) => {
    const found = pages[new URL(request.url, robot).pathname];
    if (found !== undefined) {
      response.writeHead(200, { 'content-type': found[0] });
      return response.end(found[1]);
    }
    try {
      const answer = await fetch(new URL(request.url, robot), { method: request.method, headers });
      response.writeHead(answer.status, { 'content-type': answer.headers.get('content-type') ?? 'text/plain' });
      return response.end(Buffer.from(await answer.arrayBuffer()));
    } catch (error) {
      response.writeHead(502);
      return response.end(String(error));
    }
  });
  const live = new WebSocketServer({ server });
  live.on('connection', (client, request) => {
    const there = new WebSocket(new URL(request.url, robot.replace(/^http/, 'ws')), { origin: new URL(robot).origin, headers });
    const waiting = [];
    client.on('message', (text) => (there.readyState === WebSocket.OPEN ? there.send(text.toString()) : waiting.push(text.toString())));
    there.on('open', () => waiting.splice(0).forEach((text) => there.send(text)));
    there.on('message', (text) => client.send(text.toString()));
    there.on('close', () => client.close());
    there.on('error', () => client.close());
    client.on('close', () => there.close());
  });
  await new Promise((done) => server.listen(port, '127.0.0.1', done));
  return { address: `http://127.0.0.1:${server.address().port}`, close: () => new Promise((done) => server.close(done)) };
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const at = process.argv.indexOf('--port');
  const { address } = await before(process.argv[2], at < 0 ? 8788 : Number(process.argv[at + 1]));
  console.log(address);
}
