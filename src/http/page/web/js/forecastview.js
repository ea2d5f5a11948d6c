// Forecast: what a traffic does to a rail and a wheel, step by step: the form, the sections with their band, curves, limits, two plans side by side.

import { html, nothing } from '../vendor/lit-html.js';
import { cancel, download, save } from './api.js';
import { removeLater, isThere } from './deleting.js';
import { drawChart } from './drawing/axes.js';
import { drawWorn } from './drawing/worn.js';
import { fileName } from './downloads.js';
import { decoded } from './files.js';
import { chooseForecast, EVENTS, FACTORS, forecastSeen, openForecast, playFilm, recordOf, repeatForecast, startForecast, templateOf, writeForm } from './forecast.js';
import { CURVES, distanceOf, distanceUnit, forecastCurve, LOSSES, numericalOf, sectionOf, wears } from './forecastdata.js';
import { count, fixed, number } from './format.js';
import { remarkList } from './remarks.js';
import { formatRoute } from './routes.js';
import { saveDrawing } from './savedrawing.js';
import { COLUMNS, parseTraffic, ROWS_MAX } from './traffic.js';

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
  const { form, sending, refusal, faults } = forecast;
  const template = templateOf(app);
  const { document, files } = app.store.get().compose;
  const write = (/** @type {keyof typeof form} */ member) => (/** @type {Event} */ event) => writeForm(app, { [member]: /** @type {HTMLInputElement} */ (event.target).value });
  const entry = (/** @type {'mgt' | 'km' | 'records' | 'name'} */ member, /** @type {string} */ label, /** @type {string} */ unit) => html`<div class="field"><label for=${`f-${member}`}>${label}</label>
    <span class="input"><input id=${`f-${member}`} autocomplete="off" .value=${form[member]} @input=${write(member)}>${unit ? html`<span class="unit">${unit}</span>` : nothing}</span></div>`;
  const names = [files.rail?.name, files.wheel?.name].filter(Boolean).join(', ');
  return html`<section class="panel" aria-labelledby="h-forecast"><header class="bar"><h1 id="h-forecast">Forecast: wear and fatigue under a traffic</h1>
      <button class="primary" ?disabled=${sending || typeof template === 'string'} @click=${() => startForecast(app)}>${sending ? 'Sending …' : 'Compute'}</button></header>
    <div class="two pad">
      <div>
        <fieldset><legend>Rail and wheel</legend>${typeof template === 'string' ? html`<p class="fault">${template}</p>`
          : html`<p>${String(document?.name ?? 'The pair of the view Contact')}${names ? html` <span class="quiet">(${names})</span>` : nothing}</p>
            <p class="hint">Sections, inclination, gauge, speed, friction and steel are those of the view <a href="#/compose">Contact</a>. Other files can be dropped here.</p>`}</fieldset>
        <fieldset><legend>Traffic</legend>${form.table ? tableOf(app, form.table) : rowsOf(app, form)}
          <label class="drop">${form.table ? 'Another table' : 'Or a table of the traffic'}<span class="quiet">CSV with titles such as Q [kN], shift [mm], yaw [mrad], friction, passes; up to 200 000 rows</span>
            <input type="file" class="visually-hidden" id="traffic" @change=${(/** @type {Event} */ event) => takeTable(app, /** @type {HTMLInputElement} */ (event.target))}></label></fieldset>
      </div>
      <div>
        <fieldset><legend>How far</legend><div class="pair">${form.wearing === 'wheel' ? nothing : entry('mgt', 'Traffic over the rail', 'MGT')}${form.wearing === 'rail' ? nothing : entry('km', 'Distance of the wheel', 'km')}</div>
          <div class="pair"><div class="field"><label for="f-wearing">What wears</label><select id="f-wearing" @change=${write('wearing')}>${[['both', 'rail and wheel'], ['rail', 'the rail'], ['wheel', 'the wheel']].map(([value, label]) => html`<option value=${value} ?selected=${form.wearing === value}>${label}</option>`)}</select></div>
            <div class="field"><label for="f-law">Law of wear</label><select id="f-law" @change=${write('law')}>${[['usfd_wear', 'Tγ/A (Sheffield)'], ['archard_wear', 'Archard']].map(([value, label]) => html`<option value=${value} ?selected=${form.law === value}>${label}</option>`)}</select></div></div>
          <div class="pair">${entry('records', 'Steps to keep', '')}${entry('name', 'Name', '')}</div></fieldset>
        <fieldset><legend>Limits</legend><div class="triple">${LOSSES.filter(({ body }) => form.wearing === 'both' || form.wearing === body).map(({ key, label }) => html`<div class="field"><label for=${`f-${key}`}>${label}</label>
          <span class="input"><input id=${`f-${key}`} autocomplete="off" placeholder="none" .value=${form.limits[key] ?? ''} @input=${(/** @type {Event} */ event) => writeForm(app, { limits: { ...form.limits, [key]: /** @type {HTMLInputElement} */ (event.target).value } })}><span class="unit">mm</span></span></div>`)}</div></fieldset>
        <fieldset><legend>Maintenance</legend>${eventsOf(app, form)}</fieldset>
      </div>
    </div>
    ${refusal ? html`<div class="pad"><p class="fault big">${refusal}</p><ul class="faults">${faults.map(({ pointer, detail }) => html`<li><code>${pointer}</code> ${detail}</li>`)}</ul></div>` : nothing}</section>`;
}

