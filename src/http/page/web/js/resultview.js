// The view Result: numbers with errors, fields, patches on the profiles, creep curve, and details of the computation.

import { html, nothing } from '../vendor/lit-html.js';
import { cancel, submit } from './api.js';
import { curveOf, isHistory } from './curvedata.js';
import { at, isObject, put } from './document.js';
import { damagePanel } from './damageview.js';
import { downloads } from './downloads.js';
import { drawProfiles } from './drawing/profiles.js';
import { editDocument, solve } from './editing.js';
import { loadsPanel } from './loadsview.js';
import { inWords, remarkList } from './remarks.js';
import { inOrder, isSolvedBent, standardSection, withEverything, withFields, withSpeed } from './starts.js';
import { indexOf } from './field/cells.js';
import { combOf } from './field/comb.js';
import { hasFields } from './fields.js';
import { chooseAmounts, chosenAmounts } from './field/palette.js';
import { offered, quantityOf } from './field/quantities.js';
import { FieldMap } from './fieldmap.js';
import { count, degrees, fixed, number, plusMinus, seconds, withError } from './format.js';
import { choose, frictionOf, lookedAt, rememberView, rangeShown } from './result.js';
import { formatRoute } from './routes.js';
import { wheelsetPanel } from './wheelsetview.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./result.js').Looked} Looked */
/** @typedef {import('./api.js').Patch} Patch */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./api.js').Point} Point */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./fieldmap.js').CrosshairEvent} CrosshairEvent */

const TABLE_ROWS = 400;

/** @param {App} app */
export function result(app) {
  const looked = lookedAt();
  if (!looked) return html`<p class="pad quiet">Loading …</p>`;
  const { job } = looked;
  const head = html`<header class="jobhead">
    <div><h1>${job.name || `Job ${job.id.slice(0, 8)}`}</h1>
      <p class="quiet">${Object.entries(job.labels ?? {}).map(([key, value]) => html`<span class="chip">${key}: ${value}</span>`)} <code>${job.id}</code></p></div>
    ${looked.result ? html`<div class="downloads" role="group" aria-label="Download">${downloads(app, looked)}
      ${isWorn(app, looked.document) ? html`<button class="small" @click=${() => compareWithNew(app, looked).catch(app.refused)}>Compare with new profiles</button>` : nothing}
      <button class="small primary" @click=${() => edit(app, looked)}>Edit case</button></div>` : nothing}
  </header>`;
  if (!looked.result) return html`<div class="result">${head}${waiting(app, looked)}</div>`;
  return html`<div class="result">${head}${loaded(app, looked, looked.result)}</div>`;
}

/** @param {App} app @param {Looked} looked */
function edit(app, looked) {
  if (looked.document) editDocument(app, inOrder(looked.document));
  app.compose({ example: '' });
  app.go(formatRoute('compose'));
}

const BODIES = /** @type {const} */ (['rail', 'wheel']);

/** Returns whether a case of profiles differs from the standard profiles of the examples. @param {App} app @param {JsonObject | null} document */
function isWorn(app, document) {
  const { examples } = app.store.get().compose;
  const differs = (/** @type {'rail' | 'wheel'} */ body) => JSON.stringify(at(document ?? undefined, `/contact/${body}`)) !== JSON.stringify(standardSection(examples, body));
  return examples.length > 0 && at(document ?? undefined, '/contact/type') === 'profiles' && BODIES.some(differs);
}

/** Solves the same case with a new 60E1 rail and a new S1002 wheel, and compares both. @param {App} app @param {Looked} looked */
async function compareWithNew(app, { document, job }) {
  const { examples } = app.store.get().compose;
  const fresh = BODIES.reduce((of, body) => put(of, `/contact/${body}`, standardSection(examples, body)), put(document ?? {}, '/contact/flange_back_position_mm', undefined));
  const other = await submit(JSON.stringify({ ...fresh, name: 'new S1002 on new 60E1' }), { wait: 10 });
  if (other.state !== 'succeeded') return app.go(formatRoute('result', [other.id]));
  app.go(formatRoute('compare', [other.id, job.id]));
}

/** Solves a case in spite of its rough profiles. @param {App} app @param {Looked} looked */
function allTheSame(app, looked) {
  if (!looked.document) return;
  editDocument(app, put(looked.document, '/contact/accept_rough_profiles', true));
  solve(app);
}

