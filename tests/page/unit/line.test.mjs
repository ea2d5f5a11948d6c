// Tests the rows of the view Line, read from the lines of a table.
import assert from 'node:assert/strict';
import { test } from 'node:test';

// The page keeps its key in the storage of the browser.
Object.assign(globalThis, { sessionStorage: { getItem: () => null, setItem() {} } });
const { numericLabels, rowReader, splitLine, worstRows } = await import('../../../src/http/page/web/js/line.js');

const LINES = [
  'id,index,point,patch,normal_force_n,force_x_n,force_y_n,friction_power_n,pressure_max_mpa,area_mm2,stick_share,label:km,label:line',
  'a,0,0,0,100,3,4,2,900,10,0.5,36.1,"A, 12"',
  'a,0,0,1,300,0,15,4,1100,30,0.1,36.1,"A, 12"',
  'a,0,1,0,100,9,9,9,9999,10,0.5,36.1,"A, 12"',
  'b,1,,,,,,,,,,36.2,A12',
  'c,2,0,0,50,5,0,1,700,5,,36.3,A12',
];

test('the patches of a job make one row, of its first motion', () => {
  const take = rowReader(['km', 'line']);
  const rows = [...LINES, ''].flatMap((line) => take(line) ?? []);
  assert.deepEqual(rows.map(({ id }) => id), ['a', 'c']);
  assert.deepEqual(rows[0], { id: 'a', index: 0, labels: { km: '36.1', line: 'A, 12' }, wear: 6, used: 5, pressure: 1100, stick: 20 });
  assert.ok(Number.isNaN(rows[1].stick), 'what was not asked for is not 0');
  assert.deepEqual(numericLabels(rows), ['km']);
  const line = { rows, by: 'km', worst: 'pressure', zoom: { from: 36.2, to: 40 }, batch: '', count: 2, done: true, labels: ['km'], limits: {} };
  assert.deepEqual(worstRows(line, 8).map(({ id }) => id), ['c']);
});

test('cells may be quoted', () => {
  assert.deepEqual(splitLine('a,"b,""c""",,d'), ['a', 'b,"c"', '', 'd']);
  assert.deepEqual(splitLine(''), ['']);
});
