// A fake of Leo for the page's own tests. It simulates a table with line-of-sight visibility from two pairs of eyes,
// and follows docs/page.md. It learns only which colours were filled.
//
//   node tests/fake.mjs [--port 8787] [--blocks N]
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { WebSocketServer } from 'ws';
import { bundle } from '../build.mjs';
import { COLOURS, KINDS, TABLES } from './lesson.mjs';

const here = dirname(fileURLToPath(import.meta.url));
const TICK_MS = 33;
const TICK_S = 0.033;
const CONE = Math.PI / 3;
const policy = (host) => `default-src 'self'; connect-src 'self' ws://${host} wss://${host}; img-src 'self' data: blob:; style-src 'self'; script-src 'self'`;

const minus = (a, b) => a.map((value, axis) => value - b[axis]);
const length = (a) => Math.hypot(...a);
const yaw = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];

/** The orientation of an eye that looks along `f`. */
function gaze(f) {
  const around = Math.atan2(f[1], f[0]);
  const down = -Math.atan2(f[2], Math.hypot(f[0], f[1]));
  const [a, b] = [around / 2, down / 2];
  return [-Math.sin(a) * Math.sin(b), Math.cos(a) * Math.sin(b), Math.sin(a) * Math.cos(b), Math.cos(a) * Math.cos(b)];
}

/** Whether the segment from `a` to `b` intersects a box (slab method). */
function blocked(a, b, { p, half }) {
  let [from, to] = [0, 1];
  for (const axis of [0, 1, 2]) {
    const d = b[axis] - a[axis];
    const bounds = [p[axis] - half[axis] - a[axis], p[axis] + half[axis] - a[axis]];
    if (Math.abs(d) < 1e-9) {
      if (bounds[0] > 0 || bounds[1] < 0) return false;
      continue;
    }
    const times = bounds.map((bound) => bound / d).sort((x, y) => x - y);
    [from, to] = [Math.max(from, times[0]), Math.min(to, times[1])];
  }
  return from < to;
}

export class Fake {
  cells = new Map();
  clients = new Set();
  version = 0;
  t = 0;
  serial = 0;
  lines = [];
  tasks = new Map();
  memories = [new Map(), new Map()];
  histories = new Map();
  seat = { eyes: [0, 1.5, 0.55], looks_at: [0, 0.75, 0] };
  mode = 'script';
  table = 0;
  held = null;
  undone = [];
  teaching = null;
  performing = [];
  recording = { on: false, file: null, seconds: 0, bytes: 0, dropped: 0, error: null };
  saved = null;
  /** Whether the joints that are not locked are armed, and whether one joint is locked. */
  armed = true;
  locked = false;
  /** The acknowledged lock counts of the arming orders received. */
  orders = [];

  constructor() {
    this.lay(0);
    this.play();
  }

  play() {
    this.mode = 'script';
    this.table = 0;
    this.lay(0);
    this.script = [...TABLES[0].script];
    this.began = this.t;
    this.seat = { eyes: [0, 1.5, 0.55], looks_at: [0, 0.75, 0] };
  }

  lay(table) {
    this.table = table;
    this.objects = [];
    this.occluders = [];
    this.born = (this.born ?? 0) + 100;
    if (table === null) return;
    for (const [name, kind, colour, x, y] of TABLES[table].objects) this.add(kind, colour, [x, y], 0, name);
    for (const [name, from, to] of TABLES[table].occluders) {
      this.occluders.push({ name, p: from.map((v, i) => (v + to[i]) / 2), half: from.map((v, i) => (to[i] - v) / 2) });
    }
  }

  add(kindName, colourName, [x, y], heading = 0, name = null) {
    const kind = KINDS.find((each) => each.name === kindName);
    const colour = COLOURS.find((each) => each.name === colourName);
    if (kind === undefined || colour === undefined) throw new Error(`no kind "${kindName}" in colour "${colourName}"`);
    const base = kind.role === 'block' ? colourName : kindName;
    let n = 1;
    const named = () => (kind.role === 'block' && n === 1 ? base : `${base} ${n}`);
    while (this.objects.some((each) => each.name === named())) n += 1;
    const object = {
      ...kind, kind: kindName, name: name ?? named(), colour: colourName, rgb: colour.rgb, id: this.born + this.objects.length,
      p: [x, y, kind.half[2]], heading, into: null, held: null,
    };
    this.objects.push(object);
    this.drop(object, x, y);
    return object;
  }

