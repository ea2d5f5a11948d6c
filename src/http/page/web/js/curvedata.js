// Data of a creep curve: forces or moment of a patch over the component of motion that varies most, or over the distance rolled
// of a transient.

/** @typedef {import('./api.js').Patch} Patch */

/** @typedef {{ label: string, unit: string, colour: string, dash?: number[], y: number[], error: (number | null)[] }} Line */

/**
 * @typedef {object} Curve
 * @property {string} xLabel
 * @property {string} yLabel
 * @property {number[]} x Increasing.
 * @property {number[]} order Index of the motion of each value.
 * @property {Line[]} lines
 * @property {number} bound The bound of friction μN in kN; NaN for none.
 */

const MOTIONS = /** @type {const} */ ([
  { key: 'creepage_x', label: 'creepage x / %', factor: 0.01 },
  { key: 'creepage_y', label: 'creepage y / %', factor: 0.01 },
  { key: 'spin_per_mm', label: 'spin / (1/m)', factor: 0.001 },
]);

/** @typedef {'forces' | 'moment' | 'creepages'} CurveKind */

/** Returns whether the motions of a patch are consecutive states of transient rolling. @param {Patch} patch */
export const isHistory = ({ points }) => points.every(({ history }) => history);

/**
 * Returns the motions in the order of the axis, with their positions.
 * @param {Patch} patch
 * @returns {{ xLabel: string, x: number[], order: number[] }}
 */
function places(patch) {
  const { points } = patch;
  if (isHistory(patch)) return { xLabel: 'distance rolled / mm', x: points.map(({ history }) => history?.distance_mm ?? 0), order: [...points.keys()] };
  const values = MOTIONS.map(({ key, factor }) => points.map(({ motion }) => (motion[key] ?? 0) / factor));
  const spreads = values.map((of) => Math.max(...of) - Math.min(...of));
  const most = spreads.indexOf(Math.max(...spreads));
  const order = [...points.keys()].sort((one, two) => values[most][one] - values[most][two]);
  return { xLabel: MOTIONS[most].label, x: order.map((at) => values[most][at]), order };
}

/**
 * Returns the creepages, prescribed or computed, over the distance rolled.
 * @param {Patch} patch
 * @returns {Curve}
 */
function creepageCurve(patch) {
  const { points } = patch;
  const known = (/** @type {number | null | undefined} */ value) => (typeof value === 'number' ? 100 * value : null);
  return {
    ...places(patch),
    yLabel: 'creepage / %',
    lines: [
      { label: 'creepage x', unit: '%', colour: '--c1', y: points.map(({ motion }) => 100 * (motion.creepage_x ?? 0)), error: points.map(({ history }) => known(history?.creepage_x_error)) },
      { label: 'creepage y', unit: '%', colour: '--c2', dash: [7, 4], y: points.map(({ motion }) => 100 * (motion.creepage_y ?? 0)), error: points.map(({ history }) => known(history?.creepage_y_error)) },
    ],
    bound: NaN,
  };
}

/**
 * Returns the curve of a patch.
 * @param {Patch} patch
 * @param {CurveKind} kind `creepages` applies to transient rolling only.
 * @param {number} friction
 * @returns {Curve | null} Null for fewer than three motions.
 */
export function curveOf(patch, kind, friction) {
  const { points } = patch;
  if (points.length < 3) return null;
  if (kind === 'creepages' && isHistory(patch)) return creepageCurve(patch);
  const { xLabel, x, order } = places(patch);
  /** @type {(name: 'force_x_n' | 'force_y_n' | 'moment_z_n_mm', look: Pick<Line, 'label' | 'unit' | 'colour' | 'dash'>) => Line} */
  const line = (name, look) => ({
    ...look,
    y: order.map((at) => points[at][name] / 1000),
    error: order.map((at) => {
      const error = points[at].error_estimate?.[name];
      return typeof error === 'number' ? error / 1000 : null;
    }),
  });
  const moment = kind === 'moment';
  return {
    xLabel,
    yLabel: moment ? 'moment on the rail / N·m' : 'force on the rail / kN',
    x,
    order,
    lines: moment
      ? [line('moment_z_n_mm', { label: 'Mz', unit: 'N·m', colour: '--c3' })]
      : [line('force_x_n', { label: 'Fx', unit: 'kN', colour: '--c1' }), line('force_y_n', { label: 'Fy', unit: 'kN', colour: '--c2', dash: [7, 4] })],
    bound: moment ? NaN : (friction * patch.normal_force_n) / 1000,
  };
}
