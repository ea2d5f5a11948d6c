// The beginning of a case of each kind of contact, and the order of its members.

import { at, isObject } from './document.js';

/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */

/** Parts of an answer that are fields; the page draws all of them. */
export const ALL_OUTPUTS = ['resultants', 'zones', 'tractions', 'pressure', 'slip'];

/** Outputs beyond the fields, each with the member of the case that it needs, and what that is where nothing else is said. */
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

/** A wheel on a rail without their cross-sections. */
export const PROFILES = /** @type {JsonObject} */ ({ type: 'profiles', rail: {}, wheel: {}, side: 'right', rolling_radius_mm: 460, cant_rad: 0.025, lateral_shift_mm: 0 });

/** One motion to begin with. */
export const ONE_MOTION = /** @type {JsonObject} */ ({ creepage_x: 0.001, creepage_y: 0, spin_per_mm: 0, ...SPEED });

/** A wheel that rolls freely: the rail carries no longitudinal force. @param {unknown} type Type of the contact. @returns {JsonObject} */
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

/** Is a contact of this kind given by cross-sections? @param {unknown} type */
export const hasSections = (type) => type === 'profiles' || type === 'wheelset';

/** Contacts of one family have loads and motions alike. @param {unknown} type */
const family = (type) => (hasSections(type) ? type : 'patch');

/**
 * A case with another kind of contact: material, friction, name and labels stay, and what else still fits.
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

/** All fields that are drawn, and what else is asked for. @param {JsonValue | undefined} asked @returns {JsonValue[]} */
export function withFields(asked) {
  const others = Array.isArray(asked) ? asked.filter((output) => !ALL_OUTPUTS.includes(String(output))) : [];
  return [...ALL_OUTPUTS, ...others];
}

/**
 * A case that asks for one more output or one less, with the settings that it needs.
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

/** A case that asks for all that is drawn: fields, damage, stresses below the surface, temperature. @param {JsonObject} document */
export const withEverything = (document) => withExtras({ ...document, outputs: withFields(document.outputs) }, true);

/** Does a case ask for the curve of the rail, which is the default? @param {JsonObject | null} document */
export const isBent = (document) => ['profiles', 'wheelset'].includes(String(at(document ?? undefined, '/contact/type')))
  && at(document ?? undefined, '/contact/reference_surface') !== 'plane';

/**
 * Was a patch solved there? The remark on planes is on all patches, or on the first of a wheel of a wheelset.
 * @param {JsonObject | null} document
 * @param {Pick<import('./api.js').JobResult, 'remarks' | 'wheelset'>} result
 * @param {number} patch
 */
export function isSolvedBent(document, { remarks, wheelset }, patch) {
  const wheels = wheelset?.positions.flatMap(({ left, right }) => [left.patches, right.patches]) ?? [];
  const here = wheels.find((patches) => patches.includes(patch)) ?? [patch];
  return isBent(document) && !remarks?.some((remark) => remark.code === 'on-planes' && (typeof remark.patch !== 'number' || here.includes(remark.patch)));
}

/** A case with a speed, which temperature and Archard's wear need; lists of motions have theirs. @param {JsonObject} document @returns {JsonObject} */
export function withSpeed(document) {
  const { motion } = document;
  if (!isObject(motion) || 'wheelset' in motion || 'history' in motion) return document;
  return { ...document, motion: isObject(motion.sweep) ? { ...motion, sweep: { ...SPEED, ...motion.sweep } } : { ...SPEED, ...motion } };
}

/** A case that asks for fields only. @param {JsonObject} document */
export const withoutExtras = (document) => withExtras(document, false);

/** @param {JsonObject} document @returns {string[]} */
export const outputsOf = ({ outputs }) => (Array.isArray(outputs) ? outputs.map(String) : ['resultants', 'zones']);

/** Are nothing but the empty braces of a cross-section there yet? @param {JsonObject} document @param {'rail' | 'wheel'} body */
export function lacksSection({ contact }, body) {
  if (!isObject(contact) || !hasSections(contact.type)) return false;
  const section = contact[body];
  return isObject(section) && Object.keys(section).length === 0;
}

/**
 * The new cross-section of a body that examples of the service have.
 * @param {readonly import('./api.js').Schemas['ExampleCase'][]} examples
 * @param {'rail' | 'wheel'} body
 */
export function standardSection(examples, body) {
  const known = /** @type {JsonObject | undefined} */ (/** @type {unknown} */ (examples.find(({ name }) => name === 'wheel-rail')?.case));
  return at(known, `/contact/${body}`);
}

/**
 * A case without the name and the labels that it has from an example: they say nothing of another contact.
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
 * A case with its members as a person would order them: the kind of contact first, what is in no list last.
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
