// The region of the table that contains all objects, in discrete steps so that pictures of it do not jitter. Pure.

const STEP_M = 0.05;
const MIN_HALF_M = /** @type {[number, number]} */ ([0.3, 0.22]);

/**
 * @param {{p: number[] | null, half?: number[] | null}[]} things
 * @returns {import('./lens.js').Extent}
 */
export function extent(things) {
  const placed = things.filter((thing) => thing.p);
  if (placed.length === 0) return { centre: [0, 0.7], half: [0.5, 0.4] };
  const bounds = [0, 1].map((axis) => {
    const min = Math.min(...placed.map(({ p, half }) => (p?.[axis] ?? 0) - (half?.[axis] ?? 0.03)));
    const max = Math.max(...placed.map(({ p, half }) => (p?.[axis] ?? 0) + (half?.[axis] ?? 0.03)));
    const [from, to] = [Math.floor(min / STEP_M) * STEP_M, Math.ceil(max / STEP_M) * STEP_M];
    return { centre: (from + to) / 2, half: Math.max(MIN_HALF_M[axis], (to - from) / 2) };
  });
  return { centre: [bounds[0].centre, bounds[1].centre], half: [bounds[0].half, bounds[1].half] };
}