/** Rows of the traffic, written by hand. @param {App} app @param {Forecast['form']} form */
function rowsOf(app, { rows }) {
  const set = (/** @type {number} */ row, /** @type {import('./traffic.js').ColumnKey} */ key) => (/** @type {Event} */ event) =>
    writeForm(app, { rows: rows.map((old, at) => (at === row ? { ...old, [key]: /** @type {HTMLInputElement} */ (event.target).value } : old)) });
  return html`<div class="scroll" tabindex="0" role="region" aria-label="Traffic"><table class="traffic"><thead><tr>${COLUMNS.map(({ label, unit }) => html`<th scope="col">${label}${unit ? ` / ${unit}` : ''}</th>`)}<th></th></tr></thead>
    <tbody>${rows.map((row, at) => html`<tr>${COLUMNS.map(({ key, label }) => html`<td><input inputmode="decimal" aria-label=${`${label}, row ${at + 1}`} .value=${row[key]} @input=${set(at, key)}></td>`)}
      <td><button class="icon" aria-label=${`Remove row ${at + 1}`} ?disabled=${rows.length < 2} @click=${() => writeForm(app, { rows: rows.filter((_, other) => other !== at) })}>×</button></td></tr>`)}</tbody></table></div>
    <p><button class="small" ?disabled=${rows.length >= ROWS_MAX} @click=${() => writeForm(app, { rows: [...rows, { ...rows[rows.length - 1] }] })}>Add a row</button> <span class="hint">Passes are shares or numbers: only their ratios count.</span></p>`;
}

/** @param {App} app @param {NonNullable<Forecast['form']['table']>} table */
const tableOf = (app, table) => html`<p>${table.name}: ${count(table.rows)} rows of ${Object.keys(table.columns).map((pointer) => COLUMNS.find((column) => column.pointer === pointer)?.label ?? pointer).join(', ')}${table.passes ? ' and passes' : ''}
  <button class="small" @click=${() => writeForm(app, { table: null })}>Write rows instead</button></p>`;

/** @param {App} app @param {HTMLInputElement} input */
async function takeTable(app, input) {
  const file = input.files?.[0];
  input.value = '';
  if (!file) return;
  const parsed = parseTraffic(decoded(await file.arrayBuffer()));
  if (typeof parsed === 'string') app.say(`${file.name}: ${parsed}.`);
  else writeForm(app, { table: { name: file.name, ...parsed } });
}

