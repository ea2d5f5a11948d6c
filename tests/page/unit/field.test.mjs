// Tests fields: the cell at a point, the border of the stick zone, interpolation.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { CellIndex, smoothLoop } from '../../../src/http/page/web/js/field/cells.js';
import { quantityOf, rangeOf, valuesOf } from '../../../src/http/page/web/js/field/quantities.js';
import { rasterCells, rasterSmooth, rasterZones, sectionSmooth, spanAt } from '../../../src/http/page/web/js/field/raster.js';
import { stickBorder } from '../../../src/http/page/web/js/field/stick.js';

/** @typedef {import('../../../src/http/page/web/js/fields.js').Cells} Cells */

/** A square of 3 × 3 cells of 1 mm around the origin; values and zones row by row from the lowest y. @param {Partial<Cells>} more */
function square(more = {}) {
  const places = [-1, 0, 1];
  /** @type {Cells} */
  const cells = {
    x_mm: places.flatMap(() => places),
    y_mm: places.flatMap((y) => [y, y, y]),
    dx_mm: Array(9).fill(1),
    dy_mm: Array(9).fill(1),
    strip: [0, 0, 0, 1, 1, 1, 2, 2, 2],
    ...more,
  };
  return new CellIndex({ cells, border: [[[-1.5, -1.5], [1.5, -1.5], [1.5, 1.5], [-1.5, 1.5]]] });
}
const FRAME = { width: 90, height: 90, x0: -1.5, y1: 1.5, step: 1 / 30 };

test('a place belongs to the cell around it', () => {
  const index = square();
  assert.equal(index.cellAt(-1, -1), 0);
  assert.equal(index.cellAt(0.4, 0.4), 4);
  assert.equal(index.cellAt(1.49, 1.49), 8);
  assert.equal(index.cellAt(1.6, 0), -1);
  assert.equal(index.cellAt(0, -1.6), -1);
  assert.equal(index.nearest(1.6, 0), 5);
  assert.equal(index.nearest(40, 0), -1);
  assert.deepEqual(index.column(1), [2, 5, 8]);
});

test('the smooth picture has the values of the cells at their middles', () => {
  const pressure_mpa = [1, 2, 3, 4, 9, 6, 7, 8, 5];
  const index = square({ pressure_mpa });
  const raster = rasterSmooth(index, pressure_mpa, FRAME, true);
  for (const [cell, x] of index.cells.x_mm.entries()) {
    const column = Math.floor((x - FRAME.x0) / FRAME.step);
    const row = Math.floor((FRAME.y1 - index.cells.y_mm[cell]) / FRAME.step);
    const value = raster[row * FRAME.width + column];
    assert.ok(Math.abs(value - pressure_mpa[cell]) < 0.35, `cell ${cell}: ${value}`);
  }
});

test('the smooth picture vanishes at the border where the quantity does', () => {
  const ones = Array(9).fill(1);
  const vanishing = rasterSmooth(square(), ones, FRAME, true);
  const constant = rasterSmooth(square(), ones, FRAME, false);
  const edge = 45 * FRAME.width;
  assert.ok(vanishing[edge + 1] < 0.2 && vanishing[45] < 0.3, `${vanishing[edge + 1]} ${vanishing[45]}`);
  assert.ok(Math.abs(constant[edge + 1] - 1) < 1e-6);
});

test('the picture of cells has one value for each', () => {
  const values = [1, 2, 3, 4, 5, 6, 7, 8, 9];
  const raster = rasterCells(square(), values, FRAME);
  assert.deepEqual([...new Set(raster)].sort(), values);
  assert.equal(raster[0], 7);
  assert.equal(raster[raster.length - 1], 3);
});

test('the border of the stick zone lies between cells of different zones', () => {
  const zone = ['slip', 'stick', 'stick', 'slip', 'slip', 'stick', 'slip', 'slip', 'slip'];
  const lines = stickBorder(square({ zone }), NaN);
  assert.equal(lines.length, 1);
  const points = lines[0].filter(([, y]) => [-1, 0].includes(y));
  assert.deepEqual(points, [[-0.5, -1], [0.5, 0]]);
  assert.deepEqual(stickBorder(square({ zone: Array(9).fill('slip') }), NaN), []);
});