/** Panel of a job without a result. @param {App} app @param {Looked} looked */
function waiting(app, looked) {
  const { job } = looked;
  switch (job.state) {
    case 'queued':
    case 'running': {
      const place = job.queue ? ` ${count(job.queue.position)} before it, starts in about ${seconds(job.queue.starts_in_s)}.` : '';
      return html`<section class="panel wait"><p role="status">${job.state === 'queued' ? `Waiting in the queue …${place}` : 'Solving …'}</p>
        <progress max="1" .value=${job.progress} aria-label="Progress"></progress>
        <button @click=${() => cancel('jobs', job.id).catch(app.refused)}>Cancel</button></section>`;
    }
    case 'failed':
    case 'cancelled':
      return html`<section class="panel wait"><p class="fault big">${job.state === 'failed' ? (job.error?.title ?? 'Failed') : 'Cancelled'}</p>
        <p>${job.error?.detail ?? ''}</p>
        ${(job.error?.errors ?? []).filter(({ detail }) => detail !== job.error?.detail).map((fault) => html`<p><b>${inWords(fault.pointer ?? '')}</b> ${fault.detail}</p>`)}
        <div class="actions"><button @click=${() => edit(app, looked)}>Open the case</button>
        ${job.error?.detail?.includes('accept_rough_profiles') ? html`<button @click=${() => allTheSame(app, looked)}>Solve it anyway</button>` : nothing}</div></section>`;
    default:
      return html`<p class="pad quiet">Loading …</p>`;
  }
}

/** @param {App} app @param {Looked} looked @param {JobResult} answer */
function loaded(app, looked, answer) {
  const patch = answer.patches[looked.patch];
  const point = patch.points[looked.point];
  const mapped = hasFields(answer);
  return html`
    ${figures(looked, patch, point)}
    ${remarkList(answer.remarks ?? [], (place) => choose(app, place))}
    ${smoothAgain(app, looked, answer)}
    ${answer.wheelset?.kinematics ? wheelsetPanel(app, looked, answer.wheelset) : nothing}
    <div class=${mapped ? 'cols' : 'cols nofield'}>
      ${mapped ? fieldPanel(app, looked, answer) : html`<section class="panel wait"><p>The case requested no fields, so there is no map.</p>
        <button class="primary" @click=${() => again(app, looked.document)}>Solve again with fields</button></section>`}
      <div class="aside">
        ${looked.placed && patch.position ? profilePanel(app, looked, answer) : nothing}
        ${answer.wheelset && !answer.wheelset.kinematics ? wheelsetPanel(app, looked, answer.wheelset) : nothing}
        ${patch.points.length > 2 ? curvePanel(app, looked, patch) : nothing}
        ${loadsPanel(app, looked, answer)}
        ${answer.patches.length > 1 && !patch.position ? totalPanel(answer, looked.point) : nothing}
        ${factsPanel(answer, patch, point)}
      </div>
    </div>
    ${damagePanel(app, looked, answer, () => again(app, looked.document))}`;
}

/** Button that solves the case again with the smoothing suggested by warnings. @param {App} app @param {Looked} looked @param {JobResult} answer */
function smoothAgain(app, looked, answer) {
  /** @type {Record<string, number>} */
  const lengths = {};
  for (const remark of answer.remarks ?? []) {
    if (remark.severity !== 'warning' || !remark.pointer || !('smoothing_mm' in remark) || typeof remark.smoothing_mm !== 'number') continue;
    lengths[remark.pointer] = Math.max(lengths[remark.pointer] ?? 0, remark.smoothing_mm);
  }
  const advised = Object.entries(lengths);
  if (!advised.length || !looked.document) return nothing;
  const solveSmooth = () => {
    editDocument(app, advised.reduce((of, [pointer, length]) => put(of, `${pointer}/smoothing_mm`, length), /** @type {JsonObject} */ (looked.document)));
    solve(app);
  };
  return html`<p class="advice"><button class="small" @click=${solveSmooth}>Solve again with ${advised.map(([pointer, length]) => `the ${pointer.split('/').pop()} smoothed by ${number(length, 2)} mm`).join(' and ')}</button></p>`;
}

