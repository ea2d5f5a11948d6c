// Drawing of the contact ellipse of a case from above, with its semi-axes, creepages and spin.

import { html, nothing, svg } from '../../vendor/lit-html.js';
import { at, isObject, numberAt } from '../document.js';
import { number } from '../format.js';

/** @typedef {import('../document.js').JsonObject} JsonObject */
/** @typedef {import('../document.js').JsonValue} JsonValue */

const WIDTH = 560;
const HEIGHT = 400;
const STEP = 40;
const ARROW = 70;

/** @typedef {NonNullable<import('../api.js').CheckedCase['understood']>['patches'][number]} KnownPatch */

/**
 * @param {JsonObject} document A case of the types `ellipse` or `radii`.
 * @param {KnownPatch | undefined} known Its patch, as interpreted by the service.
 */
export function drawEllipse(document, known) {
  if (!known?.semi_axes_mm) return html`<p class="quiet pad">The drawing appears when the contact is complete.</p>`;
  const [a, b] = known.semi_axes_mm;
  const pressure = known.pressure_max_mpa;
  const scale = Math.min(330 / (2 * a), 260 / (2 * b));
  const [x, y] = [WIDTH / 2, HEIGHT / 2];
  const label = `Contact ellipse with semi-axes ${number(a, 3)} mm along and ${number(b, 3)} mm across rolling`;
  return html`<svg class="drawing" viewBox=${`0 0 ${WIDTH} ${HEIGHT}`} role="img" aria-label=${label}>
    <g class="gridlines">
      ${steps(WIDTH).map((at) => svg`<line x1=${at} x2=${at} y1="0" y2=${HEIGHT}/>`)}
      ${steps(HEIGHT).map((at) => svg`<line x1="0" x2=${WIDTH} y1=${at} y2=${at}/>`)}
    </g>
    <ellipse class="area" cx=${x} cy=${y} rx=${a * scale} ry=${b * scale}/>
    <g class="dims">
      <line x1=${x} y1=${y} x2=${x + a * scale} y2=${y}/>
      <line x1=${x} y1=${y} x2=${x} y2=${y - b * scale}/>
      <text x=${x + (a * scale) / 2} y=${y + 18} text-anchor="middle">a = ${number(a)} mm</text>
      <text x=${x - 8} y=${y - (b * scale) / 2} text-anchor="end">b = ${number(b)} mm</text>
    </g>
    ${drawMotion(firstMotion(document), x, y)}
    <text x=${WIDTH - 10} y=${HEIGHT - 10} text-anchor="end" class="strong">x along rolling →</text>
    <text x="10" y="20" class="strong">y to the left ↑</text>
    <text x="10" y=${HEIGHT - 10}>p max ${number(pressure)} MPa (Hertz)</text>
  </svg>`;
}

/** @param {number} length */
const steps = (length) => Array.from({ length: Math.ceil(length / STEP) - 1 }, (_, place) => (place + 1) * STEP);

/** @param {JsonObject} document @returns {JsonValue | undefined} */
function firstMotion(document) {
  const motion = Array.isArray(document.motion) ? document.motion[0] : document.motion;
  return isObject(motion) && !('sweep' in motion) && !('wheelset' in motion) && !('history' in motion) ? motion : undefined;
}

/**
 * Draws the directions of creepage and spin.
 * @param {JsonValue | undefined} motion
 * @param {number} x
 * @param {number} y
 */
function drawMotion(motion, x, y) {
  if (!motion) return nothing;
  const along = numberAt(motion, '/creepage_x') || 0;
  const across = numberAt(motion, '/creepage_y') || 0;
  const spin = Number(at(motion, '/spin_per_mm')) || 0;
  const size = Math.hypot(along, across);
  const [dx, dy] = size ? [along / size, -across / size] : [0, 0];
  const turn = spin > 0 ? `M${x + 34} ${y}A34 34 0 0 0 ${x} ${y - 34}` : `M${x} ${y - 34}A34 34 0 0 1 ${x + 34} ${y}`;
  return svg`<g class="creep">
    <defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto"><path d="M0 0L8 4L0 8z"/></marker></defs>
    ${size ? svg`<line x1=${x} y1=${y} x2=${x + dx * ARROW} y2=${y + dy * ARROW} marker-end="url(#tip)"/>
      <text x=${x + dx * (ARROW + 12)} y=${y + dy * (ARROW + 12) - 6}>creepage</text>` : nothing}
    ${spin ? svg`<path d=${turn} marker-end="url(#tip)"/><text x=${x + 32} y=${y - 30}>spin</text>` : nothing}
  </g>`;
}
