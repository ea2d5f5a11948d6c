// Drawings of the data of a case: a gap curve, and gaps or pressures on a grid.

import { html } from '../../vendor/lit-html.js';
import { at, numbersAt } from '../document.js';
import { mapOf, wordsOf } from '../field/palette.js';
import { fixed, number } from '../format.js';
import { grid, path, scaleOf } from './axes.js';

/** @typedef {import('../document.js').JsonObject} JsonObject */

const WIDTH = 560;
const HEIGHT = 400;

/** @param {JsonObject} document A case of the type `gap_profile`. */
export function drawGapCurve(document) {
  const ys = numbersAt(document, '/contact/y_mm');
  const gaps = numbersAt(document, '/contact/gap_mm');
  const points = ys.map((y, place) => /** @type {const} */ ([y, gaps[place]])).filter(([y, gap]) => Number.isFinite(y) && Number.isFinite(gap));
  if (points.length < 3) return html`<p class="quiet pad">Drop a file with two columns, y and gap in mm.</p>`;
  const low = Math.min(...points.map(([, gap]) => gap));
  const high = Math.max(...points.map(([, gap]) => gap));
  const axes = {
    left: 60, right: WIDTH - 20, top: 30, bottom: HEIGHT - 50,
    x: /** @type {const} */ ([points[0][0], points[points.length - 1][0]]), y: /** @type {const} */ ([low, high > low ? high : low + 1]),
  };
  const line = path(points.map(scaleOf(axes)));
  return html`<svg class="drawing" viewBox=${`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label=${`Gap across rolling at ${points.length} points, from ${number(low)} to ${number(high)} mm`}>
    ${grid(axes, { x: 'y across / mm', y: 'gap / mm', columns: 8 })}
    <path class="rail" d=${`${line}L${axes.right} ${axes.bottom}L${axes.left} ${axes.bottom}Z`}/>
  </svg>`;
}

/** @param {JsonObject} document A case of the types `gap_grid` and `pressure_grid`. */
export function drawGrid(document) {
  const gap = at(document, '/contact/type') === 'gap_grid';
  const values = rowsOf(document, gap ? '/contact/gap_mm' : '/contact/pressure_mpa');
  if (values.length < 2) return html`<p class="quiet pad">Drop a file with x in the first row and y in the first column, in mm.</p>`;
  const all = values.flat().filter(Number.isFinite);
  const [low, high] = all.reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
  const what = gap ? `gap from ${number(low)} to ${number(high)} mm` : `pressure to ${number(high)} MPa`;
  return html`<figure class="gridded">
    <value-grid .values=${values} .reversed=${gap} .aspect=${extent(document, '/contact/x_mm') / extent(document, '/contact/y_mm')}></value-grid>
    <figcaption>${fixed(values[0].length, 0)} × ${fixed(values.length, 0)} values, ${what}; x along rolling →, y to the left ↑</figcaption>
  </figure>`;
}

/** Returns the extent of coordinates; 1 if it is not positive or unknown. @param {JsonObject} document @param {string} pointer */
function extent(document, pointer) {
  const places = numbersAt(document, pointer);
  const length = places[places.length - 1] - places[0];
  return length > 0 ? length : 1;
}

/** @param {JsonObject} document @param {string} pointer */
function rowsOf(document, pointer) {
  const rows = at(document, pointer);
  if (!Array.isArray(rows) || !rows.every(Array.isArray)) return [];
  return rows.map((row) => row.map((value) => (typeof value === 'number' ? value : NaN)));
}

const LONGER_SIDE = 640;

/** Custom element <value-grid>: numbers on a grid as colours, to scale and without smoothing. */
class ValueGrid extends HTMLElement {
  #canvas = document.createElement('canvas');
  /** Whether small values are bright. */
  reversed = false;
  /** Width over height. */
  aspect = 1;
  /** @type {number[][]} */ #values = [];

  connectedCallback() {
    this.append(this.#canvas);
    this.#canvas.setAttribute('aria-hidden', 'true');
    this.#draw();
  }

  /** Sets the values by rows, lowest y first. @param {number[][]} values */
  set values(values) {
    this.#values = values;
    queueMicrotask(() => this.#draw());
  }

  #draw() {
    const height = this.#values.length;
    const width = this.#values[0]?.length ?? 0;
    if (!width) return;
    const sheet = document.createElement('canvas');
    sheet.width = width;
    sheet.height = height;
    const pen = /** @type {CanvasRenderingContext2D} */ (sheet.getContext('2d'));
    const image = pen.createImageData(width, height);
    const pixels = new Uint32Array(image.data.buffer);
    const words = wordsOf(mapOf('amount'));
    const [low, high] = this.#values.flat().filter(Number.isFinite).reduce(([least, most], value) => [Math.min(least, value), Math.max(most, value)], [Infinity, -Infinity]);
    this.#values.forEach((row, j) => row.forEach((value, i) => {
      const share = (value - low) / (high - low || 1);
      pixels[(height - 1 - j) * width + i] = words[Math.round(255 * (this.reversed ? 1 - share : share))];
    }));
    pen.putImageData(image, 0, 0);
    const aspect = Math.max(0.05, Math.min(20, this.aspect));
    this.#canvas.width = Math.round(LONGER_SIDE * Math.min(1, aspect));
    this.#canvas.height = Math.round(LONGER_SIDE * Math.min(1, 1 / aspect));
    const shown = /** @type {CanvasRenderingContext2D} */ (this.#canvas.getContext('2d'));
    shown.imageSmoothingEnabled = false;
    shown.drawImage(sheet, 0, 0, this.#canvas.width, this.#canvas.height);
  }
}

customElements.define('value-grid', ValueGrid);