/** Solves a case again with all outputs that the page draws. @param {App} app @param {JsonObject | null} document */
function again(app, document) {
  if (!document) return;
  editDocument(app, isObject(document.motion) && 'history' in document.motion ? { ...document, outputs: withFields(document.outputs) } : withEverything(withSpeed(document)));
  solve(app);
}

/** @param {Looked} looked @param {Patch} patch @param {Point} point */
function figures(looked, patch, point) {
  // Some motions have their own region and pressure.
  const region = { ...patch, ...point.region };
  const errors = point.error_estimate;
  const friction = frictionOf(looked);
  const figure = (/** @type {unknown} */ label, /** @type {number} */ value, /** @type {string} */ unit, /** @type {number | null | undefined} */ error) => {
    const text = withError(value, error);
    return html`<div class="figure-of"><dt>${label}</dt><dd><b>${text.value}</b>${text.error
      ? html`<span class="err" title="estimated error"> ± ${text.error}</span>` : nothing}<span class="unit"> ${unit}</span></dd></div>`;
  };
  const share = typeof point.stick_area_mm2 === 'number' ? point.stick_area_mm2 / region.area_mm2 : NaN;
  const bound = (friction * region.normal_force_n) / 100;
  const used = Math.hypot(point.force_x_n, point.force_y_n) / bound;
  const power = point.damage?.t_gamma?.with_spin_n;
  return html`<dl class="figures" tabindex="0" aria-label="Numbers of the chosen patch and motion; forces on the rail">
    ${looked.result && looked.result.patches.length > 1 ? html`<div class="figure-of"><dt>patch</dt><dd><b>${looked.patch}</b></dd></div>` : nothing}
    ${figure(html`F<sub>x</sub>`, point.force_x_n / 1000, 'kN', errors && errors.force_x_n / 1000)}
    ${figure(html`F<sub>y</sub>`, point.force_y_n / 1000, 'kN', errors && errors.force_y_n / 1000)}
    ${figure(html`M<sub>z</sub>`, point.moment_z_n_mm / 1000, 'N·m', errors && errors.moment_z_n_mm / 1000)}
    ${figure(html`N`, region.normal_force_n / 1000, 'kN', undefined)}
    ${figure(html`p<sub>max</sub>`, region.pressure_max_mpa, 'MPa', point.profile_uncertainty?.pressure_max_mpa ?? undefined)}
    ${figure('area', region.area_mm2, 'mm²', undefined)}
    ${Number.isFinite(used) ? figure('friction used', used, '% of μN', errors && Math.hypot(errors.force_x_n, errors.force_y_n) / bound) : nothing}
    ${Number.isFinite(share) ? html`<div class="figure-of"><dt>stick</dt><dd><b>${number(100 * share, 3)}</b><span class="unit"> % of area</span></dd>
      <svg class="share" viewBox="0 0 100 5" preserveAspectRatio="none" aria-hidden="true"><rect class="slip" width="100" height="5"/><rect class="stick" width=${100 * share} height="5"/></svg></div>` : nothing}
    ${figure('Tγ', point.friction_power_n, 'J/m', power && ((power.high ?? power.value) - (power.low ?? power.value)) / 2)}
  </dl>`;
}

/** @param {App} app @param {Looked} looked @param {JobResult} answer */
function fieldPanel(app, looked, answer) {
  const field = looked.fields[looked.patch];
  const all = field ? offered(field.cells) : [];
  const quantity = quantityOf(looked.quantity);
  const toggles = /** @type {const} */ ([['border', 'stick–slip line'], ['arrows', 'arrows'], ['mesh', 'cells']]);
  const shown = field && quantity && all.includes(quantity) ? {
    field, quantity, range: rangeShown(looked, quantity), friction: frictionOf(looked), border: looked.border, arrows: looked.arrows,
    mesh: looked.mesh, held: looked.held, bent: isSolvedBent(looked.document, answer, looked.patch), name: `${quantity.heading} of patch ${looked.patch}`,
  } : null;
  const moved = (/** @type {CrosshairEvent} */ { detail: { x, y, held } }) => {
    looked.held = held ? { x, y } : null;
    rememberView(app);
  };
  return html`<section class="panel map" aria-labelledby="h-field">
    <header class="bar"><h2 id="h-field" class="visually-hidden">Field</h2>
      <div class="segs" role="group" aria-label="Quantity">${all.map(({ key, label }) => html`<label class=${key.includes('_') ? 'seg minor' : 'seg'}>
        <input type="radio" name="quantity" .checked=${looked.quantity === key} @change=${() => choose(app, { quantity: key })}><span>${label}</span></label>`)}</div>
      <div class="toggles">${toggles.map(([key, label]) => html`<label><input type="checkbox" .checked=${looked[key]}
        @change=${(/** @type {Event} */ event) => choose(app, { [key]: /** @type {HTMLInputElement} */ (event.target).checked })}> ${label}</label>`)}
        ${scaleChoice(app, looked, answer)}${colourChoice()}</div>
    </header>
    ${answer.patches.length > 1 ? thumbnails(app, looked, answer) : nothing}
    ${shown ? html`<field-map class="main" .shown=${shown} @crosshair=${moved}></field-map>` : html`<p class="pad quiet">Loading the field …</p>`}
    ${field ? cellTable(field, isSolvedBent(looked.document, answer, looked.patch)) : nothing}
  </section>`;
}

