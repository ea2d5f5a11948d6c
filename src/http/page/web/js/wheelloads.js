// Wheel loads in railway convention: Q down and Y outward on the rail, Y/Q and Nadal's limit.

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

/** Length of the chord over which the flange angle is measured, in mm. */
const CHORD_MM = 2;
/** Smallest angle of a flange. */
const FLANGE_MIN_RAD = 0.7;
/** Largest angle of the tread. */
const TREAD_MAX_RAD = 0.35;

/** Converts a component from positive to the left to positive to the field side. @param {Side} side @param {number} toTheLeft */
export const outward = (side, toTheLeft) => (side === 'left' ? toTheLeft : -toTheLeft);

/** @param {JsonObject | null} document @returns {Side} */
export const sideOf = (document) => (at(document ?? undefined, '/contact/side') === 'left' ? 'left' : 'right');

/**
 * Returns the loads of the wheels: one for `profiles`, two for `wheelset`, none for other contacts.
 * @param {JobResult} result
 * @param {JsonObject | null} document
 * @param {number} at Index of the motion, or of the position of a wheelset.
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
 * Returns the force of a patch on the rail in track axes, including the normal force.
 * @param {Patch} patch A patch with a position.
 * @param {number} point
 * @returns {{ x_n: number, left_n: number, down_n: number }}
 */
export function inTrackAxes({ position, normal_force_n: normal, points }, point) {
  // On a curved contact surface the normals vary over the patch, so that the service reports the force.
  const { force_track_n: force } = /** @type {{ force_track_n?: number[] }} */ (points[point]);
  if (force) return { x_n: force[0], left_n: force[1], down_n: -force[2] };
  const angle = position?.contact_angle_rad ?? 0;
  const { force_x_n: x_n, force_y_n: y } = points[point];
  return { x_n, left_n: y * Math.cos(angle) + normal * Math.sin(angle), down_n: normal * Math.cos(angle) - y * Math.sin(angle) };
}

/**
 * Returns Nadal's limit of Y/Q, above which a wheel may climb the rail.
 * @param {number} angle Flange angle in rad.
 * @param {number} friction
 */
export const nadal = (angle, friction) => (Math.tan(angle) - friction) / (1 + friction * Math.tan(angle));

/**
 * Returns the largest angle of a wheel's flange on the side of the tread, over a chord of 2 mm.
 * @param {readonly Place[]} wheel Cross-section in track axes.
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
    // The tread starts here; a steep face beyond it belongs to the rim.
    if (steepest >= FLANGE_MIN_RAD && angle < TREAD_MAX_RAD) break;
    steepest = Math.max(steepest, angle);
  }
  return steepest >= FLANGE_MIN_RAD ? steepest : NaN;
}

/**
 * Returns a case of one wheel of a wheelset, for example to request the placement of its cross-sections. Other cases are returned unchanged.
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

/** Returns the patch to show first: the first one of a wheelset, else the one with the largest load. @param {JobResult} result */
export const firstPatch = ({ patches, wheelset }) =>
  wheelset ? 0 : patches.reduce((most, { normal_force_n: load }, at) => (load > patches[most].normal_force_n ? at : most), 0);
