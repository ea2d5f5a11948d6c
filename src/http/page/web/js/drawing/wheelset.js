// Drawing of both wheels of a wheelset: on their rails with the pressure, or above them with lines between the points of contact.

import { html, nothing, svg } from '../../vendor/lit-html.js';
import { fixed, number } from '../format.js';
import { combShape } from '../field/comb.js';
import { surfaceOf } from '../placing.js';
import { path } from './axes.js';

/** @typedef {import('../placing.js').Place} Place */
/** @typedef {import('../wheelloads.js').Side} Side */
/** @typedef {import('./axes.js').Point} Point */

/** @typedef {{ shift: number, rail: Place, wheel: Place }} Touch Points of contact on rail and wheel at a shift, in the coordinates of the drawing. */

/**
 * @typedef {object} DrawnSide
 * @property {readonly Place[]} rail
 * @property {readonly Place[]} wheel
 * @property {Touch} touch Contact at the drawn shift.
 * @property {readonly Touch[]} lines Contacts at other shifts.
 * @property {readonly import('../shifting.js').Pressed[]} pressed
 */

const WIDTH = 900;
/** Space beside the rail on the field side and on the flange side. */
const FIELD_MM = 12;
const FLANGE_MM = 40;
const BETWEEN = 26;
/** Height of a wheel above its rail when they are drawn apart. */
export const APART_MM = 30;
const COMB_MM = 16;
/** Smallest distance between the labels of contact lines, in pixels. */
const APART_PX = 30;

/** @param {Partial<Record<Side, DrawnSide>>} sides @param {boolean} apart @param {number} shift */
export function drawWheelset(sides, apart, shift) {
  const all = Object.values(sides);
  if (!all.length) return html`<p class="pad quiet">Loading the cross-sections …</p>`;
  const spans = all.map(({ rail }) => {
    const ys = rail.map(([y]) => y);
    const left = ys[0] > 0;
    return /** @type {const} */ ([Math.min(...ys) - (left ? FLANGE_MM : FIELD_MM), Math.max(...ys) + (left ? FIELD_MM : FLANGE_MM)]);
  });
  const scale = (WIDTH - BETWEEN * (all.length - 1)) / spans.reduce((sum, [from, to]) => sum + to - from, 0);
  const [top, low] = [24 + (apart ? APART_MM : 0), -34];
  const height = (top - low) * scale;
  const most = Math.max(1, ...all.flatMap(({ pressed }) => pressed.map(({ patch }) => patch.pressure_max_mpa)));
  let left = 0;
  return html`<svg class="drawing" viewBox=${`0 0 ${WIDTH} ${height.toFixed(0)}`} role="img"
    aria-label=${`Both wheels on their rails, seen along rolling, shifted ${number(shift, 3)} mm to the left`}>${all.map((side, at) => {
      const [from, to] = spans[at];
      const width = (to - from) * scale;
      /** @type {(point: Point) => Point} */
      const T = ([y, z]) => [(to - y) * scale, (top - z) * scale];
      const part = svg`<svg x=${left} width=${width} height=${height} viewBox=${`0 0 ${width} ${height}`}>
        <path class="rail" d=${`${path(side.rail.map(T))}V${height + 20}H${T(side.rail[0])[0]}Z`}/>
        <path class="wheel" d=${`${path(side.wheel.map(T))}V-20H${T(side.wheel[0])[0]}Z`}/>
        ${apart ? contactLines(side, T) : nothing}
        ${side.pressed.map(({ patch, comb, bent }) => pressure(patch, comb, surfaceOf(patch, side.rail, bent), (COMB_MM * patch.pressure_max_mpa) / most, T))}
        ${apart ? nothing : svg`<circle class="dot" cx=${T(side.touch.rail)[0]} cy=${T(side.touch.rail)[1]} r="4"/>`}</svg>`;
      left += width + BETWEEN;
      return part;
    })}</svg>`;
}

/** Draws lines between the points of contact, with labels at the rail where there is space. @param {DrawnSide} side @param {(point: Point) => Point} T */
function contactLines({ lines, touch }, T) {
  /** @type {Point[]} */
  const numbered = [T(touch.rail)];
  const line = (/** @type {Touch} */ { shift, rail, wheel }, /** @type {string} */ look) => {
    const [[x, y], [x1, y1]] = [T(rail), T(wheel)];
    const free = numbered.every(([x2, y2]) => Math.abs(x - x2) > APART_PX || Math.abs(y - y2) > APART_PX);
    if (free) numbered.push([x, y]);
    return svg`<g class=${look}><line x1=${x} y1=${y} x2=${x1} y2=${y1}/>
      ${free || look.endsWith('chosen') ? svg`<text x=${x} y=${y + 15} text-anchor="middle">${fixed(shift, 1)}</text>` : nothing}</g>`;
  };
  return [...lines.map((other) => line(other, 'touching')), line(touch, 'touching chosen')];
}

/** @param {import('../api.js').Patch} patch @param {import('../field/comb.js').Comb | null} comb @param {ReturnType<typeof surfaceOf>} surface @param {number} size Height of the largest pressure, in mm. @param {(point: Point) => Point} T */
function pressure(patch, comb, surface, size, T) {
  if (!surface || !comb) return nothing;
  return svg`<path class="comb" d=${`${path(combShape(comb, surface, size / patch.pressure_max_mpa, T))}Z`}/>`;
}
