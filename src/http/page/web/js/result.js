// State of the view Result: the loaded data of a job and the selection.

import { caseOf, checkCase, job as jobOf, Refused, result as resultOf, stresses as stressesOf } from './api.js';
import { follow } from './events.js';
import { at, numberAt } from './document.js';
import { hasFields, loadField } from './fields.js';
import { offered, quantityOf, rangeOf } from './field/quantities.js';
import { placed } from './placing.js';
import { formatRoute } from './routes.js';
import { hasSections, isSolvedBent } from './starts.js';
import { firstPatch, flangeAngle, oneWheel, sideOf } from './wheelloads.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Job} Job */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./api.js').Point} Point */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./fields.js').Field} Field */
/** @typedef {import('./api.js').Schemas['Stresses']} Stresses */
/** @typedef {import('./field/quantities.js').Quantity} Quantity */

/**
 * @typedef {object} Standing
 * A wheel on its rail, in track axes.
 * @property {import('./placing.js').Placed} placed
 * @property {import('./placing.js').Placement['first_touch']} touch
 * @property {number} shift Shift of the wheelset to the left, in mm.
 * @property {number} cant Inclination of the rail, in rad.
 */

/**
 * @typedef {object} Looked
 * A job with its result and the selection.
 * @property {Job} job
 * @property {JobResult | null} result
 * @property {JsonObject | null} document The case.
 * @property {import('./placing.js').Placed | null} placed Placed cross-sections of a single wheel and rail.
 * @property {Map<string, Promise<Field>>} asked Fields by patch and motion.
 * @property {(Field | undefined)[]} fields Fields of the chosen motion, by patch.
 * @property {Map<string, Stresses | null>} stresses Stresses below the surface, by patch and motion; null while loading.
 * @property {Partial<Record<'left' | 'right', Standing>>} wheels Wheels of a wheelset.
 * @property {Partial<Record<'left' | 'right', number>>} flange Flange angle of each wheel in rad; absent for a wheel without a flange.
 * @property {'rail' | 'wheel'} wornBody Body on which wear is shown.
 * @property {boolean} ownScale Whether the range of colours is that of the shown patch and motion, instead of a common one.
 * @property {boolean} near Whether only the surroundings of the patches are drawn, instead of the whole profiles.
 * @property {number} patch
 * @property {number} point
 * @property {string} quantity Key of the shown quantity; empty if there is no field.
 * @property {{ x: number, y: number } | null} held Fixed position of the crosshair.
 * @property {boolean} border
 * @property {boolean} arrows
 * @property {boolean} mesh
 * @property {import('./curvedata.js').CurveKind} curve
 * @property {import('./wheelsetdata.js').Kind} wheelset
 * @property {string} window Pair of EN 15302 whose window is drawn; empty for none.
 */

/** @type {Looked | null} */
let looked = null;
let following = new AbortController();

export const lookedAt = () => looked;

/** Returns the motion to show first, whose force is nearest to 65 % of the largest. @param {readonly Point[]} points */
export function tellingPoint(points) {
  const forces = points.map((point) => Math.hypot(point.force_x_n, point.force_y_n));
  const wanted = 0.65 * Math.max(...forces);
  return forces.reduce((best, force, at) => (Math.abs(force - wanted) < Math.abs(forces[best] - wanted) ? at : best), 0);
}

/** @param {Job} job @returns {Looked} */
const fresh = (job) => ({
  job, result: null, document: null, placed: null, asked: new Map(), fields: [], stresses: new Map(), wheels: {}, flange: {}, wornBody: 'rail', ownScale: true, near: false, patch: -1, point: -1, quantity: '',
  held: null, border: true, arrows: true, mesh: false, curve: 'forces', wheelset: 'radii', window: '',
});

/**
 * Opens a job that has just been submitted, without requesting its case again.
 * @param {App} app
 * @param {Job} job
 * @param {JsonObject} document
 */
export function adoptJob(app, job, document) {
  following.abort();
  looked = { ...fresh(job), document };
  if (job.result) show(app, job.result);
  else if (job.state === 'queued' || job.state === 'running') followJob(app);
}

/**
 * Opens the job of an address.
 * @param {App} app
 * @param {string} id
 * @param {Record<string, string>} query
 */
export async function openJob(app, id, query) {
  try {
    if (looked?.job.id !== id) {
      following.abort();
      looked = null;
      const job = await jobOf(id);
      looked = fresh(job);
      apply(query);
      await load(app);
    } else {
      apply(query);
      if (looked.result) await loadFields(app);
    }
    app.redraw();
  } catch (error) {
    app.absent(error);
  }
}

/** @param {Record<string, string>} query */
function apply({ patch, point, field, x, y, cells }) {
  if (!looked) return;
  if (patch !== undefined) looked.patch = Math.max(0, Math.trunc(Number(patch)) || 0);
  if (point !== undefined) looked.point = Math.max(0, Math.trunc(Number(point)) || 0);
  if (field && quantityOf(field)) looked.quantity = field;
  if (x !== undefined && y !== undefined && Number.isFinite(Number(x) + Number(y))) looked.held = { x: Number(x), y: Number(y) };
  if (cells) looked.mesh = true;
}

/** @param {App} app */
async function load(app) {
  const mine = looked;
  if (!mine) return;
  if (mine.job.state === 'succeeded') {
    const [result, document] = await Promise.all([resultOf(mine.job.id), mine.document ?? caseOf(mine.job.id)]);
    if (looked !== mine) return;
    mine.document = document;
    show(app, result);
  } else if (mine.job.state === 'queued' || mine.job.state === 'running') followJob(app);
  else mine.document ??= await caseOf(mine.job.id);
  app.redraw();
}

