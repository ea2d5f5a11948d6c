// Loads the fields of one patch and motion: cells in strips along rolling, and the border of the patch.

import { request } from './api.js';
import { readNpz } from './npz.js';

/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {[number, number][]} Loop A closed line whose first point is not repeated. */

/**
 * @typedef {object} Cells
 * Columns with one value for each cell. Cells are ordered strip by strip, each strip along rolling.
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
 * @property {number[]} [temperature_c]
 */

/** @typedef {{ cells: Cells, border: Loop[] | null }} Field */

/** Outputs of a case that are fields. */
const PARTS = ['pressure', 'tractions', 'slip', 'zones', 'temperature'];
/** Number of cells above which arrays are loaded instead of JSON. */
const TEXT_CELLS_MAX = 4000;

/** Returns whether the case requested any field. @param {JobResult} result */
export const hasFields = ({ links }) => PARTS.some((part) => part in links);

/**
 * Loads all fields of a patch and a motion in single precision.
 * @param {string} id Id of the job.
 * @param {JobResult} result
 * @param {number} patch
 * @param {number} point
 * @returns {Promise<Field>}
 */
export async function loadField(id, result, patch, point) {
  const { mesh } = result.patches[patch].points[point].solver;
  // A method that computes only resultants has neither mesh nor fields.
  const large = mesh !== undefined && mesh.strips * mesh.cells > TEXT_CELLS_MAX;
  const answer = await request(`/v1/jobs/${id}/fields?patch=${patch}&point=${point}&precision=single&format=${large ? 'npz' : 'json'}`);
  if (large) return fromArrays(await readNpz(await answer.arrayBuffer()));
  const { cells, outlines } = await answer.json();
  return { cells, border: outlines.patch };
}

/**
 * @param {Record<string, import('./npz.js').NamedArray>} arrays
 * @returns {Field}
 */
export function fromArrays(arrays) {
  /** @type {Record<string, number[] | string[]>} */
  const cells = {};
  for (const [name, { values }] of Object.entries(arrays)) {
    if (name.startsWith('outline_')) continue;
    const numbers = Array.from(/** @type {Iterable<number>} */ (values));
    cells[name] = name === 'zone' ? numbers.map((zone) => (zone === 0 ? 'stick' : 'slip')) : numbers;
  }
  const corners = Array.from(/** @type {Iterable<number>} */ (arrays.outline_patch_mm.values));
  const starts = Array.from(/** @type {Iterable<number>} */ (arrays.outline_patch_start.values));
  const border = starts.map((start, at) => {
    const end = starts[at + 1] ?? corners.length / 2;
    return Array.from({ length: end - start }, (_, corner) => /** @type {[number, number]} */ ([corners[2 * (start + corner)], corners[2 * (start + corner) + 1]]));
  });
  return { cells: /** @type {Cells} */ (/** @type {unknown} */ (cells)), border };
}
