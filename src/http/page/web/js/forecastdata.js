// Data of the drawings of a forecast: worn sections and curves over the traffic.

/** @typedef {import('./forecast.js').Answer} Answer */
/** @typedef {import('./forecast.js').WornRecord} WornRecord */
/** @typedef {import('./forecast.js').Body} Body */
/** @typedef {import('./drawing/axes.js').ChartLine} ChartLine */
/** @typedef {import('./drawing/axes.js').Point} Point y to the field side and z up, in mm. */

/** Losses that can have a limit, with their bodies. */
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

/** Returns the progress of an evolution in the unit of its events. @param {WornRecord['progress']} progress */
export const distanceOf = ({ mgt, axle_passes, wheel_distance_km, share }) => mgt ?? axle_passes ?? wheel_distance_km ?? 100 * share;

/** @param {Answer} answer */
export function distanceUnit({ records: [first] }) {
  const { mgt, axle_passes, wheel_distance_km } = first.progress;
  return mgt !== undefined ? 'MGT' : axle_passes !== undefined ? 'axles' : wheel_distance_km !== undefined ? 'km' : '% of the extent';
}

/** Worn area in mm² below which a body counts as not worn: rounding errors are smaller. */
const NO_WEAR_MM2 = 1e-6;

/** Returns whether a body wears. @param {Answer} answer @param {Body} body */
export const wears = ({ records }, body) => records.some((record) => record[body].worn_area_mm2 > NO_WEAR_MM2);

/** Returns the unit normals of a section, pointing into the body. @param {readonly Point[]} line @param {Body} body @returns {Point[]} */
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
 * Returns a section at the start and at a step with magnified wear, and its band of 90 % probability.
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
  return { start, now, normals, low: edge(low), high: edge(high) };
}

/** Returns the relative numerical uncertainty: the root sum of squares of the parts due to steps, states and contact. @param {WornRecord} record @param {Body} body */
export const numericalOf = (record, body) => {
  const { steps, states, contact } = record[body].uncertainty;
  return Math.hypot(steps, states, contact);
};

const BODIES = /** @type {const} */ (['rail', 'wheel']);
const LOOKS = ['one', 'two', 'three', 'four'];
/** Loss in mm below which it counts as 0. */
const NO_LOSS_MM = 1e-4;

/** Returns the chart lines of one body of an evolution over its records. @param {Answer} answer @param {string} kind @param {Body} body @returns {(ChartLine & { limited?: boolean })[]} */
function linesOf(answer, kind, body) {
  const { records, limits } = answer;
  const places = records.map(({ progress }) => distanceOf(progress));
  /** @type {(label: string, look: number, of: (record: WornRecord) => number | null | undefined) => ChartLine} */
  const line = (label, look, of) => ({ label, look: LOOKS[look], points: records.map((record, at) => [places[at], of(record) ?? NaN]) });
  const limit = (/** @type {string} */ label, /** @type {number} */ value) => ({ label, look: 'limit', points: /** @type {Point[]} */ ([[places[0], value], [places[places.length - 1], value]]) });
  /** Adds error bars of the numerical uncertainty and the band of the wear coefficients. Machined material has no uncertainty. @type {(of: (record: WornRecord) => number) => Pick<ChartLine, 'errors' | 'band'>} */
  const uncertain = (of) => {
    let machined = 0;
    const parts = records.map((record, at) => {
      const before = records[at - 1];
      if (before && record.events_done > before.events_done) machined += of(record) - of(before);
      return { record, machined, worn: of(record) - machined };
    });
    const edge = (/** @type {0 | 1} */ end) => parts.map((part, at) => /** @type {Point} */ ([places[at], part.machined + part.worn * part.record[body].uncertainty.coefficients[end]]));
    return { errors: parts.map(({ record, worn }) => worn * numericalOf(record, body) || null), band: [edge(0), edge(1)] };
  };
  switch (kind) {
    case 'losses':
      // The largest depth is omitted if a loss has a limit: it has none itself, but would seem to exceed it.
      return [...(LOSSES.some((loss) => loss.body === body && limits.some((known) => known.loss === loss.key)) ? []
        : [{ ...line('largest depth', 0, (record) => deepest(record, body)), ...uncertain((record) => deepest(record, body)) }]), ...LOSSES.filter((loss) => loss.body === body).flatMap(({ key, label }, at) => {
        const of = (/** @type {WornRecord} */ record) => record.losses[key] ?? 0;
        const known = limits.find(({ loss }) => loss === key);
        if (!known && !records.some((record) => of(record) > NO_LOSS_MM)) return [];
        return [{ ...line(label, at + 1, of), ...uncertain(of), limited: Boolean(known) }, ...(known ? [limit(`limit of ${label}`, known.limit_mm)] : [])];
      })];
    case 'area': {
      const of = (/** @type {WornRecord} */ record) => record[body].worn_area_mm2;
      return [{ ...line(`worn area of the ${body}`, 0, of), ...uncertain(of) }];
    }
    case 'pressure':
      return [line('largest', 0, ({ contact }) => contact.pressure_max_mpa), line('mean of the traffic', 1, ({ contact }) => contact.pressure_mean_mpa)];
    case 'yq':
      return [line('largest Y/Q', 0, ({ contact }) => contact.y_over_q_max), line('mean of the traffic', 1, ({ contact }) => contact.y_over_q_mean)];
    case 'conicity':
      return [line('equivalent conicity at 3 mm', 0, ({ conicity }) => conicity)];
    default:
      return [line(`${body}, largest`, 0, (record) => worstDamage(record, body)), limit('visible crack', 1)];
  }
}

