// Draws the picture of a field: colours inside the border, border of the stick zone, arrows, axes and colour bar.

import { fixed, number, tickLabel, ticks } from '../format.js';
import { colourise, hex, mapOf } from './palette.js';
import { rasterCells, rasterSmooth, rasterZones } from './raster.js';
import { smoothLine } from './cells.js';
import { stickBorder } from './stick.js';

/** @typedef {import('./cells.js').CellIndex} CellIndex */
/** @typedef {import('./layout.js').Layout} Layout */
/** @typedef {import('./quantities.js').Quantity} Quantity */
/** @typedef {CanvasRenderingContext2D} Pen */

/** @typedef {{ ink: string, quiet: string, line: string, sunken: string, surface: string, accent: string, stick: string, slip: string, font: string }} Ink */

/**
 * @typedef {object} Scene
 * @property {CellIndex} index
 * @property {Quantity} quantity
 * @property {ArrayLike<number>} values
 * @property {readonly [number, number]} range
 * @property {number} friction Coefficient of friction; NaN if unknown.
 * @property {boolean} border Whether the border of the stick zone is drawn.
 * @property {boolean} arrows
 * @property {boolean} mesh Whether the computed cells are shown without interpolation.
 * @property {boolean} compact
 * @property {boolean} bent Whether the lateral coordinate is the arc length along the rail.
 */

const ARROW_STEP = 30;
const HATCH_STEP = 9;

/**
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {number} density Device pixels per CSS pixel.
 * @param {Ink} ink
 */
export function drawPicture(pen, scene, layout, density, ink) {
  const { map } = layout;
  pen.setTransform(density, 0, 0, density, 0, 0);
  pen.clearRect(0, 0, layout.width, layout.height);
  if (!scene.compact) drawGround(pen, layout, ink);
  pen.save();
  pen.beginPath();
  pen.rect(map.left, map.top, map.width, map.height);
  pen.clip();
  drawValues(pen, scene, layout, density, ink);
  drawBorders(pen, scene, layout, ink);
  if (scene.arrows) drawArrows(pen, scene, layout);
  pen.restore();
  if (scene.compact) return;
  drawAxes(pen, layout, ink, scene.bent ? 's along the rail, to the left / mm' : 'y to the left / mm');
  drawBar(pen, scene, layout, ink);
}

/** @param {Layout} layout */
const ticksOf = ({ map, scale, x0, y1 }) => ({
  x: ticks(x0, x0 + map.width / scale, Math.max(3.4, map.width / 80)),
  y: ticks(y1 - map.height / scale, y1, Math.max(3.4, map.height / 56)),
});

/**
 * @param {Pen} pen
 * @param {Layout} layout
 * @param {Ink} ink
 */
function drawGround(pen, layout, ink) {
  const { map, X, Y } = layout;
  pen.fillStyle = ink.sunken;
  pen.fillRect(map.left, map.top, map.width, map.height);
  const marks = ticksOf(layout);
  pen.strokeStyle = ink.line;
  pen.lineWidth = 1;
  pen.beginPath();
  for (const x of marks.x) {
    const at = Math.round(X(x)) + 0.5;
    pen.moveTo(at, map.top);
    pen.lineTo(at, map.top + map.height);
  }
  for (const y of marks.y) {
    const at = Math.round(Y(y)) + 0.5;
    pen.moveTo(map.left, at);
    pen.lineTo(map.left + map.width, at);
  }
  pen.stroke();
}

/**
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {number} density
 * @param {Ink} ink
 */
function drawValues(pen, scene, layout, density, ink) {
  const { index, quantity, values, mesh } = scene;
  const { map } = layout;
  const smooth = !mesh && index.whole;
  const frame = {
    width: Math.ceil(map.width * density),
    height: Math.ceil(map.height * density),
    x0: layout.x0,
    y1: layout.y1,
    step: 1 / (layout.scale * density),
  };
  if (!frame.width || !frame.height) return;
  const raster = !smooth ? rasterCells(index, values, frame)
    : quantity.scale === 'zones' ? rasterZones(index, scene.friction, frame) : rasterSmooth(index, values, frame, quantity.vanishes);
  pen.save();
  if (smooth) {
    pen.beginPath();
    trace(pen, index.border, layout);
    pen.clip();
  }
  if (quantity.scale === 'zones' && !smooth) drawZones(pen, scene, layout, ink);
  else {
    const sheet = document.createElement('canvas');
    sheet.width = frame.width;
    sheet.height = frame.height;
    const sheetPen = /** @type {Pen} */ (sheet.getContext('2d'));
    const image = sheetPen.createImageData(frame.width, frame.height);
    const pixels = new Uint32Array(image.data.buffer);
    if (quantity.scale === 'zones') paintZones(raster, pixels, frame.width, density, ink);
    else colourise(raster, pixels, mapOf(quantity.scale), scene.range);
    sheetPen.putImageData(image, 0, 0);
    pen.drawImage(sheet, map.left, map.top, frame.width / density, frame.height / density);
  }
  pen.restore();
  if (mesh && index.cells.x_mm.length < 20_000) drawMesh(pen, scene, layout, density);
}

