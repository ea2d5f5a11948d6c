// Cross-sections of rail and wheel in the axes of the track, for drawings: y to the left, z up from the top of the rail.

import { at, isObject, numberAt } from './document.js';
import { rowsOf } from './tables.js';

/** @typedef {import('./document.js').JsonValue} JsonValue */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {[number, number]} Place y and z in mm. */

/**
 * @typedef {object} Placed
 * @property {Place[]} rail
 * @property {Place[]} wheel Lowered until it touches.
 * @property {Place | null} touch Where it touches first.
 * @property {Place[]} gap y and the vertical distance of the two.
 */

/** Samples per mm at which the two are compared. */
const PER_MM = 5;

/**
 * @param {JsonValue | undefined} contact Of the type `profiles`.
 * @returns {Placed | null} Null where one of the two cannot be read here.
 */
export function place(contact) {
  const rail = placeRail(contact);
  const wheel = rail && placeWheel(contact);
  if (!rail || !wheel) return null;
  const below = envelope(wheel, Math.min);
  const above = envelope(rail, Math.max);
  const common = [...below.keys()].filter((step) => above.has(step)).sort((one, two) => one - two);
  if (!common.length) return { rail, wheel, touch: null, gap: [] };
  const distance = (/** @type {number} */ step) => (below.get(step) ?? 0) - (above.get(step) ?? 0);
  const first = common.reduce((best, step) => (distance(step) < distance(best) ? step : best));
  const lift = distance(first);
  return {
    rail,
    wheel: wheel.map(([y, z]) => [y, z - lift]),
    touch: [first / PER_MM, above.get(first) ?? 0],
    gap: common.map((step) => [step / PER_MM, distance(step) - lift]),
  };
}

/**
 * Points of a cross-section as [to the field side, down].
 * @param {JsonValue | undefined} section
 * @param {'rail' | 'wheel'} body
 * @returns {Place[]}
 */
function readSection(section, body) {
  if (!isObject(section)) return [];
  const given = section.points_mm;
  let points = Array.isArray(given) ? given.filter(Array.isArray).map(([y, z]) => [Number(y), Number(z)]) : [];
  if (typeof section.text === 'string' && section.format !== 'simpack') {
    points = rowsOf(section.text.replace(/^.*=.*$/gm, '')).filter((row) => row.length >= 2);
  }
  const line = points.filter(([y, z]) => Number.isFinite(y) && Number.isFinite(z)).map(([y, z]) => /** @type {Place} */ ([y, z]));
  if (line.length < 3) return [];
  const down = typeof section.mirror_z === 'boolean' ? !section.mirror_z : pointsDown(line);
  const upright = /** @type {Place[]} */ (line.map(([y, z]) => [y, down ? z : -z]));
  const outward = typeof section.mirror_y === 'boolean' ? !section.mirror_y : body === 'rail' || flangeInside(upright);
  return outward ? upright : upright.map(([y, z]) => [-y, z]);
}

/** Is z positive down? The side of a rail's head and the flange of a wheel hang lower than the rest. @param {Place[]} line */
function pointsDown(line) {
  const heights = line.map(([, z]) => z).sort((one, two) => one - two);
  const middle = heights[heights.length >> 1];
  return heights[heights.length - 1] - middle >= middle - heights[0];
}

/** Is the flange on the side of the track's centre, y < 0? @param {Place[]} line */
const flangeInside = (line) => line.reduce((lowest, point) => (point[1] > lowest[1] ? point : lowest))[0] < 0;

/** @param {JsonValue | undefined} contact @param {string} name @param {number} otherwise */
function given(contact, name, otherwise) {
  const value = numberAt(contact, `/${name}`);
  return Number.isFinite(value) ? value : otherwise;
}

/** @param {JsonValue | undefined} contact 1 for the left side of the track, −1 for the right. */
const sideOf = (contact) => (at(contact, '/side') === 'left' ? 1 : -1);

/** @param {JsonValue | undefined} contact @returns {Place[] | null} */
function placeRail(contact) {
  const section = readSection(at(contact, '/rail'), 'rail');
  if (!section.length) return null;
  const cant = given(contact, 'cant_rad', 0);
  const [cos, sin] = [Math.cos(cant), Math.sin(cant)];
  const turned = section.map(([out, down]) => [out * cos + down * sin, down * cos - out * sin]);
  const top = Math.min(...turned.map(([, down]) => down));
  const level = top + given(contact, 'gauge_height_mm', 14);
  let face = Infinity;
  for (let i = 1; i < turned.length; i += 1) {
    const [[out, down], [out2, down2]] = [turned[i - 1], turned[i]];
    if (down === down2 || (down - level) * (down2 - level) > 0) continue;
    face = Math.min(face, out + ((level - down) / (down2 - down)) * (out2 - out));
  }
  if (!Number.isFinite(face)) face = Math.min(...turned.map(([out]) => out));
  const half = given(contact, 'gauge_mm', 1435) / 2;
  return turned.map(([out, down]) => [sideOf(contact) * (half + out - face), top - down]);
}

/** @param {JsonValue | undefined} contact @returns {Place[] | null} */
function placeWheel(contact) {
  const section = readSection(at(contact, '/wheel'), 'wheel');
  if (!section.length) return null;
  const back = given(contact, 'flange_back_distance_mm', 1360) / 2 - given(contact, 'flange_back_position_mm', -70);
  const radius = given(contact, 'rolling_radius_mm', 460);
  const roll = given(contact, 'roll_rad', 0);
  const shift = given(contact, 'lateral_shift_mm', 0);
  return section.map(([out, down]) => {
    const y = sideOf(contact) * (back + out);
    const z = -radius - down;
    return [y * Math.cos(roll) - z * Math.sin(roll) + shift, y * Math.sin(roll) + z * Math.cos(roll) + radius];
  });
}

/**
 * The highest or lowest point of a line at every step.
 * @param {Place[]} line
 * @param {(one: number, two: number) => number} pick
 */
function envelope(line, pick) {
  /** @type {Map<number, number>} */
  const heights = new Map();
  for (let i = 1; i < line.length; i += 1) {
    const [one, two] = line[i - 1][0] < line[i][0] ? [line[i - 1], line[i]] : [line[i], line[i - 1]];
    for (let step = Math.ceil(one[0] * PER_MM); step <= two[0] * PER_MM; step += 1) {
      const share = two[0] === one[0] ? 0 : (step / PER_MM - one[0]) / (two[0] - one[0]);
      const z = one[1] + share * (two[1] - one[1]);
      const known = heights.get(step);
      heights.set(step, known === undefined ? z : pick(known, z));
    }
  }
  return heights;
}
