// What is drawn of a forecast: sections with their wear, and curves over the traffic.

/** @typedef {import('./forecast.js').Answer} Answer */
/** @typedef {import('./forecast.js').WornRecord} WornRecord */
/** @typedef {import('./forecast.js').Body} Body */
/** @typedef {import('./curvedata.js').Curve} Curve */
/** @typedef {import('./curvedata.js').Line} Line */
/** @typedef {import('./drawing/axes.js').Point} Point y to the field side and z up, in mm. */

/** Losses with a limit, the body that they belong to. */
export const LOSSES = /** @type {const} */ ([
  { key: 'height_mm', label: 'rail height, W1', body: 'rail' },
  { key: 'gauge_face_mm', label: 'gauge face, W2', body: 'rail' },
  { key: 'gauge_corner_mm', label: 'gauge corner, W3', body: 'rail' },
  { key: 'tread_mm', label: 'tread', body: 'wheel' },
  { key: 'flange_mm', label: 'flange', body: 'wheel' },
]);

export const CURVES = /** @type {const} */ ([
  ['losses', 'Losses'], ['area', 'Worn area'], ['pressure', 'Pressure'], ['yq', 'Y/Q'], ['conicity', 'Conicity'], ['damage', 'RCF damage'],
]);
const COLOURS = ['--c1', '--c2', '--c3'];

/** How far an evolution has come, in the unit that its events have. @param {WornRecord['progress']} progress */
export const distanceOf = ({ mgt, axle_passes, wheel_distance_km, share }) => mgt ?? axle_passes ?? wheel_distance_km ?? 100 * share;

/** @param {Answer} answer */
export function distanceUnit({ records: [first] }) {
  const { mgt, axle_passes, wheel_distance_km } = first.progress;
  return mgt !== undefined ? 'MGT' : axle_passes !== undefined ? 'axles' : wheel_distance_km !== undefined ? 'km' : '% of the extent';
}

/** Worn area below which a body has no wear, in mm²: what is left of rounding. */
const NO_WEAR_MM2 = 1e-6;

/** Does a body wear? @param {Answer} answer @param {Body} body */
export const wears = ({ records }, body) => records.some((record) => record[body].worn_area_mm2 > NO_WEAR_MM2);

/** Unit normals of a section into the body. @param {readonly Point[]} line @param {Body} body @returns {Point[]} */
export function normalsInto(line, body) {
  const normals = line.map((_, at) => {
    const [[y0, z0], [y1, z1]] = [line[Math.max(0, at - 1)], line[Math.min(line.length - 1, at + 1)]];
    const length = Math.hypot(y1 - y0, z1 - z0) || 1;
    return /** @type {Point} */ ([-(z1 - z0) / length, (y1 - y0) / length]);
  });
  const up = normals.reduce((sum, [, z]) => sum + z, 0);
  const turn = (body === 'rail') === up > 0 ? -1 : 1;
  return normals.map(([y, z]) => [turn * y, turn * z]);
}

/**
 * A section at the start and at a step, its wear drawn larger by a factor, and the band in which it lies with a probability of 90 %.
 * @param {Answer} answer
 * @param {WornRecord} record
 * @param {Body} body
 * @param {number} factor
 */
export function sectionOf(answer, record, body, factor) {
  const upward = (/** @type {readonly (readonly number[])[]} */ points) => points.map(([y, z]) => /** @type {Point} */ ([y, -z]));
  const start = upward(answer.records[0][body].points_mm);
  const worn = record[body];
  const now = upward(worn.points_mm).map(([y, z], at) => /** @type {Point} */ ([start[at][0] + factor * (y - start[at][0]), start[at][1] + factor * (z - start[at][1])]));
  const normals = normalsInto(start, body);
  const edge = (/** @type {number} */ times) => now.map(([y, z], at) => {
    const more = factor * worn.depth_mm[at] * (times - 1);
    return /** @type {Point} */ ([y + more * normals[at][0], z + more * normals[at][1]]);
  });
  const [low, high] = worn.uncertainty.coefficients;
  return { start, now, low: edge(low), high: edge(high) };
}

/** The numerical part of the uncertainty, relative: of the steps, the states and the contact. @param {WornRecord} record @param {Body} body */
export const numericalOf = (record, body) => {
  const { steps, states, contact } = record[body].uncertainty;
  return Math.hypot(steps, states, contact);
};

/** @typedef {Omit<Line, 'colour'> & { look: number, limit?: boolean }} ForecastLine `look` is the place of its colour. */

