// Tests the curve of a rolling history, and lists of numbers in the form.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { curveOf } from '../../../src/http/page/web/js/curvedata.js';
import { parseList, textOf } from '../../../src/http/page/web/js/written.js';

const point = (/** @type {number} */ distance, /** @type {number} */ creepage, /** @type {number} */ force) => ({
  motion: { creepage_x: creepage, creepage_y: 0, spin_per_mm: 0 }, force_x_n: force, force_y_n: 0, moment_z_n_mm: 0,
  error_estimate: { force_x_n: 50, force_y_n: 50, moment_z_n_mm: 100 }, history: { distance_mm: distance, dissipated_n_mm: 1, creepage_x_error: 1e-5 },
});
const patch = (/** @type {object[]} */ points) => /** @type {import('../../../src/http/page/web/js/api.js').Patch} */ (/** @type {unknown} */ ({ points, normal_force_n: 10_000 }));

test('forces of a history stand over the distance rolled, in its order, jumps as well', () => {
  const rolled = patch([point(0, 0.002, 1000), point(4, -0.001, 3000), point(4, 0.003, 2000), point(9, 0, 500)]);
  const curve = curveOf(rolled, 'forces', 0.3);
  assert.equal(curve?.xLabel, 'distance rolled / mm');
  assert.deepEqual(curve?.x, [0, 4, 4, 9]);
  assert.deepEqual(curve?.order, [0, 1, 2, 3]);
  assert.deepEqual(curve?.lines[0].y, [1, 3, 2, 0.5]);
});

test('creepages of a history have the errors of those that were found', () => {
  const curve = curveOf(patch([point(0, 0.002, 1), point(4, -0.001, 1), point(9, 0, 1)]), 'creepages', 0.3);
  assert.deepEqual(curve?.lines.map(({ y }) => y.map((value) => Number(value.toFixed(9)))), [[0.2, -0.1, 0], [0, 0, 0]]);
  assert.deepEqual(curve?.lines[0].error.map((error) => Number(error?.toFixed(9))), [0.001, 0.001, 0.001]);
  assert.deepEqual(curve?.lines[1].error, [null, null, null]);
});

test('other motions stand over what varies most, whatever kind was looked at before', () => {
  const steady = [3, 1, 2].map((creepage) => ({ ...point(0, 0.001 * creepage, 1000 * creepage), history: undefined }));
  for (const kind of /** @type {const} */ (['forces', 'creepages'])) {
    const curve = curveOf(patch(steady), kind, 0.3);
    assert.equal(curve?.xLabel, 'creepage x / %');
    assert.deepEqual(curve?.order, [1, 2, 0]);
  }
});

test('lists are written with spaces, semicolons or commas, in the unit of the field', () => {
  assert.deepEqual(parseList('0  2 4.5'), [0, 2, 4.5]);
  assert.deepEqual(parseList('0; 2,5; 4', 0.01), [0, 0.025, 0.04]);
  assert.deepEqual(parseList('0,2,4'), [0, 2, 4]);
  assert.deepEqual(parseList('0, 2, 4'), [0, 2, 4]);
  assert.equal(parseList('2,5'), 2.5);
  assert.equal(parseList('  '), undefined);
  assert.deepEqual(parseList('1 two'), [1, 'two']);
  assert.deepEqual(parseList('{"from": 0, "to": 4, "points": 5}'), { from: 0, to: 4, points: 5 });
  assert.equal(parseList('{"from"'), '{"from"');
  assert.deepEqual(parseList(textOf([0, 0.025, 0.04], 0.01), 0.01), [0, 0.025, 0.04]);
});
