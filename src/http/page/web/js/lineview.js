// The view Track: strips along a numeric label, limits, and the worst places with links to their contacts.

import { html, nothing } from '../vendor/lit-html.js';
import { chooseLine, lineSeen, offeredLines, placeOf, STRIPS, worstRows } from './line.js';
import { count, number } from './format.js';
import { formatRoute } from './routes.js';
import { runSeen } from './run.js';
import { runView } from './runview.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./line.js').Line} Line */
/** @typedef {import('./line.js').StripKey} StripKey */

const WORST = 8;

/** @type {{ rows: readonly import('./line.js').Row[], by: string, x: number[], strips: import('./strips.js').Strip[] } | null} */
let made = null;

/** Returns the data of the strips, cached by the rows and their order. @param {Line} of */
function stripsOf({ rows, by }) {
  if (made?.rows !== rows || made.by !== by) {
    const strips = STRIPS.map(({ key, label, unit, colour }) => ({ key, label, unit, colour, lines: [{ label, values: rows.map((row) => row[key]) }] }));
    made = { rows, by, x: rows.map((row) => placeOf(row, by)), strips };
  }
  return made;
}

/** @param {App} app */
export function lineView(app) {
  const run = runSeen();
  if (run) return runView(app, run);
  const line = lineSeen();
  if (!line) return choice(offeredLines());
  if (!line.rows.length && line.done) return html`<section class="panel wait"><h1>Along the track</h1><p>This batch has no results.</p></section>`;
  const { x, strips } = stripsOf(line);
  const shown = {
    x, strips, xLabel: line.by || 'case', limits: line.limits, zoom: line.zoom,
    open: (/** @type {number} */ at) => app.go(formatRoute('result', [line.rows[at].id])),
    zoomed: (/** @type {Line['zoom']} */ zoom) => chooseLine(app, { zoom }),
  };
  const by = (/** @type {Event} */ event) => chooseLine(app, { by: /** @type {HTMLSelectElement} */ (event.target).value, zoom: null });
  return html`<div class="result"><header class="jobhead"><div><h1>Along the track</h1>
      <p class="quiet">${count(line.rows.length)} of ${count(line.count)} cases · drag to zoom, double click or Enter opens the contact, Escape shows all</p></div>
      <label class="inline">Along <select @change=${by}>${['', ...line.labels].map((label) => html`<option value=${label} ?selected=${label === line.by}>${label || 'order of the batch'}</option>`)}</select></label></header>
    ${line.done ? html`<div class="cols">
      <section class="panel" aria-label="Strips"><line-strips tabindex="0" role="group" aria-label="Strips along the line; arrow keys move the cursor" .shown=${shown}></line-strips>${limits(app, line)}</section>
      ${worstPanel(app, line)}</div>`
    : html`<progress max=${line.count || 1} .value=${line.rows.length} aria-label="Loading"></progress>`}</div>`;
}

/** View for choosing a batch or a run. @param {import('./line.js').Offered | null} offered */
function choice(offered) {
  if (!offered) return html`<p class="pad quiet">Loading …</p>`;
  const { batches, runs } = offered;
  const when = (/** @type {string} */ time) => time.slice(0, 16).replace('T', ' ');
  return html`<section class="panel wait"><h1>Along the track</h1>
    ${batches.length || runs.length ? html`<p>Choose a run or a batch of cases:</p>
      ${runs.map((run) => html`<a class="button" href=${formatRoute('line', [run.id], { kind: 'run' })}>${run.name || 'Run'}: ${count(run.rows)} rows of ${when(run.created_at)}</a>`)}
      ${batches.map((batch) => html`<a class="button" href=${formatRoute('line', [batch.id])}>${batch.name || 'Batch'}: ${count(batch.count)} cases of ${when(batch.created_at)}</a>`)}`
    : html`<p>There is no run yet, and no batch that has ended. Programs send them: a table of loads and creepages with a column such as <code>km</code> to <code>/v1/runs</code>,
      or cases with a label that is a number to <code>/v1/batches</code> (<a href="/docs/">API</a>).</p>`}
    <a class="button" href="#/jobs">To the jobs</a></section>`;
}

/** Fields for the limits that are drawn in the strips. @param {App} app @param {Line} line */
function limits(app, line) {
  const set = (/** @type {StripKey} */ key) => (/** @type {Event} */ event) => {
    const text = /** @type {HTMLInputElement} */ (event.target).value.trim();
    const value = Number(text);
    const rest = { ...line.limits };
    delete rest[key];
    chooseLine(app, { limits: text && Number.isFinite(value) ? { ...rest, [key]: value } : rest });
  };
  return html`<div class="limits" role="group" aria-label="Limits">${STRIPS.map(({ key, label, unit }) => html`<label>Limit of ${label}
    <span class="input"><input inputmode="decimal" .value=${String(line.limits[key] ?? '')} @change=${set(key)}><span class="unit">${unit}</span></span></label>`)}</div>`;
}

/** @param {App} app @param {Line} line */
function worstPanel(app, line) {
  const strip = STRIPS.find(({ key }) => key === line.worst) ?? STRIPS[0];
  const rows = worstRows(line, WORST);
  const limit = line.limits[strip.key];
  const over = limit === undefined ? 0 : line.rows.filter((row) => row[strip.key] > limit).length;
  const pick = (/** @type {Event} */ event) => chooseLine(app, { worst: /** @type {HTMLSelectElement} */ (event.target).value });
  return html`<section class="panel" aria-labelledby="h-worst"><header class="bar"><h2 id="h-worst">Worst places</h2>
      <label class="inline">by <select @change=${pick}>${STRIPS.map(({ key, label }) => html`<option value=${key} ?selected=${key === line.worst}>${label}</option>`)}</select></label></header>
    ${limit === undefined ? nothing : html`<p class="pad">${count(over)} of ${count(line.rows.length)} over the limit of ${number(limit)} ${strip.unit}</p>`}
    <div class="scroll" tabindex="0" role="region" aria-labelledby="h-worst"><table>
      <thead><tr><th scope="col">${line.by || 'case'}</th>${STRIPS.map(({ short, unit }) => html`<th scope="col">${short} / ${unit.split(' ')[0]}</th>`)}<th></th></tr></thead>
      <tbody>${rows.map((row) => html`<tr><th scope="row">${String(Number(placeOf(row, line.by).toPrecision(7)))}</th>${STRIPS.map(({ key }) => html`<td class=${over && key === strip.key && row[key] > (limit ?? Infinity) ? 'warn' : ''}>${number(row[key])}</td>`)}
        <td><a href=${formatRoute('result', [row.id])}>open<span class="visually-hidden"> the contact at ${number(placeOf(row, line.by), 6)}</span></a></td></tr>`)}</tbody></table></div></section>`;
}
