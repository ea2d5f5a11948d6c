// Index of the cells of a field by strip, with lookup by position, extent and border of the patch.

/** @typedef {import('../fields.js').Cells} Cells */
/** @typedef {import('../fields.js').Field} Field */
/** @typedef {import('../fields.js').Loop} Loop */

/**
 * @typedef {object} Strip
 * @property {number} y Centre of the strip.
 * @property {number} low
 * @property {number} high
 * @property {number} first Index of the first cell.
 * @property {number} end Index after the last cell.
 * @property {number} left Start of the first cell.
 * @property {number} right End of the last cell.
 * @property {boolean} whole Whether the cells have no gaps between them.
 */

export class CellIndex {
  /** @param {Field} field */
  constructor(field) {
    this.cells = field.cells;
    this.strips = stripsOf(field.cells);
    this.border = (field.border?.length ? field.border : [outline(this.strips)]).map(smoothLoop);
    const across = this.border.flat();
    this.x0 = Math.min(...across.map(([x]) => x), ...this.strips.map((strip) => strip.left));
    this.x1 = Math.max(...across.map(([x]) => x), ...this.strips.map((strip) => strip.right));
    this.y0 = Math.min(...across.map(([, y]) => y), ...this.strips.map((strip) => strip.low));
    this.y1 = Math.max(...across.map(([, y]) => y), ...this.strips.map((strip) => strip.high));
  }

  /** Whether values can be interpolated between strips, which requires a patch without holes. */
  get whole() {
    return this.border.length === 1 && this.strips.length > 2 && this.strips.every((strip) => strip.whole);
  }

  /**
   * Returns the strip at y; -1 outside.
   * @param {number} y
   */
  stripAt(y) {
    let low = 0;
    let high = this.strips.length - 1;
    while (low <= high) {
      const middle = (low + high) >> 1;
      const strip = this.strips[middle];
      if (y < strip.low) high = middle - 1;
      else if (y > strip.high) low = middle + 1;
      else return middle;
    }
    return -1;
  }

