// The largest pressure of every strip of a patch, as it is drawn on the profiles.

import { indexOf } from './cells.js';

/** @typedef {{ y: number[], pressure: number[] }} Comb The largest pressure of every strip, across the patch. */

/** @param {import('../fields.js').Field | undefined} field @returns {Comb | null} */
export function combOf(field) {
  if (!field?.cells.pressure_mpa) return null;
  const { strips } = indexOf(field);
  const pressure = field.cells.pressure_mpa;
  const largest = strips.map(({ first, end }) => pressure.slice(first, end).reduce((most, value) => Math.max(most, value), 0));
  return { y: [strips[0].low, ...strips.map(({ y }) => y), strips[strips.length - 1].high], pressure: [0, ...largest, 0] };
}
