// The traffic of a forecast: rows that are written by hand, or a table from a file.

import { parse } from './written.js';

/** @typedef {import('./document.js').JsonValue} JsonValue */
/** @typedef {{ rows: number, columns: Record<string, number[]>, passes: number[] | null }} Table Columns by JSON pointers, in the units of the API. */

/** Columns of the traffic: what a person writes, and what that is in the unit of the API. */
export const COLUMNS = /** @type {const} */ ([
  { key: 'passes', label: 'passes', unit: '', pointer: '', factor: 1, title: /pass|count|share|number/i },
  { key: 'load', label: 'wheel load Q', unit: 'kN', pointer: '/load/vertical_force_n', factor: 1000, title: /load|vertical_force|^q\b/i },
  { key: 'shift', label: 'shift to the left', unit: 'mm', pointer: '/contact/lateral_shift_mm', factor: 1, title: /shift|^y\b/i },
  { key: 'yaw', label: 'angle of attack', unit: 'mrad', pointer: '/contact/yaw_rad', factor: 0.001, title: /yaw|angle/i },
  { key: 'friction', label: 'friction μ', unit: '', pointer: '/friction/coefficient', factor: 1, title: /friction|^mu\b|^μ/i },
]);
/** @typedef {typeof COLUMNS[number]['key']} ColumnKey */
/** Units in titles of tables, in the unit that is shown. @type {Record<string, number>} */
const UNITS = { n: 0.001, kn: 1, t: 9.80665, mm: 1, m: 1000, rad: 1000, mrad: 1, deg: 1000 * (Math.PI / 180), '°': 1000 * (Math.PI / 180) };

/** Rows of a traffic that are written by hand. */
export const ROWS_MAX = 24;

/**
 * A table of a traffic: its first row has titles such as `Q [kN]`, `shift / mm`, `passes`, or JSON pointers.
 * @param {string} text
 * @returns {Table | string} Or what is wrong with it.
 */
export function parseTraffic(text) {
  const lines = text.split(/\r\n?|\n/).filter((line) => line.trim() && !/^\s*[#%]/.test(line));
  const mark = lines[0]?.includes(';') ? ';' : lines[0]?.includes('\t') ? '\t' : ',';
  const [titles = [], ...rows] = lines.map((line) => line.split(mark).map((cell) => cell.trim()));
  if (!rows.length) return 'the table needs a row of titles and rows of numbers';
  /** @type {Record<string, number[]>} */
  const columns = {};
  let passes = null;
  for (const [place, title] of titles.entries()) {
    const values = rows.map((row) => Number(mark === ',' ? row[place] : row[place]?.replace(',', '.')));
    const wrong = values.findIndex((value, row) => !Number.isFinite(value) || !rows[row][place]);
    const known = COLUMNS.find((column) => column.title.test(title));
    const pointer = title.startsWith('/') ? title : known?.pointer;
    if (pointer === undefined) return `the column “${title}” is not known; known are ${COLUMNS.map(({ label }) => label).join(', ')}, and JSON pointers of the case`;
    if (wrong >= 0) return `row ${wrong + 1} of “${title}” is no number`;
    const unit = /[[(/]\s*([a-zA-Z°]+)\s*[\])]?\s*$/.exec(title.startsWith('/') ? '' : title)?.[1].toLowerCase();
    const own = /_n$/.test(title) ? 0.001 : /_rad$/.test(title) ? 1000 : unit ? UNITS[unit] : 1;
    // A wheel carries half of an axle load.
    const half = known?.key === 'load' && /axle/i.test(title) ? 0.5 : 1;
    if (own === undefined) return `the unit ${unit} of “${title}” is not known`;
    const scaled = title.startsWith('/') || !known ? values : values.map((value) => value * own * half * known.factor);
    if (pointer === '') passes = scaled;
    else columns[pointer] = scaled;
  }
  return { rows: rows.length, columns, passes };
}

/**
 * The columns of the rows that were written, or of the table; those without any value are left to the case.
 * @param {{ rows: readonly Record<ColumnKey, string>[], table: Table | null }} form
 */
export function trafficOf({ rows, table }) {
  if (table) return { columns: table.columns, ...(table.passes ? { passes: table.passes } : {}) };
  /** @type {Record<string, JsonValue[]>} */
  const columns = {};
  /** @type {JsonValue[]} */
  let passes = [];
  for (const { key, pointer, factor } of COLUMNS) {
    const values = rows.map((row) => parse(row[key], factor) ?? null);
    if (values.every((value) => value === null)) continue;
    if (pointer) columns[pointer] = values;
    else passes = values;
  }
  return { columns, ...(passes.length ? { passes } : {}) };
}
