// Tests the curves of a wheelset.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { readFileSync } from 'node:fs';
import { WINDOWS, windowAt } from '../../../src/http/page/web/js/en15302.js';
import { placeOn } from '../../../src/http/page/web/js/placing.js';
import { nearest, wheelsetCurve } from '../../../src/http/page/web/js/wheelsetdata.js';

const side = (/** @type {number} */ sign) => ({ rolling_radius_mm: [459, 460, 461], contact_angle_rad: [0.02, 0.035, 0.05].map((angle) => sign * angle), rail_y_mm: [0, 0, 0], wheel_y_mm: [0, 0, 0] });
const kinematics = {
  lateral_shift_mm: [-2, 0, 2], roll_rad: [0, 0, 0], centre_height_mm: [460, 460, 460],
  radius_difference_mm: [-0.3, 0, 0.3], radius_difference_with_roll_mm: [-0.31, 0, null], radius_difference_without_roll_mm: [-0.3, 0, 0.3], profile_uncertainty_mm: [0.01, 0.02, 0.03],
  left: side(1), right: side(-1), equilibrium_shift_mm: 0, equilibrium_uncertainty_mm: 0, contact_distance_mm: 1500,
  conicity: [
    { amplitude_mm: 1, conicity: 0.1, conicity_with_roll: 0.101, conicity_harmonic: 0.102, error_estimate: 0.003, profile_uncertainty: 0.004 },
    { amplitude_mm: 2, conicity: 0.2, conicity_with_roll: 0.202, conicity_harmonic: 0.203, error_estimate: 0, profile_uncertainty: 0 },
    { amplitude_mm: 9 },
  ],
};

test('Δr stands over the shift with what the cross-sections leave open', () => {
  const curve = wheelsetCurve(kinematics, 'radii');
  assert.ok(curve);
  assert.deepEqual(curve.x, [-2, 0, 2]);
  assert.deepEqual(curve.lines.map(({ y }) => y), [[-0.3, 0, 0.3], [-0.31, 0, NaN]]);
  assert.deepEqual(curve.lines[0].error, [0.01, 0.02, 0.03]);
});

test('angles of both sides are seen with one sign, in degrees', () => {
  const lines = wheelsetCurve(kinematics, 'angles')?.lines.map(({ y }) => y.map((angle) => Math.round(1000 * angle) / 1000));
  assert.deepEqual(lines, [[1.146, 2.005, 2.865], [1.146, 2.005, 2.865]]);
});

test('an amplitude without a conicity is no point, and both errors count', () => {
  const curve = wheelsetCurve(kinematics, 'conicity');
  assert.deepEqual(curve?.x, [1, 2]);
  assert.deepEqual(curve?.lines[0].error, [0.005, 0]);
  assert.equal(wheelsetCurve({ ...kinematics, conicity: [{ amplitude_mm: 9 }] }, 'conicity'), null);
});

test('the nearest of equal values is the first', () => {
  assert.equal(nearest([0, 2, 4], 2.9), 1);
  assert.equal(nearest([1, 1], 1), 0);
});

test('windows of the conicity are those of the benchmark, and between its amplitudes in between', () => {
  const { pairs } = JSON.parse(readFileSync(new URL('../../data/en15302/benchmark.json', import.meta.url), 'utf8'));
  assert.deepEqual(Object.keys(WINDOWS), Object.keys(pairs));
  for (const [name, { amplitude_mm: amplitudes, window }] of Object.entries(pairs)) {
    for (const [at, amplitude] of amplitudes.entries()) {
      windowAt(name, amplitude)?.forEach((limit, end) => assert.ok(Math.abs(limit - window[at][end]) < 1e-9, `${name} at ${amplitude}`));
      assert.ok(windowAt(name, amplitude));
    }
  }
  assert.deepEqual(windowAt('WheelARailA', 1.1)?.map((limit) => Math.round(1e4 * limit)), [775, 1775]);
  assert.equal(windowAt('WheelARailA', 0.9), null);
  assert.equal(windowAt('', 3), null);
});

test('a place on a turned rail is found by its y on the cross-section', () => {
  /** @type {[number, number][]} */
  const own = [[-36, -20], [-35, -5], [-20, 0], [0, 1], [20, 0], [35, -5], [36, -20]];
  const cant = 0.05;
  for (const side of /** @type {const} */ (['left', 'right'])) {
    const sign = side === 'left' ? 1 : -1;
    // The points are turned with their top toward the track centre, and lie 750 mm from it.
    const laid = own.map(([f, u]) => /** @type {[number, number]} */ ([sign * (750 + f * Math.cos(cant) - u * Math.sin(cant)), f * Math.sin(cant) + u * Math.cos(cant)]));
    const on = placeOn(laid, laid[3], 0, side, cant);
    for (const [at, [f]] of own.entries()) if (Math.abs(f) <= 20) assert.ok(Math.hypot(on(f)[0] - laid[at][0], on(f)[1] - laid[at][1]) < 1e-9, `${side} ${f}`);
  }
});
