// The view Forecast: form, worn sections with their bands, curves, limits, and the comparison of two plans.

import { html, nothing } from '../vendor/lit-html.js';
import { cancel, download } from './api.js';
import { drawing, verdict } from './compose.js';
import { removeLater, isThere } from './deleting.js';
import { drawChart } from './drawing/axes.js';
import { drawWorn } from './drawing/worn.js';
import { fileName } from './downloads.js';
import { faultText, fieldId } from './field.js';
import { chooseForecast, EVENTS, FACTORS, faultOf, forecastSeen, nameOf, openForecast, playFilm, recordOf, repeatForecast, startForecast, takeTarget, takeTraffic, TARGETS, templateOf, writeForm } from './forecast.js';
import { CURVES, decisionOf, deepest, distanceOf, distanceUnit, forecastChart, LOSSES, numericalOf, reachedOf, sectionOf, wears, worstDamage } from './forecastdata.js';
import { count, fixed, number, plusMinus, seconds } from './format.js';
import { inWords, remarkList } from './remarks.js';
import { formatRoute } from './routes.js';
import { savable } from './savedrawing.js';
import { columnPointer, COLUMNS, ROWS_MAX, usualOf } from './traffic.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./forecast.js').Forecast} Forecast */
/** @typedef {import('./forecast.js').Side} Side */
/** @typedef {import('./forecast.js').Answer} Answer */
/** @typedef {import('./forecast.js').WornRecord} WornRecord */
/** @typedef {import('./api.js').Job} Job */

/** @param {App} app */
export function forecastView(app) {
  const forecast = forecastSeen();
  if (!forecast.ids.length) return html`<div class="forecast">${formPanel(app, forecast)}${listPanel(app, forecast)}</div>`;
  if (!forecast.sides.length) return html`<p class="pad quiet">Loading …</p>`;
  const waiting = forecast.sides.find(({ answer }) => !answer);
  if (waiting) return waitingPanel(app, waiting.job);
  return resultView(app, forecast);
}

/** @param {App} app @param {Forecast} forecast */
function formPanel(app, forecast) {
  const { form, sending, refusal, faults, against } = forecast;
  const template = templateOf(app);
  const state = app.store.get().compose;
  const { document, files } = state;
  const write = (/** @type {keyof typeof form} */ member, pointer = `/${member}`) => (/** @type {Event} */ event) => writeForm(app, { [member]: valueOf(event) }, pointer);
  const entry = (/** @type {'mgt' | 'km' | 'records'} */ member, /** @type {string} */ pointer) => fieldOf(pointer, form[member], write(member, pointer));
  const select = (/** @type {'wearing' | 'law' | 'states'} */ member, /** @type {string} */ label, /** @type {string[][]} */ options) => html`<div class="field"><label for=${`f-${member}`}>${label}</label>
    <select id=${`f-${member}`} @change=${write(member)}>${options.map(([value, name]) => html`<option value=${value} ?selected=${form[member] === value}>${name}</option>`)}</select></div>`;
  const names = [files.rail?.name, files.wheel?.name].filter(Boolean).join(', ');
  return html`<section class="panel" aria-labelledby="h-forecast"><header class="bar"><h1 id="h-forecast">${against ? 'Another plan' : 'Forecast: wear and fatigue under a traffic'}</h1>
      ${against ? html`<span class="hint">compared with <b>${against.name}</b></span><button class="small ghost" @click=${() => chooseForecast(app, { against: null })}>Do not compare</button>` : nothing}
      <button class="primary" ?disabled=${sending || typeof template === 'string'} @click=${() => startForecast(app)}>${sending ? 'Sending …' : against ? 'Compute and compare' : 'Compute'}</button></header>
    ${refusal ? html`<div class="pad" role="alert"><p class="fault big">${refusal}</p><ul class="faults">${faults.map((fault) => faultEntry(fault, form))}</ul></div>` : nothing}
    <div class="two pad">
      <fieldset><legend>Rail and wheel</legend>${typeof template === 'string' ? html`<p class="fault">${template}</p>`
        : html`<p>${String(document?.name ?? 'The pair of the view Contact')}${names ? html` <span class="quiet">(${names})</span>` : nothing}</p>
          ${document ? html`<div class=${state.faults.length ? 'figure pair-drawing stale' : 'figure pair-drawing'}>${drawing(state, document)}</div>` : nothing}
          <div class="verdict" role="status">${verdict(app, state, false)}</div>
          <p class="hint">Drop other files of a rail and a wheel, or a table of the traffic, anywhere here. Inclination, gauge and steel are those of the view <a href="#/compose">Contact</a>; loads, shifts and friction are those of the traffic below.</p>`}</fieldset>
      <div>
        <fieldset><legend>How far</legend><div class="pair">${form.wearing === 'wheel' ? nothing : entry('mgt', '/extent/mgt')}${form.wearing === 'rail' ? nothing : entry('km', '/extent/wheel_distance_km')}</div>
          <div class="pair">${select('wearing', 'What wears', [['both', 'rail and wheel'], ['rail', 'the rail'], ['wheel', 'the wheel']])}${select('law', 'Law of wear', [['usfd_wear', 'Tγ/A (Sheffield)'], ['archard_wear', 'Archard']])}</div>
          <div class="pair">${select('states', 'Traffic condensed to', [['24', 'quick look: 24 states'], ['', '100 states'], ['200', 'fine: 200 states']])}${entry('records', '/records')}</div>
          <div class="field"><label for="f-name">Name</label><span class="input"><input id="f-name" autocomplete="off" placeholder=${nameOf(form)} .value=${form.name} @input=${write('name')}></span></div></fieldset>
        <fieldset><legend>Limits</legend><div class="triple">${LOSSES.filter(({ body }) => form.wearing === 'both' || form.wearing === body).map(({ key }) => {
          const pointer = `/limits/${key}`;
          return fieldOf(pointer, form.limits[key] ?? '', (event) => writeForm(app, { limits: { ...form.limits, [key]: valueOf(event) } }, pointer), 'none');
        })}</div></fieldset>
        <fieldset><legend>Maintenance</legend>${eventsOf(app, form)}</fieldset>
      </div>
    </div>
    <fieldset class="pad"><legend>Traffic</legend>${form.table ? tableOf(app, form.table) : rowsOf(app, form, typeof template === 'string' ? {} : template)}
      <label class="drop">${form.table ? 'Another table' : 'Or a table of the traffic'}<span class="quiet">CSV with titles such as passes; axle load [t]; speed [km/h]; radius [m]; shift [mm]; angle of attack [mrad]; friction. Up to 200 000 rows</span>
        <input type="file" class="visually-hidden" id="traffic" @change=${chosen((file) => takeTraffic(app, file).catch(app.refused))}></label></fieldset></section>`;
}