/**
 * Paints stick and slip. Slip is also hatched, because colour must not be the only distinction.
 * @param {Float32Array} distances Distance of each pixel from the border of the stick zone, negative in the stick zone.
 * @param {Uint32Array} pixels
 * @param {number} width
 * @param {number} density
 * @param {Ink} ink
 */
function paintZones(distances, pixels, width, density, ink) {
  const [stick, slip, hatched] = [wordOf(ink.stick, 1), wordOf(ink.slip, 1), wordOf(ink.slip, 0.6)];
  const step = Math.round(HATCH_STEP * density);
  for (let pixel = 0; pixel < distances.length; pixel += 1) {
    const distance = distances[pixel];
    if (distance !== distance) continue;
    const line = ((pixel % width) + Math.floor(pixel / width)) % step < density;
    pixels[pixel] = distance < 0 ? stick : line ? hatched : slip;
  }
}

/** Returns a colour as a 32-bit word of an `ImageData` on a little-endian machine. @param {string} colour A colour `#rrggbb`. @param {number} light Brightness factor. */
function wordOf(colour, light) {
  const rgb = parseInt(colour.slice(1), 16);
  const part = (/** @type {number} */ shift) => Math.round(((rgb >> shift) & 255) * light);
  return (0xff000000 | (part(0) << 16) | (part(8) << 8) | part(16)) >>> 0;
}

/**
 * Draws the zones of the computed cells. Slip is also hatched, because colour must not be the only distinction.
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {Ink} ink
 */
function drawZones(pen, { index, values }, layout, ink) {
  const { x_mm, y_mm, dx_mm, dy_mm } = index.cells;
  const { X, Y, scale, map } = layout;
  /** @type {[Path2D, Path2D]} */
  const areas = [new Path2D(), new Path2D()];
  for (let cell = 0; cell < x_mm.length; cell += 1) {
    const left = X(x_mm[cell] - dx_mm[cell] / 2);
    const top = Y(y_mm[cell] + dy_mm[cell] / 2);
    // An extra half pixel hides the seams between neighbours.
    areas[values[cell] ? 1 : 0].rect(left, top, dx_mm[cell] * scale + 0.5, dy_mm[cell] * scale + 0.5);
  }
  pen.fillStyle = ink.stick;
  pen.fill(areas[0]);
  pen.fillStyle = ink.slip;
  pen.fill(areas[1]);
  pen.save();
  pen.clip(areas[1]);
  pen.beginPath();
  for (let at = -map.height; at < map.width; at += HATCH_STEP) {
    pen.moveTo(map.left + at, map.top + map.height);
    pen.lineTo(map.left + at + map.height, map.top);
  }
  pen.strokeStyle = '#00000066';
  pen.lineWidth = 1;
  pen.stroke();
  pen.restore();
}

/**
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {number} density
 */
function drawMesh(pen, { index }, layout, density) {
  const { x_mm, y_mm, dx_mm, dy_mm } = index.cells;
  pen.beginPath();
  for (let cell = 0; cell < x_mm.length; cell += 1) {
    const left = layout.X(x_mm[cell] - dx_mm[cell] / 2);
    const top = layout.Y(y_mm[cell] + dy_mm[cell] / 2);
    pen.rect(left, top, dx_mm[cell] * layout.scale, dy_mm[cell] * layout.scale);
  }
  pen.strokeStyle = '#ffffff66';
  pen.lineWidth = 1 / density;
  pen.stroke();
}

/**
 * @param {Pen | Path2D} pen
 * @param {readonly (readonly (readonly [number, number])[])[]} loops
 * @param {Layout} layout
 * @param {boolean} [closed]
 */
function trace(pen, loops, { X, Y }, closed = true) {
  for (const loop of loops) {
    loop.forEach(([x, y], place) => (place ? pen.lineTo(X(x), Y(y)) : pen.moveTo(X(x), Y(y))));
    if (closed) pen.closePath();
  }
}

/**
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {Ink} ink
 */
