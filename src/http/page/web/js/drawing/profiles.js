// Drawing of a wheel on a rail, seen along rolling with the left side on the left, and of the gap between them.

import { html, nothing, svg } from '../../vendor/lit-html.js';
import { degrees, number, tickLabel, ticks } from '../format.js';
import { surfaceOf } from '../placing.js';
import { combShape } from '../field/comb.js';
import { grid, path, scaleOf } from './axes.js';

/** @typedef {import('../placing.js').Placed} Placed */
/** @typedef {import('../api.js').Patch} Patch */
/** @typedef {import('./axes.js').Point} Point */

/** @typedef {import('../field/comb.js').Comb} Comb */

/**
 * @typedef {object} Standing
 * @property {readonly Patch[]} patches
 * @property {readonly (Comb | null)[]} combs
 * @property {number} chosen
 * @property {(patch: number) => void} choose
 * @property {boolean} bent Whether the patches follow the curve of the rail.
 * @property {boolean} near Whether only the surroundings of the patches are drawn, instead of the whole head.
 */

const WIDTH = 560;
const TOP_MM = 27;
/** Heights of the largest pressure and of the number of a patch, relative to the drawn width. */
const COMB = 0.12;
const TAG = 0.17;
/** Width of the text of a pressure beside the number of a patch, in pixels. */
const LABEL = 84;
/** Width of the surroundings of the patches, relative to the size of the patches. */
const NEAR = 0.3;

/**
 * @param {Placed | null} placed
 * @param {Standing} [standing] Patches with their pressure.
 */
export function drawProfiles(placed, standing) {
  if (!placed) return html`<p class="quiet pad">The drawing appears when both cross-sections can be read. Drop the files of a rail and a wheel.</p>`;
  const { rail, touch } = placed;
  const patches = standing?.patches ?? [];
  const [[y0, y1], [low, top]] = standing?.near ? aroundPatches(placed, standing) : wholeHead(rail, patches);
  const scale = WIDTH / (y1 - y0);
  const height = (top - low) * scale;
  /** @type {(point: Point) => Point} */
  const T = ([y, z]) => [(y1 - y) * scale, (top - z) * scale];
  const wheel = placed.wheel.filter(([y]) => y > y0 - 40 && y < y1 + 40).map(T);
  const seen = patches.length
    ? patches.map((patch, at) => `patch ${at} at ${degrees(patch.position?.contact_angle_rad ?? 0)}`).join(', ')
    : `first touch at y ${number(touch[0])} mm`;
  return html`<svg class="drawing" viewBox=${`0 0 ${WIDTH} ${height.toFixed(0)}`} role="img" aria-label=${`Wheel on rail, seen along rolling: ${seen}`}>
    ${lattice([y0, y1], [low, top], T, height)}
    <path class="rail" d=${closed(rail.map(T), height + 20)}/>
    ${wheel.length > 1 ? svg`<path class="wheel" d=${closed(wheel, -20)}/>` : nothing}
    ${latticeNumbers([y0, y1], [low, top], T, height)}
    <g class="bodies">
      <text x=${WIDTH / 2} y="22" text-anchor="middle">wheel</text>
      <text x=${standing?.near ? WIDTH / 2 : T([mean(rail), 0])[0]} y=${height - 34} text-anchor="middle">rail</text>
    </g>
    ${standing && patches.length ? standPatches(standing, rail, y1 - y0, T) : drawTouch(T(touch))}
  </svg>`;
}

/** Returns the ranges of the drawing of the whole head, lateral and vertical. @param {readonly Point[]} rail @param {readonly Patch[]} patches @returns {[Point, Point]} */
function wholeHead(rail, patches) {
  const ys = rail.map(([y]) => y);
  const [y0, y1] = [Math.min(...ys) - 12, Math.max(...ys) + 12];
  const tips = patches.flatMap(({ position }) => (position ? [position.track_mm[1] - 1.2 * TAG * (y1 - y0) * Math.sin(position.contact_angle_rad)] : []));
  const low = -Math.min(44, 4 - Math.min(...rail.map(([, z]) => z)));
  return [[Math.min(y0, ...tips), Math.max(y1, ...tips)], [low, TOP_MM]];
}