/** @param {Event} event */
const valueOf = ({ target }) => /** @type {HTMLInputElement} */ (target).value;

/** Returns an event handler that passes the chosen file on. @param {(file: File) => unknown} take */
const chosen = (take) => (/** @type {Event} */ { target }) => {
  const input = /** @type {HTMLInputElement} */ (target);
  const [file] = input.files ?? [];
  if (file) take(file);
  input.value = '';
};

/** Values of the form by their pointer in the request: name, unit, and factor from the unit to that of the API. @type {Record<string, readonly [string, string, number?]>} */
const VALUES = {
  '/extent/mgt': ['Traffic over the rail', 'MGT'], '/extent/wheel_distance_km': ['Distance of the wheel', 'km'], '/records': ['Steps shown', ''],
  ...Object.fromEntries(LOSSES.map(({ key, label }) => [`/limits/${key}`, [label, 'mm']])),
};

/** Returns name, unit and factor of a value of the request; undefined if the form has no such value. @param {string} pointer @returns {readonly [string, string, number?] | undefined} */
function valueAt(pointer) {
  const [, event] = /^\/events\/(\d+)/.exec(pointer) ?? [];
  if (event) return [`maintenance ${Number(event) + 1}`, ''];
  const column = COLUMNS.find((known) => pointer.startsWith(columnPointer(known)));
  if (!column) return VALUES[pointer];
  const row = /\/(\d+)$/.exec(pointer)?.[1];
  // Limits of a yaw rate are not those of a radius.
  const [unit, factor] = column.key === 'radius' ? ['', undefined] : [column.unit, column.factor];
  return [row ? `${column.label}, row ${Number(row) + 1}` : column.label, unit, factor];
}

/** @param {import('./api.js').Fault} fault */
function describeFault(fault) {
  const [, unit = '', factor = 1] = valueAt(fault.pointer ?? '') ?? [];
  return faultText(fault, factor, unit);
}

/** Moves the focus to the field of a fault, or to the part of the form that contains it. @param {string} pointer */
function lead(pointer) {
  const input = pointer && document.getElementById(fieldId(pointer));
  if (input) input.focus();
  else if (pointer) lead(pointer.slice(0, pointer.lastIndexOf('/')));
}

/** Entry of a fault in the list, with a button that leads to its field. @param {import('./api.js').Fault} fault @param {Forecast['form']} form */
function faultEntry(fault, { table }) {
  const pointer = fault.pointer ?? '';
  const known = valueAt(pointer);
  const hasField = known && !(table && pointer.startsWith('/traffic'));
  const place = known ? known[0] : inWords(pointer.replace(/^\/template/, ''));
  return html`<li>${hasField ? html`<button class="link" @click=${() => lead(pointer)}>${place}</button>` : html`<b>${place}</b>`} ${describeFault(fault)}</li>`;
}

