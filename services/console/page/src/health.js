// The health panel: Leo's processes, buses and joints in trouble.
import { find, make, write } from './element.js';

/** Processes that should read every frame. In the queues of the others newer frames replace older ones by design. */
const READS_ALL = ['belief', 'motor'];
const DROPS = 'Skipped: a newer frame replaced it in the queue of a process that needs the newest one. That is no fault. '
  + 'Lost: belief or motor, which should read every frame, was too slow.';

/**
 * The frames that a process did not read, in words. Pure.
 * @param {{process: string, drops?: number}} process
 */
export function dropWords({ process, drops }) {
  if (typeof drops !== 'number') return '–';
  if (drops === 0) return '0';
  return `${number(drops)} ${READS_ALL.includes(process) ? 'lost' : 'skipped'}`;
}

export class Health {
  #store;
  #details = /** @type {HTMLDetailsElement} */ (find('health'));

  /** @param {import('./store.js').Store} store */
  constructor(store) {
    this.#store = store;
    store.on(['process/', 'joint-trouble', 'joints-stopped'], () => this.#update());
    this.#details.addEventListener('toggle', () => this.#update());
  }

  #update() {
    const processes = this.#store.under('process/').map(([, process]) => process);
    const buses = processes.flatMap((process) => process.buses ?? []);
    const trouble = this.#store.get('joint-trouble') ?? [];
    const { words, bad } = summary(processes, buses, trouble, this.#store.get('joints-stopped'));
    write(find('health-summary'), words);
    this.#details.classList.toggle('bad', bad);
    if (!this.#details.open) return;
    find('health-body').replaceChildren(
      table(['process', 'state', 'Hz', 'p50', 'p99', 'overruns', 'unread'], processes.map((process) => [
        process.process, state(process), number(process.rate_hz), number(process.execution_us?.p50),
        number(process.execution_us?.p99), number(process.overruns), dropWords(process)])),
      make('p', { class: 'quiet', text: 'p50 and p99: how long a cycle took, µs' }),
      make('p', { class: 'quiet', text: DROPS }),
      table(['bus', 'exchanges', 'errors', 'quarantined'], buses.map(busRow)),
      make('ul', {}, ...trouble.map((/** @type {any} */ each) => make('li', { text: troubleWords(each) }))),
    );
  }
}

/**
 * The health as one line, and whether anything is wrong. After the end of the run, when the motor process runs no more,
 * that is expected of the others too; the page does not hear of the last ones. An emergency stop is always shown as wrong.
 * Pure.
 * @param {any[]} processes
 * @param {any[]} buses
 * @param {any[]} trouble joints in trouble
 * @param {{ended: number, emergency: number}} [stopped] joints whose torque is off since the end or an emergency stop
 */
export function summary(processes, buses, trouble, stopped = { ended: 0, emergency: 0 }) {
  const dead = processes.filter((process) => process.state !== 'running').length;
  const lost = buses.filter((bus) => bus.lost).length;
  const parts = [`${counted(processes.length, 'process', 'processes')}${dead === 0 ? '' : `, ${dead} not running`}`];
  if (buses.length > 0) parts.push(`${counted(buses.length, 'bus', 'buses')}${lost === 0 ? '' : `, ${lost} LOST`}`);
  if (trouble.length > 0) parts.push(`${counted(trouble.length, 'joint', 'joints')} in trouble`);
  const { ended, emergency } = stopped;
  if (ended > 0) parts.push(`the robot was stopped, torque of ${counted(ended, 'joint', 'joints')} is off`);
  if (emergency > 0) parts.push(`emergency stop, torque of ${counted(emergency, 'joint', 'joints')} is off`);
  const hasEnded = ended > 0 && processes.some((process) => process.process === 'motor' && process.state !== 'running');
  return { words: parts.join(' · '), bad: (hasEnded ? 0 : dead) + lost + trouble.length + emergency > 0 };
}

/** @param {number} count @param {string} one @param {string} several */
function counted(count, one, several) {
  return `${count} ${count === 1 ? one : several}`;
}

/**
 * A joint in trouble as text: its mode and cause, and the states of its state machines. Pure.
 * @param {any} joint
 */
export function troubleWords({ joint, mode, cause, link, power, arming, arming_cause: why, motion }) {
  const reason = why === undefined || why === null || why === 'none' ? '' : `: ${why}`;
  const machines = arming ? ` (link ${link}, power ${power}, ${arming}${reason}, ${motion})` : '';
  return `${joint}: ${mode}, ${cause}${machines}`;
}

/** Errors are missing, corrupt and stale replies. Pure. @param {any} bus */
export function busRow({ name, lost, exchanges, missed, broken, stale, quarantined }) {
  return [lost ? `${name} LOST` : name, number(exchanges), number(missed + broken + stale), number(quarantined)];
}

/** @param {any} process */
function state(process) {
  return process.restarts > 0 ? `${process.state} (restarted ${process.restarts} ×)` : process.state;
}

/** @param {any} value */
function number(value) {
  return typeof value === 'number' ? String(Math.round(value)) : '–';
}

/** @param {string[]} heads @param {string[][]} rows */
function table(heads, rows) {
  return make('table', {},
    make('thead', {}, make('tr', {}, ...heads.map((text) => make('th', { scope: 'col', text })))),
    make('tbody', {}, ...rows.map((row) => make('tr', {}, ...row.map((text) => make('td', { text }))))));
}