/** @param {App} app @param {Forecast['form']} form */
function eventsOf(app, form) {
  const { events, wearing } = form;
  const unit = wearing === 'wheel' ? 'km' : 'MGT';
  const set = (/** @type {number} */ place, /** @type {object} */ change) => writeForm(app, { events: events.map((event, at) => (at === place ? { ...event, ...change } : event)) });
  const value = (/** @type {Event} */ event) => /** @type {HTMLInputElement} */ (event.target).value;
  return html`${events.map((event, at) => html`<div class="event">
      <label>At <span class="input"><input inputmode="decimal" .value=${event.at} @input=${(/** @type {Event} */ input) => set(at, { at: value(input) })}><span class="unit">${unit}</span></span></label>
      <select aria-label=${`What is done, ${at + 1}`} @change=${(/** @type {Event} */ input) => set(at, { kind: value(input) })}>${EVENTS.map(([kind, label]) => html`<option value=${kind} ?selected=${kind === event.kind}>${label}</option>`)}</select>
      <span class="input"><input inputmode="decimal" aria-label=${event.kind === 'friction' ? 'Coefficient of friction' : 'Depth beyond that, in mm'} placeholder=${event.kind === 'friction' ? '0.15' : '0'} .value=${event.value} @input=${(/** @type {Event} */ input) => set(at, { value: value(input) })}>
        <span class="unit">${event.kind === 'friction' ? 'μ' : 'mm more'}</span></span>
      <button class="icon" aria-label=${`Remove event ${at + 1}`} @click=${() => writeForm(app, { events: events.filter((_, other) => other !== at) })}>×</button></div>`)}
    <p><button class="small" @click=${() => writeForm(app, { events: [...events, { kind: 'grind', at: String(Number(wearing === 'wheel' ? form.km : form.mgt) / 2 || ''), value: '' }] })}>Add grinding, lubrication or turning</button></p>`;
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
  return html`<section class="panel wait"><h1>${job.name || 'Forecast'}</h1>
    <p role="status" class=${job.state === 'failed' ? 'fault big' : ''}>${job.state === 'queued' ? 'Waiting in the queue …' : job.state === 'running' ? 'Computing step by step …' : job.state === 'failed' ? (job.error?.detail ?? 'Failed') : job.state}</p>
    ${open ? html`<progress max="1" .value=${job.progress} aria-label="Progress"></progress><button @click=${() => cancel('evolutions', job.id).catch(app.refused)}>Cancel</button>`
      : html`<button @click=${() => repeatForecast(app, job).catch(app.refused)}>Change and repeat</button>`}
    <a class="button" href="#/forecast">To the forecasts</a></section>`;
}

/** @type {{ key: string, curve: ReturnType<typeof forecastCurve> } | null} */
let made = null;

/** @param {App} app @param {Forecast} forecast */
function resultView(app, forecast) {
  const { sides, step, body, factor } = forecast;
  const answers = sides.map(({ answer }) => /** @type {Answer} */ (answer));
  const [first] = answers;
  const record = first.records[step];
  const unit = distanceUnit(first);
  const shapes = sides.map((side, at) => {
    const of = /** @type {WornRecord} */ (recordOf(side));
    return { side, record: of, shape: sectionOf(answers[at], of, body, factor), contacts: contactsOf(of, body, sectionOf(answers[at], of, body, factor).now) };
  });
  const key = [...forecast.ids, forecast.curve, body].join();
  if (made?.key !== key) made = { key, curve: forecastCurve(answers, forecast.curve, body) };
  const { curve } = made;
  const pick = (/** @type {number} */ place) => curve && chooseForecast(app, { step: nearestStep(first, curve.x[place]) });
  const compared = sides.length > 1;
  const label = (/** @type {number} */ at) => (compared ? `${'AB'[at]}: ${sides[at].job.name || 'forecast'}` : `at ${number(distanceOf(record.progress), 3)} ${unit}`);
  return html`<div class="result forecast">
    <header class="jobhead"><div><h1>${compared ? 'Two forecasts' : (sides[0].job.name || 'Forecast')}</h1>
      <p class="quiet">${sides.map(({ job }, at) => html`${compared ? html`<b>${'AB'[at]}</b> <a href=${formatRoute('forecast', [job.id])}>${job.name || job.id}</a> ` : html`<code>${job.id}</code> `}`)}</p></div>
      ${compared ? html`<a class="button small" href="#/forecast">To the forecasts</a>` : downloadsOf(app, forecast, sides[0], record)}</header>
    ${compared ? nothing : remarkList(first.remarks)}
    <section class="panel" aria-labelledby="h-worn"><header class="bar"><h2 id="h-worn">Section</h2>
        <div class="segs" role="group" aria-label="Body">${BODIES.map((name) => html`<label class="seg"><input type="radio" name="worn" .checked=${body === name} @change=${() => chooseForecast(app, { body: name })}><span>${name}</span></label>`)}</div>
        <label class="inline">wear drawn <select class="slim" @change=${(/** @type {Event} */ event) => chooseForecast(app, { factor: Number(/** @type {HTMLSelectElement} */ (event.target).value) })}>${FACTORS.map((times) => html`<option value=${times} ?selected=${times === factor}>${times === 1 ? 'to scale' : `${times} times larger`}</option>`)}</select></label></header>
      <div class="pad">${drawWorn({
        name: `Section of the ${body} at the start and after ${number(distanceOf(record.progress), 3)} ${unit}`, start: shapes[0].shape.start,
        shapes: shapes.map(({ shape, contacts }, at) => ({ label: label(at), now: shape.now, low: shape.low, high: shape.high, contacts })),
      })}
        <p class="hint">Band: 90 % of the scatter of the wear coefficients. Circles: where the traffic touches, their area the share of its load.</p></div>
      <div class="film"><button aria-label=${forecast.playing ? 'Stop the film' : 'Play as a film'} @click=${() => playFilm(app)}>${forecast.playing ? '❚❚' : '▶'}</button>
        <label class="slide"><span>Traffic <output>${number(distanceOf(record.progress), 4)} ${unit}${record.progress.wheel_distance_km !== undefined && unit !== 'km' ? `, wheel ${count(Math.round(record.progress.wheel_distance_km))} km` : ''}</output></span>
          <input type="range" min="0" max=${first.records.length - 1} .value=${String(step)} @input=${(/** @type {Event} */ event) => chooseForecast(app, { step: Number(/** @type {HTMLInputElement} */ (event.target).value) })}></label></div></section>
    ${depthPanel(shapes, body, label)}
    <div class="two">
      <div class="aside"><section class="panel" aria-labelledby="h-over"><header class="bar"><h2 id="h-over">Over the traffic</h2>
          <div class="segs" role="group" aria-label="Curve of the forecast">${CURVES.map(([kind, name]) => html`<label class="seg"><input type="radio" name="forecast" .checked=${forecast.curve === kind} @change=${() => chooseForecast(app, { curve: kind })}><span>${name}</span></label>`)}</div></header>
        ${curve ? html`<creep-curve .shown=${{ curve, chosen: curve.x.lastIndexOf(distanceOf(record.progress)), pick }}></creep-curve>` : html`<p class="pad quiet">Nothing to draw.</p>`}
        <p class="pad hint">Error bars: steps, condensed traffic and contact together, without the wear coefficients.</p></section>
      ${limitsPanel(answers, sides)}</div>
      ${numbersPanel(shapes.map((shape) => shape.record), BODIES.filter((name) => answers.some((answer) => wears(answer, name))), compared)}
    </div></div>`;
}

