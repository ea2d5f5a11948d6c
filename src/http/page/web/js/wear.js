// Comparison of two cross-sections: their alignment, and the wear as the distance by which the second lies inside the first.

/** @typedef {import('./placing.js').Place} Place */
/** @typedef {'rail' | 'wheel'} Body */

/**
 * @typedef {object} Wear
 * @property {readonly Place[]} moved The second cross-section, aligned with the first.
 * @property {readonly [number, number][]} curve Length along the first cross-section and depth of missing material, in mm.
 * @property {number} area Total area of missing material, in mm².
 * @property {number} added Total area of additional material, in mm².
 * @property {{ depth: number, at: Place } | null} most Largest depth and its position.
 */

/**
 * Iterations of a fit that use all points, then the nearest share `NEAREST`, because the others may be worn, and last all points within `FITTED` times
 * the distance of that share, which averages the noise of measured points. Compared with other shares on a worn rail, exact and with noise.
 */
const WHOLE_ROUNDS = 6;
const NEAREST_ROUNDS = 24;
const LAST_ROUNDS = 10;
const NEAREST = 0.55;
const FITTED = 2;
/** Distance beyond which a line belongs to another part of the cross-section. */
const REACH_MM = 20;

/** Returns the nearest place on a line; `end` is true if the point lies beyond an end of the line. @param {readonly Place[]} line @param {Place} from */
function nearestOn(line, [y, z]) {
  let best = { distance: Infinity, place: line[0], end: true };
  for (let at = 1; at < line.length; at += 1) {
    const [ya, za] = line[at - 1];
    const [dy, dz] = [line[at][0] - ya, line[at][1] - za];
    const length = dy * dy + dz * dz;
    const share = length ? ((y - ya) * dy + (z - za) * dz) / length : 0;
    const inside = Math.max(0, Math.min(1, share));
    const place = /** @type {Place} */ ([ya + inside * dy, za + inside * dz]);
    const distance = Math.hypot(place[0] - y, place[1] - z);
    if (distance < best.distance) best = { distance, place, end: (at === 1 && share < 0) || (at === line.length - 1 && share > 1) };
  }
  return best;
}

/** Resamples a line with an approximate spacing. @param {readonly Place[]} line @param {number} step In mm. */
function resampled(line, step) {
  /** @type {Place[]} */
  const points = [line[0]];
  for (let at = 1; at < line.length; at += 1) {
    const [ya, za] = line[at - 1];
    const [yb, zb] = line[at];
    const parts = Math.max(1, Math.round(Math.hypot(yb - ya, zb - za) / step));
    for (let part = 1; part <= parts; part += 1) points.push([ya + (part / parts) * (yb - ya), za + (part / parts) * (zb - za)]);
  }
  const kept = points.slice(0, 1);
  for (const point of points) {
    const last = kept[kept.length - 1];
    if (Math.hypot(point[0] - last[0], point[1] - last[1]) >= 0.9 * step) kept.push(point);
  }
  return kept;
}

/** Returns the unit normal of a line at a point, to the left of its direction. @param {readonly Place[]} line @param {number} at @returns {Place} */
function normalAt(line, at) {
  const [before, after] = [line[Math.max(0, at - 1)], line[Math.min(line.length - 1, at + 1)]];
  const [dy, dz] = [after[0] - before[0], after[1] - before[1]];
  const length = Math.hypot(dy, dz) || 1;
  return [-dz / length, dy / length];
}

/** Determinant of the mean products of the normals' components above which a part of a cross-section determines both shifts. Chosen by judgement. */
const SPREAD_MIN = 0.01;

/** Returns a test for the unworn part: the field side of a rail, or the back of a wheel's flange up to its tip. @param {readonly Place[]} line @param {Body} body */
function unworn(line, body) {
  const ys = line.map(([y]) => y);
  const middle = (Math.min(...ys) + Math.max(...ys)) / 2;
  const tip = line.reduce((lowest, point) => (point[1] < lowest[1] ? point : lowest));
  return (/** @type {Place} */ [y]) => (body === 'rail' ? y > middle : y < tip[0]);
}

/**
 * Returns the shift of the second line that fits its unworn part to the first line, by least squares of the distances along its normals. Later
 * iterations leave out points that are worn. The whole line is used if the unworn part does not determine both shifts.
 * @param {readonly Place[]} one Both lines have y to the field side.
 * @param {readonly Place[]} two
 * @param {Body} body
 * @returns {Place} In mm.
 */
