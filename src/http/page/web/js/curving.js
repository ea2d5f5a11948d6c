// Effect of a curve and its cant on the load of a wheel or an axle, in axes of the canted track.

import { at, isObject, numberAt, put } from './document.js';
import { parse } from './written.js';

/** @typedef {import('./document.js').JsonObject} JsonObject */

export const GRAVITY_MM_PER_S2 = 9806.65;
const GAUGE_MM = 1435;
/** Distance of the running circles less the gauge: 1500 mm for a gauge of 1435 mm (2b_A of EN 14363). */
const HEAD_MM = 65;
const LOAD = '/load/vertical_force_n';
/** Significant digits of a static load. The stored load has three more, so that the static load is recovered exactly. */
const DIGITS = 9;
/** Label that stores the cant in mm. A case has no member for it because track and wheelset roll together. */
export const CANT = 'track_cant_mm';

/**
 * @typedef {object} Curving
 * @property {number} base Distance of the rails' running circles in mm.
 * @property {number} cant Height of the outer rail above the inner rail in mm; on straight track, of the right rail above the left one. 0 if not given.
 * @property {boolean} wrong Whether the entered cant is not a number of mm below `base`.
 * @property {boolean} left Whether the curve is to the left, with the right rail outside. Also true on straight track.
 * @property {number} roll Roll angle of the track in rad, positive from y to z.
 * @property {number} factor Ratio of the load normal to the track to the static load.
 * @property {number} balancing The cant in mm that balances the curve.
 * @property {number} lateral Unbalanced acceleration in the track plane in m/s², positive to the outer rail.
 */

/** Returns the curve and the cant of a case with the motion of a wheelset. @param {JsonObject | null} document @returns {Curving} */
export function curving(document) {
  const of = document ?? undefined;
  const origin = Math.abs(numberAt(of, '/contact/rail_origin_mm'));
  const base = 2 * origin || (numberAt(of, '/contact/gauge_mm') || GAUGE_MM) + HEAD_MM;
  const written = at(of, `/labels/${CANT}`);
  const read = typeof written === 'string' ? parse(written) : undefined;
  const wrong = read !== undefined && !(typeof read === 'number' && Math.abs(read) < base);
  const cant = typeof read === 'number' && !wrong ? read : 0;
  // Acceleration to the left, v²/R, with the yaw rate v/R.
  const toLeft = numberAt(of, '/motion/wheelset/speed_mm_per_s') * numberAt(of, '/motion/wheelset/yaw_rate_rad_per_s') || 0;
  const left = toLeft >= 0;
  const [sin, gravities] = [cant / base, Math.abs(toLeft) / GRAVITY_MM_PER_S2];
  const cos = Math.sqrt(1 - sin * sin);
  return {
    base, cant, wrong, left, roll: (left ? -1 : 1) * Math.asin(sin), factor: cos + gravities * sin,
    balancing: base * gravities, lateral: ((gravities * cos - sin) * GRAVITY_MM_PER_S2) / 1000,
  };
}

/** Returns the labels of a case with its cant replaced; undefined if none remains. @param {JsonObject | null} document @param {string | undefined} cant */
export function labelsWithCant(document, cant) {
  const labels = at(document ?? undefined, '/labels');
  const { [CANT]: before, ...others } = isObject(labels) ? labels : {};
  const all = cant ? { ...others, [CANT]: cant } : others;
  return Object.keys(all).length ? all : undefined;
}

const rounded = (/** @type {number} */ value, digits = DIGITS) => Number(value.toPrecision(digits));

/** Returns the load normal to the track, in N. @param {number} load The static load in N. @param {Curving} on */
export const normalLoad = (load, { factor }) => rounded(load * factor, DIGITS + 3);

/** Returns the static load of a case in N; NaN if it has no vertical force. @param {JsonObject | null} document */
export const staticLoad = (document) => rounded(numberAt(document ?? undefined, LOAD) / curving(document).factor);

/**
 * Returns an edited case with its load normal to the track adapted to its curve, speed and cant, unless the edit changed the load.
 * @param {JsonObject | null} before
 * @param {JsonObject} after
 */
export function withLoadOfCurve(before, after) {
  const [was, is] = [curving(before), curving(after)];
  const load = staticLoad(before);
  if (was.factor === is.factor || Number.isNaN(load) || numberAt(after, LOAD) !== numberAt(before ?? undefined, LOAD)) return after;
  return put(after, LOAD, normalLoad(load, is));
}