/** Lines of one evolution over its records. @param {Answer} answer @param {string} kind @returns {(ForecastLine & { body?: Body })[]} */
function linesOf(answer, kind) {
  const { records, limits } = answer;
  /** @type {(label: string, unit: string, look: number, of: (record: WornRecord) => number | null | undefined, error?: (record: WornRecord) => number) => ForecastLine} */
  const line = (label, unit, look, of, error) => ({ label, unit, look, y: records.map((record) => of(record) ?? NaN), error: records.map((record) => error?.(record) || null) });
  switch (kind) {
    case 'losses':
      return LOSSES.flatMap(({ key, label, body }, at) => {
        const loss = line(label, 'mm', at % 3, ({ losses }) => losses[key], (record) => (record.losses[key] ?? 0) * numericalOf(record, body));
        const limit = limits.find((known) => known.loss === key);
        if (!limit && !loss.y.some((value) => value > 0)) return [];
        return [{ ...loss, body }, ...(limit ? [{ ...line(`limit of ${label}`, 'mm', 0, () => limit.limit_mm), limit: true, body }] : [])];
      });
    case 'area':
      return BODIES.flatMap((body) => {
        const area = (/** @type {WornRecord} */ record) => record[body].worn_area_mm2;
        const bound = (/** @type {0 | 1} */ end) => ({ ...line(`${body}, ${end ? 'highest' : 'lowest'} coefficients`, 'mm²', 2, (record) => area(record) * record[body].uncertainty.coefficients[end]), body });
        const worn = line(body, 'mm²', 0, area, (record) => area(record) * numericalOf(record, body));
        return wears(answer, body) ? [{ ...worn, body }, bound(0), bound(1)] : [];
      });
    case 'pressure':
      return [line('largest', 'MPa', 0, ({ contact }) => contact.pressure_max_mpa), line('mean of the traffic', 'MPa', 1, ({ contact }) => contact.pressure_mean_mpa)];
    case 'yq':
      return [line('largest Y/Q', '', 0, ({ contact }) => contact.y_over_q_max), line('mean of the traffic', '', 1, ({ contact }) => contact.y_over_q_mean)];
    case 'conicity':
      return [line('equivalent conicity at 3 mm', '', 0, ({ conicity }) => conicity)];
    default:
      return [...BODIES.map((body) => ({ ...line(`${body}, largest`, '', 0, (record) => Math.max(0, ...record[body].damage)), body })), { ...line('visible crack', '', 0, () => 1), limit: true }];
  }
}

const BODIES = /** @type {const} */ (['rail', 'wheel']);
const Y_LABELS = { losses: 'loss / mm', area: 'worn area / mm²', pressure: 'largest pressure / MPa', yq: 'Y/Q', conicity: 'equivalent conicity', damage: 'RCF damage, net of wear' };

/**
 * Curves over the traffic, of one body of one evolution or of two.
 * @param {readonly Answer[]} answers
 * @param {string} kind
 * @param {Body} body
 * @returns {Curve | null}
 */
export function forecastCurve(answers, kind, body) {
  const [first] = answers;
  const places = answers.map(({ records }) => records.map(({ progress }) => distanceOf(progress)));
  const x = [...new Set(places.flat())].sort((one, two) => one - two);
  if (x.length < 2) return null;
  const compared = answers.length > 1;
  const lines = answers.flatMap((answer, side) => linesOf(answer, kind)
    // Of two, bounds and what the first has as well would only be in the way.
    .filter((line) => (!line.body || line.body === body) && !(compared && /coefficients/.test(line.label)) && !(side && line.limit))
    .map(({ look, limit, label, unit, y, error }) => ({
      label: compared && !limit ? `${'AB'[side]}: ${label}` : label, unit, colour: limit ? '--bad' : COLOURS[look], dash: limit ? [5, 3] : side ? [7, 4] : /coefficients/.test(label) ? [2, 3] : undefined,
      y: x.map((place) => between(places[side], y, place)), error: x.map((place) => error[places[side].indexOf(place)] ?? null),
    })));
  if (!lines.some(({ y }) => y.some(Number.isFinite))) return null;
  return { xLabel: `traffic / ${distanceUnit(first)}`, yLabel: Y_LABELS[/** @type {keyof typeof Y_LABELS} */ (kind)] ?? '', x, order: [...x.keys()], lines, bound: NaN };
}

/** The value at a place between those of increasing places; the later one where two are the same. @param {readonly number[]} xs @param {readonly number[]} ys @param {number} x */
function between(xs, ys, x) {
  const at = xs.lastIndexOf(x);
  if (at >= 0) return ys[at];
  const after = xs.findIndex((place) => place > x);
  if (after < 1) return NaN;
  return ys[after - 1] + ((x - xs[after - 1]) / (xs[after] - xs[after - 1])) * (ys[after] - ys[after - 1]);
}
