// The form: fields for the common parts of a case, in engineers' units. Whatever it does not show stays in the JSON untouched.

import { html, nothing } from '../vendor/lit-html.js';
import { at, isObject, numberAt } from './document.js';
import { change, editDocument } from './editing.js';
import { contactFields } from './contactform.js';
import { ALL_OUTPUTS, hasSections, withContact, withoutNameOf } from './starts.js';
import { faultAt, field } from './field.js';
import { FIRST_HISTORY, historyFields } from './historyform.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */

const CONTACTS = [
  ['radii', 'Radii'], ['ellipse', 'Ellipse'], ['profiles', 'Profiles'], ['wheelset', 'Wheelset'], ['gap_profile', 'Gap curve'],
  ['gap_grid', 'Gap grid'], ['pressure_grid', 'Pressure grid'],
];
const COMPONENTS = /** @type {const} */ ([
  { key: 'creepage_x', label: 'Creepage along', unit: '%', factor: 0.01 },
  { key: 'creepage_y', label: 'across', unit: '%', factor: 0.01 },
  { key: 'spin_per_mm', label: 'Spin', unit: '1/m', factor: 0.001 },
]);

/** Another kind of contact. @param {App} app @param {string} kind */
function chooseContact(app, kind) {
  const { document, example, examples } = app.store.get().compose;
  const known = /** @type {JsonObject | undefined} */ (/** @type {unknown} */ (examples.find(({ name }) => name === example)?.case));
  app.compose({ example: '' });
  editDocument(app, withContact(withoutNameOf(document ?? {}, known), kind));
}

/** @param {App} app */
export function caseForm(app) {
  const document = app.store.get().compose.document ?? {};
  const type = String(at(document, '/contact/type') ?? '');
  const fault = faultAt(app, '/contact/type');
  return html`
    <fieldset><legend>Contact</legend>
      <div class="segs" role="group" aria-label="Kind of contact">${CONTACTS.map(([kind, label]) => html`<label class="seg">
        <input type="radio" name="contact" .checked=${kind === type} @change=${() => chooseContact(app, kind)}>
        <span>${label}</span></label>`)}</div>
      ${contactFields(app, type)}
      ${fault ? html`<p class="fault">${fault.detail}</p>` : nothing}
    </fieldset>
    <fieldset><legend>Load and friction</legend><div class="pair">${loadField(app, type)}${field(app, '/friction/coefficient', 'Friction coefficient', 'μ')}</div></fieldset>
    <fieldset><legend>Motion</legend>${motionFields(app, type)}</fieldset>
    <fieldset><legend>Material</legend><div class="pair">
      ${at(document, '/material/young_modulus_mpa') === undefined
        ? field(app, '/material/shear_modulus_mpa', 'Shear modulus', 'GPa', { factor: 1000 })
        : field(app, '/material/young_modulus_mpa', "Young's modulus", 'GPa', { factor: 1000 })}
      ${field(app, '/material/poisson_ratio', "Poisson's ratio", 'ν')}</div></fieldset>
    <fieldset><legend>Answer</legend>${answerFields(app, document)}</fieldset>`;
}

/** @param {App} app @param {string} type */
function loadField(app, type) {
  const document = app.store.get().compose.document ?? {};
  if (type === 'pressure_grid') return html`<p class="hint">The load is that of the given pressure.</p>`;
  if (at(document, '/load/approach_mm') !== undefined) return field(app, '/load/approach_mm', 'Approach', 'μm', { factor: 0.001 });
  const vertical = at(document, '/load/vertical_force_n') !== undefined || (hasSections(type) && at(document, '/load/normal_force_n') === undefined);
  return vertical
    ? field(app, '/load/vertical_force_n', 'Vertical force', 'kN', { factor: 1000 })
    : field(app, '/load/normal_force_n', 'Normal force', 'kN', { factor: 1000 });
}

/** @param {App} app @param {string} type */
function motionFields(app, type) {
  const { motion } = app.store.get().compose.document ?? {};
  const kind = Array.isArray(motion) ? 'list' : isObject(motion) && 'sweep' in motion ? 'sweep' : isObject(motion) && 'wheelset' in motion ? 'wheelset' : isObject(motion) && 'history' in motion ? 'history' : 'one';
  const kinds = [...(hasSections(type) ? [['wheelset', 'Wheelset']] : []), ['one', 'Creepages'], ['sweep', 'Creep curve'], ...(type === 'wheelset' ? [] : [['history', 'While it rolls']])];
  return html`
    <div class="segs" role="group" aria-label="Kind of motion">${kinds.map(([key, label]) => html`<label class="seg">
      <input type="radio" name="motion" .checked=${key === kind} @change=${() => change(app, '/motion', startMotion(key, motion))}><span>${label}</span></label>`)}</div>
    ${kind === 'list' ? html`<p class="hint">${/** @type {JsonValue[]} */ (motion).length} motions on the same patch; change them in the JSON.</p>` : nothing}
    ${kind === 'history' ? historyFields(app, type) : nothing}
    ${kind === 'one' ? html`<div class="triple">${COMPONENTS.map(({ key, label, unit, factor }) => field(app, `/motion/${key}`, label, unit, { factor }))}</div>` : nothing}
    ${kind === 'wheelset' ? html`<div class="pair">
      ${field(app, '/motion/wheelset/speed_mm_per_s', 'Speed', 'km/h', { factor: 1e6 / 3600 })}
      ${turningField(app)}
      ${acrossField(app)}</div>` : nothing}
    ${kind === 'sweep' && isObject(motion) && isObject(motion.sweep) ? sweepFields(app, motion.sweep) : nothing}`;
}