/** Choice between the range of colours of the chosen patch and motion and a common one, which extends to the largest μp for tractions. @param {App} app @param {Looked} looked @param {JobResult} answer */
function scaleChoice(app, looked, answer) {
  const bounded = quantityOf(looked.quantity)?.bounded;
  if (!bounded && answer.patches.length < 2 && answer.patches[0].points.length < 2) return nothing;
  return html`<label>scale <select class="slim" @change=${(/** @type {Event} */ event) => choose(app, { ownScale: /** @type {HTMLSelectElement} */ (event.target).value === 'own' })}>
    <option value="own" ?selected=${looked.ownScale}>own</option><option value="common" ?selected=${!looked.ownScale}>common${bounded ? ', to μp' : ''}</option></select></label>`;
}

/** Choice between two colour maps, both suitable for colour-blind readers. */
function colourChoice() {
  const pick = (/** @type {Event} */ event) => {
    chooseAmounts(/** @type {HTMLSelectElement} */ (event.target).value === 'cividis' ? 'cividis' : 'viridis');
    document.querySelectorAll('field-map').forEach((map) => map instanceof FieldMap && map.draw());
  };
  return html`<label>colours <select class="slim" @change=${pick}>${['viridis', 'cividis'].map((name) => html`<option ?selected=${chosenAmounts() === name}>${name}</option>`)}</select></label>`;
}

/** Small maps of all patches with common scales of length and colour. @param {App} app @param {Looked} looked @param {JobResult} answer */
function thumbnails(app, looked, answer) {
  const quantity = quantityOf(looked.quantity);
  const indices = looked.fields.map((field) => field && indexOf(field));
  const widest = Math.max(...indices.map((index) => (index ? Math.max(index.x1 - index.x0, 1.6 * (index.y1 - index.y0)) : 1)));
  return html`<div class="segs thumbs" role="group" aria-label="Patch">${answer.patches.map((patch, at) => {
    const field = looked.fields[at];
    const shown = field && quantity ? { field, quantity, range: rangeShown(looked, quantity), friction: frictionOf(looked), border: true, scale: 124 / widest } : null;
    const angle = patch.position ? ` · ${degrees(patch.position.contact_angle_rad)}` : '';
    const warned = (answer.remarks ?? []).some((remark) => remark.patch === at && remark.severity === 'warning');
    return html`<label class="seg thumb"><input type="radio" name="patch" .checked=${looked.patch === at} @change=${() => choose(app, { patch: at })}>
      <span>${shown ? html`<field-map class="small" .shown=${shown}></field-map>` : nothing}
        <b>Patch ${at}${warned ? html` <abbr class="warn" title="There is a remark on this patch">▲</abbr>` : nothing}</b>
        <small>${number(patch.normal_force_n / 1000, 3)} kN${angle}</small>${wheelOf(answer, at)}</span></label>`;
  })}</div>`;
}

/** Shows the wheel and the shift of a patch of a wheelset. @param {JobResult} answer @param {number} patch */
function wheelOf({ wheelset }, patch) {
  const position = wheelset?.positions.find(({ left, right }) => left.patches.includes(patch) || right.patches.includes(patch));
  return position ? html`<small>${position.left.patches.includes(patch) ? 'left' : 'right'}, shift ${fixed(position.lateral_shift_mm, 1)} mm</small>` : nothing;
}

