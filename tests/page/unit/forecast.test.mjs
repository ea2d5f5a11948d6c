// Tests tables of a traffic, and computations for drawings of worn sections.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { decisionOf, normalsInto } from '../../../src/http/page/web/js/forecastdata.js';
import { isTraffic, parseTraffic, rowsOf, tableOf, trafficOf } from '../../../src/http/page/web/js/traffic.js';

const SPEED = 20_000;
const CASE = { contact: { lateral_shift_mm: -3 }, friction: { coefficient: 0.4 }, motion: { wheelset: { speed_mm_per_s: SPEED } } };
/** @param {string} text */
const read = (text) => {
  const table = parseTraffic(text);
  assert.ok(typeof table !== 'string', String(table));
  return { table, ...trafficOf({ rows: [], table }, CASE) };
};

test('a table of a traffic has titles with units, in the signs and marks of its country', () => {
  const german = read('Axle load [t];shift [mm];yaw [mrad];friction;passes\n20;-1,5;2;0,35;10\n22,5;0;0;0,3;5\n');
  assert.equal(german.table.rows, 2);
  assert.ok(Math.abs(Number(german.columns['/load/vertical_force_n'][0]) - 10 * 9806.65) < 1e-6);
  assert.deepEqual(german.columns['/contact/lateral_shift_mm'], [-1.5, 0]);
  assert.deepEqual(german.columns['/contact/yaw_rad'], [0.002, 0]);
  assert.deepEqual(german.passes, [10, 5]);
  const plain = read('vertical_force_n,lateral_shift_mm,yaw_rad,/motion/wheelset/speed_mm_per_s,/contact/rolling_radius_mm\n75000,1,0.001,20000,450');
  assert.deepEqual(plain.columns, { '/load/vertical_force_n': [75000], '/contact/lateral_shift_mm': [1], '/contact/yaw_rad': [0.001], '/motion/wheelset/speed_mm_per_s': [20000], '/contact/rolling_radius_mm': [450] });
});

test('a curve radius becomes a yaw rate at the speed of its row, or of the case; texts and unknown columns are left out by name', () => {
  const { table, columns } = read('class;R [m];speed [km/h];mood\nfreight;-500;72;1\ncoach;;144;2\nlight;0.8;36;3');
  assert.deepEqual(columns['/motion/wheelset/yaw_rate_rad_per_s'], [-0.04, 0, 12.5]);
  assert.deepEqual(table.unused, ['class', 'mood']);
  assert.deepEqual(read('radius / km;Q [kN]\n1;75').columns['/motion/wheelset/yaw_rate_rad_per_s'], [0.02]);
});

test('what is wrong with a table is said with its column and row', () => {
  assert.match(String(parseTraffic('mood\ngood')), /no column of the table is known/);
  assert.match(String(parseTraffic('Q [kN],shift [mm]\n75,1\n80,x')), /row 2 of “shift \[mm\]” is not a number/);
  assert.match(String(parseTraffic('Q [furlongs]\n75')), /unit furlongs/);
  assert.match(String(parseTraffic('Q [kN]')), /row of titles and rows/);
});

test('a dropped text is a traffic where it has two columns of one, not a cross-section with titles', () => {
  assert.equal(isTraffic('Q [kN];shift [mm]\n75;1'), true);
  assert.equal(isTraffic('Q [kN];shift [mm]\n75;1\n80;x'), true);
  for (const section of ['y;z\n1;2\n3;4', '1.5 2.5\n3 4', 'y,z,weight\n0,1,1']) assert.equal(isTraffic(section), false, section);
});

