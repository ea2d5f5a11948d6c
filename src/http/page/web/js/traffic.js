// The traffic of a forecast: rows entered by hand or a table from a file.

import { escapeKey, numberAt } from './document.js';
import { parse } from './written.js';

/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */
/**
 * @typedef {object} Table
 * @property {number} rows
 * @property {Partial<Record<ColumnKey, number[]>>} values Known columns in the shown units.
 * @property {Record<string, number[]>} others Other columns by JSON pointer, in the units of the API.
 * @property {string[]} unused Titles of ignored columns.
 * @property {string[]} assumed Titles without a unit, each with the assumed one and the allowed ones.
 */

/** Columns of the traffic. `factor` converts the shown unit to that of the API; a radius is converted to a yaw rate. */
export const COLUMNS = /** @type {const} */ ([
  { key: 'passes', label: 'passes', unit: '', pointer: '', factor: 1, title: /pass|axles|count|share|^n(umber)?\b/i, units: {} },
  { key: 'load', label: 'wheel load Q', unit: 'kN', pointer: '/load/vertical_force_n', factor: 1000, title: /load|vertical_force|^q\b/i, units: { kN: 1, N: 0.001, t: 9.80665 } },
  { key: 'speed', label: 'speed', unit: 'km/h', pointer: '/motion/wheelset/speed_mm_per_s', factor: 1000 / 3.6, title: /speed|velocity|^v\b/i, units: { 'km/h': 1, 'm/s': 3.6, 'mm/s': 0.0036 } },
  { key: 'radius', label: 'curve radius', unit: 'm', pointer: '/motion/wheelset/yaw_rate_rad_per_s', factor: 1, title: /radius|^r\b/i, units: { m: 1, km: 1000 } },
  { key: 'shift', label: 'shift to the left', unit: 'mm', pointer: '/contact/lateral_shift_mm', factor: 1, title: /shift|displacement|^y\b/i, units: { mm: 1, cm: 10, m: 1000 } },
  { key: 'yaw', label: 'angle of attack', unit: 'mrad', pointer: '/contact/yaw_rad', factor: 0.001, title: /yaw|angle|attack/i, units: { mrad: 1, rad: 1000, deg: 1000 * (Math.PI / 180), '°': 1000 * (Math.PI / 180) } },
  { key: 'friction', label: 'friction μ', unit: '', pointer: '/friction/coefficient', factor: 1, title: /friction|^mu\b|^μ/i, units: { '%': 0.01 } },
]);
/** @typedef {typeof COLUMNS[number]['key']} ColumnKey */
/** @typedef {Record<ColumnKey, string>} Row */

/** Largest number of rows entered by hand. */
export const ROWS_MAX = 24;
const DIGITS = 12;
const rounded = (/** @type {number} */ value) => Number(value.toPrecision(DIGITS));

/** Returns the unit at the end of a title, such as `[kN]`, `/ kN` or `_kn`; undefined if there is none. @param {string} title @param {Record<string, number>} units */
function unitOf(title, units) {
  const end = title.toLowerCase().replaceAll('_per_', '/').replace(/[\])\s]+$/, '');
  return Object.keys(units).find((unit) => end.endsWith(unit.toLowerCase()) && !/[a-z]/.test(end.at(-1 - unit.length) ?? ' '));
}

/**
 * Parses a table of the traffic. Its first row contains titles such as `Q [kN]`, `shift / mm`, `passes`, or JSON pointers. Text columns and unknown titles are ignored.
 * @param {string} text
 * @returns {Table | string} The table, or a description of its fault.
 */
export function parseTraffic(text) {
  const lines = text.split(/\r\n?|\n/).filter((line) => line.trim() && !/^\s*[#%]/.test(line));
  const mark = lines[0]?.includes(';') ? ';' : lines[0]?.includes('\t') ? '\t' : ',';
  const [titles = [], ...rows] = lines.map((line) => line.split(mark).map((cell) => cell.trim().replace(/^"(.*)"$/, '$1')));
  if (!rows.length) return 'the table needs a row of titles and rows of numbers';
  /** @type {Table} */
  const table = { rows: rows.length, values: {}, others: {}, unused: [], assumed: [] };
  for (const [place, title] of titles.entries()) {
    const pointer = title.startsWith('/');
    const known = COLUMNS.find((column) => (pointer ? column.pointer === title : column.title.test(title)));
    const cells = rows.map((row) => row[place] ?? '');
    // A row without a radius means straight track.
    const values = cells.map((cell) => (cell === '' && known?.key !== 'radius' ? NaN : Number(mark === ',' ? cell : cell.replace(',', '.'))));
    const wrong = values.findIndex((value) => !Number.isFinite(value));
    const text = wrong >= 0 && values.every((value) => !Number.isFinite(value));
    if (text || (!known && !pointer) || (known && known.key in table.values)) {
      table.unused.push(title);
      continue;
    }
    if (wrong >= 0) return `row ${wrong + 1} of “${title}” is not a number`;
    if (pointer || !known) {
      if (known && known.key !== 'radius') table.values[known.key] = values.map((value) => value / known.factor);
      else table.others[title] = values;
      continue;
    }
    const unit = unitOf(title, known.units);
    const stated = /[[(]\s*([^\])]+?)\s*[\])]\s*$/.exec(title)?.[1];
    if (!unit && stated && stated !== '-') return `the unit ${stated} of “${title}” is not known`;
    if (!unit && !stated && known.unit) table.assumed.push(`“${title}” is read in ${known.unit} (allowed: ${Object.keys(known.units).join(', ')})`);
    // A wheel carries half of an axle load.
    const factor = (unit ? /** @type {Record<string, number>} */ (known.units)[unit] : 1) * (known.key === 'load' && /axle/i.test(title) ? 0.5 : 1);
    table.values[known.key] = values.map((value) => value * factor);
  }
  const known = Object.keys(table.values).length + Object.keys(table.others).length;
  return known ? table : `no column of the table is known: ${COLUMNS.map(({ label }) => label).join(', ')}, or JSON pointers of the case`;
}