/**
 * An input of the form with the fault of its value.
 * @param {string} pointer
 * @param {string} value
 * @param {(event: Event) => void} write
 * @param {{ label?: string, unit?: string, empty?: string }} [look] The label is for inputs without a visible one.
 */
function inputOf(pointer, value, write, { label, unit = '', empty = '' } = {}) {
  const fault = faultOf(pointer);
  const id = fieldId(pointer);
  return html`<span class="input"><input id=${id} inputmode="decimal" autocomplete="off" placeholder=${empty} aria-label=${label ?? nothing} .value=${value}
      aria-invalid=${fault ? 'true' : 'false'} aria-describedby=${fault ? `${id}-fault` : nothing} @input=${write}>${unit ? html`<span class="unit">${unit}</span>` : nothing}</span>
    ${fault ? html`<p class="fault" id=${`${id}-fault`}>${describeFault(fault)}</p>` : nothing}`;
}

/** A labelled input for a value of `VALUES`. @param {string} pointer @param {string} value @param {(event: Event) => void} write @param {string} [empty] */
const fieldOf = (pointer, value, write, empty) => html`<div class=${faultOf(pointer) ? 'field bad' : 'field'}><label for=${fieldId(pointer)}>${VALUES[pointer][0]}</label>
  ${inputOf(pointer, value, write, { unit: VALUES[pointer][1], empty })}</div>`;

/** Table for entering the rows of the traffic. @param {App} app @param {Forecast['form']} form @param {import('./document.js').JsonObject} template */
function rowsOf(app, { rows }, template) {
  const usual = usualOf(template);
  const cell = (/** @type {typeof COLUMNS[number]} */ column, /** @type {number} */ row) => {
    const { key, label } = column;
    const pointer = `${columnPointer(column)}/${row}`;
    const write = (/** @type {Event} */ event) => writeForm(app, { rows: rows.map((old, at) => (at === row ? { ...old, [key]: valueOf(event) } : old)) }, pointer);
    const empty = key === 'radius' ? 'straight' : usual[key] === undefined ? '' : number(usual[key], 4);
    return html`<td class=${faultOf(pointer) ? 'field bad' : ''}>${inputOf(pointer, rows[row][key], write, { label: `${label}, row ${row + 1}`, empty })}</td>`;
  };
  return html`<div class="scroll" tabindex="0" role="region" aria-label="Traffic"><table class="traffic"><thead><tr>${COLUMNS.map(({ label, unit }) => html`<th scope="col">${label}${unit ? ` / ${unit}` : ''}</th>`)}<td></td></tr></thead>
    <tbody>${rows.map((_, at) => html`<tr>${COLUMNS.map((column) => cell(column, at))}
      <td><button class="icon" aria-label=${`Remove row ${at + 1}`} ?disabled=${rows.length < 2} @click=${() => writeForm(app, { rows: rows.filter((_, other) => other !== at) })}>×</button></td></tr>`)}</tbody></table></div>
    <p><button class="small" ?disabled=${rows.length >= ROWS_MAX} @click=${() => writeForm(app, { rows: [...rows, { ...rows[rows.length - 1] }] })}>Add a row</button> <span class="hint">Passes are shares or numbers: only their ratios count. On the right rail a shift to the right, below 0, brings the flange to the gauge. Radii are positive to the left. An empty cell has the value in grey: straight track, or the value of the view Contact.</span></p>`;
}

/** Describes an imported table. @param {App} app @param {NonNullable<Forecast['form']['table']>} table */
function tableOf(app, { name, rows, values, others, unused, assumed }) {
  const range = (/** @type {readonly number[]} */ list) => list.reduce(([low, high], value) => [Math.min(low, value), Math.max(high, value)], [Infinity, -Infinity]).map((value) => number(value, 3)).join(' … ');
  const lacking = COLUMNS.filter(({ key }) => !values[key] && key !== 'passes').map(({ label }) => label);
  return html`<p><b>${name}</b>: ${count(rows)} rows <button class="small" @click=${() => writeForm(app, { table: null })}>Write rows instead</button></p>
    <div class="scroll columns" tabindex="0" role="region" aria-label="Columns of the table"><table><tbody>${COLUMNS.flatMap(({ key, label, unit }) => (values[key] ? [html`<tr><th scope="row">${label}</th><td>${range(values[key])} ${unit}</td></tr>`] : []))}
      ${Object.entries(others).map(([pointer, list]) => html`<tr><th scope="row"><code>${pointer}</code></th><td>${range(list)}</td></tr>`)}</tbody></table></div>
    ${lacking.length ? html`<p class="hint">As in the view Contact: ${lacking.join(', ')}.</p>` : nothing}
    ${assumed.length ? html`<p class="hint warn">Titles without a unit: ${assumed.join('; ')}.</p>` : nothing}
    ${unused.length ? html`<p class="hint warn">Not used: ${unused.join(', ')}.</p>` : nothing}`;
}

