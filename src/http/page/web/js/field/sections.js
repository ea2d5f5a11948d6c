// Draws the two sections of a field at the crosshair: longitudinal below the map and lateral on its right, with common axes.

import { fixed, tickLabel, ticks } from '../format.js';
import { smoothLine } from './cells.js';
import { sectionSmooth } from './raster.js';

/** @typedef {import('./layout.js').Layout} Layout */
/** @typedef {import('./layout.js').Box} Box */
/** @typedef {import('./picture.js').Scene} Scene */
/** @typedef {import('./picture.js').Ink} Ink */
/** @typedef {import('./picture.js').Pen} Pen */

/** Largest number of cells of a section with a smooth curve through their centres, and the number of points from which the centres are taken. */
const FEW = 60;
const FINE = 160;

/**
 * @typedef {object} Section
 * @property {boolean} along
 * @property {Box} box
 * @property {number[]} cells
 * @property {readonly [number, number]} range
 * @property {boolean} bounded
 * @property {(cell: number) => number} from Start of a cell on the section's axis, in pixels.
 * @property {(cell: number) => number} middle
 * @property {(cell: number) => number} to
 * @property {(value: number) => number} value Maps a value to pixels.
 */

/**
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {{ x: number, y: number }} place
 * @param {Ink} ink
 */
export function drawSections(pen, scene, layout, place, ink) {
  const at = scene.index.stripAt(place.y);
  const here = scene.index.cellIn(at, place.x);
  if (layout.along) drawSection(pen, scene, sectionOf(scene, layout, layout.along, true, scene.index.row(at)), layout, place, here, ink);
  if (layout.across) {
    drawSection(pen, scene, sectionOf(scene, layout, layout.across, false, scene.index.column(place.x)), layout, place, here, ink);
  }
}

/**
 * @param {Scene} scene
 * @param {Layout} layout
 * @param {Box} box
 * @param {boolean} along
 * @param {number[]} cells
 * @returns {Section}
 */
function sectionOf({ index, quantity, range, friction }, layout, box, along, cells) {
  const { x_mm, y_mm, dx_mm, dy_mm, pressure_mpa } = index.cells;
  const [middle, size] = along ? [x_mm, dx_mm] : [y_mm, dy_mm];
  const toPixels = along ? layout.X : layout.Y;
  const [low, high] = range;
  const length = along ? box.height - 6 : box.width - 8;
  const start = along ? box.top + box.height : box.left;
  const sign = along ? -1 : 1;
  return {
    along, box, cells, range,
    bounded: quantity.bounded && friction > 0 && pressure_mpa !== undefined,
    from: (cell) => toPixels(middle[cell] - size[cell] / 2),
    middle: (cell) => toPixels(middle[cell]),
    to: (cell) => toPixels(middle[cell] + size[cell] / 2),
    value: (value) => start + sign * ((value - low) / (high - low)) * length,
  };
}

/**
 * @param {Pen} pen
 * @param {Scene} scene
 * @param {Section} section
 * @param {Layout} layout
 * @param {{ x: number, y: number }} place
 * @param {number} here The cell at the crosshair.
 * @param {Ink} ink
 */
function drawSection(pen, scene, section, layout, place, here, ink) {
  const { values, quantity, friction, index } = scene;
  drawScale(pen, section, Math.min(quantity.scale === 'signed' ? 5 : 3, section.along ? Infinity : section.box.width / 45), ink);
  shadeStick(pen, section, index.cells.zone, ink);
  if (section.bounded) {
    const pressure = index.cells.pressure_mpa ?? [];
    const signs = quantity.scale === 'signed' ? [1, -1] : [1];
    const bound = lineOf(scene, section, pressure, true, place);
    for (const sign of signs) drawLine(pen, section, layout, bound.map(([at, value]) => [at, sign * friction * value]), ink.quiet, 1.25, [4, 3]);
  }
  drawLine(pen, section, layout, lineOf(scene, section, values, quantity.vanishes, place), ink.accent, 2, []);
  drawCursor(pen, section, layout, place, here, values, ink);
  pen.fillStyle = ink.ink;
  pen.font = `12px ${ink.font}`;
  pen.textBaseline = 'alphabetic';
  pen.textAlign = 'left';
  const { box } = section;
  const legend = section.bounded && !layout.narrow ? '   (dashed: μp, shaded: stick)' : '';
  const what = quantity.unit ? `${quantity.label.toLowerCase()} / ${quantity.unit}` : quantity.label.toLowerCase();
  const title = section.along ? `${what} along rolling, ${scene.bent ? 's' : 'y'} = ${fixed(place.y, 2)} mm${legend}` : `across, x = ${fixed(place.x, 2)} mm`;
  pen.fillText(title, box.left, box.top - 7);
  if (section.along || !quantity.unit) return;
  pen.textAlign = 'right';
  pen.fillText(`/ ${quantity.unit}`, box.left + box.width, box.top + box.height + 34);
}