  filled = (block) => this.objects.some((peg) => peg.into === block.name);

  /** Lays a thing at a place: in a hole, on the thing below, or on the table. */
  drop(object, x, y) {
    object.into = null;
    const hole = object.role === 'peg' && this.objects.find((each) => each !== object && each.hole
      && Math.hypot(each.p[0] - x, each.p[1] - y) < 0.02 && !this.filled(each));
    if (hole) {
      object.into = hole.name;
      object.p = [hole.p[0], hole.p[1], hole.p[2] + hole.half[2]];
      return;
    }
    const below = this.objects.filter((each) => each !== object
      && Math.abs(each.p[0] - x) < each.half[0] && Math.abs(each.p[1] - y) < each.half[1]);
    const top = Math.max(0, ...below.map((each) => each.p[2] + each.half[2]));
    object.p = [x, y, top + object.half[2]];
  }

  line(who, kind, text) {
    this.serial += 1;
    this.lines.push([`line/${this.serial}`, { t: this.t, who, kind, text }]);
    this.lines = this.lines.slice(-300);
  }

  // The acts of teachers.

  say(text) {
    this.line('the teacher', 'said', text);
    const begin = /teach you to do (.+)$/i.exec(text);
    const end = /^(.+) is done$/i.exec(text);
    const perform = /^leo,? do (.+)$/i.exec(text);
    if (begin) {
      this.teaching = { name: begin[1].toLowerCase(), before: new Set(this.objects.filter((each) => this.filled(each)).map((each) => each.name)) };
      this.line(null, 'sees', `${this.objects.length} things (Leo's own view)`);
      this.line('Leo', 'said', `I am watching; say "${begin[1]} is done" at the end`);
    } else if (end) this.learn(end[1].toLowerCase());
    else if (perform) this.perform(perform[1].toLowerCase());
    else if (/what do you think i see/i.test(text)) this.line('Leo', 'said', `you see ${this.memories[1].size} things`);
    else if (/why/i.test(text)) this.line('Leo', 'said', [...this.tasks.values()].at(-1)?.explanation ?? 'I have learned nothing yet');
    else this.line('Leo', 'said', 'I did not understand that');
  }

  learn(name) {
    if (this.teaching?.name !== name) return this.line('Leo', 'said', `you are not teaching me ${name}`);
    const task = this.tasks.get(name) ?? { name, shown: [], performances: [], hypotheses: {}, rule: null, explanation: null };
    const blocks = this.objects.filter((each) => each.hole);
    const seen = (block) => this.memories[1].has(block.id);
    task.shown.push(blocks.map((block) => ({ colour: block.colour, done: this.filled(block) && !this.teaching.before.has(block.name), seen: seen(block) })));
    this.teaching = null;
    const named = [{ name: 'all', fits: () => true }];
    for (const { name: colour } of COLOURS.slice(0, 4)) {
      named.push({ name: `all but ${colour}`, fits: (c) => c !== colour }, { name: colour, fits: (c) => c === colour });
    }
    for (const [perspective, key] of ['robot', 'human'].entries()) {
      const examples = task.shown.map((example) => example.filter((block) => perspective === 0 || block.seen));
      const tallies = named.map(({ fits }) => examples.filter((example) => example.every(({ colour, done }) => fits(colour) === done)).length);
      const weights = tallies.map((tally, at) => Math.exp(4 * (tally - task.shown.length) - (at === 0 ? 0 : 3.5)));
      const sum = weights.reduce((a, b) => a + b, 0);
      task.hypotheses[key] = named.map((each, at) => ({ name: each.name, posterior: weights[at] / sum, tally: tallies[at], rank: 0, high_likelihood: false }))
        .filter(({ tally }) => tally > 0).sort((a, b) => b.posterior - a.posterior).map((each, at) => ({ ...each, rank: at + 1, high_likelihood: at === 0 }));
    }
    const best = task.hypotheses.human[0];
    task.rule = best === undefined ? null : { perspective: 'human', name: best.name };
    const mine = task.hypotheses.robot[0]?.name;
    task.explanation = mine === best?.name ? null : `to me it looked like "${mine}", but you could not see the blue square`;
    task.fits = named.find((each) => each.name === best?.name)?.fits;
    this.tasks.set(name, task);
    this.line(null, 'rule', `${best?.name.toUpperCase()} (the teacher's view)`);
    if (task.explanation !== null) this.line(null, 'why', task.explanation);
    this.line('Leo', 'said', `I learned ${name}: ${best?.name}`);
  }