test('the border lies where the margin to friction is used up', () => {
  // Along the middle strip the friction margin of the sticking cells is 2 and 0.75 MPa. Extrapolated, it vanishes at x = 0.6 mm.
  const zone = ['stick', 'stick', 'slip'];
  const row = (/** @type {number[]} */ values) => [...values, ...values, ...values];
  const index = square({
    zone: row([]).concat(zone, zone, zone), pressure_mpa: Array(9).fill(10), traction_x_mpa: row([8, 9.25, 10]), traction_y_mpa: Array(9).fill(0),
  });
  const [line] = stickBorder(index, 1);
  assert.ok(line.some(([x, y]) => y === 0 && Math.abs(x - 0.6) < 1e-9), JSON.stringify(line));
});

test('a zone inside the patch is closed', () => {
  const zone = ['slip', 'slip', 'slip', 'slip', 'stick', 'slip', 'slip', 'slip', 'slip'];
  const lines = stickBorder(square({ zone }), NaN);
  assert.equal(lines.length, 2);
  const ends = lines.flatMap((line) => [line[0], line[line.length - 1]]);
  assert.deepEqual(ends.map((end) => end.join()).sort(), ['0,-0.5', '0,-0.5', '0,0.5', '0,0.5']);
});

test('ranges of tractions reach friction\'s bound, and signed ones are symmetric', () => {
  const traction = { traction_x_mpa: [-3, 0, 0, 0, 4, 0, 0, 0, 0], traction_y_mpa: Array(9).fill(0) };
  const { cells } = square(traction);
  const size = /** @type {import('../../../src/http/page/web/js/field/quantities.js').Quantity} */ (quantityOf('traction'));
  const along = /** @type {typeof size} */ (quantityOf('traction_x'));
  assert.deepEqual(rangeOf(size, [cells], 10), [0, 10]);
  assert.deepEqual(rangeOf(size, [cells], NaN), [0, 4]);
  assert.deepEqual(rangeOf(along, [cells], NaN), [-4, 4]);
  assert.equal(valuesOf(size, cells)?.[0], 3);
});

test('a smooth border goes through the corners it is given', () => {
  /** @type {[number, number][]} */
  const octagon = Array.from({ length: 8 }, (_, i) => [Math.cos((i * Math.PI) / 4), Math.sin((i * Math.PI) / 4)]);
  const smooth = smoothLoop(octagon);
  for (const [x, y] of octagon) assert.ok(smooth.some(([sx, sy]) => Math.hypot(sx - x, sy - y) < 1e-9));
  assert.deepEqual(smoothLoop([[0, 0], [2, 0], [2, 2], [0, 2]]).filter(([x, y]) => x < 0 || x > 2 || y < 0 || y > 2), [], 'sharp corners stay');
  assert.ok(smooth.every(([x, y]) => Math.abs(Math.hypot(x, y) - 1) < 0.02), 'near the circle');
  assert.ok(Math.abs((spanAt(smooth, 0.1)?.[1] ?? 0) - Math.sqrt(0.99)) < 0.02);
});

test('zones are smooth from strip to strip: half-way between two strips the border lies half-way', () => {
  const index = square({ zone: ['slip', 'stick', 'stick', 'slip', 'slip', 'stick', 'slip', 'stick', 'stick'] });
  const raster = rasterZones(index, NaN, FRAME);
  // Returns the x of the first sticking pixel in a row, in mm.
  const border = (/** @type {number} */ y) => {
    const row = Math.floor((1.5 - y) * 30);
    const column = Array.from({ length: 90 }, (_, at) => raster[row * 90 + at]).findIndex((distance) => distance < 0);
    return -1.5 + column / 30;
  };
  for (const [y, x] of [[-1.2, -0.5], [0.5, 0], [0.01, 0.5], [1.2, -0.5]]) assert.ok(Math.abs(border(y) - x) < 0.08, `${y}: ${border(y)}`);
});

test('a section reaches from border to border, with 0 at both ends where the quantity vanishes there', () => {
  const index = square();
  const values = [1, 2, 3, 4, 9, 6, 7, 8, 5];
  for (const along of [true, false]) {
    const line = sectionSmooth(index, values, along, { x: 0, y: 0 }, true);
    const places = line.map(([place]) => place).sort((one, two) => one - two);
    assert.ok(line.length > 20);
    assert.deepEqual([line[0][1], line[line.length - 1][1]], [0, 0]);
    assert.ok(Math.abs(places[0] + 1.5) < 0.05 && Math.abs(places[places.length - 1] - 1.5) < 0.05, `${places[0]}`);
    assert.ok(Math.abs(Math.max(...line.map(([, value]) => value)) - 9) < 0.3);
    assert.ok(sectionSmooth(index, values, along, { x: 0, y: 0 }, false)[0][1] > 0);
  }
  assert.deepEqual(sectionSmooth(index, values, true, { x: 0, y: 2 }, true), []);
});