/** Returns the heading of a column of cells, with its unit. @param {string} name @param {boolean} bent */
const columnName = (name, bent) => (bent && name === 'y_mm' ? 's / mm' : name.replace(/_mm$/, ' / mm').replace(/_mpa$/, ' / MPa').replace(/_c$/, ' / °C').replaceAll('_', ' '));

/** The field as an accessible table. @param {import('./fields.js').Field} field @param {boolean} bent */
function cellTable({ cells }, bent) {
  const columns = /** @type {(keyof typeof cells)[]} */ (Object.keys(cells)).filter((name) => !['dx_mm', 'dy_mm', 'strip'].includes(name));
  const rows = Math.min(cells.x_mm.length, TABLE_ROWS);
  const fill = (/** @type {Event} */ event) => {
    const details = /** @type {HTMLDetailsElement} */ (event.target);
    const body = details.querySelector('tbody');
    if (!details.open || !body) return;
    const lines = Array.from({ length: rows }, (_, row) => {
      const line = document.createElement('tr');
      for (const name of columns) {
        const value = cells[name]?.[row];
        line.insertCell().textContent = typeof value === 'number' ? number(value) : String(value);
      }
      return line;
    });
    body.replaceChildren(...lines);
  };
  return html`<details class="as-table" @toggle=${fill}><summary>As a table${rows < cells.x_mm.length ? `, the first ${rows} of ${count(cells.x_mm.length)} cells` : ''}</summary>
    <div class="scroll" tabindex="0" role="region" aria-label="Cells of the field"><table><thead><tr>${columns.map((name) => html`<th scope="col">${columnName(name, bent)}</th>`)}</tr></thead><tbody></tbody></table></div></details>`;
}

/** @param {App} app @param {Looked} looked @param {JobResult} answer */
function profilePanel(app, looked, answer) {
  const standing = {
    patches: answer.patches, combs: answer.patches.map((_, at) => combOf(looked.fields[at])), chosen: looked.patch,
    choose: (/** @type {number} */ patch) => choose(app, { patch }), bent: isSolvedBent(looked.document, answer, looked.patch), near: looked.near,
  };
  const parts = /** @type {const} */ ([[false, 'Whole head'], [true, 'Contact']]);
  return html`<section class="panel" aria-labelledby="h-profiles"><header class="bar"><h2 id="h-profiles">On the profiles</h2>
    <span class="hint">${standing.combs[0] ? `pressure ${standing.bent ? 'along the curve of the rail' : 'on the rail'}` : ''}</span>
    <div class="segs" role="group" aria-label="Part of the profiles">${parts.map(([near, label]) => html`<label class="seg">
      <input type="radio" name="near" .checked=${looked.near === near} @change=${() => choose(app, { near })}><span>${label}</span></label>`)}</div></header>
    <div class="figure">${drawProfiles(looked.placed, standing)}</div></section>`;
}

/** @type {{ patch: Patch, kind: string, friction: number, curve: ReturnType<typeof curveOf> } | null} */
let curveBefore = null;

/** @param {App} app @param {Looked} looked @param {Patch} patch */
function curvePanel(app, looked, patch) {
  const friction = frictionOf(looked);
  if (curveBefore?.patch !== patch || curveBefore.kind !== looked.curve) {
    curveBefore = { patch, kind: looked.curve, friction, curve: curveOf(patch, looked.curve, friction) };
  }
  const { curve } = curveBefore;
  if (!curve) return nothing;
  const pick = (/** @type {number} */ point) => choose(app, { point });
  const at = curve.order.indexOf(looked.point);
  const slide = (/** @type {Event} */ event) => pick(curve.order[Number(/** @type {HTMLInputElement} */ (event.target).value)]);
  const [what, unit = ''] = curve.xLabel.split(' / ');
  const rolled = isHistory(patch);
  const kinds = /** @type {const} */ ([['forces', 'Forces'], ['moment', 'Moment'], ...(rolled ? [/** @type {const} */ (['creepages', 'Creepages'])] : [])]);
  return html`<section class="panel" aria-labelledby="h-curve"><header class="bar"><h2 id="h-curve">${rolled ? 'While it rolls' : 'Creep curve'}</h2>
    <div class="segs" role="group" aria-label="Curve">${kinds.map(([kind, label]) => html`<label class="seg">
      <input type="radio" name="curve" .checked=${looked.curve === kind} @change=${() => choose(app, { curve: kind })}><span>${label}</span></label>`)}</div></header>
    <creep-curve .shown=${{ curve, chosen: looked.point, pick }}></creep-curve>
    <label class="slide"><span>Motion <output>${at + 1} of ${curve.order.length}: ${what} ${number(curve.x[at], 3)} ${unit.replace(/[()]/g, '')}</output></span>
      <input type="range" aria-label="Motion" min="0" max=${curve.order.length - 1} .value=${String(at)} @input=${slide}></label>
    <details class="as-table"><summary>As a table</summary><div class="scroll" tabindex="0" role="region" aria-label="Values of the curve"><table>
      <thead><tr><th scope="col">${curve.xLabel}</th>${curve.lines.map((line) => html`<th scope="col">${line.label} / ${line.unit}</th><th scope="col">±</th>`)}</tr></thead>
      <tbody>${curve.x.map((x, place) => html`<tr><td>${number(x)}</td>${curve.lines.map((line) => html`<td>${number(line.y[place])}</td><td>${number(line.error[place], 2)}</td>`)}</tr>`)}</tbody></table></div></details>
  </section>`;
}

