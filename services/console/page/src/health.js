// Leo's processes, buses and joints in trouble, for who looks after it.
import { find, make, write } from './element.js';

export class Health {
  #cells;
  #details = /** @type {HTMLDetailsElement} */ (find('health'));

  /** @param {import('./cells.js').Cells} cells */
  constructor(cells) {
    this.#cells = cells;
    cells.on(['process/', 'joint-trouble'], () => this.#update());
    this.#details.addEventListener('toggle', () => this.#update());
  }

  #update() {
    const processes = this.#cells.under('process/').map(([, process]) => process);
    const buses = processes.flatMap((process) => process.buses ?? []);
    const trouble = this.#cells.get('joint-trouble') ?? [];
    const bad = processes.filter((process) => process.state !== 'running').length;
    const parts = [`${processes.length} processes${bad === 0 ? '' : `, ${bad} not running`}`];
    if (buses.length > 0) parts.push(`${buses.length} ${buses.length === 1 ? 'bus' : 'buses'}`);
    if (trouble.length > 0) parts.push(`${trouble.length} joints in trouble`);
    write(find('health-summary'), parts.join(' · '));
    this.#details.classList.toggle('bad', bad + trouble.length > 0);
    if (!this.#details.open) return;
    find('health-body').replaceChildren(
      table(['process', 'state', 'Hz', 'p50', 'p99', 'overruns', 'drops'], processes.map((process) => [
        process.process, state(process), number(process.rate_hz), number(process.execution_us?.p50),
        number(process.execution_us?.p99), number(process.overruns), number(process.drops)])),
      make('p', { class: 'quiet', text: 'p50 and p99: how long a cycle took, µs' }),
      table(['bus', 'cycles', 'errors', 'quarantined'], buses.map((bus, at) => [
        bus.name ?? String(bus.bus ?? at), number(bus.cycles), number(bus.errors), number(bus.quarantined)])),
      make('ul', {}, ...trouble.map((/** @type {any} */ each) => make('li', { text: `${each.joint}: ${each.mode}, ${each.cause}` }))),
    );
  }
}

/** @param {any} process */
function state(process) {
  return process.restarts > 0 ? `${process.state} (restarted ${process.restarts} ×)` : process.state;
}

/** @param {any} value */
function number(value) {
  if (Array.isArray(value)) return String(value.length);
  return typeof value === 'number' ? String(Math.round(value)) : '–';
}

/** @param {string[]} heads @param {string[][]} rows */
function table(heads, rows) {
  return make('table', {},
    make('thead', {}, make('tr', {}, ...heads.map((text) => make('th', { scope: 'col', text })))),
    make('tbody', {}, ...rows.map((row) => make('tr', {}, ...row.map((text) => make('td', { text }))))));
}