/** @param {Answer} answer @param {number} place */
const nearestStep = ({ records }, place) => records.reduce((best, { progress }, at) => (Math.abs(distanceOf(progress) - place) <= Math.abs(distanceOf(records[best].progress) - place) ? at : best), 0);

/** Places of contact of all states on a section as it is drawn. @param {WornRecord} record @param {'rail' | 'wheel'} body @param {readonly import('./drawing/axes.js').Point[]} drawn */
function contactsOf(record, body, drawn) {
  const { states, [body]: worn } = record;
  const all = states.flatMap(({ share, patches }) => patches.map((patch) => ({ place: body === 'rail' ? patch.rail_mm : patch.wheel_mm, load: share * patch.normal_force_n })));
  const total = all.reduce((sum, { load }) => sum + load, 0) || 1;
  return all.map(({ place: [y, z], load }) => {
    const nearest = worn.points_mm.reduce((best, point, at) => (Math.hypot(point[0] - y, point[1] - z) < Math.hypot(worn.points_mm[best][0] - y, worn.points_mm[best][1] - z) ? at : best), 0);
    return { at: drawn[nearest], size: load / total };
  });
}

/** Depth and damage over the section. @param {{ side: Side, record: WornRecord }[]} shapes @param {'rail' | 'wheel'} body @param {(at: number) => string} label */
function depthPanel(shapes, body, label) {
  const points = (/** @type {WornRecord} */ record, /** @type {'depth_mm' | 'damage'} */ what, factor = 1) => record[body].points_mm.map(([y], at) => /** @type {[number, number]} */ ([y, factor * record[body][what][at]]));
  const looks = ['one', 'two'];
  const [{ record }] = shapes;
  const [low, high] = record[body].uncertainty.coefficients;
  const band = shapes.length > 1 ? [] : [{ label: '90 % of coefficients', look: 'three', points: points(record, 'depth_mm', low) }, { label: '', look: 'three', points: points(record, 'depth_mm', high) }];
  const axis = `y on the ${body}, to the field side / mm`;
  return html`<section class="panel" aria-labelledby="h-depth"><header class="bar"><h2 id="h-depth">Depth and fatigue across the ${body}</h2></header><div class="cards">
    <div class="card">${drawChart({ name: `Worn depth across the ${body}`, x: axis, y: 'worn depth / mm', lines: [...shapes.map((shape, at) => ({ label: label(at), look: looks[at], points: points(shape.record, 'depth_mm') })), ...band] })}</div>
    <div class="card">${drawChart({ name: `Fatigue across the ${body}`, x: axis, y: 'RCF damage net of wear (1: visible crack)', lines: shapes.map((shape, at) => ({ label: label(at), look: looks[at], points: points(shape.record, 'damage') })) })}</div></div></section>`;
}