/** Returns the largest worn depth, in mm. @param {WornRecord} record @param {Body} body */
export const deepest = (record, body) => Math.max(0, ...record[body].depth_mm);

/** @param {WornRecord} record @param {Body} body */
export const worstDamage = (record, body) => Math.max(0, ...record[body].damage);

const Y_LABELS = { losses: 'loss / mm', area: 'worn area / mm²', pressure: 'largest pressure / MPa', yq: 'Y/Q', conicity: 'equivalent conicity', damage: 'RCF damage, net of wear' };

/**
 * Returns the chart over the traffic for one body of one or two evolutions.
 * @param {readonly Answer[]} answers
 * @param {string} kind
 * @param {Body} body
 */
export function forecastChart(answers, kind, body) {
  const compared = answers.length > 1;
  const lines = answers.flatMap((answer, side) => linesOf(answer, kind, body)
    // The limits of the first evolution apply to both.
    .filter(({ look }) => !(side && look === 'limit'))
    // With two evolutions, only losses with a limit have bands; more bands would overlap.
    .map((line) => (compared && line.look !== 'limit' ? { ...line, band: line.limited ? line.band : undefined, label: `${'AB'[side]}: ${line.label}`, look: `${line.look} ${side ? 'dashed' : 'solid'}` } : line)));
  const y = Y_LABELS[/** @type {keyof typeof Y_LABELS} */ (kind)] ?? '';
  return { name: `${CURVES.find(([key]) => key === kind)?.[1]} over the traffic`, x: `traffic / ${distanceUnit(answers[0])}`, y, lines };
}

/**
 * @typedef {object} Life Progress at which a limit is reached; null if it is not reached within the extent.
 * @property {number | null} mean
 * @property {number | null} earliest
 * @property {number | null} latest
 */
/** @typedef {{ key: string, label: string, limit: string, lives: Life[] }} Reached */

/** Returns when the limits of losses and a visible crack are reached. @param {readonly Answer[]} answers @returns {Reached[]} */
export function reachedOf(answers) {
  const losses = LOSSES.flatMap(({ key, label }) => {
    const [limit] = answers.flatMap(({ limits }) => limits.filter(({ loss }) => loss === key));
    if (!limit) return [];
    const lives = answers.map(({ limits }) => {
      const own = limits.find(({ loss }) => loss === key);
      const [mean, earliest, latest] = [own?.reached, own?.earliest, own?.latest].map((progress) => (progress ? distanceOf(progress) : null));
      return { mean, earliest, latest };
    });
    return [{ key, label, limit: `${limit.limit_mm} mm`, lives }];
  });
  const cracks = BODIES.map((body) => ({ key: body, label: `RCF of the ${body}`, limit: 'visible crack', lives: answers.map((answer) => crackOf(answer, body)) }));
  return [...losses, ...cracks.filter(({ lives }) => lives.some(({ mean }) => mean !== null))];
}

/** Returns when the damage of a body reaches a visible crack, interpolated between records. @param {Answer} answer @param {Body} body @returns {Life} */
function crackOf({ records }, body) {
  const worst = records.map((record) => worstDamage(record, body));
  const after = worst.findIndex((damage) => damage >= 1);
  if (after < 0) return { mean: null, earliest: null, latest: null };
  const [from, to] = [records[Math.max(0, after - 1)], records[after]].map(({ progress }) => distanceOf(progress));
  const mean = after ? from + ((to - from) * (1 - worst[after - 1])) / (worst[after] - worst[after - 1]) : from;
  return { mean, earliest: mean, latest: mean };
}

/** Returns the limit that an evolution reaches first. @param {readonly Reached[]} reached @param {number} side @param {keyof Life} when */
function firstOf(reached, side, when) {
  const ended = reached.flatMap((each) => {
    const place = each.lives[side][when];
    return place === null ? [] : [{ place, label: each.label }];
  });
  return ended.reduce((best, each) => (each.place < best.place ? each : best), { place: Infinity, label: '' });
}

/**
 * Decides which of two plans lasts longer until its first limit, and whether the result is the same for the lowest and highest wear coefficients.
 * @param {readonly Reached[]} reached
 * @returns {{ better: 0 | 1 | null, sure: boolean, ends: { place: number, label: string }[] }} `better` is null if neither reaches a limit, or both at the same time.
 */
export function decisionOf(reached) {
  const ahead = (/** @type {keyof Life} */ when) => {
    const [one, two] = [firstOf(reached, 0, when).place, firstOf(reached, 1, when).place];
    return one === two ? 0 : Math.sign(two - one);
  };
  const sign = ahead('mean');
  return { better: sign > 0 ? 1 : sign < 0 ? 0 : null, sure: [ahead('earliest'), ahead('latest')].every((other) => other === 0 || other === sign), ends: [firstOf(reached, 0, 'mean'), firstOf(reached, 1, 'mean')] };
}
