// Parsing of dropped tables: columns of numbers, and grids with their axes in the first row and column.

/**
 * Returns the rows of numbers of a text. Comments after `#`, `!`, `%` and `//` and lines without numbers are skipped. Commas are decimal if blanks or
 * semicolons separate the numbers and no number has a decimal point.
 * @param {string} text
 * @returns {number[][]}
 */
export function rowsOf(text) {
  const decimal = !/\d\.\d/.test(text) && (/[;\t] *-?\d+,\d/.test(text) || /\d,\d+[;\t ]+-?\d/.test(text));
  const plain = decimal ? text.replace(/(\d),(\d)/g, '$1.$2') : text;
  return plain
    .split(/\r\n?|\n/)
    .map((line) => line.replace(/([#!%]|\/\/).*/, '').trim())
    .filter(Boolean)
    .map((line) => line.split(/[\s,;]+/).filter(Boolean).map(Number))
    .filter((row) => row.length && row.some(Number.isFinite));
}

/**
 * Parses two columns y and gap, and sorts them by y.
 * @param {string} text
 * @returns {{ y_mm: number[], gap_mm: number[] } | null} Null if there are fewer than three rows with two numbers.
 */
export function parseGapCurve(text) {
  const rows = rowsOf(text).filter((row) => row.length >= 2 && row.slice(0, 2).every(Number.isFinite));
  if (rows.length < 3) return null;
  rows.sort((one, two) => one[0] - two[0]);
  return { y_mm: rows.map(([y]) => y), gap_mm: rows.map(([, gap]) => gap) };
}

/**
 * Parses a grid: the first row contains x after an optional corner cell; every further row contains y and its values.
 * @param {string} text
 * @returns {{ x_mm: number[], y_mm: number[], values: number[][] } | null} Null if the text is not such a grid.
 */
export function parseGrid(text) {
  const rows = rowsOf(text);
  if (rows.length < 3) return null;
  const width = rows[1].length - 1;
  const x_mm = rows[0].slice(-width);
  const body = rows.slice(1);
  if (width < 2 || x_mm.length !== width || body.some((row) => row.length !== width + 1)) return null;
  if (![...x_mm, ...body.flat()].every(Number.isFinite)) return null;
  if (body[0][0] > body[body.length - 1][0]) body.reverse();
  return { x_mm, y_mm: body.map(([y]) => y), values: body.map((row) => row.slice(1)) };
}
