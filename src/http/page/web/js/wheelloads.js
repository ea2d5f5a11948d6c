// Wheel loads as railways write them: Q down and Y outward on the rail, Y/Q and Nadal's limit.

import { at, numberAt, put } from './document.js';

/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./api.js').Patch} Patch */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./placing.js').Place} Place */
/** @typedef {'left' | 'right'} Side */

/**
 * @typedef {object} WheelLoad
 * @property {Side} side
 * @property {number} x_n Longitudinal force on the rail.
 * @property {number} y_n Lateral force on the rail, positive to the field side.
 * @property {number} q_n Vertical force on the rail, positive down.
 * @property {number | undefined} [y_error_n]
 * @property {number | undefined} [x_error_n]
 */

/** Length of a chord of the flank by which its angle is measured, in mm. */
const CHORD_MM = 2;
/** A flank that is less steep is no flange. */
const FLANGE_MIN_RAD = 0.7;
/** Less steep than this is the tread. */
const TREAD_MAX_RAD = 0.35;

/** Positive to the field side. @param {Side} side @param {number} toTheLeft */
export const outward = (side, toTheLeft) => (side === 'left' ? toTheLeft : -toTheLeft);

/** @param {JsonObject | null} document @returns {Side} */
export const sideOf = (document) => (at(document ?? undefined, '/contact/side') === 'left' ? 'left' : 'right');

/**
 * The loads of the wheels: one of `profiles`, two of `wheelset`, none of other contacts.
 * @param {JobResult} result
 * @param {JsonObject | null} document
 * @param {number} at The motion, or the position of a wheelset.
 * @returns {WheelLoad[]}
 */
export function wheelLoads(result, document, at) {
  const position = result.wheelset?.positions[at];
  if (position) {
    return /** @type {const} */ (['left', 'right']).map((side) => {
      const { force_x_n, force_y_n, force_z_n } = position[side];
      return { side, x_n: force_x_n, y_n: outward(side, force_y_n), q_n: -force_z_n };
    });
  }
  const total = result.total[at];
  if (typeof total?.force_z_n !== 'number') return [];
  const side = sideOf(document);
  return [{ side, x_n: total.force_x_n, y_n: outward(side, total.force_y_n), q_n: -total.force_z_n, y_error_n: total.error_estimate?.force_y_n, x_error_n: total.error_estimate?.force_x_n }];
}

/**
 * Forces of a patch on the rail in track axes, with its normal force.
 * @param {Patch} patch One with a position.
 * @param {number} point
 * @returns {{ x_n: number, left_n: number, down_n: number }}
 */
export function inTrackAxes({ position, normal_force_n: normal, points }, point) {
  // On the curve of the rail the normals of a patch differ: its force is that of the service.
  const { force_track_n: force } = /** @type {{ force_track_n?: number[] }} */ (points[point]);
  if (force) return { x_n: force[0], left_n: force[1], down_n: -force[2] };
  const angle = position?.contact_angle_rad ?? 0;
  const { force_x_n: x_n, force_y_n: y } = points[point];
  return { x_n, left_n: y * Math.cos(angle) + normal * Math.sin(angle), down_n: normal * Math.cos(angle) - y * Math.sin(angle) };
}

/**
 * Nadal's limit of Y/Q, beyond which a wheel may climb the rail.
 * @param {number} angle Of the flange, in rad.
 * @param {number} friction
 */
export const nadal = (angle, friction) => (Math.tan(angle) - friction) / (1 + friction * Math.tan(angle));

/**
 * The steepest angle of a wheel's flange on the side of the tread, over a chord of 2 mm.
 * @param {readonly Place[]} wheel Its cross-section in track axes.
 * @param {Side} side
 * @returns {number} In rad; NaN for a wheel without a flange.
 */
export function flangeAngle(wheel, side) {
  const line = wheel.map(([y, z]) => /** @type {Place} */ ([outward(side, y), z]));
  if (line.length < 8) return NaN;
  if (line[0][0] > line[line.length - 1][0]) line.reverse();
  const tip = line.reduce((lowest, [, z], place) => (z < line[lowest][1] ? place : lowest), 0);
  let steepest = 0;
  for (let from = tip, to = tip; to < line.length; to += 1) {
    while (from < to && Math.hypot(line[to][0] - line[from + 1][0], line[to][1] - line[from + 1][1]) >= CHORD_MM) from += 1;
    const [y, z] = [line[to][0] - line[from][0], line[to][1] - line[from][1]];
    if (Math.hypot(y, z) < CHORD_MM) continue;
    const angle = Math.atan2(z, Math.max(y, 0));
    // The tread begins; a steep face behind it is that of the rim.
    if (steepest >= FLANGE_MIN_RAD && angle < TREAD_MAX_RAD) break;
    steepest = Math.max(steepest, angle);
  }
  return steepest >= FLANGE_MIN_RAD ? steepest : NaN;
}

/**
 * A case of one wheel of a wheelset, which says where its cross-sections lie. A case of one wheel is itself.
 * @param {JsonObject} document
 * @param {Side} side
 * @param {number} shift In mm.
 * @returns {JsonObject}
 */
export function oneWheel(document, side, shift) {
  if (at(document, '/contact/type') !== 'wheelset') return document;
  const { right, kinematics, combine, ...contact } = /** @type {JsonObject} */ (document.contact);
  const other = side === 'right' && right !== null && typeof right === 'object' && !Array.isArray(right) ? right : {};
  const load = numberAt(document, '/load/vertical_force_n') / 2 || 75000;
  const own = { ...contact, ...other, type: 'profiles', side, lateral_shift_mm: shift, yaw_rad: 0 };
  const { damage, subsurface, thermal, ...plain } = document;
  return put({ ...plain, contact: own, load: { vertical_force_n: load }, outputs: ['resultants'] }, '/motion', { creepage_x: 0, creepage_y: 0, spin_per_mm: 0 });
}

/** The patch to look at first: of one wheel that which carries most. @param {JobResult} result */
export const firstPatch = ({ patches, wheelset }) =>
  wheelset ? 0 : patches.reduce((most, { normal_force_n: load }, at) => (load > patches[most].normal_force_n ? at : most), 0);
