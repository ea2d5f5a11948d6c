// Initial cases for each kind of contact, their outputs, and the order of members.

import { at, isObject } from './document.js';

/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */

/** Resultants and the fields that the page draws. */
export const ALL_OUTPUTS = ['resultants', 'zones', 'tractions', 'pressure', 'slip'];

/** Additional outputs, each with the member of the case that it needs. */
const EXTRAS = /** @type {const} */ ({ damage: 'damage', subsurface: 'subsurface', temperature: 'thermal' });
const DEPTHS_MM = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.75, 1, 1.25, 1.5, 1.75, 2, 2.25, 2.5, 2.75, 3, 3.5, 4, 4.5, 5, 6, 7, 8, 10, 12];
/** @type {Record<keyof typeof EXTRAS, JsonObject>} */
const SETTINGS = {
  damage: { models: ['t_gamma', 'usfd_wear', 'archard_wear', 'wlrm', 'surface_fatigue_index', 'shakedown'], across: true },
  subsurface: { along_depth_at_mm: 'worst', depths_mm: DEPTHS_MM },
  temperature: { conductivity_w_per_mk: 50, density_kg_per_m3: 7850, specific_heat_j_per_kgk: 450, bulk_c: 20 },
};
const SPEED = { speed_mm_per_s: 20000 };

const STEEL = { shear_modulus_mpa: 82000, poisson_ratio: 0.28 };
const GAP_YS = [-12, -9, -6, -3, 0, 3, 6, 9, 12];

/** Contact of a wheel on a rail without cross-sections. */
export const PROFILES = /** @type {JsonObject} */ ({ type: 'profiles', rail: {}, wheel: {}, side: 'right', rolling_radius_mm: 460, cant_rad: 0.025, lateral_shift_mm: 0 });

/** Initial single motion. */
export const ONE_MOTION = /** @type {JsonObject} */ ({ creepage_x: 0.001, creepage_y: 0, spin_per_mm: 0, ...SPEED });

/** Returns the motion of free rolling, without longitudinal force or torque. @param {unknown} type Type of the contact. @returns {JsonObject} */
export const freeRolling = (type) => ({ wheelset: { ...SPEED, ...(type === 'wheelset' ? { drive_torque_n_mm: 0 } : { force_x_n: 0 }) } });

/** @type {Record<string, { contact: JsonObject, load?: JsonObject, motion: JsonObject }>} */
const STARTS = {
  radii: {
    contact: { type: 'radii', rolling_mm: 460, lateral_mm: 300 },
    load: { normal_force_n: 100000 },
    motion: ONE_MOTION,
  },
  ellipse: {
    contact: { type: 'ellipse', a_mm: 7, b_mm: 5 },
    load: { normal_force_n: 100000 },
    motion: ONE_MOTION,
  },
  profiles: {
    contact: PROFILES,
    load: { vertical_force_n: 75000 },
    motion: freeRolling('profiles'),
  },
  wheelset: {
    contact: { type: 'wheelset', rail: {}, wheel: {}, rolling_radius_mm: 460, cant_rad: 0.025, lateral_shift_mm: { from: 0, to: 4, points: 3 }, kinematics: {} },
    load: { vertical_force_n: 150000 },
    motion: freeRolling('wheelset'),
  },
  gap_profile: {
    contact: { type: 'gap_profile', rolling_mm: 460, y_mm: GAP_YS, gap_mm: GAP_YS.map((y) => Math.round((y * y * 1e6) / 600) / 1e6) },
    load: { normal_force_n: 100000 },
    motion: ONE_MOTION,
  },
  gap_grid: {
    contact: { type: 'gap_grid', x_mm: [], y_mm: [], gap_mm: [] },
    load: { normal_force_n: 100000 },
    motion: ONE_MOTION,
  },
  pressure_grid: {
    contact: { type: 'pressure_grid', x_mm: [], y_mm: [], pressure_mpa: [] },
    motion: ONE_MOTION,
  },
};

/** Returns whether a kind of contact is defined by cross-sections. @param {unknown} type */
export const hasSections = (type) => type === 'profiles' || type === 'wheelset';

/** Returns the family of a kind of contact. Contacts of one family have the same kinds of loads and motions. @param {unknown} type */
const family = (type) => (hasSections(type) ? type : 'patch');

/**
 * Returns a case with another kind of contact. All other members that remain valid are kept.
 * @param {JsonObject | null} document
 * @param {string} type
 * @returns {JsonObject}
 */
export function withContact(document, type) {
  const start = STARTS[type];
  const before = document ?? {};
  const contact = /** @type {JsonObject} */ (before.contact ?? {});
  const alike = family(type) === family(contact.type);
  /** @type {JsonObject} */
  const sections = hasSections(type) && hasSections(contact.type) ? { rail: contact.rail ?? {}, wheel: contact.wheel ?? {} } : {};
  const { load, ...kept } = before;
  return {
    ...kept,
    material: before.material ?? STEEL,
    friction: before.friction ?? { coefficient: 0.3 },
    contact: { ...start.contact, ...sections },
    ...(start.load ? { load: alike && load ? load : start.load } : {}),
    motion: alike && before.motion ? before.motion : start.motion,
    outputs: withFields(before.outputs),
  };
}