  perform(name) {
    const task = this.tasks.get(name);
    if (task === undefined) return this.line('Leo', 'said', `I do not know how to do ${name}`);
    const performance = { done: [], failed: [], result: null };
    task.performances = [performance];
    const blocks = this.objects.filter((each) => each.hole && !this.filled(each) && task.fits(each.colour));
    this.performing = blocks.map((block) => ({ block, performance, of: blocks.length, peg: null, from: null, k: 0 }));
  }

  step() {
    const now = this.performing[0];
    if (now === undefined) return;
    if (now.peg === null) {
      now.peg = this.objects.find((each) => each.role === 'peg' && each.into === null && each.held === null);
      if (now.peg === undefined) return this.performing.shift();
      now.from = now.peg.p;
      this.line(null, 'does', `put a peg into the ${now.block.name}`);
    }
    now.k = Math.min(1, now.k + 0.04);
    const to = [now.block.p[0], now.block.p[1], 0.085];
    now.peg.p = now.from.map((v, axis) => v + now.k * (to[axis] - v) + (axis === 2 ? 0.3 * now.k * (1 - now.k) : 0));
    if (now.k < 1) return;
    this.drop(now.peg, to[0], to[1]);
    this.performing.shift();
    now.performance.done.push(`${now.block.colour} square filled`);
    this.line(null, 'done', `${now.block.colour} square filled`);
    if (this.performing.length > 0) return;
    now.performance.result = `filled ${now.performance.done.length} of ${now.of}`;
    this.line(null, 'result', now.performance.result);
  }

  // Perception and belief.

  sees(object) {
    const { eyes, looks_at } = this.seat;
    const [way, sight] = [minus(object.p, eyes), minus(looks_at, eyes)];
    const cosine = way.reduce((sum, v, i) => sum + v * sight[i], 0) / (length(way) * length(sight));
    return cosine > Math.cos(CONE) && !this.occluders.some((box) => blocked(eyes, object.p, box));
  }

  believe() {
    for (const perspective of [0, 1]) {
      const memory = this.memories[perspective];
      for (const id of memory.keys()) if (!this.objects.some((each) => each.id === id)) memory.delete(id);
      for (const object of this.objects) {
        const seen = perspective === 0 || this.sees(object);
        const old = memory.get(object.id);
        if (seen) {
          const states = object.hole ? { filled: this.filled(object) ? 0.98 : 0.02 }
            : object.role === 'peg' ? { inserted: object.into === null ? 0.02 : 0.98 } : {};
          memory.set(object.id, { p: object.p, q: yaw(object.heading), states, held: object.held, seen, at: this.t });
        } else if (old !== undefined) old.seen = false;
        this.remember(object, perspective, memory.get(object.id));
      }
    }
    for (const id of this.histories.keys()) if (!this.memories[0].has(id)) this.histories.delete(id);
  }

