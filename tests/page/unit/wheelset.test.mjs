// The curves of a wheelset.
import assert from 'node:assert/strict';
import { test } from 'node:test';
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
