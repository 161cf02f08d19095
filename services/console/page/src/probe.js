// `window.leo`: the page's interface for tests and the browser's console.

/**
 * @param {object} parts
 * @param {import('./store.js').Store} parts.store
 * @param {import('./connection.js').Connection} parts.connection
 * @param {import('./stage.js').Stage} parts.stage
 * @param {import('./hit-targets.js').HitTargets} parts.hitTargets
 * @param {HTMLElement} parts.main
 * @param {import('./world.js').World} parts.world
 * @param {import('./teacher-seat.js').TeacherSeat} parts.teacherSeat
 * @param {import('./hand.js').Hand} parts.hand
 * @param {(view: import('./lens.js').Name) => void} parts.look
 */
export function probe({ store, connection, stage, hitTargets, main, world, teacherSeat, hand, look }) {
  /** @param {number} x @param {number} y @param {number} z */
  const at = (x, y, z) => {
    const spot = hitTargets.project([x, y, z]);
    const rect = main.getBoundingClientRect();
    return spot === null ? null : { x: rect.left + spot.x, y: rect.top + spot.y };
  };
  const leo = {
    store,
    connection,
    stage,
    at,
    look,
    /** The position of a thing on the page, in CSS pixels, by its name. @param {string} name */
    screen(name) {
      const key = store.thing(name);
      const pose = key === null ? null : world.pose(key);
      return pose === null ? null : at(pose.p[0], pose.p[1], pose.p[2]);
    },
    /** @param {string} name */
    thing: (name) => store.get(store.thing(name) ?? ''),
    /** All store under a prefix, as an object. @param {string} prefix */
    under: (prefix) => Object.fromEntries(store.under(prefix)),
    seat: () => teacherSeat.seat,
    held: () => hand.held?.thing.name ?? null,
    pictures: () => stage.pictures,
  };
  Object.assign(window, { leo });
}