/** How the wheelset turns, in the form that the case has. @param {App} app */
function turningField(app) {
  const given = (/** @type {string} */ member) => at(app.store.get().compose.document ?? {}, `/motion/wheelset/${member}`) !== undefined;
  if (given('drive_torque_n_mm')) return field(app, '/motion/wheelset/drive_torque_n_mm', 'Torque of the drive', 'N·m', { factor: 1000 });
  if (given('angular_velocity_rad_per_s')) return field(app, '/motion/wheelset/angular_velocity_rad_per_s', 'Angular velocity', 'rad/s');
  return field(app, '/motion/wheelset/free_rolling_radius_mm', 'Free rolling radius', 'mm');
}

/** How it moves across the track, in the form that the case has. @param {App} app */
function acrossField(app) {
  const forced = at(app.store.get().compose.document ?? {}, '/motion/wheelset/force_y_n') !== undefined;
  return forced
    ? field(app, '/motion/wheelset/force_y_n', 'Force across', 'kN', { factor: 1000 })
    : field(app, '/motion/wheelset/lateral_velocity_mm_per_s', 'Lateral velocity', 'mm/s');
}

/** @param {App} app @param {JsonObject} sweep */
function sweepFields(app, sweep) {
  return Object.entries(sweep).map(([key, range]) => {
    const component = COMPONENTS.find((known) => known.key === key);
    if (!component || !isObject(range) || 'values' in range) return html`<p class="hint">${key} = ${JSON.stringify(range)}</p>`;
    const { label, unit, factor } = component;
    return html`<div class="triple">
      ${field(app, `/motion/sweep/${key}/from`, `${label} from`, unit, { factor })}
      ${field(app, `/motion/sweep/${key}/to`, 'to', unit, { factor })}
      ${field(app, `/motion/sweep/${key}/points`, 'Points', '')}</div>`;
  });
}

/**
 * @param {string} kind
 * @param {JsonValue | undefined} before
 * @returns {JsonObject}
 */
function startMotion(kind, before) {
  if (kind === 'wheelset') return { wheelset: { speed_mm_per_s: 20000, free_rolling_radius_mm: 460 } };
  if (kind === 'history') return FIRST_HISTORY;
  if (kind === 'sweep') return { sweep: { creepage_x: { from: 0, to: 0.006, points: 13 } } };
  const first = Array.isArray(before) ? before[0] : before;
  const alone = isObject(first) && !('sweep' in first) && !('wheelset' in first) && !('history' in first);
  return alone ? first : { creepage_x: 0.001, creepage_y: 0, spin_per_mm: 0 };
}

/** @param {App} app @param {JsonObject} document */
function answerFields(app, document) {
  const outputs = Array.isArray(document.outputs) ? document.outputs.map(String) : ['resultants', 'zones'];
  const mesh = isObject(at(document, '/solver/mesh'));
  const toggle = (/** @type {string} */ output, /** @type {boolean} */ on) =>
    change(app, '/outputs', on ? [...outputs, output] : outputs.filter((name) => name !== output));
  return html`
    <div class="checks" role="group" aria-label="Fields of the answer">${ALL_OUTPUTS.slice(1).map((output) => html`<label>
      <input type="checkbox" .checked=${outputs.includes(output)}
        @change=${(/** @type {Event} */ event) => toggle(output, /** @type {HTMLInputElement} */ (event.target).checked)}> ${output}</label>`)}</div>
    <div class="pair">
      ${mesh ? field(app, '/solver/mesh/strips', 'Strips', '') : field(app, '/solver/target_error', 'Target error', '% of μN', { factor: 0.01, empty: '0.5' })}
      ${mesh ? field(app, '/solver/mesh/cells', 'Cells of a strip', '') : field(app, '/name', 'Name', '', { text: true })}
    </div>
    ${Number.isFinite(numberAt(document, '/solver/time_limit_s')) ? field(app, '/solver/time_limit_s', 'Time limit', 's') : nothing}`;
}