function drawBorders(pen, scene, layout, ink) {
  const { index, quantity } = scene;
  pen.lineJoin = 'round';
  pen.lineCap = 'round';
  pen.beginPath();
  trace(pen, index.border, layout);
  pen.strokeStyle = ink.ink;
  pen.lineWidth = scene.compact ? 1 : 1.25;
  pen.stroke();
  if (!scene.border || quantity.scale === 'zones') return;
  const border = new Path2D();
  trace(border, stickBorder(index, scene.friction).map(smoothLine), layout, false);
  pen.save();
  pen.beginPath();
  trace(pen, index.border, layout);
  pen.clip();
  twoTone(pen, border, scene.compact ? [2, 1] : [4, 1.75]);
  pen.restore();
}

/** Strokes a white line with a dark edge, visible on every colour. @param {Pen} pen @param {Path2D} path @param {[number, number]} widths */
function twoTone(pen, path, [outer, inner]) {
  pen.strokeStyle = '#000000b0';
  pen.lineWidth = outer;
  pen.stroke(path);
  pen.strokeStyle = '#ffffff';
  pen.lineWidth = inner;
  pen.stroke(path);
}

/**
 * Draws arrows on a lattice, with lengths that increase with the magnitude.
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 */
function drawArrows(pen, { index, quantity, range }, layout) {
  const vector = quantity.vector(index.cells);
  if (!vector) return;
  const { map } = layout;
  const step = layout.narrow ? 24 : ARROW_STEP;
  const arrows = new Path2D();
  for (let py = map.top + (map.height % step) / 2; py < map.top + map.height; py += step) {
    for (let px = map.left + (map.width % step) / 2; px < map.left + map.width; px += step) {
      const x = layout.x0 + (px - map.left) / layout.scale;
      const cell = index.cellAt(x, layout.y1 - (py - map.top) / layout.scale);
      if (cell < 0) continue;
      const along = vector[0][cell];
      const across = vector[1][cell];
      const size = Math.hypot(along, across);
      if (size < 0.02 * range[1]) continue;
      const length = (0.25 + 0.75 * Math.min(1, size / range[1])) * step * 0.82;
      addArrow(arrows, px, py, (along / size) * length, (-across / size) * length);
    }
  }
  twoTone(pen, arrows, [3.2, 1.4]);
}

/**
 * @param {Path2D} path
 * @param {number} x Centre of the arrow.
 * @param {number} y
 * @param {number} dx Component of its length.
 * @param {number} dy
 */
function addArrow(path, x, y, dx, dy) {
  const tipX = x + dx / 2;
  const tipY = y + dy / 2;
  const barb = Math.min(6, Math.hypot(dx, dy) * 0.42) / Math.hypot(dx, dy);
  path.moveTo(x - dx / 2, y - dy / 2);
  path.lineTo(tipX, tipY);
  for (const side of [-1, 1]) {
    path.moveTo(tipX, tipY);
    path.lineTo(tipX - barb * (0.86 * dx - side * 0.5 * dy), tipY - barb * (0.86 * dy + side * 0.5 * dx));
  }
}

/**
 * @param {Pen} pen
 * @param {Layout} layout
 * @param {Ink} ink
 * @param {string} across
 */
function drawAxes(pen, layout, ink, across) {
  const { map, X, Y } = layout;
  const marks = ticksOf(layout);
  pen.font = `12px ${ink.font}`;
  pen.fillStyle = ink.quiet;
  pen.textBaseline = 'top';
  pen.textAlign = 'center';
  for (const x of marks.x) pen.fillText(tickLabel(x, marks.x), X(x), map.top + map.height + 6);
  pen.textAlign = 'right';
  pen.textBaseline = 'middle';
  for (const y of marks.y) pen.fillText(tickLabel(y, marks.y), map.left - 7, Y(y));
  pen.globalAlpha = 0.5;
  pen.strokeStyle = ink.quiet;
  pen.lineWidth = 1;
  pen.strokeRect(map.left + 0.5, map.top + 0.5, map.width, map.height);
  pen.globalAlpha = 1;
  pen.fillStyle = ink.ink;
  pen.textBaseline = 'top';
  pen.fillText('x along rolling / mm  →', map.left + map.width, map.top + map.height + 23);
  pen.save();
  pen.translate(11, map.top + map.height / 2);
  pen.rotate(-Math.PI / 2);
  pen.textAlign = 'center';
  pen.textBaseline = 'middle';
  pen.fillText(across, 0, 0);
  pen.restore();
}

/**
 * Returns the box of the colour bar.
 * @param {Layout} layout
 */
export function barBox({ map, narrow }) {
  // The bar leaves space for the heading.
  const width = Math.max(60, Math.min(260, map.width * (narrow ? 0.46 : 0.55), map.width - 130));
  return { left: map.left + map.width - width, top: 12, width, height: 10 };
}

/**
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {Ink} ink
 */