/** Returns the ranges of the drawing around the patches with space for their pressure, lateral and vertical. @param {Placed} placed @param {Standing} standing @returns {[Point, Point]} */
function aroundPatches({ rail }, standing) {
  const places = standing.patches.flatMap((patch) => {
    const on = surfaceOf(patch, rail, standing.bent);
    return on ? [on(patch.extent_mm[2], 0), on(patch.extent_mm[3], 0)] : [];
  });
  const [ys, zs] = [places.map(([y]) => y), places.map(([, z]) => z)];
  const size = Math.max(12, Math.max(...ys) - Math.min(...ys), 1.6 * (Math.max(...zs) - Math.min(...zs)));
  const middle = (Math.max(...ys) + Math.min(...ys)) / 2;
  const half = (0.5 + NEAR) * size;
  const top = Math.max(...zs) + 2.6 * TAG * half;
  return [[middle - half, middle + half], [Math.min(top - 1.1 * half, Math.min(...zs) - NEAR * half), top]];
}

/**
 * Draws a single cross-section.
 * @param {'rail' | 'wheel'} body
 * @param {readonly (readonly number[])[] | null} line In track axes; null if it could not be read.
 */
export function drawSection(body, line) {
  if (!line) return html`<p class="quiet pad">The drawing appears when the ${body} can be read.</p>`;
  const points = line.map(([y, z]) => /** @type {Point} */ ([y, z]));
  const [ys, zs] = [points.map(([y]) => y), points.map(([, z]) => z)];
  const [y0, y1, z0, z1] = [Math.min(...ys) - 10, Math.max(...ys) + 10, Math.min(...zs) - 12, Math.max(...zs) + 12];
  const scale = WIDTH / (y1 - y0);
  const height = (z1 - z0) * scale;
  /** @type {(point: Point) => Point} */
  const T = ([y, z]) => [(y1 - y) * scale, (z1 - z) * scale];
  return html`<svg class="drawing" viewBox=${`0 0 ${WIDTH} ${height.toFixed(0)}`} role="img" aria-label=${`The ${body} alone, seen along rolling`}>
    ${lattice([y0, y1], [z0, z1], T, height)}
    <path class=${body} d=${closed(points.map(T), body === 'rail' ? height + 20 : -20)}/>
    ${latticeNumbers([y0, y1], [z0, z1], T, height)}
  </svg>`;
}

/** @param {readonly Point[]} line */
const mean = (line) => (Math.min(...line.map(([y]) => y)) + Math.max(...line.map(([y]) => y))) / 2;

/** Returns the path of a line that is closed outside the picture. @param {readonly Point[]} line @param {number} edge */
const closed = (line, edge) => `${path(line)}L${line[line.length - 1][0]} ${edge}L${line[0][0]} ${edge}Z`;

/** @param {Point} touch */
const drawTouch = ([x, y]) => svg`<g class="touch"><circle cx=${x} cy=${y} r="5"/><text x=${x + 10} y=${y - 16}>first touch</text></g>`;

/**
 * @param {Point} across
 * @param {Point} up
 * @param {(point: Point) => Point} T
 * @param {number} height
 */
function lattice([y0, y1], [low, high], T, height) {
  const ys = ticks(y0, y1, 7);
  const zs = ticks(low, high, 5);
  return svg`
    <g class="gridlines">
      ${ys.map((y) => svg`<line x1=${T([y, 0])[0]} x2=${T([y, 0])[0]} y1="0" y2=${height}/>`)}
      ${zs.map((z) => svg`<line x1="0" x2=${WIDTH} y1=${T([0, z])[1]} y2=${T([0, z])[1]}/>`)}
    </g>
`;
}

/**
 * Draws the labels of the lattice in front of the bodies.
 * @param {Point} across
 * @param {Point} up
 * @param {(point: Point) => Point} T
 * @param {number} height
 */