  remember(object, perspective, belief) {
    if (!this.histories.has(object.id)) {
      this.histories.set(object.id, { words: `${object.colour} ${object.kind}`, tracks: [0, 1].map((n) => ({ perspective: n, points: [] })) });
    }
    const { points } = this.histories.get(object.id).tracks[perspective];
    const point = { t: this.t, known: belief !== undefined, seen: belief?.seen ?? false, p: belief?.p ?? null, states: belief?.states ?? {} };
    const last = points.at(-1);
    const same = last !== undefined && last.known === point.known && last.seen === point.seen && JSON.stringify(last.states) === JSON.stringify(point.states);
    if (!same) points.push(point);
    if (points.length > 64) points.shift();
  }

  // The state shown on the page.

  snapshot() {
    const cells = {
      robot: {
        version: 'fake', joints: this.joints ?? [], agents: { 0: 'Leo', 1: 'the teacher' }, base: { p: [0, 0, 0], q: yaw(Math.PI / 2) },
        cone_rad: CONE, perspectives: [{ number: 0, name: 'Leo', agents: [] }, { number: 1, name: 'the teacher', agents: [1] }], bench: false,
      },
      workspace: {
        lesson: 'task1', title: 'Task 1: fill the holes', mode: this.mode, table: this.table, tables: TABLES.length, steps: 6,
        watch: 'A blue block lies behind a wall. Leo sees it, the teacher does not. Does Leo learn "all" or "all but blue"?',
        kinds: KINDS, colours: COLOURS, simulated: true, saved: this.saved,
      },
      lessons: [
        { id: 'task1', title: 'Task 1: fill the holes', watch: '' }, { id: 'task2', title: 'Task 2: mark the blocks', watch: '' },
        { id: 'behind_his_back', title: 'Behind his back: a peg is taken out', watch: '' },
      ],
      now: { t: Math.round(this.t * 10) / 10 },
      joints: (this.joints ?? []).map((name) => this.angle(name)),
      'joint-trouble': [],
      'joints-stopped': { ended: 0, emergency: 0 },
      arming: this.summary(),
      recording: this.recording,
    };
    ['sensor', 'belief', 'learner', 'motor', 'simulator', 'mock-bus'].forEach((name, at) => {
      cells[`process/${name}`] = { process: name, state: 'running', restarts: 0, rate_hz: [200, null, null, 250, 200, 250][at], wakeup_us: { p50: 90, p99: 400 }, execution_us: { p50: 40 + at, p99: 120 }, overruns: 0, drops: 0, buses: name === 'motor' ? [{ name: 'torso', lost: false, joints: 9, quarantined: 0, exchanges: Math.round(this.t * 250), skipped: 0, missed: 0, broken: 0, stale: 0, late_bytes: 0, exchange_us: { p50: 900, p99: 1400 } }] : [] };
    });
    let n = 0;
    for (const object of this.objects) {
      const block = object.hole ? this.filled(object) : null;
      cells[`thing/${n}`] = {
        name: object.name, kind: 'object', role: object.role, p: object.p, q: yaw(object.heading), half: object.half, rgb: object.rgb, shape: object.shape,
        hole: object.hole, markable: object.markable, filled: block, marked: null, inserted: object.role === 'peg' ? object.into !== null : null,
        held: object.held, belief: object.id,
      };
      n += 1;
    }
    for (const box of this.occluders) {
      cells[`thing/${n}`] = { name: box.name, kind: 'occluder', role: null, p: box.p, q: yaw(0), half: box.half, rgb: [0.5, 0.5, 0.5], shape: null, held: null };
      n += 1;
    }
    const look = gaze(minus(this.seat.looks_at, this.seat.eyes));
    cells[`thing/${n}`] = { name: 'the teacher', kind: 'person', role: null, p: this.seat.eyes, q: look, half: null, rgb: null, shape: null, held: null, agent: 1 };
    const eyes = [{ p: [0, 0.06, 0.62], q: gaze(minus([0, 0.75, 0], [0, 0.06, 0.62])) }, { p: this.seat.eyes, q: look }];
    for (const perspective of [0, 1]) {
      const memory = this.memories[perspective];
      cells[`mind/${perspective}`] = { present: true, eye: eyes[perspective], beliefs: memory.size, perceivable: memory.size, hidden: 0, steps: this.version };
      for (const [id, belief] of memory) this.tell(cells, perspective, id, belief);
    }
    for (const [id, history] of this.histories) cells[`history/${id}`] = history;
    for (const [key, line] of this.lines) cells[key] = line;
    for (const { name, shown, hypotheses, rule, explanation, performances } of this.tasks.values()) {
      cells[`task/${name}`] = { name, examples: shown.length, hypotheses, rule, explanation, performances };
    }
    return cells;
  }

