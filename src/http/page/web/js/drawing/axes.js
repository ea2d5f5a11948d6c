// What drawings share: paths, and lines of a grid with their numbers.

import { svg } from '../../vendor/lit-html.js';
import { tickLabel, ticks } from '../format.js';

/** @typedef {readonly [number, number]} Point */

/** @param {readonly Point[]} points In pixels. */
export const path = (points) => points.map(([x, y], place) => `${place ? 'L' : 'M'}${x.toFixed(2)} ${y.toFixed(2)}`).join('');

/**
 * @typedef {object} Axes
 * @property {number} left
 * @property {number} right
 * @property {number} top
 * @property {number} bottom
 * @property {readonly [number, number]} x The values at left and right.
 * @property {readonly [number, number]} y The values at bottom and top.
 */

/** From values to pixels. @param {Axes} axes @returns {(point: Point) => Point} */
export const scaleOf = ({ left, right, top, bottom, x, y }) => ([h, v]) => [
  left + ((h - x[0]) / (x[1] - x[0])) * (right - left),
  bottom - ((v - y[0]) / (y[1] - y[0])) * (bottom - top),
];

/**
 * Lines and numbers of a grid.
 * @param {Axes} axes
 * @param {{ x: string, y: string, columns?: number, rows?: number }} labels
 */
export function grid(axes, labels) {
  const { left, right, top, bottom } = axes;
  const scale = scaleOf(axes);
  const columns = ticks(Math.min(...axes.x), Math.max(...axes.x), labels.columns ?? 7);
  const rows = ticks(Math.min(...axes.y), Math.max(...axes.y), labels.rows ?? 4);
  return svg`
    <g class="gridlines">
      ${columns.map((value) => svg`<line x1=${scale([value, 0])[0]} x2=${scale([value, 0])[0]} y1=${top} y2=${bottom}/>`)}
      ${rows.map((value) => svg`<line x1=${left} x2=${right} y1=${scale([0, value])[1]} y2=${scale([0, value])[1]}/>`)}
    </g>
    <g>
      ${columns.map((value) => svg`<text x=${scale([value, 0])[0]} y=${bottom + 16} text-anchor="middle">${tickLabel(value, columns)}</text>`)}
      ${rows.map((value) => svg`<text x=${left - 6} y=${scale([0, value])[1] + 4} text-anchor="end">${tickLabel(value, rows)}</text>`)}
      <text x=${right} y=${bottom + 32} text-anchor="end" class="strong">${labels.x}</text>
      <text x="4" y=${top - 8} class="strong">${labels.y}</text>
    </g>`;
}