/** Shows the fault of the target section of an event. @param {string} event Its pointer. */
function sectionFault(event) {
  const fault = faultOf(`${event}/grind`) ?? faultOf(`${event}/reprofile`);
  return fault ? html`<span class="fault">${fault.detail}</span>` : nothing;
}

/** @param {App} app @param {Forecast['form']} form */
function eventsOf(app, form) {
  const { events, wearing } = form;
  const unit = wearing === 'wheel' ? 'km' : 'MGT';
  const set = (/** @type {number} */ place, /** @type {object} */ change, pointer = `/events/${place}`) => writeForm(app, { events: events.map((event, at) => (at === place ? { ...event, ...change } : event)) }, pointer);
  const entry = (/** @type {number} */ place, /** @type {'at' | 'value'} */ member, /** @type {string} */ name, /** @type {{ label: string, unit: string, empty?: string }} */ look) => {
    const pointer = `/events/${place}/${name}`;
    return html`<span class=${faultOf(pointer) ? 'field bad' : ''}>${inputOf(pointer, events[place][member], (event) => set(place, { [member]: valueOf(event) }, pointer), look)}</span>`;
  };
  return html`${events.map((event, at) => html`<div class="event" role="group" tabindex="-1" id=${fieldId(`/events/${at}`)} aria-label=${`Maintenance ${at + 1}`}>
      At ${entry(at, 'at', 'at', { label: `Time of maintenance ${at + 1}`, unit })}
      <select aria-label=${`What is done, ${at + 1}`} @change=${(/** @type {Event} */ input) => set(at, { kind: valueOf(input), value: '', target: null })}>${EVENTS.map(([kind, label]) => html`<option value=${kind} ?selected=${kind === event.kind}>${label}</option>`)}</select>
      ${event.kind === 'friction' ? nothing : html`to ${event.target ? html`<b>${event.target.name}</b> <button class="small ghost" @click=${() => set(at, { target: null })}>${TARGETS[event.kind]} instead</button>` : TARGETS[event.kind]}
        <label class="button small">${event.target ? 'Another file' : 'Or a file'}<input type="file" class="visually-hidden" aria-label=${`Section of maintenance ${at + 1}`} @change=${chosen((file) => takeTarget(app, at, file).catch(app.refused))}></label>`}
      ${event.kind === 'friction' ? entry(at, 'value', 'friction_coefficient', { label: 'Coefficient of friction', unit: 'μ', empty: '0.15' })
        : entry(at, 'value', 'depth_mm', { label: 'Depth beyond that, in mm', unit: 'mm more', empty: '0' })}
      ${sectionFault(`/events/${at}`)}
      <button class="icon" aria-label=${`Remove event ${at + 1}`} @click=${() => writeForm(app, { events: events.filter((_, other) => other !== at) })}>×</button></div>`)}
    <p><button class="small" @click=${() => writeForm(app, { events: [...events, { kind: wearing === 'wheel' ? 'reprofile' : 'grind', at: String(Number(wearing === 'wheel' ? form.km : form.mgt) / 2 || ''), value: '', target: null }] })}>Add grinding, lubrication or turning</button></p>`;
}

/** @param {App} app @param {Forecast} forecast */
function listPanel(app, { listed, ticked }) {
  const jobs = (listed ?? []).filter(isThere);
  const chosen = jobs.filter(({ id, state }) => ticked.has(id) && state === 'succeeded').map(({ id }) => id);
  const tick = (/** @type {string} */ id) => () => {
    if (!ticked.delete(id)) ticked.add(id);
    app.redraw();
  };
  const again = () => openForecast(app, []);
  const act = (/** @type {Job} */ job) => () => (job.state === 'queued' || job.state === 'running' ? cancel('evolutions', job.id).then(again, app.refused) : removeLater(app, 'evolutions', [job.id], job.name || 'The forecast'));
  return html`<section class="panel" aria-labelledby="h-forecasts"><header class="bar"><h2 id="h-forecasts">Forecasts</h2>
      ${chosen.length === 2 ? html`<a class="button primary small" href=${formatRoute('forecast', chosen)}>Compare 2</a>` : html`<span class="hint">tick two to compare them</span>`}</header>
    ${listed && !jobs.length ? html`<p class="pad quiet">None yet.</p>` : nothing}
    <div class="scroll" tabindex="0" role="region" aria-labelledby="h-forecasts"><table class="forecasts"><tbody>${jobs.map((job) => html`<tr>
      <td><input type="checkbox" aria-label=${`Choose ${job.name || job.id}`} .checked=${ticked.has(job.id)} @change=${tick(job.id)}></td>
      <th scope="row"><a href=${formatRoute('forecast', [job.id])}>${job.name || job.id}</a></th>
      <td class=${`state ${job.state}`}>${job.state}${job.state === 'running' ? ` ${Math.round(100 * job.progress)} %` : ''}</td><td><time>${job.created_at.slice(0, 16).replace('T', ' ')}</time></td>
      <td><button class="small" @click=${() => repeatForecast(app, job).catch(app.refused)}>Change and repeat</button>
        <button class="small ghost" @click=${act(job)}>${job.state === 'queued' || job.state === 'running' ? 'Cancel' : 'Delete'}</button></td></tr>`)}</tbody></table></div></section>`;
}