  tell(cells, perspective, id, belief) {
    const object = this.objects.find((each) => each.id === id);
    const key = perspective === 0 ? id : id + 10000;
    cells[`belief/${perspective}/${key}`] = {
      words: `${object.colour} ${object.kind}`, p: belief.p, q: belief.q, half: object.half, rgb: object.rgb, colour: object.colour, shape: object.shape,
      states: belief.states, confidence: 0.9, held: belief.held, owner: null, unseen_s: belief.seen ? 0 : Math.round(this.t - belief.at), twin: perspective === 0 ? null : id,
    };
    if (perspective !== 0) {
      const mine = this.memories[0].get(id);
      const aspects = [];
      if (length(minus(mine.p, belief.p)) > 0.05) aspects.push({ percept: 'position', robot: 'elsewhere', other: 'where it was' });
      for (const state of Object.keys(mine.states)) {
        const [a, b] = [mine.states[state] > 0.5, belief.states[state] > 0.5];
        if (a !== b) aspects.push({ percept: state, robot: a ? state : `not ${state}`, other: b ? state : `not ${state}` });
      }
      const words = aspects[0]?.percept === 'position' ? `the teacher does not know that the ${object.colour} ${object.kind} moved`
        : `the teacher is mistaken about the ${object.colour} ${object.kind}: ${aspects.map(({ percept }) => percept).join(', ')}`;
      if (aspects.length > 0) cells[`divide/1/${id}`] = { words, kind: 'different', robot: id, other: key, aspects };
    } else if (!this.memories[1].has(id)) {
      cells[`divide/1/${id}`] = { words: `the teacher does not know of the ${object.colour} ${object.kind}`, kind: 'unknown', robot: id, other: null, aspects: [] };
    }
  }

  /** Idle motion: Leo breathes, and looks at the current action. */
  angle(name) {
    const swing = Math.sin(this.t * 1.3);
    if (name === 'head_pitch_joint') return 0.35 + 0.03 * swing;
    if (/shoulder_roll/.test(name)) return name.startsWith('left') ? 0.25 : -0.25;
    if (/elbow_pitch/.test(name)) return -1.0 + 0.02 * swing;
    return 0;
  }

  tick() {
    this.t += TICK_S;
    while (this.mode === 'script' && this.script.length > 0 && this.t - this.began >= this.script[0][0]) this.act(this.script.shift());
    this.glide();
    this.step();
    if (this.recording.on) this.recording = { ...this.recording, seconds: this.recording.seconds + TICK_S, bytes: this.recording.bytes + 40000 };
    this.believe();
    this.publish();
    const over = this.mode === 'script' && this.script.length === 0 && this.t - this.began > 9;
    if (over && this.table === TABLES.length - 1 && this.performing.length === 0) this.mode = 'over';
    if (over && this.table < TABLES.length - 1) {
      this.lay(this.table + 1);
      this.script = [...TABLES[this.table].script];
      this.began = this.t;
    }
  }

  act([, what, first, second]) {
    if (what === 'say') return this.say(first);
    const [peg, block] = [first, second].map((name) => this.objects.find((each) => each.name === name));
    this.gliding = { peg, block, from: peg.p, k: 0 };
    peg.held = 1;
  }

  glide() {
    const way = this.gliding;
    if (!way) return;
    way.k = Math.min(1, way.k + TICK_S);
    way.peg.p = way.from.map((v, axis) => v + way.k * ([...way.block.p.slice(0, 2), 0.12][axis] - v) + (axis === 2 ? 0.2 * way.k * (1 - way.k) : 0));
    if (way.k < 1) return;
    way.peg.held = null;
    this.drop(way.peg, way.block.p[0], way.block.p[1]);
    this.line(null, 'saw', `the teacher: ${way.block.colour} square filled and peg inserted`);
    this.gliding = null;
  }

