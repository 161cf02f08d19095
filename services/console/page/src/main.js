// The page's entry point: creates and connects its parts.
import { AccessToken } from './access-token.js';
import { Arming } from './arming.js';
import { Beliefs, idOf } from './beliefs.js';
import { ColourNames } from './colour-names.js';
import { Store } from './store.js';
import { TeacherSeat } from './teacher-seat.js';
import { Connection, isLockedOut, liveAddress } from './connection.js';
import { Dialogue } from './dialogue.js';
import { listDivergences } from './divergences.js';
import { find, make, write } from './element.js';
import { extent } from './extent.js';
import { Guide } from './guide.js';
import { Hand } from './hand.js';
import { Health } from './health.js';
import { Keys } from './keys.js';
import { Labels } from './labels.js';
import { landing } from './landing.js';
import { arrange } from './layout.js';
import { VIEWS, freeSeat, freely, fromAbove, overTable, throughEyes, throughLeo } from './lens.js';
import { Lessons } from './lessons.js';
import { HitTargets } from './hit-targets.js';
import { repaint } from './paint.js';
import { Palette } from './palette.js';
import { People, signed } from './people.js';
import { Pointer } from './pointer.js';
import { distance } from './pose.js';
import { probe } from './probe.js';
import { Stage, camera, isSoftware } from './stage.js';
import { stopButton } from './stop.js';
import { lightFor } from './surface.js';
import { Tasks } from './tasks.js';
import { Timeline } from './timeline.js';
import { Toasts } from './toasts.js';
import { agrees, believes } from './words.js';
import { World } from './world.js';

const software = isSoftware();
lightFor(software);
const store = new Store();
const toasts = new Toasts(find('toasts'));
// First, so that the stop button works even if something below fails.
stopButton(toasts);
const accessToken = new AccessToken(() => localStorage);
accessToken.take(location, history);
const connection = new Connection(liveAddress(location, accessToken.value), (message) => store.apply(message), connectionChanged);

/**
 * Sends a request to Leo and shows the error, if any.
 * @param {string} what
 * @param {Record<string, any>} [content]
 */
async function ask(what, content) {
  const answer = await connection.ask(what, signed(what, content, acting()));
  if (answer.error !== undefined && connection.state === 'connected') toasts.show(answer.error, 'error');
  return answer;
}

/** @param {import('./connection.js').State} state */
function connectionChanged(state) {
  document.body.dataset.connection = state;
  const words = { connecting: 'Connecting…', connected: 'Connected', lost: 'Not connected. Trying again…' };
  const label = /** @type {Element} */ (find('connection').querySelector('.label'));
  write(label, words[state]);
  if (state === 'connected') {
    if (connection.isReadOnly) lock('This page may only watch the robot.');
    else find('locked').hidden = true;
    loadBody();
    return;
  }
  isLockedOut(accessToken.headers).then((locked) => {
    if (!locked) return;
    connection.close();
    write(label, 'Not connected');
    lock('This page lacks the robot’s token.');
  });
  hand.cancel();
  keys.forget();
}

/** Shows how to get the token. @param {string} what is missing without it */
function lock(what) {
  write(find('locked'), `${what} To command the robot, open the whole address that leo run prints: ${location.origin}/?token=… The button Stop works without it.`);
  find('locked').hidden = false;
}
addEventListener('storage', (event) => {
  if (!find('locked').hidden && AccessToken.isStored(event)) location.reload();
});

// The scenes and their views.

const stage = new Stage(/** @type {HTMLCanvasElement} */ (find('canvas')), { software }, (why) => {
  write(find('blind'), `This browser cannot draw the table (${why}): enable WebGL 2, or use another browser. Everything else works.`);
  find('blind').hidden = false;
});
const shadows = !software;
const colourNames = new ColourNames(store, () => stage.request());
const world = new World(store, { shadows }, () => stage.request(main));
const teacherSeat = new TeacherSeat({ ask }, store, () => {
  if (view === 'seat') stage.request(main);
});
const minds = [0, 1].map((perspective) => {
  const beliefs = new Beliefs(store, { shadows: false });
  beliefs.perspective = perspective;
  const element = find(`mind-${perspective}`);
  const eye = camera();
  const labels = new Labels(element, eye);
  const aim = (/** @type {number} */ aspect) => overTable(eye, region, aspect);
  return { beliefs, view: { element, scene: beliefs.scene, camera: eye, aim, drawn: () => labels.place(colourNames.areShown ? beliefs.labels() : []) } };
});

