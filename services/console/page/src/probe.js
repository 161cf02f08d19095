// `window.leo`: the page's interface for tests and the browser's console.

/**
 * @param {object} parts
 * @param {import('./cells.js').Cells} parts.cells
 * @param {import('./connection.js').Connection} parts.connection
 * @param {import('./stage.js').Stage} parts.stage
 * @param {import('./marks.js').Marks} parts.marks
 * @param {HTMLElement} parts.main
 * @param {import('./world.js').World} parts.world
 * @param {import('./chair.js').Chair} parts.chair
 * @param {import('./hand.js').Hand} parts.hand
 * @param {(view: import('./lens.js').Name) => void} parts.look
 */
export function probe({ cells, connection, stage, marks, main, world, chair, hand, look }) {
  /** @param {number} x @param {number} y @param {number} z */
  const at = (x, y, z) => {
    const spot = marks.project([x, y, z]);
    const rect = main.getBoundingClientRect();
    return spot === null ? null : { x: rect.left + spot.x, y: rect.top + spot.y };
  };
  const leo = {
    cells,
    connection,
    stage,
    at,
    look,
    /** The position of a thing on the page, in CSS pixels, by its name. @param {string} name */
    screen(name) {
      const key = cells.thing(name);
      const pose = key === null ? null : world.pose(key);
      return pose === null ? null : at(pose.p[0], pose.p[1], pose.p[2]);
    },
    /** @param {string} name */
    thing: (name) => cells.get(cells.thing(name) ?? ''),
    /** All cells under a prefix, as an object. @param {string} prefix */
    under: (prefix) => Object.fromEntries(cells.under(prefix)),
    seat: () => chair.seat,
    held: () => hand.held?.thing.name ?? null,
    pictures: () => stage.pictures,
  };
  Object.assign(window, { leo });
}
