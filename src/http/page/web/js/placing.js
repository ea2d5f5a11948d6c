// Cross-sections of rail and wheel as placed by the service, the gap between them, and coordinates on them.

import { isSolvedBent } from './starts.js';
import { outward, sideOf } from './wheelloads.js';
import { nearest } from './wheelsetdata.js';

/** @typedef {import('./api.js').CheckedCase} CheckedCase */
/** @typedef {NonNullable<NonNullable<CheckedCase['understood']>['placement']>} Placement */
/** @typedef {[number, number]} Place y to the left and z up, in mm. */

/**
 * @typedef {object} Placed
 * @property {Place[]} rail
 * @property {Place[]} wheel Wheel at the height of first contact.
 * @property {Place} touch Point of first contact.
 * @property {Place[]} gap y and the vertical distance between rail and wheel.
 */

/** Samples per mm of the gap. */
const PER_MM = 5;

/**
 * @param {Placement | null | undefined} placement
 * @returns {Placed | null}
 */
export function placed(placement) {
  if (!placement) return null;
  const points = (/** @type {number[][]} */ line) => line.map(([y, z]) => /** @type {Place} */ ([y, z]));
  const rail = points(placement.rail_mm);
  const wheel = points(placement.wheel_mm);
  const [, y, z] = placement.first_touch.track_mm;
  return { rail, wheel, touch: [y, z], gap: gapOf(rail, wheel) };
}

/**
 * Returns the vertical distance from the top of the rail to the bottom of the wheel, where both exist.
 * @param {readonly Place[]} rail
 * @param {readonly Place[]} wheel
 * @returns {Place[]}
 */
export function gapOf(rail, wheel) {
  const below = envelope(wheel, Math.min);
  const above = envelope(rail, Math.max);
  const common = [...below.keys()].filter((step) => above.has(step)).sort((one, two) => one - two);
  return common.map((step) => [step / PER_MM, (below.get(step) ?? 0) - (above.get(step) ?? 0)]);
}

/**
 * Returns the highest or lowest point of a line at every sample.
 * @param {readonly Place[]} line
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

/**
 * Returns a map from arc length and height to track axes: the arc length is measured along a line from one of its points, positive to the left,
 * and the height along its normal.
 * @param {readonly Readonly<Place>[]} line From end to end.
 * @param {Readonly<Place>} from Origin of the arc length, on the line or close to it.
 * @returns {(along: number, height: number) => Place}
 */
export function unfolded(line, from) {
  const points = line[0][0] < line[line.length - 1][0] ? line : [...line].reverse();
  const lengths = [0];
  for (let i = 1; i < points.length; i += 1) lengths.push(lengths[i - 1] + Math.hypot(points[i][0] - points[i - 1][0], points[i][1] - points[i - 1][1]));
  let start = 0;
  let nearest = Infinity;
  for (let i = 1; i < points.length; i += 1) {
    const [[y, z], [y1, z1]] = [points[i - 1], points[i]];
    const length = lengths[i] - lengths[i - 1];
    const share = length ? Math.min(1, Math.max(0, ((from[0] - y) * (y1 - y) + (from[1] - z) * (z1 - z)) / length ** 2)) : 0;
    const away = Math.hypot(y + share * (y1 - y) - from[0], z + share * (z1 - z) - from[1]);
    if (away >= nearest) continue;
    nearest = away;
    start = lengths[i - 1] + share * length;
  }
  return (along, height) => {
    const at = start + along;
    const after = lengths.findIndex((length) => length > at);
    const i = after < 0 ? points.length - 1 : Math.max(1, after);
    const length = lengths[i] - lengths[i - 1] || 1;
    const [cos, sin] = [(points[i][0] - points[i - 1][0]) / length, (points[i][1] - points[i - 1][1]) / length];
    const beyond = at - lengths[i - 1];
    return [points[i - 1][0] + beyond * cos - height * sin, points[i - 1][1] + beyond * sin + height * cos];
  };
}

/**
 * Returns a map from places in track axes to the y coordinate of a cross-section, positive to the field side.
 * @param {Place} from A place in track axes.
 * @param {number} fromY The y coordinate of `from` on the cross-section.
 * @param {import('./wheelloads.js').Side} side
 * @param {number} cant Turn of the cross-section with its top toward the track centre, in rad.
 * @returns {(place: Place) => number}
 */
const onSection = (from, fromY, side, cant) => ([y, z]) => fromY + outward(side, y - from[0]) * Math.cos(cant) + (z - from[1]) * Math.sin(cant);

/**
 * Returns a map from the y coordinate of a cross-section, positive to the field side, to the highest such place on its line.
 * @param {readonly Place[]} line In track axes.
 * @param {Place} from A place of the line in track axes.
 * @param {number} fromY The y coordinate of `from` on the cross-section.
 * @param {import('./wheelloads.js').Side} side
 * @param {number} cant Turn of the cross-section with its top toward the track centre, in rad.
 * @returns {(y: number) => Place}
 */
