// A run along one of its extra columns: totals by interval and section from the service, and the worst rows.

import { request, run as runOf, runRow, runTotals, submit } from './api.js';
import { ticks } from './format.js';
import { splitLine } from './line.js';
import { adoptJob } from './result.js';
import { formatRoute } from './routes.js';
import { withFields } from './starts.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Schemas} Schemas */
/** @typedef {Schemas['Run']} Run */
/** @typedef {Schemas['RunTotals']} RunTotals */
/** @typedef {import('./document.js').JsonObject} JsonObject */

/** @type {readonly { key: string, label: string, short: string, unit: string, colour: string, factor: number }[]} */
export const QUANTITIES = [
  { key: 'friction_power_n', label: 'wear number Tγ', short: 'Tγ', unit: 'J/m', colour: '--c1', factor: 1 },
  { key: 'pressure_max_mpa', label: 'largest pressure', short: 'p max', unit: 'MPa', colour: '--c3', factor: 1 },
  { key: 'force_x_n', label: 'longitudinal force Fx', short: 'Fx', unit: 'kN', colour: '--c2', factor: 1000 },
  { key: 'force_y_n', label: 'lateral force Fy', short: 'Fy', unit: 'kN', colour: '--stick', factor: 1000 },
];

/** @typedef {{ row: number, place: string, values: Record<string, number> }} WorstRow */

/**
 * @typedef {object} RunLine
 * @property {string} id
 * @property {Run} run
 * @property {readonly string[]} numbers Numeric columns by which rows can be ordered.
 * @property {readonly string[]} texts Text columns by which rows can be divided into sections.
 * @property {string} by Numeric column of the horizontal axis.
 * @property {string} part Column that defines the sections.
 * @property {number} width Width of the sections if `part` is numeric.
 * @property {RunTotals | null} along Totals by intervals of `by`.
 * @property {number} step Length of the intervals of `along`.
 * @property {RunTotals | null} sections
 * @property {string} worst Quantity whose largest values are listed.
 * @property {readonly WorstRow[] | null} rows
 * @property {number} searched Number of rows read in the search for `rows`.
 * @property {Record<string, number>} limits Limits in the units of the quantities.
 * @property {{ from: number, to: number } | null} zoom
 */

/** Number of intervals of the strips, about one for each pixel. */
const INTERVALS = 1000;
const SECTIONS = 10;
const WORST = 10;
/** Largest number of rows for which the worst rows are searched automatically. */
const SEARCHED_MAX = 200_000;
const POLL_MS = 1500;

/** @type {RunLine | null} */
let seen = null;
let searching = new AbortController();

export const runSeen = () => seen;

/** @param {App} app @param {string} id @param {Record<string, string>} query */
export async function openRun(app, id, query) {
  if (seen?.id === id) return;
  searching.abort();
  const run = await runOf(id);
  const carried = new Set(run.columns.filter(({ pointer }) => !pointer).map(({ name }) => name));
  const of = (/** @type {string} */ kind) => run.answers.filter((column) => carried.has(column.name) && (column.kind === kind || (kind === 'number' && column.kind === 'integer'))).map(({ name }) => name);
  const numbers = [...of('number'), 'row'];
  const texts = of('text');
  /** @type {RunLine} */
  const mine = {
    id, run, numbers, texts, by: numbers.includes(query.by) ? query.by : numbers[0], part: texts[0] ?? numbers[0], width: 0, along: null, step: 1, sections: null,
    worst: query.worst ?? QUANTITIES[0].key, rows: null, searched: 0, limits: {}, zoom: null,
  };
  for (const { key } of QUANTITIES) if (query[key]) mine.limits[key] = Number(query[key]);
  seen = mine;
  app.redraw();
  while (!mine.run.ended_at && seen === mine) {
    await new Promise((resolve) => setTimeout(resolve, POLL_MS));
    mine.run = await runOf(id);
    app.redraw();
  }
  if (seen === mine) await load(app, mine);
}

export function leaveRun() {
  searching.abort();
  seen = null;
}

/** Requests the data of the view. @param {App} app @param {RunLine} of */
async function load(app, of) {
  await Promise.all([loadAlong(app, of), loadSections(app, of)]);
  if (of.run.rows <= SEARCHED_MAX) await searchWorst(app);
}

/** Returns the smallest and the largest value of a column. @param {RunLine} of @param {string} column */
async function extent({ id, run }, column) {
  if (column === 'row') return [0, Math.max(1, run.rows)];
  const { all } = await runTotals(id, { columns: column, percentiles: '100' });
  const { min, max } = all.columns[column] ?? {};
  return [min ?? 0, max ?? 1];
}

const COLUMNS = QUANTITIES.map(({ key }) => key).join(',');

