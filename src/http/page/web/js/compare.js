// Up to four jobs side by side: what is loaded of them, and what is chosen.

import { caseOf, job as jobOf, result as resultOf } from './api.js';
import { numberAt } from './document.js';
import { hasFields, loadField } from './fields.js';
import { indexOf } from './field/cells.js';
import { offered, quantityOf, rangeOf, valuesOf } from './field/quantities.js';
import { MARKED_MAX } from './marks.js';
import { tellingPoint } from './result.js';
import { formatRoute } from './routes.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Job} Job */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./fields.js').Field} Field */
/** @typedef {import('./field/quantities.js').Quantity} Quantity */

/** @typedef {{ id: string, job: Job, result: JobResult, document: JsonObject, patch: number, point: number, field: Field | null }} Side */

/**
 * @typedef {object} Comparison
 * @property {string} key The ids.
 * @property {Side[]} sides
 * @property {string} quantity
 * @property {number} other Which side the first is compared with.
 */

/** @type {Comparison | null} */
let comparison = null;

export const compared = () => comparison;

/**
 * @param {App} app
 * @param {readonly string[]} ids
 * @param {Record<string, string>} query
 */
export async function openComparison(app, ids, query) {
  const wanted = ids.slice(0, MARKED_MAX);
  const key = wanted.join('/');
  if (comparison?.key === key) return;
  /** @type {Comparison} */
  const mine = { key, sides: [], quantity: query.field ?? '', other: Math.max(1, Math.min(wanted.length - 1, Number(query.with) || 1)) };
  comparison = mine;
  try {
    mine.sides = await Promise.all(wanted.map((id, at) => loadSide(id, query[`patch${at}`] ?? query.patch, query[`point${at}`] ?? query.point)));
    settle(mine);
    app.redraw();
  } catch (error) {
    app.refused(error);
  }
}

/**
 * @param {string} id
 * @param {string | undefined} patch
 * @param {string | undefined} point
 * @returns {Promise<Side>}
 */
async function loadSide(id, patch, point) {
  const [job, result, document] = await Promise.all([jobOf(id), resultOf(id), caseOf(id)]);
  const at = Math.min(result.patches.length - 1, Math.max(0, Number(patch) || 0));
  const { points } = result.patches[at];
  const chosen = point === undefined ? tellingPoint(points) : Math.min(points.length - 1, Math.max(0, Number(point) || 0));
  const side = { id, job, result, document, patch: at, point: chosen, field: null };
  return { ...side, field: await fieldOf(side) };
}

/** @param {Pick<Side, 'id' | 'result' | 'patch' | 'point'>} side */
const fieldOf = async ({ id, result, patch, point }) => (hasFields(result) ? loadField(id, result, patch, point) : null);

/** A quantity that all sides have. @param {Comparison} of */
function settle(of) {
  const all = common(of);
  if (!all.some(({ key }) => key === of.quantity)) of.quantity = (all.find(({ key }) => key === 'traction') ?? all[0])?.key ?? '';
}

/** The quantities that all sides have. @param {Comparison} of @returns {Quantity[]} */
export function common({ sides }) {
  const fields = sides.map((side) => side.field);
  const [first] = fields;
  if (!first || fields.some((field) => !field)) return [];
  return offered(first.cells).filter((quantity) => fields.every((field) => field && valuesOf(quantity, field.cells)));
}

/** @param {App} app @param {Partial<Comparison>} choice */
export function chooseCompared(app, choice) {
  if (!comparison) return;
  Object.assign(comparison, choice);
  rememberComparison(app, comparison);
  app.redraw();
}

/** @param {App} app @param {Side} side @param {{ patch?: number, point?: number }} choice */
export async function chooseSide(app, side, choice) {
  if (!comparison) return;
  Object.assign(side, choice);
  side.point = Math.min(side.point, side.result.patches[side.patch].points.length - 1);
  rememberComparison(app, comparison);
  try {
    side.field = await fieldOf(side);
    settle(comparison);
    app.redraw();
  } catch (error) {
    app.refused(error);
  }
}

/** @param {App} app @param {Comparison} of */
function rememberComparison(app, { sides, quantity, other }) {
  const chosen = Object.fromEntries(sides.flatMap(({ patch, point }, at) => [[`patch${at}`, patch], [`point${at}`, point]]));
  app.remember(formatRoute('compare', sides.map((side) => side.id), { field: quantity, with: other > 1 ? other : undefined, ...chosen }));
}

/** @param {Side} side */
export const frictionOf = ({ document }) => numberAt(document, '/friction/coefficient');

/** One range of colours for all sides. @param {Comparison} of @param {Quantity} quantity */
export function rangeOfAll({ sides }, quantity) {
  const bounds = sides.map((side) => frictionOf(side) * side.result.patches[side.patch].pressure_max_mpa);
  return rangeOf(quantity, sides.flatMap(({ field }) => (field ? [field.cells] : [])), Math.max(...bounds));
}

/**
 * The difference of two fields at the cells of the first, where both have a value.
 * @param {Field} one
 * @param {Field} two
 * @param {Quantity} quantity
 * @returns {Quantity} One that is shown on the first field.
 */
export function differenceOf(one, two, quantity) {
  const values = valuesOf(quantity, one.cells) ?? [];
  const others = valuesOf(quantity, two.cells) ?? [];
  const index = indexOf(two);
  const { x_mm, y_mm } = one.cells;
  const differences = Float64Array.from(x_mm, (x, cell) => {
    const other = index.nearest(x, y_mm[cell]);
    return other < 0 ? NaN : others[other] - values[cell];
  });
  return {
    key: 'difference', label: 'Difference', heading: `Δ ${quantity.heading}`, unit: quantity.unit, scale: 'signed',
    vanishes: false, bounded: false, values: () => differences, vector: () => null,
  };
}

/** @type {{ one: Field, two: Field, key: string, quantity: Quantity, field: Field } | null} */
let differenceBefore = null;

/** The same, made once for each pair. @param {Field} one @param {Field} two @param {string} key */
export function knownDifference(one, two, key) {
  const quantity = quantityOf(key);
  if (!quantity || quantity.scale === 'zones') return null;
  if (differenceBefore?.one !== one || differenceBefore.two !== two || differenceBefore.key !== key) {
    // A field of its own: values are kept by the cells that they belong to.
    const field = { cells: { ...one.cells }, border: one.border };
    differenceBefore = { one, two, key, quantity: differenceOf(one, two, quantity), field };
  }
  return differenceBefore;
}
