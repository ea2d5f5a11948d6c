// Tests the worst rows of a run, read from its table as the service writes it.
import assert from 'node:assert/strict';
import { test } from 'node:test';

// The page keeps its key in the storage of the browser.
Object.assign(globalThis, { sessionStorage: { getItem: () => null, setItem() {} } });
const { worstOf } = await import('../../../src/http/page/web/js/run.js');

test('the rows with the largest sizes are kept, whatever the order of the columns, and rows without a number are left out', () => {
  const take = worstOf('km', 'force_y_n', 2);
  const lines = ['row,km,force_x_n,force_y_n,friction_power_n,pressure_max_mpa', '0,1.5,1,-700,3,1000', '1,1.6,2,,3,1100', '2,"1,7",3,200,4,1200', '3,1.8,4,650,5,900', ''];
  /** @type {readonly import('../../../src/http/page/web/js/run.js').WorstRow[]} */
  let kept = [];
  for (const line of lines) kept = take(line);
  assert.deepEqual(kept.map(({ row, place, values }) => [row, place, values.force_y_n, values.pressure_max_mpa]), [[0, '1.5', -700, 1000], [3, '1.8', 650, 900]]);
});