/** @param {App} app @param {RunLine} of */
async function loadAlong(app, of) {
  const { by } = of;
  const [low, high] = await extent(of, by);
  const step = Math.max((high - low) / INTERVALS, Number.MIN_VALUE) || 1;
  const along = await runTotals(of.id, { columns: COLUMNS, percentiles: '50,100', by, width: step });
  if (of.by !== by) return;
  Object.assign(of, { along, step });
  app.redraw();
}

/** @param {App} app @param {RunLine} of */
async function loadSections(app, of) {
  const { part } = of;
  const text = of.texts.includes(part);
  const above = QUANTITIES.map(({ key, factor }) => (of.limits[key] === undefined ? '' : String(of.limits[key] * factor))).filter(Boolean).join(',');
  if (!text) {
    const [low, high] = await extent(of, part);
    const [one, two] = ticks(low, high, SECTIONS);
    of.width = two > one ? two - one : 1;
  }
  const sections = await runTotals(of.id, { columns: COLUMNS, percentiles: '50,99,100', by: part, width: text ? undefined : of.width, above });
  if (of.part !== part) return;
  of.sections = sections;
  app.redraw();
}

/**
 * Reads all rows as a stream and keeps those with the largest values.
 * @param {App} app
 */
export async function searchWorst(app) {
  const of = seen;
  if (!of) return;
  searching.abort();
  const { signal } = (searching = new AbortController());
  Object.assign(of, { rows: null, searched: 0 });
  const { worst, by } = of;
  const columns = ['row', ...(by === 'row' ? [] : [by]), ...QUANTITIES.map(({ key }) => key)];
  const answer = await request(`/v1/runs/${of.id}/results?format=csv&columns=${encodeURIComponent(columns.join(','))}`, { signal });
  const stream = /** @type {ReadableStream<Uint8Array<ArrayBuffer>>} */ (answer.body);
  const reader = stream.pipeThrough(new TextDecoderStream()).getReader();
  const take = worstOf(by, worst, WORST);
  let rest = '';
  try {
    for (let piece = await reader.read(); !piece.done && !signal.aborted; piece = await reader.read()) {
      const lines = (rest + piece.value).split(/\r?\n/);
      rest = lines.pop() ?? '';
      for (const line of lines) take(line);
      of.searched += lines.length;
    }
    if (signal.aborted) return;
    of.rows = take(rest);
    app.redraw();
  } catch (error) {
    if (!signal.aborted) app.refused(error);
  }
}

/**
 * Creates a reader that keeps the rows with the largest absolute values of a quantity.
 * @param {string} by Column of their positions.
 * @param {string} worst
 * @param {number} howMany
 * @returns {(line: string) => readonly WorstRow[]} Reads a line of the table and returns the kept rows, largest first. The first line must be the
 *   header.
 */
export function worstOf(by, worst, howMany) {
  /** @type {string[] | null} */
  let columns = null;
  /** @type {(WorstRow & { size: number })[]} */
  let kept = [];
  let at = 0;
  return (line) => {
    const cells = line.includes('"') ? splitLine(line) : line.split(',');
    if (!columns) {
      columns = cells;
      at = cells.indexOf(worst);
      return kept;
    }
    const size = Math.abs(Number(cells[at] || NaN));
    // Most rows are rejected by this comparison alone.
    if (!(size >= 0) || (kept.length >= howMany && size <= kept[kept.length - 1].size)) return kept;
    const of = (/** @type {string} */ name) => cells[columns?.indexOf(name) ?? -1] ?? '';
    const values = Object.fromEntries(QUANTITIES.map(({ key }) => [key, Number(of(key))]));
    kept = [...kept, { row: Number(of('row')), place: of(by), values, size }].sort((one, two) => two.size - one.size).slice(0, howMany);
    return kept;
  };
}

/** @param {App} app @param {Partial<RunLine>} choice */
export function chooseRun(app, choice) {
  const of = seen;
  if (!of) return;
  Object.assign(of, choice);
  const { by, worst, limits } = of;
  app.remember(formatRoute('line', [of.id], { kind: 'run', by, worst: worst === QUANTITIES[0].key ? undefined : worst, ...limits }));
  app.redraw();
  if (!of.run.ended_at) return;
  if (choice.by) loadAlong(app, of).catch(app.refused);
  if (choice.part || choice.limits) loadSections(app, of).catch(app.refused);
  if (choice.worst && of.rows) searchWorst(app).catch(app.refused);
}

/** Solves a row as a job with fields, and shows its result. @param {App} app @param {number} row */
export async function openRow(app, row) {
  if (!seen) return;
  try {
    const { case: found } = await runRow(seen.id, row);
    const own = /** @type {JsonObject} */ (/** @type {unknown} */ (found));
    const document = { ...own, name: `row ${row} of ${seen.run.name || 'a run'}`, outputs: withFields(own.outputs) };
    const job = await submit(JSON.stringify(document), { wait: 10 });
    adoptJob(app, job, document);
    app.go(formatRoute('result', [job.id]));
  } catch (error) {
    app.refused(error);
  }
}