/** Adds all drawn fields to the requested outputs. @param {JsonValue | undefined} asked @returns {JsonValue[]} */
export function withFields(asked) {
  const others = Array.isArray(asked) ? asked.filter((output) => !ALL_OUTPUTS.includes(String(output))) : [];
  return [...ALL_OUTPUTS, ...others];
}

/**
 * Returns a case with one output added or removed, together with its settings.
 * @param {JsonObject} document
 * @param {string} output
 * @param {boolean} wanted
 * @returns {JsonObject}
 */
export function withOutput(document, output, wanted) {
  const outputs = outputsOf(document).filter((name) => name !== output);
  const next = { ...document, outputs: wanted ? [...outputs, output] : outputs };
  if (!isExtra(output)) return next;
  const member = EXTRAS[output];
  if (wanted) return { ...next, [member]: document[member] ?? SETTINGS[output] };
  delete (/** @type {JsonObject} */ (next)[member]);
  return next;
}

/** @param {string} output @returns {output is keyof typeof EXTRAS} */
const isExtra = (output) => Object.hasOwn(EXTRAS, output);

/** @param {JsonObject} document @param {boolean} wanted @returns {JsonObject} */
const withExtras = (document, wanted) => Object.keys(EXTRAS).reduce((/** @type {JsonObject} */ of, output) => withOutput(of, output, wanted), document);

/** Returns a case with all drawn outputs: fields, damage, stresses below the surface and temperature. @param {JsonObject} document */
export const withEverything = (document) => withExtras({ ...document, outputs: withFields(document.outputs) }, true);

/** Returns whether a case has the curved surface of the rail as contact surface, which is the default. @param {JsonObject | null} document */
export const isBent = (document) => ['profiles', 'wheelset'].includes(String(at(document ?? undefined, '/contact/type')))
  && at(document ?? undefined, '/contact/reference_surface') !== 'plane';

/**
 * Returns whether a patch was solved on the curved surface. The remark on planes applies to all patches, or to the patches of one wheel of a wheelset.
 * @param {JsonObject | null} document
 * @param {Pick<import('./api.js').JobResult, 'remarks' | 'wheelset'>} result
 * @param {number} patch
 */
export function isSolvedBent(document, { remarks, wheelset }, patch) {
  const wheels = wheelset?.positions.flatMap(({ left, right }) => [left.patches, right.patches]) ?? [];
  const here = wheels.find((patches) => patches.includes(patch)) ?? [patch];
  return isBent(document) && !remarks?.some((remark) => remark.code === 'on-planes' && (typeof remark.patch !== 'number' || here.includes(remark.patch)));
}

/** Returns a case with a speed, which temperature and Archard's wear law need. Lists of motions are unchanged. @param {JsonObject} document @returns {JsonObject} */
export function withSpeed(document) {
  const { motion } = document;
  if (!isObject(motion) || 'wheelset' in motion || 'history' in motion) return document;
  return { ...document, motion: isObject(motion.sweep) ? { ...motion, sweep: { ...SPEED, ...motion.sweep } } : { ...SPEED, ...motion } };
}

/** Returns a case without additional outputs. @param {JsonObject} document */
export const withoutExtras = (document) => withExtras(document, false);

/** @param {JsonObject} document @returns {string[]} */
export const outputsOf = ({ outputs }) => (Array.isArray(outputs) ? outputs.map(String) : ['resultants', 'zones']);

/** Returns whether a cross-section is still an empty object. @param {JsonObject} document @param {'rail' | 'wheel'} body */
export function lacksSection({ contact }, body) {
  if (!isObject(contact) || !hasSections(contact.type)) return false;
  const section = contact[body];
  return isObject(section) && Object.keys(section).length === 0;
}

/**
 * Returns the standard cross-section of a body, from the examples of the service.
 * @param {readonly import('./api.js').Schemas['ExampleCase'][]} examples
 * @param {'rail' | 'wheel'} body
 */
export function standardSection(examples, body) {
  const known = /** @type {JsonObject | undefined} */ (/** @type {unknown} */ (examples.find(({ name }) => name === 'wheel-rail')?.case));
  return at(known, `/contact/${body}`);
}

/**
 * Removes the name and the labels that a case has from an example, because they do not describe a changed contact.
 * @param {JsonObject} document
 * @param {JsonObject | undefined} example
 */
export function withoutNameOf(document, example) {
  const own = { ...document };
  if (example?.name && String(own.name ?? '').startsWith(String(example.name))) delete own.name;
  if (example && JSON.stringify(own.labels) === JSON.stringify(example.labels)) delete own.labels;
  return own;
}

const MEMBERS = ['name', 'labels', 'material', 'friction', 'contact', 'load', 'motion', 'solver', 'outputs', 'damage', 'subsurface', 'thermal'];

/**
 * Returns a case with ordered members: the type of the contact first within it, and unlisted members last.
 * @param {JsonObject} document
 * @returns {JsonObject}
 */
export function inOrder(document) {
  const { contact } = document;
  /** @type {JsonObject} */
  const first = isObject(contact) && 'type' in contact ? { ...document, contact: { type: contact.type, ...contact } } : document;
  const keys = [...MEMBERS.filter((key) => key in first), ...Object.keys(first).filter((key) => !MEMBERS.includes(key))];
  return Object.fromEntries(keys.map((key) => [key, first[key]]));
}