export function placeOn(line, from, fromY, side, cant) {
  const ys = line.map(onSection(from, fromY, side, cant));
  return (wanted) => {
    /** @type {Place | null} */
    let highest = null;
    for (let i = 1; i < line.length; i += 1) {
      const share = (wanted - ys[i - 1]) / (ys[i] - ys[i - 1]);
      if (!(share >= 0 && share <= 1)) continue;
      const z = line[i - 1][1] + share * (line[i][1] - line[i - 1][1]);
      if (!highest || z > highest[1]) highest = [line[i - 1][0] + share * (line[i][0] - line[i - 1][0]), z];
    }
    return highest ?? line[nearest(ys, wanted)];
  };
}

/**
 * Returns a map from the lateral coordinate of a patch and the height above its surface to track axes. The surface is a plane or the rail itself.
 * @param {import('./api.js').Patch} patch
 * @param {readonly Readonly<Place>[]} rail
 * @param {boolean} bent
 * @returns {((across: number, height: number) => Place) | null} Null for a patch without a position.
 */
export function surfaceOf({ position }, rail, bent) {
  if (!position) return null;
  const [, y0, z0] = position.origin_track_mm;
  if (bent) return unfolded(rail, [y0, z0]);
  const [cos, sin] = [Math.cos(position.contact_angle_rad), Math.sin(position.contact_angle_rad)];
  return (across, height) => [y0 + across * cos - height * sin, z0 + across * sin + height * cos];
}

/**
 * Returns a map from the lateral coordinate of a patch to the y coordinate of a cross-section, positive to the field side.
 * @param {import('./api.js').Patch} patch
 * @param {'rail' | 'wheel'} body
 * @param {import('./wheelloads.js').Side} side
 * @param {import('./result.js').Standing | undefined} standing The placed wheel and rail; a plane is used while undefined.
 * @param {boolean} bent
 * @returns {(across: number) => number}
 */
export function acrossSection(patch, body, side, standing, bent) {
  const { position } = patch;
  const surface = surfaceOf(patch, standing?.placed.rail ?? [], bent && standing !== undefined);
  if (!position || !surface) return (across) => across;
  const [, y, z] = position.track_mm;
  const own = body === 'rail' ? onSection([y, z], position.rail_mm[0], side, standing?.cant ?? 0) : onSection([y, z], position.wheel_mm[0], side, 0);
  return (across) => own(surface(across, 0));
}

/** @typedef {Pick<import('./compare.js').Side, 'result' | 'patch' | 'document' | 'sections' | 'field'>} OnRail A patch of a result. */

/** Number of samples across the second patch among which the nearest point is searched. */
const SAMPLES = 400;

/**
 * Returns a map from places of one patch to places of the other at the same position on the rail.
 * @param {OnRail} one
 * @param {OnRail} two
 * @returns {((place: { x: number, y: number }) => { x: number, y: number }) | null} Null if the patches have no position.
 */
export function onSameRail(one, two) {
  const [first, second] = [one, two].map(onRail);
  if (!first || !second || !two.field) return null;
  const ys = two.field.cells.y_mm;
  const [low, high] = [Math.min(...ys) - 1, Math.max(...ys) + 1];
  const places = Array.from({ length: SAMPLES + 1 }, (_, at) => low + ((high - low) * at) / SAMPLES);
  const points = places.map(second.of);
  /** Cache by y; all cells of a strip have the same y. @type {Map<number, number>} */
  const known = new Map();
  return ({ x, y }) => {
    if (!known.has(y)) {
      const [py, pz] = first.of(y);
      const distances = points.map(([qy, qz]) => Math.hypot(qy - py, qz - pz));
      known.set(y, places[distances.indexOf(Math.min(...distances))]);
    }
    return { x: x + first.x - second.x, y: known.get(y) ?? NaN };
  };
}

/** Returns a map from the lateral coordinate of a patch, along its plane or along the rail, to points of the rail with y to the field side and z up. @param {OnRail} side */
function onRail({ result, patch, document, sections }) {
  const { position } = result.patches[patch];
  if (!position) return null;
  const [x, y0, z0] = position.origin_track_mm;
  const hand = y0 > 0 ? 'left' : 'right';
  /** @type {readonly Place[]} */
  const rail = isSolvedBent(document, result, patch) && sections ? sections.rail : [];
  // The left rail is the mirrored right rail.
  const own = sideOf(document) === hand ? rail : rail.map(([y, z]) => /** @type {Place} */ ([-y, z]));
  const surface = surfaceOf(result.patches[patch], own, own.length > 0);
  return { x, of: (/** @type {number} */ across) => {
    const [y, z] = surface ? surface(across, 0) : [y0, z0];
    return /** @type {Place} */ ([outward(hand, y), z]);
  } };
}