/** The region of the table shown in the belief views. */
let region = extent([]);

/** @type {import('./lens.js').Name} */
let view = 'seat';
let free = freeSeat();
let near = 1;

const eye = camera();
const main = {
  element: find('main-view'),
  scene: world.scene,
  camera: eye,
  aim: (/** @type {number} */ aspect) => {
    if (view === 'seat') throughEyes(eye, teacherSeat.seat, aspect);
    else if (view === 'leo') throughLeo(eye, store.get('mind/0')?.eye, aspect);
    else if (view === 'above') fromAbove(eye, aspect, near);
    else freely(eye, free, aspect);
    world.present(view);
  },
  drawn: () => {
    hitTargets.place();
    labels.place(colourNames.areShown ? colourNames.things(world, view, eye.position.toArray()) : []);
  },
};
const labels = new Labels(main.element, eye);
const hitTargets = new HitTargets(find('marks'), store, world, eye);
for (const each of [main, ...minds.map((mind) => mind.view)]) stage.add(each);

/** Resets the viewpoint. */
function settle() {
  free = freeSeat();
  near = 1;
  if (view === 'seat' && desk.movable()) teacherSeat.move(teacherSeat.home);
  stage.request(main);
}

/** @param {import('./lens.js').Name} name */
function look(name) {
  view = name;
  document.body.dataset.view = name;
  for (const button of find('views').children) {
    button.setAttribute('aria-checked', String(/** @type {HTMLElement} */ (button).dataset.view === name));
  }
  stage.request(main);
}
for (const { name, label } of VIEWS) {
  find('views').append(make('button', { type: 'button', role: 'radio', data: { view: name }, text: label, onclick: () => (name === view && name !== 'leo' ? settle() : look(name)) }));
}
look('seat');

// The hand, the pointer and the keyboard.

/** The person who speaks and acts on this page; by default the first teacher. */
const who = /** @type {HTMLSelectElement} */ (find('who'));
const acting = () => (who.hidden ? null : Number(who.value));
const people = new People(store);
store.on(['thing/', 'robot', 'workspace'], () => {
  here();
  const all = people.all();
  if (who.dataset.people === all.join()) return;
  who.dataset.people = all.join();
  who.replaceChildren(...all.map((agent) => make('option', { value: agent, text: nameOf(agent), selected: agent === teacherSeat.agent })));
  who.hidden = all.length < 2;
  // The previous person may be missing from the new lesson.
  actAs(who.hidden ? 1 : Number(who.value));
});

const hand = new Hand({ ask }, store, world, () => stage.request(main));

/** The robot's own belief about a thing. @param {string | null} key @returns {number | null} */
function beliefOf(key) {
  const thing = key === null ? undefined : store.get(key);
  if (thing === undefined || thing.kind !== 'object') return null;
  if (thing.belief !== undefined) return thing.belief;
  const nearest = store.under('belief/0/').filter(([, belief]) => belief.p !== null)
    .map(([id, belief]) => ({ id: idOf(id), far: distance(belief.p, thing.p) })).sort((a, b) => a.far - b.far)[0];
  return nearest !== undefined && nearest.far < 0.06 ? nearest.id : null;
}

/** The name of the selected thing. @type {string | null} */
let chosen = null;

/** @param {string | null} key */
function select(key) {
  world.selected = key;
  chosen = key === null ? null : store.get(key)?.name ?? null;
  world.mark();
  removable();
  follow(beliefOf(key));
  stage.request(main);
}

/** Highlights one of the robot's own beliefs in all views. @param {number | null} id */
function follow(id) {
  timeline.id = id;
  timeline.update();
  for (const mind of minds) mind.beliefs.selected = id;
  thought();
}

/** @param {string | null} key */
function hover(key) {
  if (world.hovered === key) return;
  world.hovered = key;
  world.mark();
  main.element.classList.toggle('over', key !== null);
  stage.request(main);
}

/** @param {import('./seat.js').Seat} seat */
function sit(seat) {
  if (view === 'free') {
    free = seat;
    stage.request(main);
    return;
  }
  teacherSeat.move(seat);
}

/** @param {string} key */
async function remove(key) {
  const thing = store.get(key);
  if (thing === undefined || store.get('workspace')?.mode !== 'set-up') return;
  select(null);
  await ask('remove', { thing: thing.name });
}