function latticeNumbers([y0, y1], [low, high], T, height) {
  const ys = ticks(y0, y1, 7);
  const zs = ticks(low, high, 5);
  return svg`
    <g>
      ${ys.slice(1, -1).map((y) => svg`<text x=${T([y, 0])[0]} y=${height - 6} text-anchor="middle">${tickLabel(y, ys)}</text>`)}
      ${zs.slice(1).filter((z) => T([0, z])[1] > 30).map((z) => svg`<text x="6" y=${T([0, z])[1] + 4}>${tickLabel(z, zs)}</text>`)}
      <text x="6" y="14" class="strong">z up / mm</text>
      <text x=${WIDTH - 6} y=${height - 22} text-anchor="end" class="strong">y to the left / mm</text>
    </g>`;
}

/**
 * Draws the pressure of every patch on the rail. A click chooses a patch.
 * @param {Standing} standing
 * @param {readonly Point[]} rail
 * @param {number} width Width of the drawing, in mm.
 * @param {(point: Point) => Point} T
 */
function standPatches({ patches, combs, chosen, choose, bent, near }, rail, width, T) {
  const scale = (COMB * width) / Math.max(...patches.map((patch) => patch.pressure_max_mpa));
  return patches.map((patch, at) => {
    const surface = surfaceOf(patch, rail, bent);
    if (!surface || !patch.position) return nothing;
    const angle = patch.position.contact_angle_rad;
    const [, y, z] = patch.position.track_mm;
    const comb = combs[at];
    const shape = comb && combShape(comb, surface, scale, T);
    const [x, top] = T([y - TAG * width * Math.sin(angle), z + TAG * width * Math.cos(angle)]);
    const [cx, cy] = T([y, z]);
    // The text of the pressure is on the side away from the patch if there is space.
    const beside = x < cx && x > LABEL;
    return svg`<g class=${`patch ${at === chosen ? 'chosen' : ''}`} data-patch=${at} @click=${() => choose(at)}>
      ${shape ? svg`<path class="comb" d=${`${path(shape)}Z`}/>` : nothing}
      <line x1=${cx} y1=${cy} x2=${x} y2=${top}/>
      <circle class="dot" cx=${cx} cy=${cy} r="4"/>
      <circle class="tag" cx=${x} cy=${top} r="12"/>
      <text class="tag" x=${x} y=${top + 4.5} text-anchor="middle">${at}</text>
      ${near ? svg`<text class="strong" x=${beside ? x - 18 : x + 18} y=${top + 4.5} text-anchor=${beside ? 'end' : 'start'}>${number(patch.pressure_max_mpa, 4)} MPa</text>` : nothing}
    </g>`;
  });
}

/** Draws the gap from 0 to 1 mm near the point of first contact, which shows whether a second contact is close. @param {Placed | null} placed */
export function drawGap(placed) {
  if (!placed) return nothing;
  const { touch } = placed;
  const near = placed.gap.filter(([y]) => Math.abs(y - touch[0]) <= 26);
  if (near.length < 3) return nothing;
  const axes = { left: 46, right: WIDTH - 12, top: 24, bottom: 116, x: /** @type {const} */ ([touch[0] + 26, touch[0] - 26]), y: /** @type {const} */ ([0, 1]) };
  const T = scaleOf(axes);
  const line = near.map(([y, gap]) => T([y, Math.min(gap, 1.25)]));
  return html`<svg class="drawing strip" viewBox=${`0 0 ${WIDTH} 154`} role="img" aria-label=${`Gap between wheel and rail within 26 mm of the first touch`}>
    ${grid(axes, { x: 'y to the left / mm', y: 'gap before loading / mm', rows: 2 })}
    <svg x=${axes.left} y=${axes.top} width=${axes.right - axes.left} height=${axes.bottom - axes.top + 2} viewBox=${`${axes.left} ${axes.top} ${axes.right - axes.left} ${axes.bottom - axes.top + 2}`}>
      <path class="gap" d=${path(line)}/>
    </svg>
  </svg>`;
}
