// Interactive shift of a wheelset with a level axle: its wheels, their loads, and the pressure on the rails.

import { cancel, remove, submit } from './api.js';
import { at, isObject, numberAt, put } from './document.js';
import { loadField } from './fields.js';
import { combOf } from './field/comb.js';
import { gapOf } from './placing.js';
import { isSolvedBent } from './starts.js';
import { TYPED } from './typed.js';
import { oneWheel, outward } from './wheelloads.js';
import { nearest } from './wheelsetdata.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./placing.js').Place} Place */
/** @typedef {import('./wheelloads.js').Side} Side */
/** @typedef {import('./wheelsetdata.js').Kinematics} Kinematics */
/** @typedef {import('./result.js').Standing} Standing */
/** @typedef {import('./field/comb.js').Comb} Comb */
/** @typedef {import('./api.js').Patch} Patch */
/** @typedef {{ patch: Patch, comb: Comb | null, bent: boolean }} Pressed `bent`: whether the pressure is drawn along the curve of the rail. */

/**
 * @typedef {object} Carried
 * The load of a wheel at a shift, as forces on the rail.
 * @property {number} normal_n
 * @property {number} y_n Lateral force, positive to the field side.
 * @property {number} x_n
 * @property {number} pressure_mpa
 * @property {number} area_mm2
 * @property {number} power_n
 */

/**
 * @typedef {object} Shifting
 * @property {Kinematics} kinematics
 * @property {number} at Index in the lists of the kinematics.
 * @property {boolean} apart Whether the wheels are drawn above their rails, with lines between the points of contact.
 * @property {Partial<Record<Side, Carried>>} carried
 * @property {Partial<Record<Side, Pressed[]>>} pressed
 * @property {string} failure Reason why there are no results; empty if there are.
 */

const SIDES = /** @type {const} */ (['left', 'right']);

/** @type {Shifting | null} */
let shifting = null;
/** Solver settings while the slider moves, where lower accuracy is sufficient. */
const LOOK = { target_error: 0.01 };
/** Index of the newest requested shift. */
let wanted = -1;
let busy = false;

/** Returns the shifted wheelset of a result. It starts at the given shift. @param {Kinematics} kinematics @param {number} shift In mm. */
export function shiftingOf(kinematics, shift) {
  if (shifting?.kinematics !== kinematics) {
    shifting = { kinematics, at: nearest(kinematics.lateral_shift_mm, shift), apart: false, carried: {}, pressed: {}, failure: '' };
    wanted = -1;
  }
  return shifting;
}

/** Returns a rail and its wheel in track axes at a shift, with the wheel touching the rail and a level axle. @param {Standing} standing @param {number} shift In mm. */
export function shifted({ placed, shift: before }, shift) {
  const moved = placed.wheel.map(([y, z]) => /** @type {Place} */ ([y + shift - before, z]));
  const lift = Math.min(...gapOf(placed.rail, moved).map(([, gap]) => gap));
  return { rail: placed.rail, wheel: Number.isFinite(lift) ? moved.map(([y, z]) => /** @type {Place} */ ([y, z - lift])) : moved };
}

/**
 * Returns a case of one wheel of a shifted wheelset. Its free rolling radius is the mean of both rolling radii, unless the case prescribes creepages
 * or a history.
 * @param {JsonObject} document
 * @param {Side} side
 * @param {Kinematics} kinematics
 * @param {number} place
 */
function rollingWheel(document, side, { lateral_shift_mm: shifts, left, right }, place) {
  const motion = Array.isArray(document.motion) ? document.motion[0] : document.motion;
  const rolling = at(motion, '/wheelset/0') ?? at(motion, '/wheelset');
  const speed = numberAt(rolling, '/speed_mm_per_s') || 20000;
  const radius = (left.rolling_radius_mm[place] + right.rolling_radius_mm[place]) / 2;
  const one = { ...oneWheel(document, side, shifts[place]), solver: LOOK };
  return put(one, '/motion', isObject(rolling) || !isObject(motion) || 'sweep' in motion ? { wheelset: { speed_mm_per_s: speed, free_rolling_radius_mm: radius } } : motion);
}

/** Computes the initial shift once. @param {App} app @param {JsonObject} document @param {Shifting} of */
export function begin(app, document, of) {
  if (of === shifting && wanted < 0) setTimeout(() => shiftTo(app, document, of.at).catch(app.refused));
}

/** Shifts the wheelset. One shift is computed at a time, always the newest next. @param {App} app @param {JsonObject} document @param {number} place */
export async function shiftTo(app, document, place) {
  if (!shifting) return;
  shifting.at = wanted = place;
  app.redraw();
  if (busy) return;
  busy = true;
  try {
    for (let now = -1; now !== wanted;) {
      now = wanted;
      const began = performance.now();
      await compute(app, shifting, document, now);
      performance.measure('shift', { start: began });
    }
  } finally {
    busy = false;
  }
}

/** @param {App} app @param {Shifting} of @param {JsonObject} document @param {number} place */
async function compute(app, of, document, place) {
  try {
    const [left, right] = await Promise.all(SIDES.map((side) => solveWheel(rollingWheel(document, side, of.kinematics, place), side)));
    Object.assign(of, { carried: { left: left?.carried, right: right?.carried }, pressed: { left: left?.pressed, right: right?.pressed }, failure: '' });
  } catch (error) {
    Object.assign(of, { carried: {}, pressed: {}, failure: error instanceof Error ? error.message : String(error) });
  }
  app.redraw();
}

/**
 * Returns the load of a wheel and the pressures of its patches. The job is deleted.
 * @param {JsonObject} document
 * @param {Side} side
 * @returns {Promise<{ carried: Carried, pressed: Pressed[] } | null>} Null if it has no result, for example off the rail.
 */
async function solveWheel(document, side) {
  const job = await submit(JSON.stringify({ ...document, outputs: ['resultants', 'pressure'], ...TYPED }), { wait: 10 });
  try {
    const { result } = job;
    if (!result) return null;
    const { patches, total: [total] } = result;
    const sum = (/** @type {(patch: Patch) => number} */ pick) => patches.reduce((all, patch) => all + pick(patch), 0);
    const fields = await Promise.all(patches.map((_, patch) => loadField(job.id, result, patch, 0)));
    return {
      carried: {
        normal_n: sum((patch) => patch.normal_force_n), y_n: outward(side, total.force_y_n), x_n: total.force_x_n, area_mm2: sum((patch) => patch.area_mm2),
        pressure_mpa: Math.max(...patches.map((patch) => patch.pressure_max_mpa)), power_n: sum(({ points: [point] }) => point.friction_power_n),
      },
      pressed: patches.map((patch, at) => ({ patch, comb: combOf(fields[at]), bent: isSolvedBent(document, result, at) })),
    };
  } finally {
    if (job.state === 'queued' || job.state === 'running') await cancel('jobs', job.id).catch(() => {});
    remove('jobs', job.id).catch(() => {});
  }
}
