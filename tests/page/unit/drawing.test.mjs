// What drawings compute: placed cross-sections, the ellipse of Hertz, tables of files.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { ellipseOf, hertz } from '../../../src/http/page/web/js/hertz.js';
import { parseGapCurve, parseGrid, profileKind } from '../../../src/http/page/web/js/tables.js';

/** @param {string} name */
const example = (name) => JSON.parse(readFileSync(new URL(`../../../api/examples/${name}.case.json`, import.meta.url), 'utf8'));

test('the ellipse is that of Hertz', () => {
  // Semi-axes and pressure of the service for this example.
  const { a, b, pressure } = /** @type {{ a: number, b: number, pressure: number }} */ (ellipseOf(example('hertz-steel')));
  assert.ok(Math.abs(a - 7.192892) < 2e-4, `${a}`);
  assert.ok(Math.abs(b - 5.410653) < 2e-4, `${b}`);
  assert.ok(Math.abs(pressure - 1226.84) < 0.1, `${pressure}`);
  assert.equal(ellipseOf({ contact: { type: 'radii', rolling_mm: 460 } }), null);
});

test('equal radii give a circle, and the force changes the axes by its cube root', () => {
  const one = hertz(300, 299.999999, 1000, 1e5);
  assert.ok(Math.abs(one.long / one.short - 1) < 1e-3);
  const eight = hertz(900, 300, 8000, 1e5);
  assert.ok(Math.abs(eight.long / hertz(900, 300, 1000, 1e5).long - 2) < 1e-9);
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
