import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Store } from '../src/store.js';
import { Lessons, lessonName, recordingWords } from '../src/lessons.js';
import { furnish } from './document.mjs';

const lesson = (id, title, more = {}) => ({ id, title, watch: '', ...more });
const workspace = (id, title) => ({ lesson: id, title, watch: '', simulated: true, mode: 'script', table: null, tables: 1 });

/** The lesson panel while `own.toml` plays, and the requests sent. */
function picker(answer = {}) {
  const buttons = ['play', 'clear', 'undo', 'record', 'keep', 'save', 'save-cancel'];
  const ids = furnish({ menu: 'button',
    lesson: 'select', lay: 'select', watch: 'p', mode: 'p', 'save-dialog': 'dialog', 'save-title': 'input', 'save-form': 'form',
    ...Object.fromEntries(buttons.map((id) => [id, 'button'])),
  });
  const asked = [];
  const shown = [];
  const cells = new Store();
  const ask = async (what, content) => {
    asked.push([what, content]);
    return answer;
  };
  new Lessons(cells, ask, { show: (text) => shown.push(text) });
  const apply = (changed) => cells.apply({ version: 1, fresh: false, cells: changed });
  apply({ workspace: workspace('', 'My own'), lessons: [lesson('', 'My own'), lesson('task1', 'Task 1'), lesson('task2', 'Task 2')] });
  const pick = async (value) => {
    ids.lesson.value = value;
    await ids.lesson.listeners.change();
  };
  const values = () => ids.lesson.children.map((option) => option.attributes.value);
  return { ids, asked, shown, apply, pick, values };
}

test('the lesson that Leo was started with can be chosen again after another one', async () => {
  const { ids, asked, apply, pick, values } = picker();
  assert.equal(ids.lesson.value, '');
  document.activeElement = ids.lesson;
  await pick('task2');
  apply({ workspace: workspace('task2', 'Task 2') });
  assert.deepEqual([ids.lesson.value, values()], ['task2', ['', 'task1', 'task2']]);
  await pick('');
  assert.deepEqual(asked, [['open', { lesson: 'task2' }], ['open', { lesson: '' }]]);
});

test('a list that has become another one shows the lesson that is open, with the focus and without', () => {
  for (const focused of [false, true]) {
    const { ids, apply, values } = picker();
    apply({ workspace: workspace('task2', 'Task 2') });
    document.activeElement = focused ? ids.lesson : null;
    apply({ lessons: [lesson('task1', 'Task 1'), lesson('task2', 'Task 2'), lesson('by_hand', 'By hand')] });
    assert.deepEqual([ids.lesson.value, values()], ['task2', ['task1', 'task2', 'by_hand']]);
  }
});

test('who is choosing is not disturbed by a list that is the same', () => {
  const { ids, apply } = picker();
  document.activeElement = ids.lesson;
  ids.lesson.value = 'task1';
  apply({ workspace: { ...workspace('', 'My own'), table: 0 } });
  assert.equal(ids.lesson.value, 'task1');
});

test('a lesson that cannot be opened says why, and the open one stays', async () => {
  const { ids, asked, shown, apply, pick } = picker();
  apply({ lessons: [lesson('', 'My own'), lesson('broken', 'broken', { error: 'broken.toml:3:1: no key' })] });
  assert.match(ids.lesson.lastElementChild.textContent, /^broken: cannot be opened$/);
  await pick('broken');
  assert.deepEqual([shown, asked, ids.lesson.value], [['broken.toml:3:1: no key'], [], '']);
  const refused = picker({ error: 'no room' });
  await refused.pick('task1');
  assert.equal(refused.ids.lesson.value, '');
});

test('lessons of one title are told apart by their names', () => {
  const all = [lesson('', 'By hand'), lesson('by_hand', 'By hand'), lesson('by_hand_2', 'By hand'), lesson('task1', 'Task 1')];
  assert.deepEqual(all.map((_, at) => lessonName(all, at)), ['By hand', 'By hand (by_hand)', 'By hand (by_hand_2)', 'Task 1']);
});

test('frames that did not get into a recording are told', () => {
  assert.equal(recordingWords({ seconds: 3.4, bytes: 2e6, dropped: 0 }), 'Recording 3 s, 2.0 MB');
  assert.equal(recordingWords({ seconds: 3.4, bytes: 2e6, dropped: 7 }), 'Recording 3 s, 2.0 MB, 7 dropped');
});

/** The recording controls, and the messages shown. */
function recorder() {
  const { ids, shown, apply } = picker();
  // The parts of a button that the minimal DOM lacks.
  const label = new ids.record.constructor('span');
  label.setAttribute('class', 'label');
  ids.record.append(label);
  const record = (on, file, more = {}) => apply({ recording: { on, file, seconds: 0, bytes: 0, dropped: 0, error: null, ...more } });
  return { shown, record };
}

test('where a recording is, is told once all of it is written, and what was dropped of it', () => {
  const { shown, record } = recorder();
  record(false, 'a.mcap');
  record(true, 'b.mcap');
  record(true, 'b.mcap', { seconds: 1 });
  record(false, 'a.mcap');
  assert.deepEqual(shown, []);
  record(false, 'b.mcap');
  record(false, 'b.mcap', { seconds: 0.1 });
  assert.deepEqual(shown.splice(0), ['The recording is in b.mcap']);
  for (const [file, dropped] of [['c.mcap', 1], ['d.mcap', 7]]) {
    record(true, file);
    record(false, file, { dropped });
  }
  assert.deepEqual(shown, ['The recording is in c.mcap; 1 frame was dropped', 'The recording is in d.mcap; 7 frames were dropped']);
});

test('of a recording that failed only the error is told', () => {
  const { shown, record } = recorder();
  record(true, 'b.mcap');
  record(false, 'a.mcap');
  record(false, 'a.mcap', { error: 'no space left' });
  record(false, 'b.mcap');
  assert.deepEqual(shown, ['no space left']);
});

test('a lesson that has ended plays no more', () => {
  const { ids, apply } = picker();
  apply({ workspace: { ...workspace('task1', 'Task 1'), mode: 'over', table: 0 } });
  assert.equal(ids.mode.textContent, 'The lesson has ended, table 1');
});

test('the caption of a lesson stands beside its own tables only', () => {
  const { ids, apply } = picker();
  const about = { ...workspace('task1', 'Task 1'), watch: 'A blue block lies behind a wall.', mode: 'teaching' };
  apply({ workspace: { ...about, table: 0 } });
  assert.deepEqual([ids.watch.textContent, ids.watch.hidden], ['A blue block lies behind a wall.', false]);
  apply({ workspace: { ...about, table: null } });
  assert.deepEqual([ids.watch.textContent, ids.watch.hidden], ['', true]);
  apply({ workspace: { ...about, table: null, lacks: '`partners = 2`' } });
  assert.equal(ids.watch.textContent, 'This lesson needs `partners = 2` in leo.toml.');
});