/** @param {App} app */
async function followJob(app) {
  const mine = looked;
  if (!mine) return;
  const { signal } = (following = new AbortController());
  try {
    await follow(`/v1/jobs/${mine.job.id}/events`, ({ data }) => {
      mine.job = { ...mine.job, ...JSON.parse(data) };
      app.redraw();
      return !['queued', 'running'].includes(mine.job.state);
    }, signal);
    if (signal.aborted) return;
    mine.job = await jobOf(mine.job.id);
    await load(app);
  } catch (error) {
    app.refused(error);
  }
}

/** @param {App} app @param {JobResult} result */
function show(app, result) {
  if (!looked) return;
  looked.result = result;
  looked.near = isSolvedBent(looked.document, result, 0);
  placeProfiles(app).catch(app.refused);
  if (looked.patch < 0) looked.patch = firstPatch(result);
  looked.patch = Math.min(looked.patch, result.patches.length - 1);
  const { points } = result.patches[looked.patch];
  if (looked.point < 0 || looked.point >= points.length) looked.point = tellingPoint(points);
  loadFields(app).catch(app.refused);
}

/** Requests the placement of the cross-sections and computes the flange angles. @param {App} app */
async function placeProfiles(app) {
  const mine = looked;
  if (!mine?.document) return;
  const type = at(mine.document, '/contact/type');
  if (!hasSections(type)) return;
  const { document, result } = mine;
  const shift = result?.wheelset?.positions[0]?.lateral_shift_mm ?? 0;
  const sides = type === 'profiles' ? [sideOf(document)] : /** @type {const} */ (['left', 'right']);
  await Promise.all(sides.map(async (side) => {
    const checked = await checkCase(JSON.stringify(oneWheel(document, side, shift)), new AbortController().signal);
    const placement = checked.understood?.placement;
    const here = placed(placement);
    if (!placement || !here) return;
    mine.wheels[side] = { placed: here, touch: placement.first_touch, shift, cant: numberAt(document, '/contact/cant_rad') || 0 };
    const angle = flangeAngle(here.wheel, side);
    if (Number.isFinite(angle)) mine.flange[side] = angle;
    if (type === 'profiles') mine.placed = here;
  }));
  if (looked === mine) app.redraw();
}

/** Returns the stresses below a patch for the chosen motion. They are requested at the first call. @param {App} app @param {Looked} of @param {number} patch */
export function stressesBelow(app, of, patch) {
  const { job, point, result } = of;
  const name = `${patch}/${point}`;
  if (!of.stresses.has(name) && result && 'subsurface' in result.links) {
    of.stresses.set(name, null);
    stressesOf(job.id, patch, point).then((stresses) => {
      of.stresses.set(name, stresses);
      app.redraw();
    }, app.refused);
  }
  return of.stresses.get(name) ?? null;
}

/** Loads the fields of all patches of the chosen motion. @param {App} app */
async function loadFields(app) {
  const mine = looked;
  if (!mine?.result) return;
  const { point, result } = mine;
  if (!hasFields(result)) return;
  const fields = await Promise.all(result.patches.map((_, patch) => {
    const name = `${patch}/${point}`;
    const known = mine.asked.get(name) ?? loadField(mine.job.id, result, patch, point);
    mine.asked.set(name, known);
    return known;
  }));
  if (looked !== mine || mine.point !== point) return;
  mine.fields = fields;
  const all = offered(fields[0].cells);
  if (!all.some(({ key }) => key === mine.quantity)) mine.quantity = (all.find(({ key }) => key === 'traction') ?? all[0])?.key ?? '';
  app.redraw();
}

/**
 * Changes the selection and writes it into the address.
 * @param {App} app
 * @param {Partial<Looked>} choice
 */
export function choose(app, choice) {
  if (!looked) return;
  const moved = choice.point !== undefined && choice.point !== looked.point;
  Object.assign(looked, choice);
  if (choice.patch !== undefined) looked.held = null;
  rememberView(app);
  if (moved) loadFields(app).catch(app.refused);
  app.redraw();
}

/** @param {App} app */
export function rememberView(app) {
  if (!looked) return;
  const { job, patch, point, quantity, held, mesh } = looked;
  const place = held ? { x: held.x.toFixed(3), y: held.y.toFixed(3) } : {};
  app.remember(formatRoute('result', [job.id], { patch, point, field: quantity, ...place, cells: mesh ? 1 : undefined }));
}

/** Returns the coefficient of friction; NaN if the case has another law. @param {Looked} of */
export const frictionOf = ({ document }) => numberAt(document ?? undefined, '/friction/coefficient');

/** Returns the range of colours: that of the chosen patch and motion, or a common one. @param {Looked} of @param {Quantity} quantity */
export function rangeShown(of, quantity) {
  const own = of.fields[of.patch];
  if (of.ownScale && own) return rangeOf(quantity, [own.cells], NaN);
  const pressure = Math.max(...(of.result?.patches ?? []).map((patch) => patch.pressure_max_mpa));
  const bound = quantity.bounded ? frictionOf(of) * pressure : NaN;
  const cells = of.fields.flatMap((field) => (field ? [field.cells] : []));
  return rangeOf(quantity, cells, bound);
}

/** Returns whether an error means that the job no longer exists. @param {unknown} error @returns {error is Refused} */
export const isGone = (error) => error instanceof Refused && (error.status === 404 || error.status === 410);