export function bestFit(one, two, body) {
  // Chords of a spacing h lie h²/8R inside an arc, which would shift the fit. Chords of 0.1 mm are 1e-4 mm off at the corners of a head.
  const fixed = resampled(one, 0.1);
  const whole = resampled(two, 1).map((point, at, line) => ({ point, normal: normalAt(line, at) }));
  const isUnworn = unworn(two, body);
  const part = whole.filter(({ point }) => isUnworn(point));
  const mean = (/** @type {(normal: Place) => number} */ of) => part.reduce((sum, { normal }) => sum + of(normal), 0) / part.length;
  const spread = mean(([ny]) => ny * ny) * mean(([, nz]) => nz * nz) - mean(([ny, nz]) => ny * nz) ** 2;
  const free = spread > SPREAD_MIN ? part : whole;
  let [sy, sz] = [0, 0];
  let within = Infinity;
  for (let round = 0; round < WHOLE_ROUNDS + NEAREST_ROUNDS + LAST_ROUNDS; round += 1) {
    const pairs = free.flatMap(({ point: [y, z], normal: [ny, nz] }) => {
      const found = nearestOn(fixed, [y + sy, z + sz]);
      return found.end ? [] : [{ ny, nz, rest: ny * (found.place[0] - y - sy) + nz * (found.place[1] - z - sz) }];
    }).sort((a, b) => Math.abs(a.rest) - Math.abs(b.rest));
    if (round >= WHOLE_ROUNDS) within = (round < WHOLE_ROUNDS + NEAREST_ROUNDS ? 1 : FITTED) * Math.abs(pairs[Math.floor(NEAREST * pairs.length)]?.rest ?? 0);
    const near = pairs.filter(({ rest }) => Math.abs(rest) <= within);
    const sum = (/** @type {(of: typeof near[number]) => number} */ of) => near.reduce((total, pair) => total + of(pair), 0);
    const [yy, yz, zz] = [sum(({ ny }) => ny * ny), sum(({ ny, nz }) => ny * nz), sum(({ nz }) => nz * nz)];
    const [ry, rz] = [sum(({ ny, rest }) => ny * rest), sum(({ nz, rest }) => nz * rest)];
    const determinant = yy * zz - yz * yz;
    if (!(determinant > 1e-9)) break;
    const [dy, dz] = [(zz * ry - yz * rz) / determinant, (yy * rz - yz * ry) / determinant];
    sy += dy;
    sz += dz;
  }
  return [sy, sz];
}

/** Returns the signed distance from a point along a direction to the nearest intersection with a line; NaN if there is none within reach. @param {readonly Place[]} line @param {Place} from @param {Place} direction */
function metAlong(line, [y, z], [ny, nz]) {
  let best = NaN;
  for (let at = 1; at < line.length; at += 1) {
    const [ya, za] = line[at - 1];
    const [dy, dz] = [line[at][0] - ya, line[at][1] - za];
    const cross = ny * dz - nz * dy;
    if (Math.abs(cross) < 1e-12) continue;
    const share = ((ya - y) * nz - (za - z) * ny) / cross;
    if (share < -1e-9 || share > 1 + 1e-9) continue;
    const far = ((ya - y) * dz - (za - z) * dy) / cross;
    if (!(Math.abs(far) >= Math.abs(best))) best = far;
  }
  return Math.abs(best) <= REACH_MM ? best : NaN;
}

/**
 * Returns the material that the second cross-section lacks compared with the first.
 * @param {readonly Place[]} one
 * @param {readonly Place[]} two
 * @param {Body} body The material of a rail is below its line, that of a wheel above.
 * @param {Place} shift Shift of the second, in mm.
 * @returns {Wear}
 */
export function wearBetween(one, two, body, [sy, sz]) {
  const first = resampled(one, 0.25);
  const moved = two.map(([y, z]) => /** @type {Place} */ ([y + sy, z + sz]));
  const outward = body === 'rail' ? 1 : -1;
  const top = first.reduce((best, [, z], at) => (outward * z > outward * first[best][1] ? at : best), 0);
  // The direction of the line determines which side is outside.
  const sense = Math.sign(normalAt(first, top)[1]) === outward ? 1 : -1;
  /** @type {[number, number][]} */
  const curve = [];
  let [length, area, added] = [0, 0, 0];
  /** @type {Wear['most']} */
  let most = null;
  /** @type {{ from: Place, to: Place, depth: number } | null} */
  let before = null;
  first.forEach((point, at) => {
    if (at) length += Math.hypot(point[0] - first[at - 1][0], point[1] - first[at - 1][1]);
    const [ny, nz] = normalAt(first, at);
    const depth = -sense * metAlong(moved, point, [ny, nz]);
    if (!Number.isFinite(depth)) {
      before = null;
      return;
    }
    const here = { from: point, to: /** @type {Place} */ ([point[0] - sense * depth * ny, point[1] - sense * depth * nz]), depth };
    curve.push([length, depth]);
    if (before) {
      const between = quadrangle(before.from, here.from, here.to, before.to);
      if (before.depth + depth > 0) area += between;
      else added += between;
    }
    if (!most || depth > most.depth) most = { depth, at: point };
    before = here;
  });
  return { moved, curve, area, added, most };
}

/** Returns the area of a quadrangle. @param {Place[]} corners */
function quadrangle(...corners) {
  const twice = corners.reduce((sum, [y, z], at) => {
    const [yb, zb] = corners[(at + 1) % corners.length];
    return sum + y * zb - yb * z;
  }, 0);
  return Math.abs(twice) / 2;
}
