// The view Track for a run: strips by interval, totals by section, exceedances, and the worst rows with links to their contacts.

import { html, nothing } from '../vendor/lit-html.js';
import { count, number } from './format.js';
import { chooseRun, openRow, QUANTITIES, searchWorst } from './run.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./run.js').RunLine} RunLine */
/** @typedef {import('./api.js').Schemas['SectionTotals']} SectionTotals */
/** @typedef {import('./strips.js').Strip} Strip */

/** @param {App} app @param {RunLine} of */
export function runView(app, of) {
  const { run } = of;
  const title = html`<div><h1>Along the track</h1><p class="quiet">${run.name ? html`<b>${run.name}</b>, ` : nothing}run of ${count(run.rows)} rows${run.rows_without_answer
    ? `, ${count(run.rows_without_answer)} without an answer` : ''}</p></div>`;
  if (!run.ended_at) {
    return html`<section class="panel wait">${title}<p role="status">${run.state === 'queued' ? 'Waiting in the queue …' : `Solving: ${count(run.rows_done)} rows are done.`}</p>
      <progress max="1" .value=${run.progress} aria-label="Progress"></progress></section>`;
  }
  const by = (/** @type {Event} */ event) => chooseRun(app, { by: /** @type {HTMLSelectElement} */ (event.target).value, along: null, zoom: null });
  return html`<div class="result"><header class="jobhead">${title}
      <label class="inline">Along <select @change=${by}>${of.numbers.map((name) => html`<option ?selected=${name === of.by}>${name}</option>`)}</select></label></header>
    <div class="cols">
      <section class="panel" aria-label="Strips">${of.along ? strips(of) : html`<p class="pad quiet">Loading …</p>`}${limits(app, of)}</section>
      ${worstPanel(app, of)}</div>
    ${sectionPanel(app, of)}</div>`;
}

/** @type {{ along: unknown, strips: Strip[], x: number[] } | null} */
let made = null;

/** @param {RunLine} of */
function strips(of) {
  if (made?.along !== of.along) {
    const sections = (of.along?.sections ?? []).filter(({ rows }) => rows > 0);
    made = {
      along: of.along,
      x: sections.map(({ from }) => (from ?? 0) + of.step / 2),
      strips: QUANTITIES.map(({ key, label, unit, colour, factor }) => {
        const values = (/** @type {string} */ percentile) => sections.map(({ columns }) => {
          const value = columns[key]?.percentiles[percentile];
          return typeof value === 'number' ? value / factor : null;
        });
        return { key, label, unit, colour, lines: [{ label: 'largest', values: values('100') }, { label: 'median', values: values('50') }] };
      }),
    };
  }
  const shown = {
    x: made.x, xLabel: of.by, strips: made.strips, limits: of.limits, zoom: of.zoom, open: () => {}, zoomed: (/** @type {RunLine['zoom']} */ zoom) => { of.zoom = zoom; },
  };
  return html`<line-strips tabindex="0" role="group" aria-label="Strips along the track; arrow keys move the cursor" .shown=${shown}></line-strips>
    <p class="pad hint">Line: median of each interval of ${number(of.step, 3)} in ${of.by}; filled: up to its largest value. Drag to zoom, Escape shows all.</p>`;
}

/** @param {App} app @param {RunLine} of */
function limits(app, of) {
  const set = (/** @type {string} */ key) => (/** @type {Event} */ event) => {
    const text = /** @type {HTMLInputElement} */ (event.target).value.trim().replace(',', '.');
    const rest = { ...of.limits };
    delete rest[key];
    chooseRun(app, { limits: text && Number.isFinite(Number(text)) ? { ...rest, [key]: Number(text) } : rest });
  };
  return html`<div class="limits" role="group" aria-label="Limits">${QUANTITIES.map(({ key, label, unit }) => html`<label>Limit of ${label}
    <span class="input"><input inputmode="decimal" .value=${String(of.limits[key] ?? '')} @change=${set(key)}><span class="unit">${unit}</span></span></label>`)}</div>`;
}

