// Names of the values of a case by JSON pointer.

import { at, isObject } from './document.js';
import { inclinationText, textOf } from './written.js';

/** @typedef {import('./document.js').JsonObject} JsonObject */

/** Name of each value, its shown unit, and the factor from that to the unit of the API. @type {Record<string, readonly [string, string?, number?]>} */
const WORDS = {
  '/name': ['name'],
  '/contact/type': ['kind of contact'],
  '/contact/rail': ['rail'],
  '/contact/wheel': ['wheel'],
  '/contact/right': ['right side'],
  '/contact/side': ['side of the track'],
  '/contact/lateral_shift_mm': ['shift to the left', 'mm'],
  '/contact/yaw_rad': ['angle of attack', 'mrad', 0.001],
  '/contact/roll_rad': ['roll', 'mrad', 0.001],
  '/contact/cant_rad': ['rail inclination'],
  '/contact/rolling_radius_mm': ['wheel radius', 'mm'],
  '/contact/gauge_mm': ['track gauge', 'mm'],
  '/contact/gauge_height_mm': ['depth of the gauge', 'mm'],
  '/contact/rail_origin_mm': ['rail origin from track centre', 'mm'],
  '/contact/flange_back_distance_mm': ['flange back distance', 'mm'],
  '/contact/flange_back_position_mm': ['flange back at y', 'mm'],
  '/contact/reference_surface': ['contact surface'],
  '/contact/influence': ['influence of cells'],
  '/contact/kinematics': ['conicity'],
  '/contact/accept_rough_profiles': ['solve although the profiles are rough'],
  '/contact/a_mm': ['semi-axis along', 'mm'],
  '/contact/b_mm': ['semi-axis across', 'mm'],
  '/contact/rolling_mm': ['relative radius along', 'mm'],
  '/contact/lateral_mm': ['relative radius across', 'mm'],
  '/contact/gap_mm': ['gap'],
  '/contact/pressure_mpa': ['pressure'],
  '/load/vertical_force_n': ['wheel load Q', 'kN', 1000],
  '/load/normal_force_n': ['normal force N', 'kN', 1000],
  '/load/approach_mm': ['penetration', 'μm', 0.001],
  '/friction/coefficient': ['friction coefficient'],
  '/material/shear_modulus_mpa': ['shear modulus', 'GPa', 1000],
  '/material/young_modulus_mpa': ["Young's modulus", 'GPa', 1000],
  '/material/poisson_ratio': ["Poisson's ratio"],
  '/motion/wheelset/speed_mm_per_s': ['speed', 'km/h', 1e6 / 3600],
  '/motion/wheelset/force_x_n': ['longitudinal force', 'kN', 1000],
  '/motion/wheelset/force_y_n': ['lateral force', 'kN', 1000],
  '/motion/wheelset/drive_torque_n_mm': ['torque of the drive', 'N·m', 1000],
  '/motion/wheelset/free_rolling_radius_mm': ['free rolling radius', 'mm'],
  '/motion/wheelset/lateral_velocity_mm_per_s': ['lateral velocity', 'mm/s'],
  '/motion/wheelset/yaw_rate_rad_per_s': ['yaw rate', 'rad/s'],
  '/labels/track_cant_mm': ['cant in mm'],
  '/motion/creepage_x': ['creepage x', '%', 0.01],
  '/motion/creepage_y': ['creepage y', '%', 0.01],
  '/motion/spin_per_mm': ['spin', '1/m', 0.001],
  '/motion/speed_mm_per_s': ['speed', 'km/h', 1e6 / 3600],
  '/solver/target_error': ['largest error', '% of μN', 0.01],
  '/damage/parameters/shear_yield_mpa': ['yield stress in shear', 'MPa'],
};

/** Members of a cross-section, which counts as one value in comparisons. */
const SECTION = /^(\/contact(?:\/right)?\/(?:rail|wheel))\/(?:format|text|points_mm)$/;

/** Returns the name of a value with the pointer of the named part. @param {string} pointer @returns {{ pointer: string, label: string, known: boolean }} */
export function wordsOf(pointer) {
  const whole = SECTION.exec(pointer)?.[1] ?? pointer;
  const part = /^\/contact\/(rail|wheel)\/(\w+)$/.exec(whole);
  const label = WORDS[whole]?.[0] ?? (part ? `${part[1]}: ${part[2].replace(/_mm$/, '').replaceAll('_', ' ')}` : undefined);
  return { pointer: whole, label: label ?? pointer, known: label !== undefined };
}

/** Formats a value of a case as in the form. @param {JsonObject} document @param {string} pointer */
export function valueInWords(document, pointer) {
  const value = at(document, pointer);
  const [, unit = pointer.endsWith('_mm') ? 'mm' : '', factor = 1] = WORDS[pointer] ?? [];
  if (value === undefined) return '–';
  if (pointer === '/contact/cant_rad') return inclinationText(value);
  if (typeof value === 'number') return `${textOf(Number((value / factor).toPrecision(6)))}${unit ? ` ${unit}` : ''}`;
  if (Array.isArray(value)) return value.length > 4 ? `${value.length} values` : value.join(', ');
  if (!isObject(value)) return typeof value === 'boolean' ? (value ? 'yes' : 'no') : String(value);
  if (Array.isArray(value.points_mm)) return `${value.points_mm.length} points`;
  if (typeof value.text === 'string') return `${value.format}, ${value.text.split('\n').filter((line) => line.trim()).length} lines`;
  const text = JSON.stringify(value);
  return text.length > 40 ? `${text.slice(0, 39)}…` : text;
}