/** @param {App} app @param {Job} job */
function waitingPanel(app, job) {
  const open = job.state === 'queued' || job.state === 'running';
  const ran = (Date.now() - Date.parse(job.started_at ?? '')) / 1000;
  const left = job.progress > 0.01 && Math.round((ran * (1 - job.progress)) / job.progress);
  return html`<section class="panel wait"><h1>${job.name || 'Forecast'}</h1>
    <p role="status" class=${job.state === 'failed' ? 'fault big' : ''}>${job.state === 'queued' ? 'Waiting in the queue …' : job.state === 'running' ? 'Computing step by step …' : job.state === 'failed' ? (job.error?.detail ?? 'Failed') : job.state}</p>
    ${open ? html`<progress max="1" .value=${job.progress} aria-label="Progress"></progress>${left ? html`<p class="quiet">${Math.round(100 * job.progress)} %, about ${seconds(left)} left</p>` : nothing}<button @click=${() => cancel('evolutions', job.id).catch(app.refused)}>Cancel</button>`
      : html`<button @click=${() => repeatForecast(app, job).catch(app.refused)}>Change and repeat</button>`}
    <a class="button" href="#/forecast">To the forecasts</a></section>`;
}

/** @param {App} app @param {Forecast} forecast */
function resultView(app, forecast) {
  const { sides, step, body, factor } = forecast;
  const answers = sides.map(({ answer }) => /** @type {Answer} */ (answer));
  const [first] = answers;
  const record = first.records[step];
  const unit = distanceUnit(first);
  const shapes = sides.map((side, at) => {
    const of = /** @type {WornRecord} */ (recordOf(side));
    const shape = sectionOf(answers[at], of, body, factor);
    return { side, record: of, shape, contacts: contactsOf(of, body, shape) };
  });
  const strongest = Math.max(...answers.flatMap(({ records }) => records.map(({ contact }) => contact.pressure_max_mpa)));
  const compared = sides.length > 1;
  const label = (/** @type {number} */ at) => (compared ? `${'AB'[at]}: ${sides[at].job.name || 'forecast'}` : `at ${number(distanceOf(record.progress), 3)} ${unit}`);
  const title = sides.map(({ job }) => job.name || 'forecast').join(' and ');
  const chart = forecastChart(answers, forecast.curve, body);
  const numbers = numbersPanel(shapes.map((shape) => shape.record), BODIES.filter((name) => answers.some((answer) => wears(answer, name))), compared);
  const over = html`<section class="panel" aria-labelledby="h-over"><header class="bar"><h2 id="h-over">Over the traffic</h2>
      <div class="segs" role="group" aria-label="Curve of the forecast">${CURVES.map(([kind, name]) => html`<label class="seg"><input type="radio" name="forecast" .checked=${forecast.curve === kind} @change=${() => chooseForecast(app, { curve: kind })}><span>${name}</span></label>`)}</div></header>
    <div class="cards"><div class="card">${savable(`${title} ${chart.name}`, drawChart({ ...chart, chosen: { x: distanceOf(record.progress), pick: (x) => chooseForecast(app, { step: nearestStep(first, x) }) } }))}
      <p class="hint">Bands: 90 % of the scatter of the wear coefficients. Error bars: steps, condensed traffic and contact. A click chooses the step.</p></div></div></section>`;
  return html`<div class="result forecast">
    <header class="jobhead"><div><h1>${compared ? 'Two forecasts' : (sides[0].job.name || 'Forecast')}</h1>
      <p class="quiet">${sides.map(({ job }, at) => html`${compared ? html`<b>${'AB'[at]}</b> <a href=${formatRoute('forecast', [job.id])}>${job.name || job.id}</a> ` : html`<code>${job.id}</code> `}`)}</p></div>
      ${compared ? html`<a class="button small" href="#/forecast">To the forecasts</a>` : downloadsOf(app, forecast, sides[0], record)}</header>
    ${compared ? nothing : remarkList(first.remarks)}
    ${compared ? limitsPanel(answers, sides) : nothing}
    <section class="panel" aria-labelledby="h-worn"><header class="bar"><h2 id="h-worn">Section</h2>
        <div class="segs" role="group" aria-label="Body">${BODIES.map((name) => html`<label class="seg"><input type="radio" name="worn" .checked=${body === name} @change=${() => chooseForecast(app, { body: name })}><span>${name}</span></label>`)}</div>
        <label class="inline">wear drawn <select class="slim" @change=${(/** @type {Event} */ event) => chooseForecast(app, { factor: Number(valueOf(event)) })}>${FACTORS.map((times) => html`<option value=${times} ?selected=${times === factor}>${times === 1 ? 'to scale' : `${times} times larger`}</option>`)}</select></label></header>
      <div class="pad">${savable(`${title} ${body} ${number(distanceOf(record.progress), 3)} ${unit}`, drawWorn({
        name: `Section of the ${body} at the start and after ${number(distanceOf(record.progress), 3)} ${unit}`, start: shapes[0].shape.start, strongest,
        shapes: shapes.map(({ shape, contacts }, at) => ({ label: label(at), now: shape.now, low: shape.low, high: shape.high, contacts })),
      }))}
        <p class="hint">Band: 90 % of the scatter of the wear coefficients. Circles: where the traffic touches, their area the share of its load. Needles: the largest pressure there; the longest of all steps is ${number(strongest, 4)} MPa.</p></div>
      <div class="film"><button aria-label=${forecast.playing ? 'Stop the film' : 'Play as a film'} @click=${() => playFilm(app)}>${forecast.playing ? '❚❚' : '▶'}</button>
        <label class="slide"><span>Traffic <output>${number(distanceOf(record.progress), 4)} ${unit}${record.progress.wheel_distance_km !== undefined && unit !== 'km' ? `, wheel ${count(Math.round(record.progress.wheel_distance_km))} km` : ''}</output></span>
          <input type="range" aria-label="Traffic" aria-valuetext=${`${number(distanceOf(record.progress), 3)} ${unit}`} min="0" max=${first.records.length - 1} .value=${String(step)} @input=${(/** @type {Event} */ event) => chooseForecast(app, { step: Number(valueOf(event)) })}></label></div></section>
    ${depthPanel(shapes, body, label, title)}
    <div class="two"><div class="aside">${over}${compared ? nothing : limitsPanel(answers, sides)}</div>${numbers}</div></div>`;
}