function drawBar(pen, { quantity, range }, layout, ink) {
  const bar = barBox(layout);
  pen.font = `600 13px ${ink.font}`;
  pen.fillStyle = ink.ink;
  pen.textAlign = 'left';
  pen.textBaseline = 'middle';
  pen.fillText(quantity.unit ? `${quantity.heading} / ${quantity.unit}` : quantity.heading, layout.map.left, bar.top + 5);
  pen.font = `12px ${ink.font}`;
  if (quantity.scale === 'zones') {
    drawLegend(pen, bar.left + bar.width, bar.top, ink);
    return;
  }
  const map = mapOf(quantity.scale);
  for (let column = 0; column < bar.width; column += 1) {
    pen.fillStyle = hex(map, column / (bar.width - 1));
    pen.fillRect(bar.left + column, bar.top, 1.5, bar.height);
  }
  const marks = ticks(range[0], range[1], bar.width / 64);
  pen.fillStyle = ink.quiet;
  pen.textBaseline = 'top';
  for (const value of marks) {
    const at = bar.left + ((value - range[0]) / (range[1] - range[0])) * bar.width;
    pen.fillRect(at, bar.top + bar.height, 1, 3);
    pen.textAlign = at - bar.left < 12 ? 'left' : bar.left + bar.width - at < 14 ? 'right' : 'center';
    pen.fillText(tickLabel(value, marks), at, bar.top + bar.height + 5);
  }
}

/**
 * @param {Pen} pen
 * @param {number} right
 * @param {number} top
 * @param {Ink} ink
 */
function drawLegend(pen, right, top, ink) {
  let at = right;
  pen.textAlign = 'right';
  for (const [name, colour] of [['slip (hatched)', ink.slip], ['stick', ink.stick]]) {
    pen.fillStyle = ink.ink;
    pen.fillText(name, at, top + 5);
    at -= pen.measureText(name).width + 8;
    pen.fillStyle = colour;
    pen.fillRect(at - 14, top - 1, 14, 12);
    at -= 30;
  }
}

/**
 * Draws the mark of a value on the colour bar.
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {number} value
 * @param {Ink} ink
 */
export function drawBarMark(pen, { range, quantity }, layout, value, ink) {
  if (quantity.scale === 'zones' || !Number.isFinite(value)) return;
  const bar = barBox(layout);
  const at = bar.left + ((value - range[0]) / (range[1] - range[0])) * bar.width;
  pen.fillStyle = ink.ink;
  pen.beginPath();
  pen.moveTo(at - 4, bar.top - 7);
  pen.lineTo(at + 4, bar.top - 7);
  pen.lineTo(at, bar.top - 1);
  pen.fill();
}

/** Returns the colours and the font of a picture from the styles of an element. @param {Element} element @returns {Ink} */
export function inkOf(element) {
  const style = getComputedStyle(element);
  const token = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
  return {
    ink: token('--ink'), quiet: token('--ink-2'), line: token('--line'), sunken: token('--sunken'), surface: token('--surface'),
    accent: token('--accent'), stick: token('--stick'), slip: token('--slip'), font: style.fontFamily,
  };
}

/**
 * Returns the names and values with units at a cell, for the readout.
 * @param {Scene} scene
 * @param {{ x: number, y: number }} place
 * @param {number} cell Index of the cell; -1 outside.
 * @returns {[string, string][]}
 */
export function tell({ index, friction, quantity, values, bent }, place, cell) {
  /** @type {[string, string][]} */
  const told = [['x', `${fixed(place.x, 3)} mm`], [bent ? 's' : 'y', `${fixed(place.y, 3)} mm`]];
  if (cell < 0) return [...told, ['', 'outside the patch']];
  const { pressure_mpa, traction_x_mpa, traction_y_mpa, slip_x, slip_y, temperature_c, zone } = index.cells;
  if (quantity.key === 'difference') return [...told, [quantity.heading, `${number(values[cell])} ${quantity.unit}`]];
  if (pressure_mpa) told.push(['p', `${number(pressure_mpa[cell])} MPa`]);
  if (traction_x_mpa && traction_y_mpa) {
    const size = Math.hypot(traction_x_mpa[cell], traction_y_mpa[cell]);
    told.push(['|t|', `${number(size)} MPa`], ['t', `(${number(traction_x_mpa[cell], 3)}, ${number(traction_y_mpa[cell], 3)})`]);
    if (pressure_mpa && friction > 0) told.push(['|t|/μp', number(size / (friction * pressure_mpa[cell]), 3)]);
  }
  if (slip_x && slip_y) told.push(['slip', number(Math.hypot(slip_x[cell], slip_y[cell]), 3)]);
  if (temperature_c) told.push(['T', `${number(temperature_c[cell], 3)} °C`]);
  if (zone) told.push(['zone', zone[cell]]);
  return told;
}
