// Rasterises values of cells to pixels, without interpolation or interpolated inside the border of the patch.

import { slipDistances } from './stick.js';

/** @typedef {import('./cells.js').CellIndex} CellIndex */

/**
 * @typedef {object} Frame
 * Pixels of a picture. The centre of pixel (column, row) is at x0 + (column + ½)·step, y1 − (row + ½)·step.
 * @property {number} width
 * @property {number} height
 * @property {number} x0 Left edge in mm.
 * @property {number} y1 Upper edge in mm.
 * @property {number} step Side of a pixel in mm.
 */

/** Number of samples along a strip. Neighbouring strips are interpolated at equal fractions of their lengths. */
const SAMPLES = 512;

/**
 * Returns a raster with a constant value in each cell.
 * @param {CellIndex} index
 * @param {ArrayLike<number>} values
 * @param {Frame} frame
 * @returns {Float32Array} Row by row from the top; NaN outside.
 */
export function rasterCells(index, values, frame) {
  const raster = new Float32Array(frame.width * frame.height).fill(NaN);
  const { x_mm, dx_mm } = index.cells;
  for (let row = 0; row < frame.height; row += 1) {
    const strip = index.strips[index.stripAt(frame.y1 - (row + 0.5) * frame.step)];
    if (!strip) continue;
    for (let cell = strip.first; cell < strip.end; cell += 1) {
      const from = Math.round((x_mm[cell] - dx_mm[cell] / 2 - frame.x0) / frame.step);
      const to = Math.round((x_mm[cell] + dx_mm[cell] / 2 - frame.x0) / frame.step);
      raster.fill(values[cell], row * frame.width + Math.max(0, from), row * frame.width + Math.min(frame.width, Math.max(0, to)));
    }
  }
  return raster;
}

/**
 * Returns a raster of values interpolated between cell centres, along the strips and between them, inside the border.
 * @param {CellIndex} index A `whole` index.
 * @param {ArrayLike<number>} values
 * @param {Frame} frame
 * @param {boolean} vanishes Whether the value is 0 at the border.
 * @returns {Float32Array} Row by row from the top; NaN outside.
 */
export function rasterSmooth(index, values, frame, vanishes) {
  return rasterSamples(index, samplesOf(index, values, vanishes), frame, vanishes);
}

/**
 * Returns a raster of distances from the border of the stick zone as fractions of the strip, negative in the stick zone.
 * @param {CellIndex} index A `whole` index with zones.
 * @param {number} friction
 * @param {Frame} frame
 */
export const rasterZones = (index, friction, frame) => rasterSamples(index, slipDistances(index, friction, SAMPLES), frame, false);

/**
 * @param {CellIndex} index
 * @param {Float32Array} samples
 * @param {Frame} frame
 * @param {boolean} vanishes
 */
function rasterSamples(index, samples, frame, vanishes) {
  const raster = new Float32Array(frame.width * frame.height).fill(NaN);
  const { strips, border } = index;
  const last = strips.length - 1;
  for (let row = 0, upper = last; row < frame.height; row += 1) {
    const y = frame.y1 - (row + 0.5) * frame.step;
    const span = spanAt(border[0], y);
    if (!span) continue;
    while (upper > 0 && strips[upper].y > y) upper -= 1;
    const below = y < strips[0].y ? 0 : upper;
    const above = y < strips[0].y ? 0 : Math.min(last, upper + 1);
    const share = below === above ? 0 : (y - strips[below].y) / (strips[above].y - strips[below].y);
    const fade = below === above && vanishes ? edgeFade(index, strips[below], y) : 1;
    const [left, right] = span;
    // Two extra pixels on either side are clipped later by the path of the border.
    const from = Math.max(0, Math.floor((left - frame.x0) / frame.step) - 2);
    const to = Math.min(frame.width, Math.ceil((right - frame.x0) / frame.step) + 2);
    const perMm = SAMPLES / (right - left || 1);
    const one = below * SAMPLES;
    const two = above * SAMPLES;
    for (let column = from; column < to; column += 1) {
      let at = ((frame.x0 + (column + 0.5) * frame.step - left) * perMm) | 0;
      at = at < 0 ? 0 : at >= SAMPLES ? SAMPLES - 1 : at;
      raster[row * frame.width + column] = fade * (samples[one + at] * (1 - share) + samples[two + at] * share);
    }
  }
  return raster;
}