/** @param {Answer} answer @param {number} place */
const nearestStep = ({ records }, place) => records.reduce((best, { progress }, at) => (Math.abs(distanceOf(progress) - place) <= Math.abs(distanceOf(records[best].progress) - place) ? at : best), 0);

/** Returns the contacts of all states on the drawn section. @param {WornRecord} record @param {'rail' | 'wheel'} body @param {ReturnType<typeof sectionOf>} shape @returns {import('./drawing/worn.js').WornContact[]} */
function contactsOf(record, body, { now, normals }) {
  const { states, [body]: { points_mm: points } } = record;
  const all = states.flatMap(({ share, patches }) => patches.map((patch) => ({ place: body === 'rail' ? patch.rail_mm : patch.wheel_mm, load: share * patch.normal_force_n, pressure: patch.pressure_max_mpa })));
  const total = all.reduce((sum, { load }) => sum + load, 0) || 1;
  return all.map(({ place: [y, z], load, pressure }) => {
    const distances = points.map((point) => Math.hypot(point[0] - y, point[1] - z));
    const nearest = distances.indexOf(Math.min(...distances));
    return { at: now[nearest], normal: normals[nearest], size: load / total, pressure };
  });
}

/** Panel with wear depth and damage across the section. @param {{ side: Side, record: WornRecord }[]} shapes @param {'rail' | 'wheel'} body @param {(at: number) => string} label @param {string} title */
function depthPanel(shapes, body, label, title) {
  const points = (/** @type {WornRecord} */ record, /** @type {'depth_mm' | 'damage'} */ what, factor = 1) => record[body].points_mm.map(([y], at) => /** @type {[number, number]} */ ([y, factor * record[body][what][at]]));
  const looks = ['one', 'two'];
  const band = (/** @type {WornRecord} */ record) => {
    const [low, high] = record[body].uncertainty.coefficients;
    return /** @type {const} */ ([points(record, 'depth_mm', low), points(record, 'depth_mm', high)]);
  };
  const axis = `y on the ${body}, to the field side / mm`;
  return html`<section class="panel" aria-labelledby="h-depth"><header class="bar"><h2 id="h-depth">Depth and fatigue across the ${body}</h2></header><div class="cards">
    <div class="card">${savable(`${title} depth ${body}`, drawChart({ name: `Worn depth across the ${body}`, x: axis, y: 'worn depth / mm', lines: shapes.map((shape, at) => ({ label: label(at), look: looks[at], points: points(shape.record, 'depth_mm'), band: band(shape.record) })) }))}</div>
    <div class="card">${savable(`${title} fatigue ${body}`, drawChart({ name: `Fatigue across the ${body}`, x: axis, y: 'RCF damage net of wear (1: visible crack)', lines: shapes.map((shape, at) => ({ label: label(at), look: looks[at], points: points(shape.record, 'damage') })) }))}</div></div></section>`;
}