/** Returns whether a text is a table of the traffic. A cross-section with titles has at most one known column, y. @param {string} text */
export function isTraffic(text) {
  const table = parseTraffic(text);
  return typeof table === 'string' ? /^row \d|^the unit/.test(table) : Object.keys(table.values).length + Object.keys(table.others).length > 1;
}

/** Returns the JSON pointer of a column in a request. @param {{ pointer: string }} column */
export const columnPointer = ({ pointer }) => (pointer ? `/traffic/columns/${escapeKey(pointer)}` : '/traffic/passes');

/** Returns the values of empty cells, in the shown units: those of the case, and 0 on straight track. @param {JsonObject} template @returns {Partial<Record<ColumnKey, number>>} */
export function usualOf(template) {
  const given = COLUMNS.filter(({ key, pointer }) => pointer && key !== 'radius').map(({ key, pointer, factor }) => [key, rounded(numberAt(template, pointer) / factor)]);
  return { passes: 1, shift: 0, yaw: 0, radius: 0, ...Object.fromEntries(given.filter(([, value]) => Number.isFinite(value))) };
}

/**
 * Returns the columns of the table or of the entered rows. Columns without values are omitted; the case supplies them.
 * @param {{ rows: readonly Row[], table: Table | null }} form
 * @param {JsonObject} template The case.
 */
export function trafficOf({ rows, table }, template) {
  const usual = usualOf(template);
  const speed = numberAt(template, '/motion/wheelset/speed_mm_per_s');
  // Without any radius the rows are straight, also if the case is in a curve.
  const curved = Boolean(numberAt(template, '/motion/wheelset/yaw_rate_rad_per_s'));
  const written = (/** @type {ColumnKey} */ key) => {
    const values = rows.map((row) => parse(row[key]));
    return values.some((value) => value !== undefined) || (key === 'radius' && curved) ? values.map((value) => value ?? usual[key] ?? null) : undefined;
  };
  const valuesOf = (/** @type {ColumnKey} */ key) => /** @type {JsonValue[] | undefined} */ (table ? table.values[key] : written(key));
  const speeds = valuesOf('speed');
  /** @type {(value: JsonValue, row: number) => JsonValue} */
  const rateOf = (value, row) => {
    const own = speeds?.[row];
    return value === null || value === 0 ? 0 : typeof value === 'number' ? rounded((typeof own === 'number' ? own / 0.0036 : speed) / value / 1000) : value;
  };
  /** @type {Record<string, JsonValue[]>} */
  const columns = { ...table?.others };
  for (const { key, pointer, factor } of COLUMNS) {
    const values = valuesOf(key);
    if (values && pointer) columns[pointer] = values.map((value, row) => (key === 'radius' ? rateOf(value, row) : typeof value === 'number' ? rounded(value * factor) : value));
  }
  const passes = valuesOf('passes');
  return { columns, ...(passes ? { passes } : {}) };
}

/**
 * Converts the traffic of a request to a table.
 * @param {Record<string, number[]>} columns
 * @param {number[] | undefined} passes
 * @param {number} speed Speed of the case in mm/s.
 * @returns {Table}
 */
export function tableOf(columns, passes, speed) {
  const { values, others, rows } = /** @type {Table} */ ({ rows: Math.max(...Object.values(columns).map((column) => column.length)), values: passes ? { passes } : {}, others: {} });
  for (const [pointer, column] of Object.entries(columns)) {
    const known = COLUMNS.find((each) => each.pointer === pointer);
    if (!known) others[pointer] = column;
    else if (known.key !== 'radius') values[known.key] = column.map((value) => rounded(value / known.factor));
    else values.radius = column.map((rate, row) => (rate === 0 ? 0 : rounded((columns['/motion/wheelset/speed_mm_per_s']?.[row] ?? speed) / rate / 1000)));
  }
  return { rows, values, others, unused: [], assumed: [] };
}

/** Converts a table to editable rows; null if it has too many rows or other columns. @param {Table} table @returns {Row[] | null} */
export function rowsOf({ rows, values, others }) {
  if (rows > ROWS_MAX || Object.keys(others).length) return null;
  const text = (/** @type {ColumnKey} */ key, /** @type {number} */ row) => {
    const value = values[key]?.[row];
    return value === undefined || (key === 'radius' && value === 0) ? '' : String(value);
  };
  return Array.from({ length: rows }, (_, row) => /** @type {Row} */ (Object.fromEntries(COLUMNS.map(({ key }) => [key, text(key, row)]))));
}