/** When limits are reached. @param {readonly Answer[]} answers @param {readonly Side[]} sides */
function limitsPanel(answers, sides) {
  const names = [...new Set(answers.flatMap(({ limits }) => limits.map(({ loss }) => loss)))];
  const unit = distanceUnit(answers[0]);
  const told = (/** @type {Answer} */ answer, /** @type {string} */ loss) => {
    const limit = answer.limits.find((known) => known.loss === loss);
    if (!limit) return '–';
    const when = (/** @type {WornRecord['progress'] | undefined} */ progress, /** @type {string} */ none) => (progress ? `${number(distanceOf(progress), 3)}` : none);
    return html`${limit.reached ? html`<b>${when(limit.reached, '')} ${unit}</b>` : 'not reached'}<small> ${when(limit.earliest, 'later')} … ${when(limit.latest, 'later')}</small>`;
  };
  return html`<section class="panel" aria-labelledby="h-limits"><header class="bar"><h2 id="h-limits">Limits</h2></header>
    ${names.length ? html`<div class="scroll" tabindex="0" role="region" aria-labelledby="h-limits"><table><thead><tr><th scope="col">loss</th><th scope="col">limit / mm</th>${sides.map((_, at) => html`<th scope="col">${sides.length > 1 ? `${'AB'[at]} reaches it at` : 'reached at'}</th>`)}</tr></thead>
      <tbody>${names.map((loss) => html`<tr><th scope="row">${LOSSES.find(({ key }) => key === loss)?.label ?? loss}</th><td>${number(answers.flatMap(({ limits }) => limits).find((known) => known.loss === loss)?.limit_mm ?? NaN, 3)}</td>${answers.map((answer) => html`<td>${told(answer, loss)}</td>`)}</tr>`)}</tbody></table></div>`
      : html`<p class="pad quiet">No limits were given.</p>`}</section>`;
}

const BODIES = /** @type {const} */ (['rail', 'wheel']);

/** Numbers of the step. @param {readonly WornRecord[]} records @param {readonly ('rail' | 'wheel')[]} bodies Those that wear. @param {boolean} compared */
function numbersPanel(records, bodies, compared) {
  /** @type {[string, (record: WornRecord) => unknown][]} */
  const rows = [
    ...LOSSES.filter(({ body }) => bodies.includes(body)).map(({ key, label }) => /** @type {[string, (record: WornRecord) => unknown]} */ ([`${label} / mm`, ({ losses }) => fixed(losses[key] ?? NaN, 3)])),
    ...bodies.flatMap((body) => /** @type {[string, (record: WornRecord) => unknown][]} */ ([
      [`worn area of the ${body} / mm²`, (record) => {
        const { worn_area_mm2: area, uncertainty: { coefficients } } = record[body];
        return html`${number(area, 3)} ± ${number(100 * numericalOf(record, body), 2)} %<small> coefficients: ${number(area * coefficients[0], 2)} … ${number(area * coefficients[1], 2)}</small>`;
      }],
      [`ground or turned off the ${body} / mm²`, (record) => number(record[body].machined_area_mm2, 3)],
      [`largest RCF damage of the ${body}`, (record) => number(Math.max(0, ...record[body].damage), 3)],
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
  const picture = () => {
    const drawing = document.querySelector('svg.worn');
    if (drawing instanceof SVGSVGElement) save(new Blob([saveDrawing(drawing)], { type: 'image/svg+xml' }), `${at}.svg`);
  };
  const section = (/** @type {string} */ format, /** @type {string} */ end) => get(`sections/${body}?record=${step}&format=${format}`, `${at}.${end}`);
  return html`<div class="downloads" role="group" aria-label="Download">
    <button class="small" @click=${get('table?of=records&format=csv', `${name}.csv`)}>CSV</button>
    <button class="small" @click=${get('table?of=points&format=parquet', `${name}-points.parquet`)}>Parquet</button>
    <button class="small" @click=${picture}>SVG</button>
    <button class="small" @click=${section('miniprof', body === 'rail' ? 'ban' : 'whl')}>MiniProf</button>
    <button class="small" @click=${section('simpack', body === 'rail' ? 'prr' : 'prw')}>Simpack</button>
    <button class="small primary" @click=${() => repeatForecast(app, job).catch(app.refused)}>Change and repeat</button></div>`;
}
