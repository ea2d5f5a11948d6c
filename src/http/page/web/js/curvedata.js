// The values of a creep curve: forces or the moment of a patch against the component of motion that varies most.

/** @typedef {import('./api.js').Patch} Patch */

/** @typedef {{ label: string, unit: string, colour: string, dash?: number[], y: number[], error: (number | null)[] }} Line */

/**
 * @typedef {object} Curve
 * @property {string} xLabel
 * @property {string} yLabel
 * @property {number[]} x Increasing.
 * @property {number[]} order The motion of each place.
 * @property {Line[]} lines
 * @property {number} bound Friction's bound μN; NaN for none.
 */

const MOTIONS = /** @type {const} */ ([
  { key: 'creepage_x', label: 'creepage along / %', factor: 0.01 },
  { key: 'creepage_y', label: 'creepage across / %', factor: 0.01 },
  { key: 'spin_per_mm', label: 'spin / (1/m)', factor: 0.001 },
]);

/**
 * The curve of a patch against the component of motion that varies most.
 * @param {Patch} patch
 * @param {'forces' | 'moment'} kind
 * @param {number} friction
 * @returns {Curve | null} Null for fewer than three motions.
 */
export function curveOf(patch, kind, friction) {
  const { points } = patch;
  if (points.length < 3) return null;
  const values = MOTIONS.map(({ key, factor }) => points.map(({ motion }) => (motion[key] ?? 0) / factor));
  const spreads = values.map((of) => Math.max(...of) - Math.min(...of));
  const most = spreads.indexOf(Math.max(...spreads));
  const order = [...points.keys()].sort((one, two) => values[most][one] - values[most][two]);
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
    xLabel: MOTIONS[most].label,
    yLabel: moment ? 'moment on the rail / N·m' : 'force on the rail / kN',
    x: order.map((at) => values[most][at]),
    order,
    lines: moment
      ? [line('moment_z_n_mm', { label: 'M z', unit: 'N·m', colour: '--c3' })]
      : [line('force_x_n', { label: 'F x', unit: 'kN', colour: '--c1' }), line('force_y_n', { label: 'F y', unit: 'kN', colour: '--c2', dash: [7, 4] })],
    bound: moment ? NaN : (friction * patch.normal_force_n) / 1000,
  };
}
