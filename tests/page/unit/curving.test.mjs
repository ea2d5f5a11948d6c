// Tests the load of a wheel on a curve with cant.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CANT, curving, GRAVITY_MM_PER_S2, labelsWithCant, normalLoad, staticLoad, withLoadOfCurve } from '../../../src/http/page/web/js/curving.js';

const SPEED = 30_000;
/** @param {number} radius In mm, positive to the left. @param {string} [cant] @param {object} [contact] */
const on = (radius, cant, contact = {}) => ({
  contact: { type: 'profiles', ...contact }, load: { vertical_force_n: 75_000 },
  motion: { wheelset: { speed_mm_per_s: SPEED, yaw_rate_rad_per_s: SPEED / radius } }, ...(cant === undefined ? {} : { labels: { [CANT]: cant } }),
});
const near = (/** @type {number} */ value, /** @type {number} */ wanted, tolerance = 1e-9) => assert.ok(Math.abs(value - wanted) <= tolerance * Math.max(1, Math.abs(wanted)), `${value}, not ${wanted}`);

test('forces of a mass on a canted curve, resolved along the axes of the track', () => {
  for (const [radius, cant] of [[500_000, 100], [-500_000, 100], [-300_000, 160], [800_000, -40]]) {
    const curve = curving(on(radius, String(cant)));
    // The force per weight that the mass exerts on the track, in horizontal axes: outward (−y on a curve to the left) and down.
    const [y, z] = [-(SPEED ** 2) / radius / GRAVITY_MM_PER_S2, -1];
    // The axes of the track are rolled about x from y to z.
    const [cos, sin] = [Math.cos(curve.roll), Math.sin(curve.roll)];
    near(curve.factor, -(-y * sin + z * cos));
    const toLeft = y * cos + z * sin;
    near(curve.lateral, ((radius > 0 ? -toLeft : toLeft) * GRAVITY_MM_PER_S2) / 1000);
  }
});

test('the outer rail is the right one of a curve to the left, and raising it rolls the track from z to y', () => {
  near(curving(on(500_000, '150')).roll, -Math.asin(0.1));
  near(curving(on(-500_000, '150')).roll, Math.asin(0.1));
  near(curving(on(Infinity, '150')).roll, -Math.asin(0.1));
  near(curving(on(Infinity, '150')).factor, Math.cos(Math.asin(0.1)));
});

test('the balancing cant leaves no lateral acceleration, to the second order of the roll', () => {
  const { balancing } = curving(on(-600_000));
  near(balancing, (1500 * SPEED ** 2) / 600_000 / GRAVITY_MM_PER_S2);
  const { lateral, roll, factor } = curving(on(-600_000, String(balancing)));
  assert.ok(Math.abs(lateral) < 9.81 * Math.abs(roll) ** 3 && factor > 1);
  near(curving(on(-600_000)).lateral, 1.5);
});

test('a curve without cant leaves the load normal to the track as it is', () => {
  assert.equal(curving(on(300_000)).factor, 1);
  assert.equal(curving(on(300_000, '')).factor, 1);
});

test('running circles stand 65 mm farther apart than the gauge, or twice the origin of the rail', () => {
  assert.equal(curving(on(1e6, '', { gauge_mm: 1000 })).base, 1065);
  assert.equal(curving(on(1e6, '', { rail_origin_mm: -800 })).base, 1600);
});

test('a cant that is no number, or beyond the track, is wrong and changes nothing', () => {
  for (const cant of ['much', '1500', '-1500']) {
    assert.deepEqual([curving(on(5e5, cant)).wrong, curving(on(5e5, cant)).factor], [true, 1], cant);
  }
  assert.equal(curving(on(5e5, '100,5')).cant, 100.5);
});

test('the static load stays through changes of cant, speed and radius, and comes back to the last digit', () => {
  const first = on(500_000);
  const canted = withLoadOfCurve(first, on(500_000, '120'));
  near(canted.load.vertical_force_n, 75_000 * curving(canted).factor, 1e-11);
  assert.equal(staticLoad(canted), 75_000);
  let driven = canted;
  for (const speed of [10_000, 33_333, 0, 41_000]) {
    const wheelset = { speed_mm_per_s: speed, yaw_rate_rad_per_s: speed / 437_000 };
    driven = withLoadOfCurve(driven, { ...driven, motion: { wheelset } });
    assert.equal(staticLoad(driven), 75_000);
  }
  const { labels, ...flat } = driven;
  assert.equal(withLoadOfCurve(driven, flat).load.vertical_force_n, 75_000);
});

test('a load that is changed itself is taken as it is', () => {
  const before = on(500_000, '120');
  const after = { ...on(500_000), load: { vertical_force_n: normalLoad(80_000, curving(before)) } };
  assert.equal(withLoadOfCurve(before, after), after);
  assert.equal(withLoadOfCurve(null, before), before);
  const pressed = { ...before, load: { normal_force_n: 1 } };
  assert.deepEqual(withLoadOfCurve(on(500_000), pressed), pressed);
});

test('the cant stands among the labels of the case', () => {
  const labelled = { labels: { km: '12' } };
  assert.deepEqual(labelsWithCant(labelled, '90'), { km: '12', [CANT]: '90' });
  assert.deepEqual(labelsWithCant({ labels: labelsWithCant(labelled, '90') }, undefined), labelled.labels);
  assert.equal(labelsWithCant({ labels: { [CANT]: '90' } }, undefined), undefined);
});