  publish() {
    const next = new Map(Object.entries(this.snapshot()).map(([key, value]) => [key, JSON.stringify(value)]));
    const changed = [];
    for (const [key, text] of next) if (this.cells.get(key) !== text) changed.push(`${JSON.stringify(key)}:${text}`);
    for (const key of this.cells.keys()) if (!next.has(key)) changed.push(`${JSON.stringify(key)}:null`);
    this.cells = next;
    this.version += 1;
    for (const client of this.clients) {
      if (client.bufferedAmount > 1e6) continue;
      if (client.fresh) {
        client.fresh = false;
        const all = [...next].map(([key, text]) => `${JSON.stringify(key)}:${text}`);
        client.send(`{"version":${this.version},"fresh":true,"cells":{${all.join()}}}`);
      } else if (changed.length > 0) client.send(`{"version":${this.version},"fresh":false,"cells":{${changed.join()}}}`);
    }
  }

  /** The summary of 65 joints. */
  summary() {
    const locked = this.locked ? [{ cause: 'blocked', meaning: 'the joint did not follow its command: something held it', remedy: 'remove what held the joint', count: 1, joints: ['left_elbow_pitch_joint'] }] : [];
    const count = this.armed ? 0 : 65 - locked.length;
    const disarmed = count === 0 ? [] : [{ cause: 'not-started', meaning: 'the motor process started', remedy: 'arm', count, joints: [] }];
    return { joints: 65, armed: 65 - locked.length - count, disarmed, locked, locks: locked.length, stopped: false, limited: 0, refused: 0 };
  }

  /** @param {{locks?: number}} message */
  arm({ locks }) {
    this.orders.push(locks ?? null);
    if (locks === 1) this.locked = false;
    this.armed = true;
  }

  // The page's requests.

  take(message, client) {
    const answer = { answer: message.id };
    try {
      const more = this.do(message, client);
      return { ...answer, ok: true, ...more };
    } catch (error) {
      return { ...answer, error: error.message };
    }
  }

  object(name) {
    const found = this.objects.find((each) => each.name === name);
    if (found === undefined) throw new Error(`there is no "${name}" on the table`);
    return found;
  }

  /** The first interactive act ends the script. */
  hand(setting = false) {
    if (this.gliding) this.gliding.peg.held = null;
    this.gliding = null;
    if (this.mode === 'script' || this.mode === 'over') this.mode = 'teaching';
    if (setting && this.mode !== 'set-up') throw new Error('things can be added and removed only while the table is set: begin a new table');
  }

  keep() {
    this.undone.push(structuredClone({ objects: this.objects, occluders: this.occluders }));
  }

