// Curves of a wheelset: Δr and contact angles over its shift, and equivalent conicity over the amplitude.

import { windowAt } from './en15302.js';

/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./curvedata.js').Curve} Curve */
/** @typedef {NonNullable<NonNullable<JobResult['wheelset']>['kinematics']>} Kinematics */
/** @typedef {'radii' | 'angles' | 'conicity'} Kind */

export const KINDS = /** @type {const} */ ([['radii', 'Δr'], ['angles', 'Contact angles'], ['conicity', 'Conicity']]);

const DEGREE = Math.PI / 180;

/**
 * Returns a curve of the rigid wheelset without yaw.
 * @param {Kinematics} kinematics
 * @param {Kind} kind
 * @param {string} [pair] Pair of EN 15302 whose window is drawn with the conicity.
 * @returns {Curve | null} Null if there are fewer than two values.
 */
export function wheelsetCurve(kinematics, kind, pair = '') {
  const curve = kind === 'conicity' ? conicity(kinematics, pair) : overShift(kinematics, kind);
  return curve.x.length > 1 ? curve : null;
}

/** @param {Kinematics} kinematics @param {'radii' | 'angles'} kind @returns {Curve} */
function overShift(kinematics, kind) {
  const { lateral_shift_mm: shifts, left, right } = kinematics;
  const none = shifts.map(() => null);
  const degrees = (/** @type {number[]} */ angles) => angles.map((angle) => Math.abs(angle) / DEGREE);
  return {
    xLabel: 'shift to the left / mm',
    yLabel: kind === 'radii' ? 'left less right rolling radius / mm' : 'contact angle / °',
    x: shifts,
    order: [...shifts.keys()],
    lines: kind === 'radii'
      ? [
        { label: 'Δr', unit: 'mm', colour: '--c1', y: kinematics.radius_difference_mm, error: kinematics.profile_uncertainty_mm },
        { label: 'with roll', unit: 'mm', colour: '--c2', dash: [7, 4], y: shifts.map((_, at) => kinematics.radius_difference_with_roll_mm?.[at] ?? NaN), error: none },
      ]
      : [
        { label: 'left', unit: '°', colour: '--c1', y: degrees(left.contact_angle_rad), error: none },
        { label: 'right', unit: '°', colour: '--c2', dash: [7, 4], y: degrees(right.contact_angle_rad), error: none },
      ],
    bound: NaN,
  };
}

/** Returns the curve of the conicity. Amplitudes without a stable equilibrium, or outside the computed shifts, have no conicity. @param {Kinematics} kinematics @param {string} pair @returns {Curve} */
function conicity(kinematics, pair) {
  const known = kinematics.conicity.filter((of) => typeof of.conicity === 'number');
  const of = (/** @type {'conicity' | 'conicity_with_roll' | 'conicity_harmonic'} */ name) => known.map((at) => at[name] ?? NaN);
  const none = known.map(() => null);
  const limit = (/** @type {0 | 1} */ end) => known.map(({ amplitude_mm }) => windowAt(pair, amplitude_mm)?.[end] ?? NaN);
  return {
    xLabel: 'amplitude / mm',
    yLabel: 'equivalent conicity',
    x: known.map((at) => at.amplitude_mm),
    order: [...known.keys()],
    lines: [
      { label: 'EN 15302', unit: '', colour: '--c1', y: of('conicity'), error: known.map((at) => Math.hypot(at.error_estimate ?? 0, at.profile_uncertainty ?? 0)) },
      { label: 'with roll', unit: '', colour: '--c2', dash: [7, 4], y: of('conicity_with_roll'), error: none },
      { label: 'harmonic', unit: '', colour: '--c3', dash: [2, 3], y: of('conicity_harmonic'), error: none },
      ...(pair ? [
        { label: 'window from', unit: '', colour: '--bad', dash: [5, 3], y: limit(0), error: none },
        { label: 'to', unit: '', colour: '--bad', dash: [5, 3], y: limit(1), error: none },
      ] : []),
    ],
    bound: NaN,
  };
}

/** Returns the index of the value nearest to the wanted one. @param {readonly number[]} values @param {number} wanted */
export const nearest = (values, wanted) =>
  values.reduce((best, value, at) => (Math.abs(value - wanted) < Math.abs(values[best] - wanted) ? at : best), 0);

/** Returns the amplitudes in mm at which the conicity is outside the window of a pair of EN 15302, and the number of those inside. @param {Kinematics} kinematics @param {string} pair */
export function againstWindow({ conicity }, pair) {
  /** @type {number[]} */
  const outside = [];
  let inside = 0;
  for (const { amplitude_mm: amplitude, conicity: value } of conicity) {
    const window = windowAt(pair, amplitude);
    if (!window || typeof value !== 'number') continue;
    if (value < window[0] || value > window[1]) outside.push(amplitude);
    else inside += 1;
  }
  return { inside, outside };
}