/**
 * Returns the factor by which values that vanish at the border decrease beyond the centre of the outermost strip.
 * @param {CellIndex} index
 * @param {import('./cells.js').Strip} strip
 * @param {number} y
 */
function edgeFade(index, strip, y) {
  const edge = y > strip.y ? index.y1 : index.y0;
  return Math.sqrt(Math.max(0, (edge - y) / (edge - strip.y || 1)));
}

/** Cached samples, indexed by whether the value is 0 at the border. @type {[WeakMap<ArrayLike<number>, Float32Array>, WeakMap<ArrayLike<number>, Float32Array>]} */
const sampled = [new WeakMap(), new WeakMap()];

/** Returns the cached samples of values. @param {CellIndex} index @param {ArrayLike<number>} values @param {boolean} vanishes */
function samplesOf(index, values, vanishes) {
  const of = sampled[vanishes ? 1 : 0];
  const known = of.get(values) ?? sampleStrips(index, values, vanishes);
  of.set(values, known);
  return known;
}

/** Number of points of a section. */
const SECTION_POINTS = 80;

/**
 * Returns interpolated values on a line through the patch, from border to border.
 * @param {CellIndex} index A `whole` index.
 * @param {ArrayLike<number>} values
 * @param {boolean} along Whether the line is longitudinal, else lateral.
 * @param {{ x: number, y: number }} place A point on the line.
 * @param {boolean} vanishes Whether the value is 0 at the border.
 * @param {number} [points]
 * @returns {[number, number][]} Positions on the line in mm, with their values.
 */
export function sectionSmooth(index, values, along, place, vanishes, points = SECTION_POINTS) {
  const [loop] = index.border;
  const span = along ? spanAt(loop, place.y) : spanAt(loop.map(([x, y]) => /** @type {const} */ ([y, x])), place.x);
  if (!span) return [];
  const [low, high] = span;
  const step = (high - low) / points;
  const frame = along
    ? { width: points, height: 1, x0: low, y1: place.y + step / 2, step }
    : { width: 1, height: points, x0: place.x - step / 2, y1: high, step };
  const raster = rasterSmooth(index, values, frame, vanishes);
  const inner = Array.from(raster, (value, at) => /** @type {[number, number]} */ ([along ? low + (at + 0.5) * step : high - (at + 0.5) * step, value]))
    .filter(([, value]) => Number.isFinite(value));
  if (!inner.length) return [];
  const end = (/** @type {number} */ at, /** @type {[number, number]} */ near) => /** @type {[number, number]} */ ([at, vanishes ? 0 : near[1]]);
  return [end(along ? low : high, inner[0]), ...inner, end(along ? high : low, inner[inner.length - 1])];
}

/**
 * @param {CellIndex} index
 * @param {ArrayLike<number>} values
 * @param {boolean} vanishes
 */
function sampleStrips({ strips, cells: { x_mm } }, values, vanishes) {
  const samples = new Float32Array(strips.length * SAMPLES);
  strips.forEach(({ first, end, left, right }, at) => {
    let cell = first;
    for (let sample = 0; sample < SAMPLES; sample += 1) {
      const x = left + ((sample + 0.5) / SAMPLES) * (right - left);
      while (cell < end - 1 && x_mm[cell + 1] < x) cell += 1;
      const before = x < x_mm[cell];
      const x0 = before ? left : x_mm[cell];
      const v0 = before ? (vanishes ? 0 : values[cell]) : values[cell];
      const beyond = !before && cell === end - 1;
      const x1 = before ? x_mm[cell] : beyond ? right : x_mm[cell + 1];
      const v1 = before ? values[cell] : beyond ? (vanishes ? 0 : values[cell]) : values[cell + 1];
      samples[at * SAMPLES + sample] = v0 + ((x - x0) / (x1 - x0 || 1)) * (v1 - v0);
    }
  });
  return samples;
}

/**
 * Returns the smallest and the largest x of a loop at y; null if it does not reach y.
 * @param {readonly (readonly [number, number])[]} loop
 * @param {number} y
 * @returns {[number, number] | null}
 */
export function spanAt(loop, y) {
  let left = Infinity;
  let right = -Infinity;
  for (let i = 0, before = loop.length - 1; i < loop.length; before = i, i += 1) {
    const [xa, ya] = loop[before];
    const [xb, yb] = loop[i];
    if (ya > y === yb > y) continue;
    const x = xa + ((y - ya) / (yb - ya)) * (xb - xa);
    if (x < left) left = x;
    if (x > right) right = x;
  }
  return right > left ? [left, right] : null;
}