  do(message) {
    const { do: what } = message;
    if (what === 'say') {
      if (this.mode === 'script' || this.mode === 'over') this.hand();
      this.mode = 'teaching';
      this.say(message.text);
    } else if (what === 'take') {
      this.hand();
      this.keep();
      this.held = this.object(message.thing);
      this.held.held = 1;
      this.held.from = this.held.p;
    } else if (what === 'carry') {
      if (this.held === null) throw new Error('nothing is in the hand');
      this.held.p = message.at;
      this.held.into = null;
      this.held.heading = message.heading ?? this.held.heading;
    } else if (what === 'put') {
      if (this.held === null) throw new Error('nothing is in the hand');
      const object = this.held;
      this.held = null;
      object.held = null;
      object.heading = message.heading ?? object.heading;
      this.drop(object, message.at[0], message.at[1]);
      this.line(null, 'saw', `the teacher: ${object.name} ${object.into === null ? 'moved' : `into ${object.into}`}`);
    } else if (what === 'cancel') {
      if (this.held !== null) [this.held.p, this.held.held] = [this.held.from, null];
      this.held = null;
    } else if (what === 'seat') this.seat = { eyes: message.eyes, looks_at: message.looks_at };
    else if (what === 'screen') {
      const box = this.occluders.find((each) => each.name === message.name);
      if (box === undefined) {
        this.hand(true);
        this.keep();
        this.occluders.push({ name: message.name, p: message.at, half: message.half });
      } else box.p = message.at;
    } else if (what === 'add') {
      this.hand(true);
      this.keep();
      return { thing: this.add(message.kind, message.colour, message.at, message.heading ?? 0).name };
    } else if (what === 'remove') {
      this.hand(true);
      this.keep();
      this.objects = this.objects.filter((each) => each.name !== message.thing);
      this.occluders = this.occluders.filter((each) => each.name !== message.thing);
    } else if (what === 'clear') {
      this.lay(null);
      this.mode = 'set-up';
    } else if (what === 'lay') {
      this.lay(message.table);
      this.mode = 'set-up';
    } else if (what === 'play' || what === 'open') this.play();
    else if (what === 'undo') {
      const was = this.undone.pop();
      if (was === undefined) throw new Error('there is nothing to take back');
      Object.assign(this, was);
    } else if (what === 'save') this.saved = `/tmp/${message.title}.toml`;
    else if (what === 'arm') this.arm(message);
    else if (what === 'record') this.recording = { ...this.recording, on: message.on, file: 'leo.mcap', seconds: 0, bytes: 0 };
    else throw new Error(`nobody knows how to "${what}"`);
    return {};
  }
}

/**
 * Serves the page and the fake.
 * @param {number} port 0: any that is free
 * @param {Fake} fake
 */
export async function serve(port, fake = new Fake()) {
  const files = await bundle();
  // The body is missing if the page is not served from its own folder.
  const urdf = await readFile(process.env.URDF ?? join(here, '../../../../config/leo.urdf'));
  fake.joints = [...urdf.toString().matchAll(/<joint name="([^"]+)" type="revolute"/g)].map(([, name]) => name);
  const pages = {
    '/': ['text/html; charset=utf-8', files['index.html']], '/page.js': ['text/javascript', files['page.js']],
    '/page.css': ['text/css', files['page.css']], '/leo.urdf': ['application/xml', urdf],
  };
  const server = createServer((request, response) => {
    const found = pages[new URL(request.url, 'http://leo').pathname];
    response.writeHead(found === undefined ? 404 : 200, { 'content-type': found?.[0] ?? 'text/plain', 'content-security-policy': policy(request.headers.host) });
    response.end(found?.[1] ?? 'not found');
  });
  const live = new WebSocketServer({ server, path: '/live' });
  live.on('connection', (client) => {
    client.fresh = true;
    fake.clients.add(client);
    client.on('message', (text) => client.send(JSON.stringify(fake.take(JSON.parse(text), client))));
    client.on('close', () => fake.clients.delete(client));
  });
  await new Promise((done) => server.listen(port, '127.0.0.1', done));
  const timer = setInterval(() => fake.tick(), TICK_MS);
  const close = async () => {
    clearInterval(timer);
    for (const client of fake.clients) client.terminate();
    await new Promise((done) => server.close(done));
  };
  return { address: `http://127.0.0.1:${server.address().port}`, fake, close };
}

/** A table full of blocks. */
export function crowded(count) {
  const fake = new Fake();
  fake.lay(null);
  fake.mode = 'teaching';
  for (let n = 0; n < count; n += 1) {
    const kind = KINDS[n % 4].name;
    fake.add(kind, COLOURS[n % 4].name, [-0.72 + 0.16 * (n % 10), 0.3 + 0.1 * Math.floor(n / 10)], 0.3 * n, `thing ${n}`);
  }
  return fake;
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  const option = (name, other) => {
    const at = process.argv.indexOf(name);
    return at < 0 ? other : Number(process.argv[at + 1]);
  };
  const blocks = option('--blocks', 0);
  const { address } = await serve(option('--port', 8787), blocks > 0 ? crowded(blocks) : new Fake());
  console.log(`a fake of Leo: ${address}`);
}
