// Tests the comparison of cross-sections: the worn area of known shapes, and a fit that finds a known shift.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { bestFit, wearBetween } from '../../../src/http/page/web/js/wear.js';
import { flangeAngle, nadal } from '../../../src/http/page/web/js/wheelloads.js';

/** The head of a rail: an arc of 300 mm radius, 60 mm wide, with faces of 20 mm. */
const arc = Array.from({ length: 121 }, (_, i) => -30 + i / 2).map((y) => /** @type {[number, number]} */ ([y, Math.sqrt(300 ** 2 - y * y) - 300]));
const head = /** @type {[number, number][]} */ ([[-30, -21.5], ...arc, [30, -21.5]]);

test('a groove in the head is worn by its area and its depth, in whichever sense the line runs', () => {
  // Half a cosine wave of 20 mm length and 1 mm depth has an area of 10 mm².
  const worn = head.map(([y, z]) => /** @type {[number, number]} */ ([y, Math.abs(y) < 10 ? z - 0.5 * (1 + Math.cos((Math.PI * y) / 10)) : z]));
  for (const [one, two] of [[head, worn], [[...head].reverse(), worn], [head, [...worn].reverse()]]) {
    const wear = wearBetween(one, two, 'rail', [0, 0]);
    assert.ok(Math.abs(wear.area - 10) < 0.1, `${wear.area}`);
    assert.ok(wear.added < 0.05, `${wear.added}`);
    assert.ok(wear.most && Math.abs(wear.most.depth - 1) < 0.01 && Math.abs(wear.most.at[0]) < 0.3);
  }
  // With the sections exchanged, the groove is added material.
  const grown = wearBetween(worn, head, 'rail', [0, 0]);
  assert.ok(grown.area < 0.05 && Math.abs(grown.added - 10) < 0.1);
  // The material of a wheel is above its line.
  const wheel = (/** @type {[number, number][]} */ line) => line.map(([y, z]) => /** @type {[number, number]} */ ([y, -z]));
  assert.ok(Math.abs(wearBetween(wheel(head), wheel(worn), 'wheel', [0, 0]).area - 10) < 0.1);
});

test('a fit finds the shift of a rail whose whole gauge side is worn', () => {
  // The gauge face lies 1 mm further back, and the head up to its middle is 0.8 mm lower.
  const worn = head.map(([y, z]) => /** @type {[number, number]} */ ([y === -30 ? -29 : y, y < 2 ? z - 0.8 : z]));
  const moved = worn.map(([y, z]) => /** @type {[number, number]} */ ([y + 1.3, z - 0.7]));
  const [y, z] = bestFit(head, moved, 'rail');
  assert.ok(Math.abs(y + 1.3) < 0.1 && Math.abs(z - 0.7) < 0.03, `${y}, ${z}`);
});

test('the worn area of sections with the same unworn points is not changed by their alignment', () => {
  // A head with corners of 13 mm radius, in points 0.34 mm apart, a worn gauge corner, a cosine wave of 10 mm length and 0.3 mm depth, and a top that
  // is worn by 0.06 mm up to 13 mm on the field side, 28 % of it.
  const corner = (/** @type {number} */ side) => Array.from({ length: 61 }, (_, at) => (at / 60) * (Math.PI / 2)).map((angle) => /** @type {[number, number]} */ ([side * (23 + 13 * Math.sin(angle)), 13 * Math.cos(angle) - 13]));
  const top = Array.from({ length: 183 }, (_, at) => /** @type {[number, number]} */ ([-22.75 + at / 4, 0]));
  const rail = [...corner(-1).reverse(), ...top, ...corner(1)];
  const worn = rail.map(([y, z]) => /** @type {[number, number]} */ ([y, z - 0.06 * Math.max(0, Math.min(1, 7 - Math.abs(y) / 2)) - (Math.abs(y + 24) < 5 ? 0.15 * (1 + Math.cos((Math.PI * (y + 24)) / 5)) : 0)]));
  const wear = wearBetween(rail, worn, 'rail', bestFit(rail, worn, 'rail'));
  assert.ok(Math.abs(wear.area - 3.06) < 0.01 && wear.added < 0.01, `${wear.area} ${wear.added}`);
});

test('a fit finds the shift of a hollow wheel by the back of its flange, and of a wheel without a back by all of it', () => {
  // The back of a flange, its tip as half a circle, its flank, and a tread of 1:20.
  const tip = Array.from({ length: 31 }, (_, i) => (i / 30) * Math.PI).map((angle) => /** @type {[number, number]} */ ([-55 - 14 * Math.cos(angle), -14 - 14 * Math.sin(angle)]));
  const wheel = /** @type {[number, number][]} */ ([[-69, 10], [-69, -2], ...tip, [-38, -2], ...Array.from({ length: 90 }, (_, i) => /** @type {[number, number]} */ ([-36 + i, i / 20]))]);
  const hollow = wheel.map(([y, z]) => /** @type {[number, number]} */ ([y + 0.6, (y > -36 ? z + 1 : z) + 0.4]));
  const [y, z] = bestFit(wheel, hollow, 'wheel');
  assert.ok(Math.abs(y + 0.6) < 0.05 && Math.abs(z + 0.4) < 0.05, `${y}, ${z}`);
  const bare = wheel.slice(20);
  const [y1, z1] = bestFit(bare, bare.map(([a, b]) => /** @type {[number, number]} */ ([a + 0.6, b + 0.4])), 'wheel');
  assert.ok(Math.abs(y1 + 0.6) < 0.05 && Math.abs(z1 + 0.4) < 0.05, `${y1}, ${z1}`);
});

test('the angle of a flange is that of its flank, and Nadal\'s limit follows from it', () => {
  const radians = (70 * Math.PI) / 180;
  // Tread, flank of 70° and 20 mm height, and back. On the right wheel the field side is at negative y.
  const flank = Array.from({ length: 21 }, (_, i) => /** @type {[number, number]} */ ([-720 - (i - 20) / Math.tan(radians), -20 + i]));
  const wheel = /** @type {[number, number][]} */ ([[-700, 10], [-700, -20], ...flank, ...Array.from({ length: 60 }, (_, i) => /** @type {[number, number]} */ ([-721 - i, i / 40]))]);
  wheel.sort(() => 0);
  assert.ok(Math.abs(flangeAngle(wheel, 'right') - radians) < 0.02, `${(flangeAngle(wheel, 'right') * 180) / Math.PI}`);
  // The face of the rim is steep too.
  assert.ok(Math.abs(flangeAngle([...wheel, [-780.01, 40]], 'right') - radians) < 0.02);
  assert.ok(Number.isNaN(flangeAngle(wheel.filter(([, z]) => z >= 0), 'right')));
  assert.ok(Math.abs(nadal(radians, 0.3) - 1.342) < 2e-3);
});
