// Layout of a field map in CSS pixels.

/** @typedef {{ x0: number, x1: number, y0: number, y1: number }} Extent In mm. */

/**
 * @typedef {object} Box
 * @property {number} left
 * @property {number} top
 * @property {number} width
 * @property {number} height
 */

/**
 * @typedef {object} Layout
 * @property {number} width Width of the whole picture.
 * @property {number} height
 * @property {Box} map
 * @property {Box | null} along The section along rolling, below the map.
 * @property {Box | null} across The lateral section, on the right.
 * @property {number} scale Pixels per mm, the same in both directions.
 * @property {number} x0 Smallest x of the map, in mm.
 * @property {number} y1
 * @property {boolean} narrow
 * @property {(x: number) => number} X Maps mm to pixels.
 * @property {(y: number) => number} Y
 */

const MARGIN = { left: 50, top: 48, right: 14, bottom: 42 };
const NARROW = 560;

/**
 * @param {Extent} extent The visible extent.
 * @param {number} width The available width.
 * @param {{ sections: boolean, tallest: number }} wish
 * @returns {Layout}
 */
export function layoutMap(extent, width, { sections, tallest }) {
  const narrow = width < NARROW;
  const { x0, x1, y0, y1 } = padded(extent);
  const beside = sections && !narrow;
  const gap = beside ? 16 : 0;
  const least = beside ? Math.min(200, width * 0.24) : 0;
  const free = width - MARGIN.left - MARGIN.right - gap;
  const scale = Math.min((free - least) / (x1 - x0), tallest / (y1 - y0));
  // The space beside a tall patch is used by the lateral section first, then by the margin of the map.
  const mapWidth = beside ? Math.max(scale * (x1 - x0), Math.min(free - least, free * 0.6)) : free;
  const map = { left: MARGIN.left, top: MARGIN.top, width: mapWidth, height: scale * (y1 - y0) };
  const left = x0 - (mapWidth / scale - (x1 - x0)) / 2;
  const bottom = map.top + map.height + MARGIN.bottom;
  const along = sections ? { left: map.left, top: bottom + 20, width: map.width, height: narrow ? 104 : 124 } : null;
  const across = beside
    ? { left: map.left + map.width + gap, top: map.top, width: Math.min(free - map.width, 330), height: map.height }
    : null;
  const height = along ? along.top + along.height + 8 : bottom;
  return { width, height, map, along, across, narrow, ...transform(map, left, y1, scale) };
}

/**
 * Returns the layout of a small picture without axes, at a given scale.
 * @param {Extent} extent
 * @param {number} scale Pixels per mm.
 * @returns {Layout}
 */
export function layoutCompact(extent, scale) {
  const { x0, x1, y0, y1 } = padded(extent);
  const map = { left: 0, top: 0, width: (x1 - x0) * scale, height: (y1 - y0) * scale };
  const whole = { width: map.width, height: map.height, map, along: null, across: null, narrow: true };
  return { ...whole, ...transform(map, x0, y1, scale) };
}

/** @param {Extent} extent @returns {Extent} */
function padded({ x0, x1, y0, y1 }) {
  const pad = 0.05 * Math.max(x1 - x0, y1 - y0) || 1;
  return { x0: x0 - pad, x1: x1 + pad, y0: y0 - pad, y1: y1 + pad };
}

/**
 * @param {Box} map
 * @param {number} x0
 * @param {number} y1
 * @param {number} scale
 */
const transform = (map, x0, y1, scale) => ({
  scale,
  x0,
  y1,
  X: (/** @type {number} */ x) => map.left + (x - x0) * scale,
  Y: (/** @type {number} */ y) => map.top + (y1 - y) * scale,
});
