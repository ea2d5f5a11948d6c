// Form fields of transient rolling: distances rolled and the motion at each of them.

import { html } from '../vendor/lit-html.js';
import { at } from './document.js';
import { change } from './editing.js';
import { faultAt, field } from './field.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./document.js').JsonObject} JsonObject */

const STARTS = [['rest', 'Rest'], ['steady', 'Steady rolling'], ['pressed', 'Pressed together']];
const COURSES = /** @type {const} */ ([
  { key: 'creepage_x', label: 'Creepage x', unit: '%', factor: 0.01 },
  { key: 'creepage_y', label: 'Creepage y', unit: '%', factor: 0.01 },
  { key: 'force_x_n', label: 'or force Fx', unit: 'kN', factor: 1000 },
  { key: 'force_y_n', label: 'or force Fy', unit: 'kN', factor: 1000 },
  { key: 'shift_x_mm', label: 'Shift x', unit: 'μm', factor: 0.001 },
  { key: 'shift_y_mm', label: 'Shift y', unit: 'μm', factor: 0.001 },
]);

/** Initial history: a step of creepage. */
export const FIRST_HISTORY = /** @type {JsonObject} */ ({ history: { distance_mm: [0.5, 1, 2, 3, 5, 8, 12, 20], creepage_x: 0.001 }, start: 'rest' });

/** @param {App} app @param {string} type Type of the contact. Forces and the start `pressed` are not available for profiles, whose patches share creepages and do not grow self-similarly. */
export function historyFields(app, type) {
  const wheel = type === 'profiles';
  const courses = COURSES.filter(({ key }) => !wheel || !key.startsWith('force'));
  const starts = STARTS.filter(([key]) => !wheel || key !== 'pressed');
  const start = String(at(app.store.get().compose.document ?? {}, '/motion/start') ?? 'rest');
  const fault = faultAt(app, '/motion/start');
  return html`
    ${field(app, '/motion/history/distance_mm', 'Distances rolled', 'mm', { list: true, hint: 'One answer for each. Below, a number for all of them or one each.' })}
    <div class="pair">${courses.map(({ key, label, unit, factor }) => field(app, `/motion/history/${key}`, label, unit, { factor, list: true, empty: 'none' }))}
      ${field(app, '/motion/history/spin_per_mm', 'Spin', '1/m', { factor: 0.001, list: true, empty: 'none' })}
      ${field(app, '/motion/history/speed_mm_per_s', 'Speed', 'km/h', { factor: 1e6 / 3600, empty: 'none' })}</div>
    <div class="segs" role="group" aria-label="Start of the history">${starts.map(([key, label]) => html`<label class="seg">
      <input type="radio" name="start" .checked=${key === start} @change=${() => change(app, '/motion/start', key)}><span>${label}</span></label>`)}</div>
    ${fault ? html`<p class="fault">${fault.detail}</p>` : ''}`;
}
