// Drawing of a worn section: at the start, at a step with its uncertainty band, and with the contacts of the traffic.

import { nothing, svg } from '../../vendor/lit-html.js';
import { grid, path, scaleOf } from './axes.js';

/** @typedef {import('./axes.js').Point} Point */

/**
 * @typedef {object} WornShape
 * @property {string} label
 * @property {readonly Point[]} now
 * @property {readonly Point[]} low Edge of the band; `high` is the other one.
 * @property {readonly Point[]} high
 * @property {readonly WornContact[]} contacts
 */

/**
 * @typedef {object} WornContact
 * @property {Point} at
 * @property {Point} normal Unit normal into the body.
 * @property {number} size Share of the load.
 * @property {number} pressure Largest pressure in MPa.
 */

/** Radius of a circle for the whole load, and length of the needle of the largest pressure, in pixels. */
const LARGEST = 15;
const NEEDLE = 60;
const LOOKS = ['one', 'two'];

/** @param {{ name: string, start: readonly Point[], strongest: number, shapes: readonly WornShape[] }} of `strongest`: pressure of the longest needle, in MPa. */
export function drawWorn({ name, start, strongest, shapes }) {
  // The drawing is narrower on a narrow screen, so that the text keeps its size.
  const width = Math.min(1150, Math.max(420, innerWidth - 40));
  const all = [...start, ...shapes.flatMap(({ now }) => now)];
  const [ys, zs] = [all.map(([y]) => y), all.map(([, z]) => z)];
  const [y0, y1, z0, z1] = [Math.min(...ys) - 4, Math.max(...ys) + 4, Math.min(...zs) - 3, Math.max(...zs) + 5];
  const scale = (width - 66) / (y1 - y0);
  const bottom = 26 + (z1 - z0) * scale;
  const axes = { left: 50, right: width - 16, top: 26, bottom, x: /** @type {const} */ ([y0, y1]), y: /** @type {const} */ ([z0, z1]) };
  const T = scaleOf(axes);
  const band = (/** @type {WornShape} */ { low, high }) => `${path(low.map(T))}${path([...high].reverse().map(T)).replace('M', 'L')}Z`;
  const legendWidth = (width - 60) / (shapes.length + 1);
  const legend = [{ look: 'limit', label: 'at the start' }, ...shapes.map(({ label }, at) => ({ look: LOOKS[at], label }))];
  return svg`<svg class="drawing chart worn" viewBox=${`0 0 ${width} ${(bottom + 64).toFixed(0)}`} role="img" aria-label=${name}>
    ${grid(axes, { x: 'y to the field side / mm', y: 'z up / mm', columns: 10, rows: 5 })}
    ${shapes.map((shape, at) => svg`<path class=${`band ${LOOKS[at]}`} d=${band(shape)}/>`)}
    <path class="line start" d=${path(start.map(T))}/>
    ${shapes.map(({ now }, at) => svg`<path class=${`line ${LOOKS[at]}`} d=${path(now.map(T))}/>`)}
    ${shapes.map(({ contacts }, side) => contacts.map(({ at, normal: [y, z], size, pressure }) => {
      const [px, py] = T(at);
      const length = (NEEDLE * pressure) / strongest;
      return svg`<g class=${`touch ${LOOKS[side]}`}><circle cx=${px} cy=${py} r=${LARGEST * Math.sqrt(size)}/><path d=${`M${px} ${py}l${-length * y} ${length * z}`}/></g>`;
    }))}
    ${legend.map(({ look, label }, at) => svg`<g class="legend"><path class=${`line ${look === 'limit' ? 'start' : look}`} d=${`M${50 + at * legendWidth} ${bottom + 52}h22`}/><text x=${80 + at * legendWidth} y=${bottom + 56}>${label}</text></g>`)}
    ${shapes.length ? nothing : svg`<text x="60" y="60">nothing yet</text>`}
  </svg>`;
}