  /**
   * Returns the cell of a strip at x; -1 outside.
   * @param {number} at Index of the strip.
   * @param {number} x
   */
  cellIn(at, x) {
    const strip = this.strips[at];
    if (!strip) return -1;
    const { x_mm, dx_mm } = this.cells;
    let low = strip.first;
    let high = strip.end - 1;
    while (low <= high) {
      const middle = (low + high) >> 1;
      const half = dx_mm[middle] / 2 + 1e-9;
      if (x < x_mm[middle] - half) high = middle - 1;
      else if (x > x_mm[middle] + half) low = middle + 1;
      else return middle;
    }
    return -1;
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  cellAt(x, y) {
    return this.cellIn(this.stripAt(y), x);
  }

  /**
   * Returns the cell at a place or close to it, because the outermost cells of two meshes of one patch differ slightly; -1 for none.
   * @param {number} x
   * @param {number} y
   */
  nearest(x, y) {
    const last = this.strips.length - 1;
    if (last < 0) return -1;
    const inside = this.stripAt(y);
    const at = inside >= 0 ? inside : y < this.strips[0].low ? 0 : last;
    const strip = this.strips[at];
    const cell = this.cellIn(at, x);
    if (cell >= 0) return cell;
    const beside = x < strip.left ? strip.first : strip.end - 1;
    const reach = 2 * (strip.high - strip.low) + this.cells.dx_mm[beside];
    return Math.hypot(x - this.cells.x_mm[beside], y - strip.y) <= reach ? beside : -1;
  }

  /** Returns the cells at x, one of each strip that extends to it. @param {number} x */
  column(x) {
    return this.strips.map((_, at) => this.cellIn(at, x)).filter((cell) => cell >= 0);
  }

  /** Returns the cells of a strip. @param {number} at */
  row(at) {
    const strip = this.strips[at];
    return strip ? Array.from({ length: strip.end - strip.first }, (_, place) => strip.first + place) : [];
  }
}

/** @type {WeakMap<Field, CellIndex>} */
const known = new WeakMap();

/** Returns the cached index of a field. @param {Field} field */
export function indexOf(field) {
  const index = known.get(field) ?? new CellIndex(field);
  known.set(field, index);
  return index;
}

/**
 * @param {Cells} cells
 * @returns {Strip[]}
 */
function stripsOf({ x_mm, y_mm, dx_mm, dy_mm, strip }) {
  /** @type {Strip[]} */
  const strips = [];
  for (let cell = 0; cell < strip.length; cell += 1) {
    const left = x_mm[cell] - dx_mm[cell] / 2;
    const right = x_mm[cell] + dx_mm[cell] / 2;
    const open = strips.at(-1);
    if (open && strip[cell] === strip[cell - 1]) {
      open.whole &&= left - open.right < 1e-6 + 1e-3 * dx_mm[cell];
      open.end = cell + 1;
      open.right = right;
      continue;
    }
    const half = dy_mm[cell] / 2;
    strips.push({ y: y_mm[cell], low: y_mm[cell] - half, high: y_mm[cell] + half, first: cell, end: cell + 1, left, right, whole: true });
  }
  return strips;
}

/**
 * Returns an approximate border of a patch around the ends of its strips.
 * @param {Strip[]} strips
 * @returns {Loop}
 */
function outline(strips) {
  if (!strips.length) return [];
  const first = strips[0];
  const last = strips[strips.length - 1];
  const middle = (/** @type {Strip} */ strip) => (strip.left + strip.right) / 2;
  return [
    [middle(first), first.low],
    ...strips.map((strip) => /** @type {[number, number]} */ ([strip.right, strip.y])),
    [middle(last), last.high],
    ...strips.map((strip) => /** @type {[number, number]} */ ([strip.left, strip.y])).reverse(),
  ];
}

/** Number of parts into which each segment of a border is divided. */
const FINER = 6;
/** Cosine of 75°, the smallest turn of a sharp corner. With few strips, the border of an ellipse turns by 60° at its ends. */
const CORNER = 0.26;

/**
 * Returns a closed smooth curve through the points of a border (centripetal Catmull-Rom; Yuksel, Schaefer and Keyser, 2011). Most patches have
 * smooth borders, which few strips approximate by polygons. Sharp corners are kept.
 * @param {Loop} loop
 * @returns {Loop}
 */
export function smoothLoop(loop) {
  const corners = loop.filter(([x, y], at) => {
    const [xb, yb] = loop[(at || loop.length) - 1];
    return x !== xb || y !== yb;
  });
  if (corners.length < 4 || corners.length > 400) return loop;
  return corners.flatMap((one, at) => {
    const before = corners[(at + corners.length - 1) % corners.length];
    const two = corners[(at + 1) % corners.length];
    const after = corners[(at + 2) % corners.length];
    return Array.from({ length: FINER }, (_, part) => between(before, one, two, after, part / FINER));
  });
}

/**
 * Returns a smooth curve through the points of an open line.
 * @param {[number, number][]} line
 * @returns {[number, number][]}
 */
export function smoothLine(line) {
  const last = line.length - 1;
  if (last < 2 || last > 400) return line;
  const beyond = (/** @type {[number, number]} */ end, /** @type {[number, number]} */ next) => /** @type {[number, number]} */ ([2 * end[0] - next[0], 2 * end[1] - next[1]]);
  const all = [beyond(line[0], line[1]), ...line, beyond(line[last], line[last - 1])];
  const inner = line.slice(0, last).flatMap((one, at) => Array.from({ length: FINER }, (_, part) => between(all[at], one, line[at + 1], all[at + 3], part / FINER)));
  return [...inner, line[last]];
}

/**
 * @param {[number, number]} before
 * @param {[number, number]} one
 * @param {[number, number]} two
 * @param {[number, number]} after
 * @param {number} share Fraction of the way from `one` to `two`.
 * @returns {[number, number]}
 */
function between(before, one, two, after, share) {
  const knot = (/** @type {[number, number]} */ from, /** @type {[number, number]} */ to) => Math.sqrt(Math.hypot(to[0] - from[0], to[1] - from[1]));
  const [a, b, c] = [knot(before, one), knot(one, two), knot(two, after)];
  const sharpStart = turn(before, one, two) < CORNER;
  const sharpEnd = turn(one, two, after) < CORNER;
  const along = (/** @type {0 | 1} */ axis) => {
    const [p0, p1, p2, p3] = [before[axis], one[axis], two[axis], after[axis]];
    const start = sharpStart ? p2 - p1 : b * ((p1 - p0) / a - (p2 - p0) / (a + b) + (p2 - p1) / b);
    const end = sharpEnd ? p2 - p1 : b * ((p2 - p1) / b - (p3 - p1) / (b + c) + (p3 - p2) / c);
    const [s, s2, s3] = [share, share ** 2, share ** 3];
    return (2 * s3 - 3 * s2 + 1) * p1 + (s3 - 2 * s2 + s) * start + (3 * s2 - 2 * s3) * p2 + (s3 - s2) * end;
  };
  return [along(0), along(1)];
}

/** Returns the cosine of the turn at a corner. @param {[number, number]} before @param {[number, number]} at @param {[number, number]} after */
function turn(before, at, after) {
  const [x1, y1, x2, y2] = [at[0] - before[0], at[1] - before[1], after[0] - at[0], after[1] - at[1]];
  return (x1 * x2 + y1 * y2) / (Math.hypot(x1, y1) * Math.hypot(x2, y2));
}
