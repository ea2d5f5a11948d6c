// Tables of a traffic, and what is drawn of sections that wear.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { normalsInto } from '../../../src/http/page/web/js/forecastdata.js';
import { parseTraffic, trafficOf } from '../../../src/http/page/web/js/traffic.js';

test('a table of a traffic has titles with units, in the signs and marks of its country', () => {
  const german = parseTraffic('Axle load [t];shift [mm];yaw [mrad];friction;passes\n20;-1,5;2;0,35;10\n22,5;0;0;0,3;5\n');
  assert.ok(typeof german !== 'string', String(german));
  assert.equal(german.rows, 2);
  assert.ok(Math.abs(german.columns['/load/vertical_force_n'][0] - 10 * 9806.65) < 1e-6);
  assert.deepEqual(german.columns['/contact/lateral_shift_mm'], [-1.5, 0]);
  assert.deepEqual(german.columns['/contact/yaw_rad'], [0.002, 0]);
  assert.deepEqual(german.passes, [10, 5]);
  const plain = parseTraffic('vertical_force_n,lateral_shift_mm,yaw_rad,/motion/wheelset/speed_mm_per_s\n75000,1,0.001,20000');
  assert.ok(typeof plain !== 'string', String(plain));
  assert.deepEqual(plain.columns, { '/load/vertical_force_n': [75000], '/contact/lateral_shift_mm': [1], '/contact/yaw_rad': [0.001], '/motion/wheelset/speed_mm_per_s': [20000] });
});

test('what is wrong with a table is said with its column and row', () => {
  assert.match(String(parseTraffic('Q [kN],mood\n75,good')), /“mood” is not known/);
  assert.match(String(parseTraffic('Q [kN],shift [mm]\n75,1\n80,x')), /row 2 of “shift \[mm\]” is no number/);
  assert.match(String(parseTraffic('Q [furlongs]\n75')), /unit furlongs/);
  assert.match(String(parseTraffic('Q [kN]')), /row of titles and rows/);
});

test('written rows become columns in the units of the API, empty ones are left to the case', () => {
  const row = { passes: '60', load: '75,5', shift: '-2', yaw: '', friction: '' };
  assert.deepEqual(trafficOf({ rows: [row, { ...row, passes: '40', load: '80' }], table: null }), {
    columns: { '/load/vertical_force_n': [75500, 80000], '/contact/lateral_shift_mm': [-2, -2] }, passes: [60, 40],
  });
});

test('normals of a section point into the body, whichever way its points run', () => {
  const head = /** @type {[number, number][]} */ (Array.from({ length: 41 }, (_, at) => [30 * Math.sin((at - 20) / 13), 30 * Math.cos((at - 20) / 13)]));
  for (const line of [head, [...head].reverse()]) {
    normalsInto(line, 'rail').forEach(([y, z], at) => assert.ok(y * line[at][0] + z * line[at][1] < 0, `${at}`));
    normalsInto(line, 'wheel').forEach(([y, z], at) => assert.ok(y * line[at][0] + z * line[at][1] > 0, `${at}`));
  }
});