test('written rows become columns in the units of the API, empty ones are left to the case, and they come back', () => {
  const row = { passes: '60', load: '75,5', speed: '', radius: '-400', shift: '-2', yaw: '', friction: '' };
  const traffic = trafficOf({ rows: [row, { ...row, passes: '40', load: '80', radius: '' }], table: null }, CASE);
  assert.deepEqual(traffic, {
    columns: { '/load/vertical_force_n': [75500, 80000], '/motion/wheelset/yaw_rate_rad_per_s': [-0.05, 0], '/contact/lateral_shift_mm': [-2, -2] }, passes: [60, 40],
  });
  const again = tableOf(/** @type {Record<string, number[]>} */ (traffic.columns), [60, 40], SPEED);
  assert.deepEqual(rowsOf(again), [{ ...row, load: '75.5' }, { ...row, passes: '40', load: '80', radius: '' }]);
  assert.deepEqual(trafficOf({ rows: [], table: again }, CASE), traffic);
});

test('an empty cell among written ones is the value of the case, and a row without a radius is straight', () => {
  const row = { passes: '', load: '75', speed: '', radius: '', shift: '', yaw: '', friction: '' };
  const rows = [row, { ...row, passes: '2', speed: '36', shift: '1', yaw: '2', friction: '0,3' }];
  const traffic = trafficOf({ rows, table: null }, CASE);
  assert.deepEqual(traffic.passes, [1, 2]);
  assert.deepEqual(traffic.columns, {
    '/load/vertical_force_n': [75000, 75000], '/motion/wheelset/speed_mm_per_s': [SPEED, 10000], '/contact/lateral_shift_mm': [-3, 1], '/contact/yaw_rad': [0, 0.002], '/friction/coefficient': [0.4, 0.3],
  });
  // In a curve, rows without a radius are straight too. The case has no load, so that an empty one is left to the service to refuse.
  const curved = { motion: { wheelset: { speed_mm_per_s: SPEED, yaw_rate_rad_per_s: 0.05 } } };
  const straight = trafficOf({ rows: [{ ...row, load: '' }, row], table: null }, curved).columns;
  assert.deepEqual(straight, { '/load/vertical_force_n': [null, 75000], '/motion/wheelset/yaw_rate_rad_per_s': [0, 0] });
});

test('a title without a unit is reported with the assumed and the allowed units', () => {
  const { table } = read('axle load;speed [m/s];shift_mm;friction;passes\n22;20;1;0.3;1');
  assert.deepEqual(table.assumed, ['“axle load” is read in kN (allowed: kN, N, t)']);
  assert.deepEqual([table.values.load, table.values.speed, table.values.shift], [[11], [72], [1]]);
});

test('of two plans the one whose first limit comes later goes on longer, if other coefficients say the same', () => {
  /** @type {(mean: number | null, earliest?: number | null, latest?: number | null) => import('../../../src/http/page/web/js/forecastdata.js').Life} */
  const life = (mean, earliest = mean, latest = mean) => ({ mean, earliest, latest });
  /** @type {(...rows: import('../../../src/http/page/web/js/forecastdata.js').Life[][]) => ReturnType<typeof decisionOf>} */
  const decide = (...rows) => decisionOf(rows.map((lives, at) => ({ key: `${at}`, label: `limit ${at}`, limit: '1 mm', lives })));
  assert.deepEqual(decide([life(5, 3, 9), life(8, 4, null)]), { better: 1, sure: true, ends: [{ place: 5, label: 'limit 0' }, { place: 8, label: 'limit 0' }] });
  // The first of several limits counts. A limit that is not reached within the extent is later than any other.
  assert.equal(decide([life(9), life(null)], [life(null), life(7)]).better, 0);
  assert.equal(decide([life(null), life(null)]).better, null);
  assert.equal(decide([life(5, 3, 9), life(8, 2, 12)]).sure, false);
});

test('normals of a section point into the body, whichever way its points run', () => {
  const head = /** @type {[number, number][]} */ (Array.from({ length: 41 }, (_, at) => [30 * Math.sin((at - 20) / 13), 30 * Math.cos((at - 20) / 13)]));
  for (const line of [head, [...head].reverse()]) {
    normalsInto(line, 'rail').forEach(([y, z], at) => assert.ok(y * line[at][0] + z * line[at][1] < 0, `${at}`));
    normalsInto(line, 'wheel').forEach(([y, z], at) => assert.ok(y * line[at][0] + z * line[at][1] > 0, `${at}`));
  }
});
