// Border between stick and slip: the points of each strip where the traction reaches the bound of friction, joined from strip to strip.

/** @typedef {import('./cells.js').CellIndex} CellIndex */
/** @typedef {[number, number][]} Line */

/** Returns the x of each border between stick and slip, by strip. @param {CellIndex} index An index with zones. @param {number} friction */
function crossingsOf(index, friction) {
  const { zone = [] } = index.cells;
  return index.strips.map((strip) => {
    /** @type {number[]} */
    const places = [];
    for (let cell = strip.first + 1; cell < strip.end; cell += 1) {
      if ((zone[cell] === 'slip') === (zone[cell - 1] === 'slip')) continue;
      places.push(crossing(index, cell, friction));
    }
    return places;
  });
}

/** Largest distance, as a fraction of the strip; also that of strips without a border. It rounds zones that end between two strips. Chosen by judgement. */
const WHOLE = 0.25;

/**
 * Returns the distance of each sample of a strip from the nearest border between stick and slip, as a fraction of the strip; positive in slip.
 * Interpolated between strips, the level 0 is the border of the stick zone.
 * @param {CellIndex} index An index with zones.
 * @param {number} friction
 * @param {number} count Number of samples of a strip.
 */
export function slipDistances(index, friction, count) {
  const { zone = [] } = index.cells;
  const crossings = crossingsOf(index, friction);
  const samples = new Float32Array(index.strips.length * count);
  index.strips.forEach(({ first, left, right }, at) => {
    const places = crossings[at];
    let slips = zone[first] === 'slip';
    let passed = 0;
    for (let sample = 0; sample < count; sample += 1) {
      const x = left + ((sample + 0.5) / count) * (right - left);
      while (passed < places.length && places[passed] < x) {
        slips = !slips;
        passed += 1;
      }
      const near = places.reduce((least, place) => Math.min(least, Math.abs(place - x)), Infinity) / (right - left);
      samples[at * count + sample] = (slips ? 1 : -1) * Math.min(WHOLE, near);
    }
  });
  return samples;
}

/**
 * Returns the lines between stick and slip.
 * @param {CellIndex} index
 * @param {number} friction Coefficient of friction. If it is NaN, the border lies between the cells.
 * @returns {Line[]}
 */
export function stickBorder(index, friction) {
  if (!index.cells.zone) return [];
  const crossings = crossingsOf(index, friction);
  /** @type {Line[]} */
  const lines = [];
  /** @type {Line[]} */
  let open = [];
  index.strips.forEach((strip, at) => {
    const places = crossings[at];
    const middle = at ? (index.strips[at - 1].y + strip.y) / 2 : strip.low;
    const joined = join(open, places);
    meet(open.filter((_, place) => !joined.includes(place)), middle);
    open = places.map((x, place) => {
      const known = open[joined[place]];
      if (known) known.push([x, strip.y]);
      return known ?? [[x, strip.y]];
    });
    const started = open.filter((_, place) => joined[place] < 0);
    meet(started.map((line) => line.reverse()), middle);
    started.forEach((line) => line.reverse());
    lines.push(...started);
  });
  return lines.filter((line) => line.length > 1).map((line) => reachOut(line, index));
}

/**
 * Extends a line that ends at the centre of an outermost strip over its outer half. The picture is clipped at the border.
 * @param {Line} line
 * @param {CellIndex} index
 */
function reachOut(line, { strips }) {
  const first = strips[0];
  const last = strips[strips.length - 1];
  const beyond = (/** @type {[number, number]} */ end, /** @type {[number, number]} */ before) =>
    /** @type {[number, number]} */ ([end[0] + (end[0] - before[0]) / 2, end[1] + (end[1] - before[1]) / 2]);
  const start = line[0][1] === first.y ? [beyond(line[0], line[1])] : [];
  const end = line[line.length - 1][1] === last.y ? [beyond(line[line.length - 1], line[line.length - 2])] : [];
  return [...start, ...line, ...end];
}

/**
 * Assigns lines to positions of the next strip: in order if there are equally many, else by distance.
 * @param {readonly Line[]} open
 * @param {readonly number[]} places
 * @returns {number[]} The line of each position; -1 if a new line starts there.
 */
function join(open, places) {
  if (open.length === places.length) return places.map((_, place) => place);
  const ends = open.map((line) => line[line.length - 1][0]);
  const pairs = places.flatMap((x, place) => ends.map((end, line) => ({ place, line, far: Math.abs(end - x) })));
  const joined = places.map(() => -1);
  for (const { place, line } of pairs.sort((one, two) => one.far - two.far)) {
    if (joined[place] < 0 && !joined.includes(line)) joined[place] = line;
  }
  return joined;
}

/**
 * Closes lines that end between two strips: two lines meet half-way, and other lines continue in their directions.
 * @param {readonly Line[]} ending
 * @param {number} y
 */
function meet(ending, y) {
  if (ending.length === 2) {
    const [one, two] = ending.map((line) => line[line.length - 1][0]);
    ending.forEach((line) => line.push([(one + two) / 2, y]));
    return;
  }
  for (const line of ending) {
    const last = line[line.length - 1];
    const before = line[line.length - 2];
    if (before) line.push([last[0] + ((y - last[1]) * (last[0] - before[0])) / (last[1] - before[1]), y]);
  }
}

/**
 * Returns the x between the centres of a cell and the previous one where the traction reaches μp. The margin μp − |t| of the last two
 * cells in stick is extrapolated; without it, the common edge of the cells is returned.
 * @param {CellIndex} index
 * @param {number} cell
 * @param {number} friction
 */
function crossing(index, cell, friction) {
  const { x_mm, dx_mm, zone = [] } = index.cells;
  const shared = x_mm[cell] - dx_mm[cell] / 2;
  const step = zone[cell] === 'slip' ? -1 : 1;
  const near = step < 0 ? cell - 1 : cell;
  const far = near + step;
  const slipping = near - step;
  const one = margin(index, near, friction);
  const two = zone[far] === 'slip' || index.cells.strip[far] !== index.cells.strip[cell] ? NaN : margin(index, far, friction);
  const slope = (one - two) / (x_mm[near] - x_mm[far]);
  const place = x_mm[near] - one / slope;
  if (!Number.isFinite(place)) return shared;
  const low = Math.min(x_mm[near], x_mm[slipping]);
  const high = Math.max(x_mm[near], x_mm[slipping]);
  return Math.max(low, Math.min(high, place));
}

/**
 * @param {CellIndex} index
 * @param {number} cell
 * @param {number} friction
 */
function margin({ cells }, cell, friction) {
  const { pressure_mpa, traction_x_mpa, traction_y_mpa } = cells;
  if (!pressure_mpa || !traction_x_mpa || !traction_y_mpa) return NaN;
  return friction * pressure_mpa[cell] - Math.hypot(traction_x_mpa[cell], traction_y_mpa[cell]);
}