/** Panel that shows when limits are reached and which of two plans lasts longer. @param {readonly Answer[]} answers @param {readonly Side[]} sides */
function limitsPanel(answers, sides) {
  const reached = reachedOf(answers);
  const unit = distanceUnit(answers[0]);
  const compared = sides.length > 1;
  const when = (/** @type {number | null} */ place, none = 'later') => (place === null ? none : number(place, 3));
  return html`<section class="panel" aria-labelledby="h-limits"><header class="bar"><h2 id="h-limits">${compared ? 'Decision' : 'Limits'}</h2></header>
    ${compared ? html`<p class="pad decision" role="status">${decisionText(answers, sides)}</p>` : nothing}
    ${reached.length ? html`<div class="scroll" tabindex="0" role="region" aria-labelledby="h-limits"><table><thead><tr><th scope="col">loss</th><th scope="col">limit</th>${sides.map((_, at) => html`<th scope="col">${compared ? `${'AB'[at]} reaches it at` : 'reached at'}</th>`)}</tr></thead>
      <tbody>${reached.map(({ label, limit, lives }) => html`<tr><th scope="row">${label}</th><td>${limit}</td>${lives.map(({ mean, earliest, latest }) => html`<td>${mean === null ? 'not reached' : html`<b>${when(mean)} ${unit}</b>`}${earliest === latest ? nothing : html`<small> ${when(earliest)} … ${when(latest)}</small>`}</td>`)}</tr>`)}</tbody></table></div>`
      : html`<p class="pad quiet">${answers.some(({ limits }) => limits.length) ? 'No limit is reached.' : 'No limits were given.'}</p>`}</section>`;
}

/** Describes which of two plans lasts longer. @param {readonly Answer[]} answers @param {readonly Side[]} sides */
function decisionText(answers, sides) {
  const { better, sure, ends } = decisionOf(reachedOf(answers));
  const unit = distanceUnit(answers[0]);
  const short = answers.findIndex(({ remarks }) => remarks.some(({ code }) => code === 'evolution-ended-early'));
  if (short >= 0) return html`<b>${'AB'[short]}</b> (${sides[short].job.name}) ended before its extent. The plans cannot be compared.`;
  const last = answers.map(({ records }) => records[records.length - 1]);
  const end = (/** @type {0 | 1} */ side) => (ends[side].label ? `${ends[side].label}, at ${number(ends[side].place, 3)} ${unit}` : `none within ${number(distanceOf(last[side].progress), 3)} ${unit}`);
  const name = (/** @type {0 | 1} */ side) => html`<b>${'AB'[side]}</b> (${sides[side].job.name})`;
  const removed = BODIES.flatMap((body) => {
    const [one, two] = last.map((record) => record[body].machined_area_mm2);
    return one || two ? [`${body === 'rail' ? 'grinds' : 'turns'} ${number(one, 3)} (A) and ${number(two, 3)} (B) mm² off the ${body}`] : [];
  });
  const worn = BODIES.filter((body) => answers.some((answer) => wears(answer, body))).map((body) => {
    const [one, two] = last.map((record) => record[body].worn_area_mm2);
    const errors = last.map((record) => record[body].worn_area_mm2 * numericalOf(record, body));
    const less = Math.abs(one - two) > Math.hypot(...errors) ? `, ${number(100 * (1 - Math.min(one, two) / Math.max(one, two)), 2)} % less with ${one < two ? 'A' : 'B'}` : ', which do not differ by more than their errors';
    return `${plusMinus(one, errors[0])} (A) and ${plusMinus(two, errors[1])} (B) mm² off the ${body}${less}`;
  });
  return html`${better === null ? (ends[0].label ? 'Both reach their first limit at the same time.' : `Neither reaches a limit within ${number(distanceOf(last[0].progress), 3)} ${unit}. Until then traffic wears ${worn.join('; and ')}.`)
    : html`${name(better)} goes on longer. Its first limit: ${end(better)}. That of ${name(better ? 0 : 1)}: ${end(better ? 0 : 1)}.
      ${sure ? 'No wear coefficients within their scatter reverse this.' : html`<span class="warn">Other wear coefficients within their scatter may reverse this.</span>`}`}
    ${removed.length ? ` Maintenance ${removed.join(', and ')}.` : nothing}`;
}