/**
 * Returns a section from border to border: interpolated like the map, or the values of the cells if the map shows those.
 * @param {Scene} scene
 * @param {Section} section
 * @param {ArrayLike<number>} values
 * @param {boolean} vanishes
 * @param {{ x: number, y: number }} place
 * @returns {[number, number][]}
 */
function lineOf({ index, mesh }, { along, cells }, values, vanishes, place) {
  const middle = along ? index.cells.x_mm : index.cells.y_mm;
  if (index.whole && !mesh) {
    return cells.length > FEW ? sectionSmooth(index, values, along, place, vanishes) : atCells(sectionSmooth(index, values, along, place, vanishes, FINE), cells.map((cell) => middle[cell]));
  }
  return cells.map((cell) => [middle[cell], values[cell]]);
}

/** Reduces a section to its ends and the centres of its cells, for drawing a smooth curve. @param {[number, number][]} line @param {readonly number[]} middles */
function atCells(line, middles) {
  const last = line.length - 1;
  if (middles.length < 3 || last < 1) return line;
  const nearest = middles.map((middle) => line.reduce((best, [at], place) => (Math.abs(at - middle) < Math.abs(line[best][0] - middle) ? place : best), 1));
  return [...new Set([0, ...nearest, last])].sort((one, two) => one - two).map((place) => line[place]);
}

/**
 * @param {Pen} pen
 * @param {Section} section
 * @param {number} wanted
 * @param {Ink} ink
 */
function drawScale(pen, { along, box, range, value }, wanted, ink) {
  const marks = ticks(range[0], range[1], wanted);
  pen.strokeStyle = ink.line;
  pen.lineWidth = 1;
  pen.fillStyle = ink.quiet;
  pen.font = `11px ${ink.font}`;
  pen.textBaseline = along ? 'middle' : 'top';
  for (const mark of marks) {
    const at = Math.round(value(mark)) + 0.5;
    pen.beginPath();
    pen.moveTo(along ? box.left : at, along ? at : box.top);
    pen.lineTo(along ? box.left + box.width : at, along ? at : box.top + box.height);
    pen.stroke();
    pen.textAlign = along ? 'right' : mark === marks[0] ? 'left' : 'center';
    pen.fillText(tickLabel(mark, marks), along ? box.left - 7 : at, along ? at : box.top + box.height + 6);
  }
}

/**
 * @param {Pen} pen
 * @param {Section} section
 * @param {string[] | undefined} zone
 * @param {Ink} ink
 */
function shadeStick(pen, { along, box, cells, from, to }, zone, ink) {
  if (!zone) return;
  pen.fillStyle = ink.stick;
  pen.globalAlpha = 0.2;
  for (const cell of cells) {
    if (zone[cell] === 'slip') continue;
    if (along) pen.fillRect(from(cell), box.top, to(cell) - from(cell), box.height);
    else pen.fillRect(box.left, to(cell), box.width, from(cell) - to(cell));
  }
  pen.globalAlpha = 1;
}

/**
 * @param {Pen} pen
 * @param {Section} section
 * @param {Layout} layout
 * @param {readonly [number, number][]} line Positions in mm, with their values.
 * @param {string} colour
 * @param {number} width
 * @param {number[]} dash
 */
function drawLine(pen, { along, box, value }, layout, line, colour, width, dash) {
  pen.save();
  pen.beginPath();
  // The bound of friction may lie far outside the range of the values.
  pen.rect(box.left - 2, box.top - 2, box.width + 4, box.height + 4);
  pen.clip();
  pen.beginPath();
  const pixels = line.map(([at, amount]) => /** @type {[number, number]} */ (along ? [layout.X(at), value(amount)] : [value(amount), layout.Y(at)]));
  (pixels.length > FEW + 2 ? pixels : smoothLine(pixels)).forEach(([x, y], order) => {
    if (order) pen.lineTo(x, y);
    else pen.moveTo(x, y);
  });
  pen.strokeStyle = colour;
  pen.lineWidth = width;
  pen.setLineDash(dash);
  pen.stroke();
  pen.restore();
}

/**
 * @param {Pen} pen
 * @param {Section} section
 * @param {Layout} layout
 * @param {{ x: number, y: number }} place
 * @param {number} here
 * @param {ArrayLike<number>} values
 * @param {Ink} ink
 */
function drawCursor(pen, section, layout, place, here, values, ink) {
  const { along, box, middle, value } = section;
  const at = along ? layout.X(place.x) : layout.Y(place.y);
  pen.strokeStyle = ink.quiet;
  pen.lineWidth = 1;
  pen.setLineDash([3, 3]);
  pen.beginPath();
  pen.moveTo(along ? at : box.left, along ? box.top : at);
  pen.lineTo(along ? at : box.left + box.width, along ? box.top + box.height : at);
  pen.stroke();
  pen.setLineDash([]);
  if (here < 0) return;
  const height = value(values[here]);
  pen.fillStyle = ink.surface;
  pen.strokeStyle = ink.accent;
  pen.lineWidth = 2;
  pen.beginPath();
  pen.arc(along ? middle(here) : height, along ? height : middle(here), 4, 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
}