/** @param {App} app @param {RunLine} of */
function worstPanel(app, of) {
  const pick = (/** @type {Event} */ event) => chooseRun(app, { worst: /** @type {HTMLSelectElement} */ (event.target).value });
  const search = () => searchWorst(app).catch(app.refused);
  const limit = of.limits[of.worst];
  const quantity = QUANTITIES.find(({ key }) => key === of.worst) ?? QUANTITIES[0];
  return html`<section class="panel" aria-labelledby="h-worst"><header class="bar"><h2 id="h-worst">Worst rows</h2>
      <label class="inline">by <select @change=${pick}>${QUANTITIES.map(({ key, label }) => html`<option value=${key} ?selected=${key === of.worst}>${label}</option>`)}</select></label></header>
    ${limit === undefined ? nothing : html`<p class="pad">${exceeding(of.sections?.all, quantity, limit)}</p>`}
    ${of.rows ? html`<div class="scroll" tabindex="0" role="region" aria-labelledby="h-worst"><table>
      <thead><tr><th scope="col">${of.by}</th>${QUANTITIES.map(({ short, unit }) => html`<th scope="col">${short} / ${unit}</th>`)}<th></th></tr></thead>
      <tbody>${of.rows.map(({ row, place, values }) => html`<tr><th scope="row">${String(Number(Number(place).toPrecision(7)))}</th>${QUANTITIES.map(({ key, factor }) => html`<td>${number(values[key] / factor, 3)}</td>`)}
        <td><button class="small" aria-label=${`Open the contact of row ${row}`} @click=${() => openRow(app, row)}>open</button></td></tr>`)}</tbody></table></div>`
    : html`<div class="pad"><button class="small" @click=${search}>Search all ${count(of.run.rows)} rows</button></div>`}</section>`;
}

/** Describes how many rows reach a limit. @param {SectionTotals | undefined} all @param {typeof QUANTITIES[number]} quantity @param {number} limit */
function exceeding(all, { key, factor, unit }, limit) {
  const over = above(all, key, limit * factor);
  return over === null || !all ? 'Counting …' : `${count(over)} of ${count(all.rows)} rows reach the limit of ${number(limit)} ${unit}`;
}

/** @param {SectionTotals | undefined} of @param {string} key @param {number} threshold */
function above(of, key, threshold) {
  const counts = Object.entries(of?.columns[key]?.above ?? {});
  const found = counts.find(([name]) => Math.abs(Number(name) - threshold) <= 1e-9 * Math.abs(threshold));
  return found ? found[1] : null;
}

/** @param {App} app @param {RunLine} of */
function sectionPanel(app, of) {
  const pick = (/** @type {Event} */ event) => chooseRun(app, { part: /** @type {HTMLSelectElement} */ (event.target).value, sections: null });
  const text = of.texts.includes(of.part);
  const limited = QUANTITIES.filter(({ key }) => of.limits[key] !== undefined);
  const cell = (/** @type {SectionTotals} */ section, /** @type {string} */ key, /** @type {number} */ factor, /** @type {string} */ percentile) => {
    const value = section.columns[key]?.percentiles[percentile];
    return html`<td>${typeof value === 'number' ? number(value / factor, 3) : '–'}</td>`;
  };
  return html`<section class="panel" aria-labelledby="h-sections"><header class="bar"><h2 id="h-sections">Totals by section</h2>
      <label class="inline">by <select @change=${pick}>${[...of.texts, ...of.numbers].map((name) => html`<option ?selected=${name === of.part}>${name}</option>`)}</select></label></header>
    ${of.sections ? html`<div class="scroll" tabindex="0" role="region" aria-labelledby="h-sections"><table class="sections">
      <thead><tr><th rowspan="2" scope="col">${of.part}</th><th rowspan="2" scope="col">rows</th><th rowspan="2" scope="col">no answer</th>${QUANTITIES.map(({ short, unit }) => html`<th colspan="3" scope="colgroup">${short} / ${unit}</th>`)}
        ${limited.map(({ short }) => html`<th rowspan="2" scope="col">over limit of ${short}</th>`)}</tr>
        <tr>${QUANTITIES.map(() => html`<th scope="col">median</th><th scope="col">99 %</th><th scope="col">largest</th>`)}</tr></thead>
      <tbody>${[...(of.sections.sections ?? []), of.sections.all].map((section, at, all) => html`<tr><th scope="row">${at === all.length - 1 ? 'all' : text ? section.value : `${number(section.from ?? 0, 5)} …`}</th>
        <td>${count(section.rows)}</td><td>${count(section.rows - (section.statuses.ok ?? 0) - (section.statuses.target_missed ?? 0))}</td>
        ${QUANTITIES.map(({ key, factor }) => html`${cell(section, key, factor, '50')}${cell(section, key, factor, '99')}${cell(section, key, factor, '100')}`)}
        ${limited.map(({ key, factor }) => html`<td>${count(above(section, key, of.limits[key] * factor) ?? NaN)}</td>`)}</tr>`)}</tbody></table></div>` : html`<p class="pad quiet">Loading …</p>`}</section>`;
}
