// Task 1 of the study for the fake of Leo.

export const COLOURS = [
  { name: 'red', rgb: [0.8, 0.05, 0.05] },
  { name: 'green', rgb: [0.05, 0.55, 0.1] },
  { name: 'blue', rgb: [0.05, 0.15, 0.8] },
  { name: 'yellow', rgb: [0.85, 0.7, 0.05] },
  { name: 'wood', rgb: [0.55, 0.35, 0.18] },
];

export const KINDS = [
  { name: 'square', role: 'block', half: [0.03, 0.03, 0.03], shape: [0, 0, 0, 0], hole: true, markable: false },
  { name: 'triangle', role: 'block', half: [0.03, 0.03, 0.03], shape: [0, 0, 0, 1], hole: false, markable: true },
  { name: 'bridge', role: 'block', half: [0.05, 0.022, 0.025], shape: [0.5, 0, 0.5, 0], hole: false, markable: true },
  { name: 'cylinder', role: 'block', half: [0.03, 0.03, 0.03], shape: [0, 0, 1, 0], hole: false, markable: true },
  { name: 'peg', role: 'peg', half: [0.011, 0.011, 0.025], shape: [1, 0, 1, 0], hole: false, markable: false },
  { name: 'marker', role: 'marker', half: [0.016, 0.016, 0.006], shape: [0, 1, 1, 0], hole: false, markable: false },
];

/** @param {number} y */
const pegs = (y) => [-0.27, -0.18, -0.09, 0, 0.09, 0.18, 0.27].map((x, n) => [`peg ${n + 1}`, 'peg', 'wood', x, y]);

export const TABLES = [
  {
    objects: [
      ['red', 'square', 'red', -0.35, 0.75], ['green', 'square', 'green', -0.1, 0.85],
      ['yellow', 'square', 'yellow', 0.15, 0.7], ['red 2', 'square', 'red', 0.38, 0.9],
      ['blue', 'square', 'blue', 0.1, 0.4], ...pegs(1.1),
    ],
    occluders: [['wall', [-0.08, 0.5, 0], [0.28, 0.52, 0.25]]],
    script: [
      [1, 'say', 'Leo, I can teach you to do task 1'], [1.5, 'move', 'peg 1', 'red'], [3, 'move', 'peg 3', 'green'],
      [4.5, 'move', 'peg 5', 'yellow'], [6, 'move', 'peg 7', 'red 2'], [7.5, 'say', 'Task 1 is done'],
    ],
  },
  {
    objects: [
      ['green', 'square', 'green', 0.35, 0.75], ['yellow', 'square', 'yellow', -0.3, 0.9],
      ['red', 'square', 'red', -0.05, 0.72], ['yellow 2', 'square', 'yellow', 0.15, 0.95],
      ['blue', 'square', 'blue', -0.25, 0.42], ...pegs(1.1),
    ],
    occluders: [['wall', [-0.43, 0.52, 0], [-0.07, 0.54, 0.25]]],
    script: [
      [1, 'say', 'Leo, I can teach you to do task 1'], [1.5, 'move', 'peg 7', 'green'], [3, 'move', 'peg 1', 'yellow'],
      [4.5, 'move', 'peg 3', 'red'], [6, 'move', 'peg 5', 'yellow 2'], [7.5, 'say', 'Task 1 is done'],
    ],
  },
  {
    objects: [
      ['blue', 'square', 'blue', -0.26, 0.46], ['red', 'square', 'red', -0.13, 0.46], ['green', 'square', 'green', 0, 0.46],
      ['blue 2', 'square', 'blue', 0.13, 0.46], ['yellow', 'square', 'yellow', 0.26, 0.46], ...pegs(0.3),
    ],
    occluders: [],
    script: [[1.5, 'say', 'Leo, do task 1']],
  },
];
