// The largest pressure of each strip of a patch, for drawing on the profiles.

import { indexOf, smoothLine } from './cells.js';

/** @typedef {{ y: number[], pressure: number[] }} Comb Largest pressure of each strip over the lateral coordinate, with 0 at both ends. */

/** @param {import('../fields.js').Field | undefined} field @returns {Comb | null} */
export function combOf(field) {
  if (!field?.cells.pressure_mpa) return null;
  const { strips } = indexOf(field);
  const pressure = field.cells.pressure_mpa;
  const largest = strips.map(({ first, end }) => pressure.slice(first, end).reduce((most, value) => Math.max(most, value), 0));
  return { y: [strips[0].low, ...strips.map(({ y }) => y), strips[strips.length - 1].high], pressure: [0, ...largest, 0] };
}

/** @typedef {[number, number]} Place */

/**
 * Returns the outline of a comb above the surface of its patch, in pixels.
 * @param {Comb} comb
 * @param {(across: number, height: number) => Place} surface
 * @param {number} scale Height of 1 MPa, in mm.
 * @param {(place: Place) => readonly [number, number]} T Map to pixels.
 */
export function combShape({ y, pressure }, surface, scale, T) {
  const pixels = (/** @type {number} */ across, /** @type {number} */ height) => /** @type {Place} */ ([...T(surface(across, height))]);
  return [...y.map((across) => pixels(across, 0)), ...smoothLine(y.map((across, at) => pixels(across, pressure[at] * scale))).reverse()];
}
