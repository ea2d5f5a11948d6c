// The jobs of a batch along a label that is a number, such as the chainage: what the strips show of each.

import { batch as batchOf, batches as batchesOf, request } from './api.js';
import { formatRoute } from './routes.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').JobResult} JobResult */

/** @typedef {'wear' | 'used' | 'pressure' | 'stick'} StripKey */

/** @type {readonly { key: StripKey, label: string, short: string, unit: string, colour: string }[]} */
export const STRIPS = [
  { key: 'wear', label: 'wear number Tγ', short: 'Tγ', unit: 'J/m', colour: '--c1' },
  { key: 'used', label: 'traction coefficient T/N', short: 'T/N', unit: '%', colour: '--c2' },
  { key: 'pressure', label: 'largest pressure', short: 'p max', unit: 'MPa', colour: '--c3' },
  { key: 'stick', label: 'stick', short: 'stick', unit: '% of the area', colour: '--stick' },
];

/** @typedef {{ id: string, name: string, index: number, labels: Record<string, string> } & Record<StripKey, number>} Row */

/**
 * @typedef {object} Line
 * @property {string} batch
 * @property {number} count
 * @property {Row[]} rows
 * @property {boolean} done
 * @property {string[]} labels Those that are numbers.
 * @property {string} by The label along which the rows stand; empty for their order.
 * @property {string} worst The strip whose largest values are listed.
 * @property {Partial<Record<StripKey, number>>} limits
 * @property {{ from: number, to: number } | null} zoom
 */

const REDRAW_MS = 300;

/** @type {Line | null} */
let line = null;

export const lineSeen = () => line;

/** @type {import('./api.js').Batch[] | null} */
let ended = null;

/** Batches to choose from; null as long as they are being loaded. */
export const endedBatches = () => ended;

/** @param {App} app @param {string | undefined} id @param {Record<string, string>} query */
export async function openLine(app, id, query) {
  if (!id) {
    line = null;
    try {
      ended = (await batchesOf({ limit: 50 })).batches.filter((batch) => batch.ended);
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
    app.refused(error);
  }
}

/** Results arrive one by one, as lines of JSON. @param {App} app @param {Line} mine */
async function readRows(app, mine) {
  const answer = await request(`/v1/batches/${mine.batch}/results`, { headers: { Accept: 'application/x-ndjson' } });
  const stream = /** @type {ReadableStream<Uint8Array<ArrayBuffer>>} */ (answer.body);
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  let rest = '';
  let drawn = performance.now();
  for (let piece = await reader.read(); !piece.done && line === mine; piece = await reader.read()) {
    const lines = (rest + piece.value).split('\n');
    rest = lines.pop() ?? '';
    for (const text of lines) {
      const row = text && rowOf(JSON.parse(text));
      if (row) mine.rows.push(row);
    }
    if (performance.now() - drawn < REDRAW_MS) continue;
    drawn = performance.now();
    app.redraw();
  }
}

/**
 * The first motion of all patches together.
 * @param {{ id: string, name?: string | null, index: number, labels?: Record<string, string>, result?: JobResult }} entry
 * @returns {Row | null} Null for a job without a result.
 */
export function rowOf({ id, name, index, labels = {}, result }) {
  if (!result) return null;
  const sum = (/** @type {(patch: JobResult['patches'][number]) => number} */ of) => result.patches.reduce((all, patch) => all + of(patch), 0);
  const area = sum((patch) => patch.area_mm2);
  return {
    id, name: name ?? id, index, labels,
    wear: sum(({ points }) => points[0].friction_power_n),
    used: (100 * sum(({ points }) => Math.hypot(points[0].force_x_n, points[0].force_y_n))) / sum((patch) => patch.normal_force_n),
    pressure: Math.max(...result.patches.map((patch) => patch.pressure_max_mpa)),
    stick: (100 * sum(({ points }) => points[0].stick_area_mm2 ?? NaN)) / area,
  };
}

/** Labels that are a number in every row. @param {readonly Row[]} rows */
export function numericLabels(rows) {
  const [first] = rows;
  if (!first) return [];
  return Object.keys(first.labels).filter((key) => rows.every(({ labels }) => labels[key] !== '' && Number.isFinite(Number(labels[key]))));
}

/** Where a row stands along the line. @param {Row} row @param {string} by */
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

/** The rows with the largest values, within what is zoomed to. @param {Line} of @param {number} howMany @returns {Row[]} */
export function worstRows({ rows, worst, by, zoom }, howMany) {
  const key = STRIPS.find((strip) => strip.key === worst)?.key ?? 'wear';
  const seen = rows.filter((row) => !zoom || (placeOf(row, by) >= zoom.from && placeOf(row, by) <= zoom.to));
  return seen.sort((one, two) => two[key] - one[key]).slice(0, howMany);
}
