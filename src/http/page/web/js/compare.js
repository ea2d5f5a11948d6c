// State of the comparison of up to four jobs: their data and the selection.

import { caseOf, checkCase, job as jobOf, result as resultOf } from './api.js';
import { at, numberAt } from './document.js';
import { hasFields, loadField } from './fields.js';
import { indexOf } from './field/cells.js';
import { offered, quantityOf, rangeOf, valuesOf } from './field/quantities.js';
import { COMPARED_MAX } from './marks.js';
import { tellingPoint } from './result.js';
import { onSameRail, placed } from './placing.js';
import { formatRoute } from './routes.js';
import { hasSections } from './starts.js';
import { bestFit, wearBetween } from './wear.js';
import { firstPatch, oneWheel, outward, sideOf } from './wheelloads.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Job} Job */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./fields.js').Field} Field */
/** @typedef {import('./field/quantities.js').Quantity} Quantity */

/** @typedef {import('./wear.js').Body} Body */
/** @typedef {import('./placing.js').Place} Place */
/** @typedef {Record<Body, readonly Place[]>} Sections In track axes. */
/** @typedef {{ id: string, job: Job, result: JobResult, document: JsonObject, patch: number, point: number, field: Field | null, sections: Sections | null }} Side */

/**
 * @typedef {object} Comparison
 * @property {string} key The ids of the jobs, joined.
 * @property {Side[]} sides
 * @property {string} quantity
 * @property {number} other Index of the side that the first is compared with.
 * @property {Body} body Body whose cross-sections are overlaid.
 * @property {boolean} fitted Whether they are aligned by a best fit of their unworn parts, instead of by their position in the track or on the axle.
 * @property {boolean} sameRail Whether fields are subtracted at the same place on the rail, instead of the same place in the patch.
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
  const wanted = ids.slice(0, COMPARED_MAX);
  const key = wanted.join('/');
  if (comparison?.key === key) return;
  /** @type {Comparison} */
  const mine = { key, sides: [], quantity: query.field ?? '', other: Math.max(1, Math.min(wanted.length - 1, Number(query.with) || 1)), body: 'rail', fitted: true, sameRail: true };
  comparison = mine;
  try {
    mine.sides = await Promise.all(wanted.map((id, at) => loadSide(id, query[`patch${at}`] ?? query.patch, query[`point${at}`] ?? query.point)));
    settle(mine);
    const [one, two] = [mine.sides[0], mine.sides[mine.other]];
    if (one && two && equal(one, two, 'rail') && !equal(one, two, 'wheel')) mine.body = 'wheel';
    app.redraw();
  } catch (error) {
    app.absent(error);
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
  const which = Math.min(result.patches.length - 1, patch === undefined ? firstPatch(result) : Math.max(0, Number(patch) || 0));
  const { points } = result.patches[which];
  const chosen = point === undefined ? tellingPoint(points) : Math.min(points.length - 1, Math.max(0, Number(point) || 0));
  const [field, sections] = await Promise.all([fieldOf({ id, result, patch: which, point: chosen }), sectionsOf(document)]);
  return { id, job, result, document, patch: which, point: chosen, field, sections };
}

/** Requests the cross-sections of a case, as the service reads and places them. @param {JsonObject} document @returns {Promise<Sections | null>} */
async function sectionsOf(document) {
  if (!hasSections(at(document, '/contact/type'))) return null;
  const { understood } = await checkCase(JSON.stringify(oneWheel(document, 'right', 0)), new AbortController().signal);
  return placed(understood?.placement);
}

/** Returns whether two cases have the same cross-section of a body. @param {Side} one @param {Side} two @param {Body} body */
export const equal = (one, two, body) =>
  JSON.stringify(at(one.document, `/contact/${body}`)) === JSON.stringify(at(two.document, `/contact/${body}`));

/** @type {{ key: string, wear: ReturnType<typeof wearBetween> } | null} */
let wearBefore = null;

/** Returns the material that the second cross-section lacks compared with the first; null if one of them has no cross-section. @param {Comparison} of */
export function wearOf({ sides, other, body, fitted }) {
  const [one, two] = [sides[0], sides[other]];
  if (!one?.sections || !two?.sections) return null;
  const key = [one.id, two.id, body, fitted].join();
  if (wearBefore?.key !== key) {
    const moved = shapeOf(two, two.sections, body);
    const first = shapeOf(one, one.sections, body);
    wearBefore = { key, wear: wearBetween(first, moved, body, fitted ? bestFit(first, moved, body) : [0, 0]) };
  }
  return wearBefore.wear;
}

