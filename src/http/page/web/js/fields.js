// The fields of one patch and one motion: cells in strips along rolling, and the border of the patch.

import { request } from './api.js';

/** @typedef {[number, number][]} Loop A closed line, its first point not repeated. */

/**
 * @typedef {object} Cells
 * One value for each cell; cells stand strip by strip, each strip along rolling.
 * @property {number[]} x_mm
 * @property {number[]} y_mm
 * @property {number[]} dx_mm
 * @property {number[]} dy_mm
 * @property {number[]} strip
 * @property {string[]} [zone]
 * @property {number[]} [pressure_mpa]
 * @property {number[]} [traction_x_mpa]
 * @property {number[]} [traction_y_mpa]
 * @property {number[]} [slip_x]
 * @property {number[]} [slip_y]
 */

/** @typedef {{ cells: Cells, border: Loop[] | null }} Field */

/** Parts of a result that are fields, by the name of the output that a case asks for. */
export const PARTS = /** @type {const} */ (['pressure', 'tractions', 'slip', 'zones']);

/**
 * Loads all fields that a result has of a patch and a motion.
 * @param {string} id The job.
 * @param {readonly string[]} outputs What the case asked for.
 * @param {number} patch
 * @param {number} point
 * @returns {Promise<Field>}
 */
export async function loadField(id, outputs, patch, point) {
  const parts = PARTS.filter((part) => outputs.includes(part));
  const answers = await Promise.all(
    parts.map(async (part) => (await request(`/v1/jobs/${id}/${part}?patch=${patch}&point=${point}`)).json()),
  );
  const cells = Object.assign({}, ...answers.map((answer) => answer.cells));
  const outlines = answers.find((answer) => answer.outlines)?.outlines;
  return { cells, border: outlines?.patch ?? null };
}