/** @param {unknown} label @param {unknown} value */
const row = (label, value) => html`<div><dt>${label}</dt><dd>${value}</dd></div>`;

/** Panel with the total of patches without positions in a track. @param {JobResult} answer @param {number} point */
function totalPanel(answer, point) {
  const total = answer.total[point];
  if (!total) return nothing;
  const errors = total.error_estimate;
  const force = (/** @type {number} */ value, /** @type {number | undefined} */ error) => plusMinus(value / 1000, error && error / 1000);
  return html`<section class="panel" aria-labelledby="h-total"><header class="bar"><h2 id="h-total">All patches together</h2></header><dl class="table">
    ${row(html`F<sub>x</sub>`, `${force(total.force_x_n, errors?.force_x_n)} kN`)}${row(html`F<sub>y</sub>`, `${force(total.force_y_n, errors?.force_y_n)} kN`)}
    ${row(html`M<sub>z</sub>`, `${force(total.moment_z_n_mm, errors?.moment_z_n_mm)} N·m`)}</dl></section>`;
}

/** @param {JobResult} answer @param {Patch} patch @param {Point} point */
function factsPanel(answer, patch, point) {
  const { motion, solver, history } = point;
  const { position } = patch;
  return html`<details class="panel facts"><summary class="bar"><h2>How it was computed</h2></summary><dl class="table">
    ${row('creepage x, y', `${number(100 * (motion.creepage_x ?? 0))} %, ${number(100 * (motion.creepage_y ?? 0))} %`)}
    ${row('spin', `${number(1000 * (motion.spin_per_mm ?? 0))} 1/m`)}
    ${history ? row('rolled, dissipated since the start', `${number(history.distance_mm)} mm, ${number(history.dissipated_n_mm / 1000)} J`) : nothing}
    ${typeof history?.shift_x_mm === 'number' ? row('shifted in x, y', `${number(1000 * history.shift_x_mm)} μm, ${number(1000 * (history.shift_y_mm ?? 0))} μm`) : nothing}
    ${patch.semi_axes_mm ? row('semi-axes', `${patch.semi_axes_mm.map((axis) => number(axis)).join(' × ')} mm`) : nothing}
    ${typeof patch.approach_mm === 'number' ? row('penetration', `${number(1000 * patch.approach_mm)} μm`) : nothing}
    ${position ? row('contact angle, rolling radius', `${degrees(position.contact_angle_rad)}, ${number(position.rolling_radius_mm)} mm`) : nothing}
    ${typeof point.traction_max_mpa === 'number' ? row('largest traction', `${number(point.traction_max_mpa)} MPa`) : nothing}
    ${row('method', `${solver.method.replaceAll('_', ' ')}${solver.mesh ? `, ${solver.mesh.strips} × ${solver.mesh.cells} cells` : ''}`)}
    ${typeof solver.iterations === 'number' ? row('iterations', `${solver.iterations}, residual ${number(solver.residual, 2)}`) : nothing}
    ${row('time', `${seconds(solver.seconds)}${answer.cached ? ' (solved before)' : ''}`)}
    ${row('target', point.target_met === true ? 'met' : point.target_met === false ? 'not met' : 'none')}
    ${row('version', answer.solver_version)}</dl></details>`;
}

