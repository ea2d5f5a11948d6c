// The jobs of a batch along a numeric label such as the chainage, with the quantities of the strips.

import { batch as batchOf, batches as batchesOf, jobs as jobsOf, request, runs as runsOf } from './api.js';
import { formatRoute } from './routes.js';

/** @typedef {import('./state.js').App} App */

/** @typedef {'wear' | 'used' | 'pressure' | 'stick'} StripKey */

/** @type {readonly { key: StripKey, label: string, short: string, unit: string, colour: string }[]} */
export const STRIPS = [
  { key: 'wear', label: 'wear number Tγ', short: 'Tγ', unit: 'J/m', colour: '--c1' },
  { key: 'used', label: 'traction coefficient T/N', short: 'T/N', unit: '%', colour: '--c2' },
  { key: 'pressure', label: 'largest pressure', short: 'p max', unit: 'MPa', colour: '--c3' },
  { key: 'stick', label: 'stick', short: 'stick', unit: '% of the area', colour: '--stick' },
];

/** @typedef {{ id: string, index: number, labels: Record<string, string> } & Record<StripKey, number>} Row */

/**
 * @typedef {object} Line
 * @property {string} batch
 * @property {number} count
 * @property {Row[]} rows
 * @property {boolean} done
 * @property {string[]} labels Labels with numeric values.
 * @property {string} by Label by which the rows are sorted; empty for their order in the batch.
 * @property {string} worst Strip whose largest values are listed.
 * @property {Partial<Record<StripKey, number>>} limits
 * @property {{ from: number, to: number } | null} zoom
 */

const REDRAW_MS = 300;

/** @type {Line | null} */
let line = null;

export const lineSeen = () => line;

/** @typedef {{ batches: readonly import('./api.js').Batch[], runs: readonly import('./api.js').Schemas['Run'][] }} Offered */

/** @type {Offered | null} */
let offeredHere = null;

/** Returns the batches and runs to choose from; null while they are loading. */
export const offeredLines = () => offeredHere;

/** @param {App} app @param {string | undefined} id @param {Record<string, string>} query */
export async function openLine(app, id, query) {
  if (!id) {
    line = null;
    try {
      const [{ batches }, { runs }] = await Promise.all([batchesOf({ limit: 50 }), runsOf({ limit: 50 })]);
      offeredHere = { batches: batches.filter((batch) => batch.ended), runs };
      app.redraw();
    } catch (error) {
      app.refused(error);
    }
    return;
  }
  if (line?.batch === id) return;
  /** @type {Line} */
  const mine = {
    batch: id, count: 0, rows: [], done: false, labels: [], by: query.by ?? '', worst: query.worst ?? 'wear', limits: {}, zoom: null,
  };
  for (const { key } of STRIPS) if (query[key]) mine.limits[key] = Number(query[key]);
  if (query.from && query.to) mine.zoom = { from: Number(query.from), to: Number(query.to) };
  line = mine;
  try {
    mine.count = (await batchOf(id)).count;
    await readRows(app, mine);
    mine.labels = numericLabels(mine.rows);
    if (!mine.labels.includes(mine.by)) mine.by = mine.labels[0] ?? '';
    sortRows(mine);
    mine.done = true;
    app.redraw();
  } catch (error) {
    app.absent(error);
  }
}

/** Columns of the patches that the strips need, without labels. */
const COLUMNS = ['id', 'index', 'point', 'patch', 'normal_force_n', 'force_x_n', 'force_y_n', 'friction_power_n', 'pressure_max_mpa', 'area_mm2', 'stick_share'];

