// The beginning of a case of each kind of contact, and the order of its members.

import { isObject } from './document.js';

/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */

/** Parts of an answer that are fields; the page draws all of them. */
export const ALL_OUTPUTS = ['resultants', 'zones', 'tractions', 'pressure', 'slip'];

const STEEL = { shear_modulus_mpa: 82000, poisson_ratio: 0.28 };
const GAP_YS = [-12, -9, -6, -3, 0, 3, 6, 9, 12];

/** @type {Record<string, { contact: JsonObject, load?: JsonObject, motion: JsonObject }>} */
const STARTS = {
  radii: {
    contact: { type: 'radii', rolling_mm: 460, lateral_mm: 300 },
    load: { normal_force_n: 100000 },
    motion: { creepage_x: 0.001, creepage_y: 0, spin_per_mm: 0 },
  },
  ellipse: {
    contact: { type: 'ellipse', a_mm: 7, b_mm: 5 },
    load: { normal_force_n: 100000 },
    motion: { creepage_x: 0.001, creepage_y: 0, spin_per_mm: 0 },
  },
  profiles: {
    contact: { type: 'profiles', rail: {}, wheel: {}, side: 'right', rolling_radius_mm: 460, cant_rad: 0.025, lateral_shift_mm: 0 },
    load: { vertical_force_n: 75000 },
    motion: { wheelset: { speed_mm_per_s: 20000, free_rolling_radius_mm: 460 } },
  },
  wheelset: {
    contact: { type: 'wheelset', rail: {}, wheel: {}, rolling_radius_mm: 460, cant_rad: 0.025, lateral_shift_mm: { from: 0, to: 4, points: 3 }, kinematics: {} },
    load: { vertical_force_n: 150000 },
    motion: { wheelset: { speed_mm_per_s: 20000, drive_torque_n_mm: 0 } },
  },
  gap_profile: {
    contact: { type: 'gap_profile', rolling_mm: 460, y_mm: GAP_YS, gap_mm: GAP_YS.map((y) => Math.round((y * y * 1e6) / 600) / 1e6) },
    load: { normal_force_n: 100000 },
    motion: { creepage_x: 0.001, creepage_y: 0, spin_per_mm: 0 },
  },
  gap_grid: {
    contact: { type: 'gap_grid', x_mm: [], y_mm: [], gap_mm: [] },
    load: { normal_force_n: 100000 },
    motion: { creepage_x: 0.001, creepage_y: 0, spin_per_mm: 0 },
  },
  pressure_grid: {
    contact: { type: 'pressure_grid', x_mm: [], y_mm: [], pressure_mpa: [] },
    motion: { creepage_x: 0.001, creepage_y: 0, spin_per_mm: 0 },
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

/** Are nothing but the empty braces of a cross-section there yet? @param {JsonObject} document @param {'rail' | 'wheel'} body */
export function lacksSection({ contact }, body) {
  if (!isObject(contact) || !hasSections(contact.type)) return false;
  const section = contact[body];
  return isObject(section) && Object.keys(section).length === 0;
}

/**
 * A case without the name and the labels that it has from an example: they say nothing of another contact.
 * @param {JsonObject} document
 * @param {JsonObject | undefined} example
 */
export function withoutNameOf(document, example) {
  const own = { ...document };
  for (const member of ['name', 'labels']) {
    if (example && JSON.stringify(own[member]) === JSON.stringify(example[member])) delete own[member];
  }
  return own;
}

const MEMBERS = ['name', 'labels', 'material', 'friction', 'contact', 'load', 'motion', 'solver', 'outputs'];

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
