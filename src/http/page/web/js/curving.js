// Effect of a curve and its cant on the load of a wheel or an axle, in axes of the canted track.

import { at, isObject, numberAt, put } from './document.js';
import { parse } from './written.js';

/** @typedef {import('./document.js').JsonObject} JsonObject */

export const GRAVITY_MM_PER_S2 = 9806.65;
const GAUGE_MM = 1435;
/** The rails' running circles are this much farther apart than the gauge: 1500 mm for 1435 mm (2b_A of EN 14363). */
const HEAD_MM = 65;
const LOAD = '/load/vertical_force_n';
/** Digits of a static load. The stored load has three more, so that the static one comes back exactly. */
const DIGITS = 9;
/** The label that keeps the cant in mm: a case has no member for it, because the track and the wheelset roll together. */
export const CANT = 'track_cant_mm';

/**
 * @typedef {object} Curving
 * @property {number} base Distance of the rails' running circles in mm.
 * @property {number} cant Height of the outer rail over the inner one in mm, on straight track of the right one over the left one; 0 where none is given.
 * @property {boolean} wrong The cant that was written is not a number of mm below `base`.
 * @property {boolean} left Is the right rail the outer one? Also on straight track.
 * @property {number} roll Of the track in rad, positive from y to z.
 * @property {number} factor The load normal to the track, divided by the static load.
 * @property {number} balancing The cant in mm that balances the curve.
 * @property {number} lateral Unbalanced acceleration in the track plane in m/s², positive to the outer rail.
 */

/** The curve and the cant of a case with the motion of a wheelset. @param {JsonObject | null} document @returns {Curving} */
export function curving(document) {
  const of = document ?? undefined;
  const origin = Math.abs(numberAt(of, '/contact/rail_origin_mm'));
  const base = 2 * origin || (numberAt(of, '/contact/gauge_mm') || GAUGE_MM) + HEAD_MM;
  const written = at(of, `/labels/${CANT}`);
  const read = typeof written === 'string' ? parse(written) : undefined;
  const wrong = read !== undefined && !(typeof read === 'number' && Math.abs(read) < base);
  const cant = typeof read === 'number' && !wrong ? read : 0;
  // v²/R with the yaw rate v/R, to the left.
  const toLeft = numberAt(of, '/motion/wheelset/speed_mm_per_s') * numberAt(of, '/motion/wheelset/yaw_rate_rad_per_s') || 0;
  const left = toLeft >= 0;
  const [sin, gravities] = [cant / base, Math.abs(toLeft) / GRAVITY_MM_PER_S2];
  const cos = Math.sqrt(1 - sin * sin);
  return {
    base, cant, wrong, left, roll: (left ? -1 : 1) * Math.asin(sin), factor: cos + gravities * sin,
    balancing: base * gravities, lateral: ((gravities * cos - sin) * GRAVITY_MM_PER_S2) / 1000,
  };
}

/** The labels of a case with another cant; undefined for none. @param {JsonObject | null} document @param {string | undefined} cant */
export function labelsWithCant(document, cant) {
  const labels = at(document ?? undefined, '/labels');
  const { [CANT]: before, ...others } = isObject(labels) ? labels : {};
  const all = cant ? { ...others, [CANT]: cant } : others;
  return Object.keys(all).length ? all : undefined;
}

const rounded = (/** @type {number} */ value, digits = DIGITS) => Number(value.toPrecision(digits));

/** The load normal to the track, in N. @param {number} load The static one. @param {Curving} on */
export const normalLoad = (load, { factor }) => rounded(load * factor, DIGITS + 3);

/** The static load of a case in N; NaN where it has no vertical force. @param {JsonObject | null} document */
export const staticLoad = (document) => rounded(numberAt(document ?? undefined, LOAD) / curving(document).factor);

/**
 * A changed case whose load normal to the track follows its curve, its speed and its cant, unless the load itself was changed.
 * @param {JsonObject | null} before
 * @param {JsonObject} after
 */
export function withLoadOfCurve(before, after) {
  const [was, is] = [curving(before), curving(after)];
  const load = staticLoad(before);
  if (was.factor === is.factor || Number.isNaN(load) || numberAt(after, LOAD) !== numberAt(before ?? undefined, LOAD)) return after;
  return put(after, LOAD, normalLoad(load, is));
}