find('remove').addEventListener('click', () => {
  if (world.selected !== null) remove(world.selected);
});
find('leave').addEventListener('click', () => ask(people.isAway(teacherSeat.agent) ? 'return' : 'leave'));

/** Shows whether the acting person is at the table. */
function here() {
  const away = String(people.isAway(teacherSeat.agent));
  if (find('leave').ariaPressed !== away) find('leave').ariaPressed = away;
  write(find('leave'), away === 'true' ? 'Come back' : 'Leave');
}

who.addEventListener('change', () => actAs(Number(who.value)));

/** Makes a person speak, act and look on this page. @param {number} agent */
function actAs(agent) {
  teacherSeat.take(agent);
  world.lookAs(agent);
  hitTargets.refresh();
  const seat = /** @type {HTMLElement} */ (find('views').querySelector('[data-view=seat]'));
  const name = nameOf(agent);
  write(seat, agent === 1 ? 'Your eyes' : `${name[0].toUpperCase()}${name.slice(1)}’s eyes`);
  here();
  stage.request(main);
}

/** @param {number} agent */
function nameOf(agent) {
  return agent === 1 ? 'You' : (store.get('robot')?.agents ?? {})[agent] ?? `partner ${agent}`;
}
store.on('workspace', removable);

let laid = '';
store.on('workspace', () => {
  const { lesson, table } = store.get('workspace') ?? {};
  const now = `${lesson} ${table}`;
  // Things of another table may have the same keys and names.
  if (laid !== '' && laid !== now) {
    select(null);
    hover(null);
  }
  laid = now;
});

/** Shows the "remove" button if the selected thing can be removed: only while the table is set up. */
function removable() {
  const thing = world.selected === null ? undefined : store.get(world.selected);
  const can = store.get('workspace')?.mode === 'set-up' && thing !== undefined && thing.kind !== 'person';
  find('remove').hidden = !can;
  if (can) write(find('remove'), `Remove ${thing.name}`);
}

const desk = {
  element: main.element,
  camera: eye,
  store,
  world,
  hand,
  view: () => view,
  eyes: () => teacherSeat.agent,
  seat: () => (view === 'free' ? free : teacherSeat.seat),
  sit,
  ask,
  select,
  hover,
  remove,
  settle,
  movable: () => store.get('workspace')?.simulated === true && connection.state === 'connected',
  zoom: (/** @type {number} */ factor) => {
    near = Math.min(1.3, Math.max(0.35, near * factor));
    stage.request(main);
  },
  undo: () => ask('undo'),
};
const pointer = new Pointer(desk);
const keys = new Keys(desk);
find('marks').addEventListener('focusin', (event) => {
  const key = /** @type {HTMLElement} */ (event.target).dataset.key ?? null;
  if (/** @type {HTMLElement} */ (event.target).matches(':focus-visible')) hover(key);
});
find('marks').addEventListener('focusout', () => hover(null));

// The panels.

const timeline = new Timeline(store);
new Dialogue(store, (text) => ask('say', { text }), toasts);
new Tasks(store);
new Lessons(store, ask, toasts);
new Health(store);
new Guide(store);
arrange(matchMedia('(max-width: 999px)'));
new Arming(store, ask);
new Palette(store, {
  aim: (event) => {
    const { left, right, top, bottom } = main.element.getBoundingClientRect();
    const isOver = event.clientX > left && event.clientX < right && event.clientY > top && event.clientY < bottom;
    return isOver ? pointer.ground(event, 0) : null;
  },
  preview: (item, at) => {
    if (item === null || at === undefined || !('kind' in item)) world.land(null);
    else {
      const thing = { ...item.kind, rgb: item.colour.rgb };
      const others = store.under('thing/').map(([, other]) => other);
      world.land(thing, landing(thing, at, 0, others));
    }
    stage.request(main);
  },
  lying: () => store.under('thing/').map(([, thing]) => thing).filter((thing) => thing.kind !== 'person' && thing.p),
  ask,
});

// The beliefs.

/** Minimum interval between two drawings of the beliefs; longer with software rendering. */
const BELIEFS_EVERY_MS = { card: 33, software: 200 };

/** The perspective shown beside the robot's own. */
let partner = 1;
let thinking = false;

