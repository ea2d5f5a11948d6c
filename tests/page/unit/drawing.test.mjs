// What drawings compute, what files say, and the order of a case.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { gapOf } from '../../../src/http/page/web/js/placing.js';
import { inOrder } from '../../../src/http/page/web/js/starts.js';
import { parseGapCurve, parseGrid, profileKind } from '../../../src/http/page/web/js/tables.js';

test('the gap is the vertical distance of the lower side of the wheel from the upper side of the rail', () => {
  /** @type {[number, number][]} */
  const rail = [[-5, -10], [-5, 0], [5, 0], [5, -10]];
  // The wheel's flange hangs beside the rail; its tread rises to the left.
  /** @type {[number, number][]} */
  const wheel = [[-8, 2], [-7, -6], [-6, 1], [6, 4]];
  const gap = gapOf(rail, wheel);
  assert.ok(gap.every(([y]) => y >= -5 && y <= 5));
  for (const [y, distance] of gap) assert.ok(Math.abs(distance - (1 + (y + 6) / 4)) < 1e-9, `${y}: ${distance}`);
  assert.equal(gap.length, 51);
});

test('files of gaps and grids are read whatever separates their numbers', () => {
  assert.deepEqual(parseGapCurve('# y gap\n3; 0.2\n-3\t0.1\n0, 0\n'), { y_mm: [-3, 0, 3], gap_mm: [0.1, 0, 0.2] });
  assert.equal(parseGapCurve('1\n2\n3'), null);
  const grid = parseGrid(',1,2,3\n20, 4,5,6\n10, 7,8,9\n');
  assert.deepEqual(grid, { x_mm: [1, 2, 3], y_mm: [10, 20], values: [[7, 8, 9], [4, 5, 6]] });
  assert.deepEqual(parseGrid('0 1 2\n10 7 8\n20 9 1')?.x_mm, [1, 2]);
  assert.equal(parseGrid('0 1 2\n10 7 8\n20 9'), null);
});

test('the name of a file tells its format and body', () => {
  assert.deepEqual(profileKind('worn.BAN'), { format: 'miniprof', body: 'rail' });
  assert.deepEqual(profileKind('left.whl'), { format: 'miniprof', body: 'wheel' });
  assert.deepEqual(profileKind('a.prw'), { format: 'simpack', body: 'wheel' });
  assert.deepEqual(profileKind('my-rail.csv'), { format: 'columns', body: 'rail' });
  assert.deepEqual(profileKind('x.txt'), { format: 'columns', body: null });
});

test('a case is written in the order that a person would choose, and loses nothing', () => {
  const document = { outputs: [], contact: { lateral_mm: 1, type: 'radii' }, extra: 1, name: 'x', motion: {} };
  const ordered = inOrder(document);
  assert.deepEqual(Object.keys(ordered), ['name', 'contact', 'motion', 'outputs', 'extra']);
  assert.deepEqual(Object.keys(/** @type {object} */ (ordered.contact)), ['type', 'lateral_mm']);
  assert.deepEqual(ordered, document);
});