const BODIES = /** @type {const} */ (['rail', 'wheel']);

/** Formats a loss with its numerical error. @param {WornRecord} record @param {typeof LOSSES[number]['key']} key @param {'rail' | 'wheel'} body */
function lossText(record, key, body) {
  const loss = record.losses[key] ?? NaN;
  const error = loss * numericalOf(record, body);
  return error >= 5e-4 ? plusMinus(loss, error) : fixed(loss, 3);
}

/** Panel with the numbers of the displayed step. @param {readonly WornRecord[]} records @param {readonly ('rail' | 'wheel')[]} bodies The bodies that wear. @param {boolean} compared */
function numbersPanel(records, bodies, compared) {
  /** @type {[string, (record: WornRecord) => unknown][]} */
  const rows = [
    ...LOSSES.filter(({ body }) => bodies.includes(body)).map(({ key, label, body }) => /** @type {[string, (record: WornRecord) => unknown]} */ ([`${label} / mm`, (record) => lossText(record, key, body)])),
    ...bodies.flatMap((body) => /** @type {[string, (record: WornRecord) => unknown][]} */ ([
      [`largest depth on the ${body} / mm`, (record) => html`${plusMinus(deepest(record, body), deepest(record, body) * numericalOf(record, body))}<small> at y ${fixed(record[body].points_mm[record[body].depth_mm.indexOf(deepest(record, body))]?.[0] ?? NaN, 1)} mm</small>`],
      [`worn area of the ${body} / mm²`, (record) => {
        const { worn_area_mm2: area, uncertainty: { coefficients } } = record[body];
        return html`${plusMinus(area, area * numericalOf(record, body))}<small> coefficients: ${number(area * coefficients[0], 2)} … ${number(area * coefficients[1], 2)}</small>`;
      }],
      [`ground or turned off the ${body} / mm²`, (record) => number(record[body].machined_area_mm2, 3)],
      [`largest RCF damage of the ${body}`, (record) => number(worstDamage(record, body), 3)],
    ])),
    ['largest pressure / MPa', ({ contact }) => number(contact.pressure_max_mpa, 4)],
    ['Tγ, mean / (J/m)', ({ contact }) => number(contact.t_gamma_mean_n, 3)],
    ['Y/Q, largest', ({ contact }) => number(contact.y_over_q_max, 3)],
    ['equivalent conicity at 3 mm', ({ conicity }) => fixed(conicity ?? NaN, 3)],
    ['traffic without an answer / %', ({ contact }) => number(100 * contact.unsolved_share, 2)],
  ];
  return html`<section class="panel" aria-labelledby="h-step"><header class="bar"><h2 id="h-step">At this step</h2></header>
    <div class="scroll" tabindex="0" role="region" aria-labelledby="h-step"><table>${compared ? html`<thead><tr><th></th>${records.map((_, at) => html`<th scope="col">${'AB'[at]}</th>`)}</tr></thead>` : nothing}
      <tbody>${rows.map(([name, of]) => html`<tr><th scope="row">${name}</th>${records.map((record) => html`<td>${of(record)}</td>`)}</tr>`)}</tbody></table></div></section>`;
}

/** @param {App} app @param {Forecast} forecast @param {Side} side @param {WornRecord} record */
function downloadsOf(app, { body, step }, { job }, record) {
  const name = fileName(job.name || job.id);
  const get = (/** @type {string} */ path, /** @type {string} */ file) => () => download(`/v1/evolutions/${job.id}/${path}`, file).catch(app.refused);
  const at = `${name}-${body}-${fixed(distanceOf(record.progress), 1)}`;
  const section = (/** @type {string} */ format, /** @type {string} */ end) => get(`sections/${body}?record=${step}&format=${format}`, `${at}.${end}`);
  return html`<div class="downloads" role="group" aria-label="Download">
    <button class="small" @click=${get('table?of=records&format=csv', `${name}.csv`)}>CSV</button>
    <button class="small" @click=${get('table?of=points&format=parquet', `${name}-points.parquet`)}>Parquet</button>
    <button class="small" @click=${section('miniprof', body === 'rail' ? 'ban' : 'whl')}>MiniProf</button>
    <button class="small" @click=${section('simpack', body === 'rail' ? 'prr' : 'prw')}>Simpack</button>
    <button class="small primary" @click=${() => repeatForecast(app, job).catch(app.refused)}>Compare with another plan</button></div>`;
}
