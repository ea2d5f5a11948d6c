// Paths, grids, charts and overlaid cross-sections as SVG.

import { nothing, svg } from '../../vendor/lit-html.js';
import { smoothLine } from '../field/cells.js';
import { tickLabel, ticks } from '../format.js';

/** @typedef {readonly [number, number]} Point */

/** Returns the path of a line with gaps at missing values. @param {readonly Point[]} points In pixels. */
export const path = (points) => points.map(([x, y], place) => {
  if (!Number.isFinite(y)) return '';
  return `${place && Number.isFinite(points[place - 1][1]) ? 'L' : 'M'}${x.toFixed(2)} ${y.toFixed(2)}`;
}).join('');

/**
 * @typedef {object} Axes
 * @property {number} left
 * @property {number} right
 * @property {number} top
 * @property {number} bottom
 * @property {readonly [number, number]} x The values at left and right.
 * @property {readonly [number, number]} y The values at bottom and top.
 */

/** Returns the map from values to pixels. @param {Axes} axes @returns {(point: Point) => Point} */
export const scaleOf = ({ left, right, top, bottom, x, y }) => ([h, v]) => [
  left + ((h - x[0]) / (x[1] - x[0])) * (right - left),
  bottom - ((v - y[0]) / (y[1] - y[0])) * (bottom - top),
];

/**
 * Draws the lines and labels of a grid.
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

/**
 * @typedef {object} ChartLine
 * @property {string} label
 * @property {string} look CSS classes: `one`, `two`, `three`, `four` or `limit`, optionally with `solid` or `dashed`.
 * @property {readonly Point[]} points
 * @property {boolean} [smooth] Whether a smooth curve is drawn through the points.
 * @property {readonly (number | null)[]} [errors] Errors of the points, half the lengths of their error bars.
 * @property {readonly [readonly Point[], readonly Point[]]} [band] Edges of a band.
 */

/**
 * @typedef {object} Chart
 * @property {string} name Accessible name.
 * @property {string} x
 * @property {string} y
 * @property {readonly ChartLine[]} lines
 * @property {readonly [number, number]} [xRange]
 * @property {readonly [number, number]} [yRange] Bottom and top.
 * @property {readonly { at: Point, label: string }[]} [marks]
 * @property {{ x: number, pick: (x: number) => void }} [chosen] The chosen x; a click chooses another one.
 */

/** Size of a chart in pixels. The height excludes the legend. */
const CHART = { width: 460, height: 268 };
/** Widths of a character and of the sample line of the legend, and the height of its rows, in pixels. */
const LEGEND = { character: 6.4, before: 34, row: 18 };
const CAP = 3;

/** Draws lines over two axes with a legend. @param {Chart} chart */
export function drawChart({ name, x, y, lines, xRange, yRange, marks = [], chosen }) {
  const all = [...lines.flatMap(({ points, band = [] }) => [points, ...band].flat()), ...marks.map((mark) => mark.at)].filter((point) => point.every(Number.isFinite));
  const axes = {
    left: 56, right: CHART.width - 14, top: 26, bottom: CHART.height - 40,
    x: xRange ?? rangeOf(all.map((point) => point[0])), y: yRange ?? rangeOf(all.map((point) => point[1])),
  };
  const T = scaleOf(axes);
  const box = `${axes.left} ${axes.top} ${axes.right - axes.left} ${axes.bottom - axes.top}`;
  const named = lines.filter(({ label }) => label);
  const columns = Math.max(1, Math.min(named.length, Math.floor((CHART.width - 56) / (LEGEND.before + LEGEND.character * Math.max(...named.map(({ label }) => label.length))))));
  const height = CHART.height + LEGEND.row * Math.ceil(named.length / columns) + 4;
  const pick = (/** @type {MouseEvent} */ event) => {
    const { left, width } = /** @type {SVGElement} */ (event.currentTarget).getBoundingClientRect();
    const at = ((event.clientX - left) / width) * CHART.width;
    chosen?.pick(axes.x[0] + ((at - axes.left) / (axes.right - axes.left)) * (axes.x[1] - axes.x[0]));
  };
  return svg`<svg class="drawing chart" viewBox=${`0 0 ${CHART.width} ${height}`} role="img" aria-label=${name} @click=${chosen ? pick : nothing}>
    ${grid(axes, { x, y, columns: 6, rows: 5 })}
    <svg x=${axes.left} y=${axes.top} width=${axes.right - axes.left} height=${axes.bottom - axes.top} viewBox=${box}>
      ${lines.map(({ look, band }) => (band ? svg`<path class=${`band ${look}`} d=${`${path(band[0].map(T))}${path([...band[1]].reverse().map(T)).replace('M', 'L')}Z`}/>` : nothing))}
      ${chosen ? svg`<path class="chosen" d=${`M${T([chosen.x, 0])[0]} ${axes.top}V${axes.bottom}`}/>` : nothing}
      ${lines.map(({ look, points, errors, smooth }) => svg`<path class=${`line ${look}`} d=${path(smooth ? smoothLine(points.map((point) => [...T(point)])) : points.map(T))}/>${errors ? svg`<path class=${`line bars ${look}`} d=${bars(points, errors, T)}/>` : nothing}`)}
    </svg>
    ${marks.map(({ at, label }, order) => {
      const [px, py] = T(at);
      // Labels of neighbouring marks are drawn on alternating sides.
      const right = px > CHART.width * 0.8 || (px > CHART.width * 0.2 && order % 2 === 1);
      return svg`<g class="mark"><circle cx=${px} cy=${py} r="5"/><text x=${px + (right ? -9 : 9)} y=${py < axes.top + 14 ? py + 18 : py - 6} text-anchor=${right ? 'end' : 'start'}>${label}</text></g>`;
    })}
    ${named.map(({ label, look }, at) => {
      const [left, bottom] = [56 + (at % columns) * ((CHART.width - 56) / columns), CHART.height + 12 + LEGEND.row * Math.floor(at / columns)];
      return svg`<g class="legend"><path class=${`line ${look}`} d=${`M${left} ${bottom - 4}h22`}/><text x=${left + 28} y=${bottom}>${label}</text></g>`;
    })}
  </svg>`;
}