/** Redraws the beliefs, once for several messages: they change with every observation. */
function thought() {
  if (thinking) return;
  thinking = true;
  setTimeout(() => {
    thinking = false;
    for (const mind of minds) mind.beliefs.update();
    region = extent([...store.under('thing/').map(([, thing]) => thing).filter(({ kind }) => kind !== 'person'),
      ...minds.flatMap(({ beliefs }) => store.under(`belief/${beliefs.perspective}/`).map(([, belief]) => belief))]);
    stage.request(...minds.map((mind) => mind.view));
    listDivergences(find('divergences'), store, partner, follow);
    const robot = store.get('robot');
    const shown = robot?.perspectives?.find((/** @type {any} */ each) => each.number === partner);
    const differs = find('divergences').children.length > 0;
    const none = differs ? '' : agrees(shown, store.get(`mind/${partner}`), robot?.agents ?? {});
    write(find('divergences-empty'), none);
    find('divergences-empty').hidden = none === '';
    find('divergences').hidden = none !== '';
    count();
  }, software ? BELIEFS_EVERY_MS.software : BELIEFS_EVERY_MS.card);
}

function count() {
  for (const [at, perspective] of [0, partner].entries()) {
    const mind = store.get(`mind/${perspective}`);
    const element = /** @type {Element} */ (find(`mind-${at}`).parentElement?.querySelector('.count'));
    const n = store.under(`belief/${perspective}/`).length;
    write(element, mind?.present === false ? `${perspective === 1 ? 'you are' : 'is'} away` : `${n} ${n === 1 ? 'thing' : 'things'}`);
  }
}

function perspectives() {
  const robot = store.get('robot');
  const all = (robot?.perspectives ?? []).filter((/** @type {any} */ each) => each.number !== 0);
  if (all.length > 0 && !all.some((/** @type {any} */ each) => each.number === partner)) partner = all[0].number;
  const tabs = find('perspectives');
  tabs.hidden = all.length < 2;
  const said = JSON.stringify([all, robot?.agents]);
  // Rebuild the tabs only on changes, so that the focused tab keeps its focus.
  if (tabs.dataset.said !== said) {
    tabs.dataset.said = said;
    tabs.replaceChildren(...all.map((/** @type {any} */ each) => make('button', {
      type: 'button',
      role: 'tab',
      data: { perspective: each.number },
      title: believes(each, robot.agents ?? {}),
      text: each.name,
      onclick: () => {
        partner = each.number;
        perspectives();
      },
    })));
  }
  for (const tab of tabs.children) {
    tab.setAttribute('aria-selected', String(Number(/** @type {HTMLElement} */ (tab).dataset.perspective) === partner));
  }
  const shown = all.find((/** @type {any} */ each) => each.number === partner);
  if (shown !== undefined) write(find('mind-1-title'), believes(shown, robot.agents ?? {}));
  minds[1].beliefs.perspective = partner;
  thought();
}

store.on(['belief/', 'divide/', 'thing/', 'mind/'], thought);
let version = '';
store.on('robot', () => {
  const now = store.get('robot')?.version ?? '';
  if (version !== '' && now !== '' && now !== version) toasts.show(`Leo is ${now} now: load the page again`);
  version = now || version;
});
store.on('robot', perspectives);
store.on('mind/0', () => {
  if (view === 'leo') stage.request(main);
});
store.on(['thing/', 'history/'], () => {
  if (chosen === null) return;
  const key = store.thing(chosen);
  if (key === null) return select(null);
  if (key !== world.selected) {
    world.selected = key;
    world.mark();
    removable();
    stage.request(main);
  }
  if (timeline.id !== null && store.get(`history/${timeline.id}`) !== undefined) return;
  const id = beliefOf(key);
  if (id !== timeline.id) follow(id);
});

// The theme.

function themeChanged() {
  repaint();
  world.repaint();
  for (const mind of minds) mind.beliefs.repaint();
  stage.request();
}
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', themeChanged);

// Leo's body and the connection.

let isBodyLoading = false;

/** Loads Leo's body once. */
function loadBody() {
  if (isBodyLoading) return;
  isBodyLoading = true;
  world.body.load('/leo.urdf', accessToken.headers)
    .then(() => stage.request())
    .catch((error) => toasts.show(`Leo's body cannot be shown: ${error.message}`, 'error'));
}
connection.open();

probe({ store, connection, stage, hitTargets, main: main.element, world, teacherSeat, hand, look });