/**
 * Returns a cross-section with y measured from the track centre to the field side. A rail is placed by its gauge; a wheel is on its centred axle, with its running circle at z = 0.
 * @param {Side} side
 * @param {Sections} sections
 * @param {Body} body
 * @returns {readonly Place[]}
 */
export function shapeOf({ document }, sections, body) {
  const hand = at(document, '/contact/type') === 'profiles' ? sideOf(document) : 'right';
  const shift = body === 'wheel' && at(document, '/contact/type') === 'profiles' ? numberAt(document, '/contact/lateral_shift_mm') || 0 : 0;
  const line = sections[body].map(([y, z]) => /** @type {Place} */ ([outward(hand, y - shift), z]));
  const level = body === 'wheel' ? heightAt(line, RUNNING_CIRCLE_MM) : 0;
  return line.map(([y, z]) => [y, z - level]);
}

/** Distance from the track centre to the running circle, for the usual flange-back distance of 1360 mm. */
const RUNNING_CIRCLE_MM = 750;

/** Returns the height of a line at y; beyond its ends, the height of the nearest point. @param {readonly Place[]} line @param {number} y */
function heightAt(line, y) {
  for (let i = 1; i < line.length; i += 1) {
    const [[ya, za], [yb, zb]] = [line[i - 1], line[i]];
    if ((ya - y) * (yb - y) <= 0 && ya !== yb) return za + ((y - ya) / (yb - ya)) * (zb - za);
  }
  return line.reduce((best, point) => (Math.abs(point[0] - y) < Math.abs(best[0] - y) ? point : best), line[0])[1];
}

/** @param {Pick<Side, 'id' | 'result' | 'patch' | 'point'>} side */
const fieldOf = async ({ id, result, patch, point }) => (hasFields(result) ? loadField(id, result, patch, point) : null);

/** Selects a quantity that all sides have, unless the current one is. @param {Comparison} of */
function settle(of) {
  const all = common(of);
  if (!all.some(({ key }) => key === of.quantity)) of.quantity = (all.find(({ key }) => key === 'traction') ?? all[0])?.key ?? '';
}

/** Returns the quantities that all sides have. @param {Comparison} of @returns {Quantity[]} */
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

/** Returns a common range of colours for all sides. @param {Comparison} of @param {Quantity} quantity */
export const rangeOfAll = ({ sides }, quantity) => rangeOf(quantity, sides.flatMap(({ field }) => (field ? [field.cells] : [])), NaN);

/**
 * Returns the difference of two fields at the cells of the first.
 * @param {Field} one
 * @param {Field} two
 * @param {Quantity} quantity
 * @param {((place: { x: number, y: number }) => { x: number, y: number }) | null} move Maps places of the first field to places of the second; null for the identity.
 * @returns {Quantity} The difference as a quantity of the first field.
 */
function differenceOf(one, two, quantity, move) {
  const values = valuesOf(quantity, one.cells) ?? [];
  const others = valuesOf(quantity, two.cells) ?? [];
  const index = indexOf(two);
  const { x_mm, y_mm } = one.cells;
  const differences = Float64Array.from(x_mm, (x, cell) => {
    const place = move ? move({ x, y: y_mm[cell] }) : { x, y: y_mm[cell] };
    const other = index.nearest(place.x, place.y);
    // Outside the other patch, pressure and traction are 0.
    return other < 0 ? (quantity.vanishes ? -values[cell] : NaN) : others[other] - values[cell];
  });
  return {
    key: 'difference', label: 'Difference', heading: `Δ ${quantity.heading}`, unit: quantity.unit, scale: 'signed',
    vanishes: false, bounded: false, values: () => differences, vector: () => null,
  };
}

/** @type {{ one: Field, two: Field, key: string, quantity: Quantity, field: Field } | null} */
let differenceBefore = null;

/** Returns the difference of two sides; the last one is cached. @param {Side} first @param {Side} second @param {string} name @param {boolean} sameRail */
export function knownDifference(first, second, name, sameRail) {
  const [one, two] = [first.field, second.field];
  const quantity = quantityOf(name);
  if (!one || !two || !quantity || quantity.scale === 'zones') return null;
  const move = sameRail ? onSameRail(first, second) : null;
  const key = `${name} ${move !== null}`;
  if (differenceBefore?.one !== one || differenceBefore.two !== two || differenceBefore.key !== key) {
    // A new object of cells is needed because values are cached by cells.
    const field = { cells: { ...one.cells, zone: undefined }, border: one.border };
    differenceBefore = { one, two, key, quantity: differenceOf(one, two, quantity, move), field };
  }
  return differenceBefore;
}