/** Returns the path of error bars with caps. @param {readonly Point[]} points @param {readonly (number | null)[]} errors @param {(point: Point) => Point} T */
const bars = (points, errors, T) => points.map(([x, y], at) => {
  const [[px, low], [, high]] = [T([x, y - (errors[at] ?? 0)]), T([x, y + (errors[at] ?? 0)])];
  return errors[at] ? `M${px} ${low}V${high}M${px - CAP} ${low}h${2 * CAP}M${px - CAP} ${high}h${2 * CAP}` : '';
}).join('');

/** Returns the range of values, extended to include 0. @param {readonly number[]} values @returns {[number, number]} */
function rangeOf(values) {
  const [low, high] = [Math.min(0, ...values), Math.max(0, ...values)];
  return high > low ? [low, high + 0.06 * (high - low)] : [0, 1];
}

/**
 * Draws overlaid cross-sections to scale, with y to the field side.
 * @param {{ name: string, shapes: readonly ChartLine[], mark: { at: Point, label: string } | null }} of
 */
export function drawShapes({ name, shapes, mark }) {
  const all = shapes.flatMap(({ points }) => points);
  const [ys, zs] = [all.map(([y]) => y), all.map(([, z]) => z)];
  const [y0, y1, z0, z1] = [Math.min(...ys) - 4, Math.max(...ys) + 4, Math.min(...zs) - 4, Math.max(...zs) + 4];
  // The drawing is narrower on a narrow screen, so that the text keeps its size.
  const width = Math.min(640, Math.max(380, innerWidth - 60));
  const scale = (width - 60) / (y1 - y0);
  const bottom = 26 + (z1 - z0) * scale;
  const axes = { left: 50, right: width - 10, top: 26, bottom, x: /** @type {const} */ ([y0, y1]), y: /** @type {const} */ ([z0, z1]) };
  const T = scaleOf(axes);
  const room = Math.floor((width - 90) / LEGEND.character);
  return svg`<svg class="drawing chart shapes" viewBox=${`0 0 ${width} ${(bottom + 40 + 18 * shapes.length).toFixed(0)}`} role="img" aria-label=${name}>
    ${grid(axes, { x: 'y from the track centre, to the field side / mm', y: 'z up / mm', columns: 8, rows: 4 })}
    ${shapes.map(({ look, points }) => svg`<path class=${`line ${look}`} d=${path(points.map(T))}/>`)}
    ${mark ? svg`<g class="mark"><circle cx=${T(mark.at)[0]} cy=${T(mark.at)[1]} r="5"/><text
      x=${T(mark.at)[0] + (T(mark.at)[0] > 0.8 * width ? -9 : 9)} y=${T(mark.at)[1] + 18} text-anchor=${T(mark.at)[0] > 0.8 * width ? 'end' : 'start'}>${mark.label}</text></g>` : ''}
    ${shapes.map(({ label, look }, order) => svg`<g class="legend"><path class=${`line ${look}`} d=${`M50 ${bottom + 46 + 18 * order}h22`}/><text x="80" y=${bottom + 50 + 18 * order}>${label.length > room ? `${label.slice(0, room - 1)}…` : label}</text></g>`)}
  </svg>`;
}