/** Reads the table of the batch as a stream, with one line for each patch and motion. @param {App} app @param {Line} mine */
async function readRows(app, mine) {
  const [first] = (await jobsOf({ batch: mine.batch, limit: 1, fields: 'labels' })).jobs;
  const labels = Object.keys(first?.labels ?? {}).filter((key) => !key.includes(','));
  const columns = [...COLUMNS, ...labels.map((key) => `label:${key}`)].join(',');
  const answer = await request(`/v1/batches/${mine.batch}/results?format=csv&columns=${encodeURIComponent(columns)}`);
  const stream = /** @type {ReadableStream<Uint8Array<ArrayBuffer>>} */ (answer.body);
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  const take = rowReader(labels);
  let rest = '';
  let drawn = performance.now();
  for (let piece = await reader.read(); !piece.done && line === mine; piece = await reader.read()) {
    const lines = (rest + piece.value).split(/\r?\n/);
    rest = lines.pop() ?? '';
    for (const text of lines) {
      const row = take(text);
      if (row) mine.rows.push(row);
    }
    if (performance.now() - drawn < REDRAW_MS) continue;
    drawn = performance.now();
    app.redraw();
  }
  const last = take('');
  if (last) mine.rows.push(last);
}

/**
 * Creates a reader that combines the lines of a table into rows: the first motion of all patches of a job.
 * @param {readonly string[]} labels
 * @returns {(text: string) => Row | null} Returns a row when the line of the next job, or an empty line, has arrived. It skips the header and lines
 *   without a result.
 */
export function rowReader(labels) {
  /** @type {{ row: Row, force: number, load: number, area: number, stick: number } | null} */
  let open = null;
  const close = () => {
    if (!open) return null;
    const { row, force, load, area, stick } = open;
    return { ...row, used: (100 * force) / load, stick: (100 * stick) / area };
  };
  return (text) => {
    const cells = splitLine(text);
    const [load, x, y, wear, pressure, area, stick] = cells.slice(4).map((cell) => (cell === '' ? NaN : Number(cell)));
    const [id, index, point] = cells;
    if (text && (!(load > 0) || point !== '0')) return null;
    const same = open !== null && open.row.id === id;
    const done = same ? null : close();
    if (!same) {
      const named = Object.fromEntries(labels.map((key, at) => [key, cells[COLUMNS.length + at] ?? '']));
      open = text ? { row: { id, index: Number(index), labels: named, wear: 0, used: 0, pressure: 0, stick: 0 }, force: 0, load: 0, area: 0, stick: 0 } : null;
    }
    if (open) {
      open.row.wear += wear;
      open.row.pressure = Math.max(open.row.pressure, pressure);
      open.force += Math.hypot(x, y);
      open.load += load;
      open.area += area;
      open.stick += stick * area;
    }
    return done;
  };
}

/** Splits a line of CSV into cells. @param {string} text */
export function splitLine(text) {
  const cells = text.match(/(?<=^|,)("(?:[^"]|"")*"|[^,]*)/g) ?? [''];
  return cells.map((cell) => (cell.startsWith('"') ? cell.slice(1, -1).replaceAll('""', '"') : cell));
}

/** Returns the labels that are numeric in every row. @param {readonly Row[]} rows */
export function numericLabels(rows) {
  const [first] = rows;
  if (!first) return [];
  return Object.keys(first.labels).filter((key) => rows.every(({ labels }) => labels[key] !== '' && Number.isFinite(Number(labels[key]))));
}

/** Returns the position of a row along the track. @param {Row} row @param {string} by */
export const placeOf = (row, by) => (by ? Number(row.labels[by]) : row.index);

/** @param {Line} of */
function sortRows(of) {
  of.rows = [...of.rows].sort((one, two) => placeOf(one, of.by) - placeOf(two, of.by));
}

/** @param {App} app @param {Partial<Line>} choice */
export function chooseLine(app, choice) {
  if (!line) return;
  Object.assign(line, choice);
  if (choice.by !== undefined) sortRows(line);
  const { batch, by, worst, limits, zoom } = line;
  app.remember(formatRoute('line', [batch], { by, worst: worst === 'wear' ? undefined : worst, from: zoom?.from, to: zoom?.to, ...limits }));
  app.redraw();
}

/** Returns the rows with the largest values within the zoomed range. @param {Line} of @param {number} howMany @returns {Row[]} */
export function worstRows({ rows, worst, by, zoom }, howMany) {
  const key = STRIPS.find((strip) => strip.key === worst)?.key ?? 'wear';
  const seen = rows.filter((row) => !zoom || (placeOf(row, by) >= zoom.from && placeOf(row, by) <= zoom.to));
  return seen.sort((one, two) => two[key] - one[key]).slice(0, howMany);
}
