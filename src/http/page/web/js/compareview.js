// Compare: maps at one scale with one crosshair, the difference of two, their numbers against the errors, and what differs in the cases.

import { html, nothing } from '../vendor/lit-html.js';
import { chooseCompared, chooseSide, common, compared, frictionOf, knownDifference, rangeOfAll } from './compare.js';
import { at, differences } from './document.js';
import { quantityOf } from './field/quantities.js';
import { FieldMap } from './fieldmap.js';
import { number } from './format.js';
import { formatRoute } from './routes.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./compare.js').Side} Side */
/** @typedef {import('./compare.js').Comparison} Comparison */
/** @typedef {import('./api.js').Point} Point */
/** @typedef {import('./fieldmap.js').CrosshairEvent} CrosshairEvent */

const LETTERS = 'ABCD';
const DIFFERENCES_MAX = 30;
const NUMBERS = /** @type {const} */ ([
  ['F x along', 'force_x_n', 'N'], ['F y across', 'force_y_n', 'N'], ['M z', 'moment_z_n_mm', 'N·mm'],
  ['stick area', 'stick_area_mm2', 'mm²'], ['largest traction', 'traction_max_mpa', 'MPa'], ['friction power', 'friction_power_n', 'J/m'],
]);

/** @param {App} app */
export function compareView(app) {
  const of = compared();
  if (!of || of.key === '') {
    return html`<section class="panel wait"><h1>Compare</h1><p>Tick two to four jobs in the list to see them side by side.</p>
      <a class="button primary" href="#/jobs">To the jobs</a></section>`;
  }
  if (!of.sides.length) return html`<p class="pad quiet">Loading …</p>`;
  const all = common(of);
  return html`<div class="comparison">
    <header class="jobhead"><h1>Compare</h1>
      <div class="segs" role="group" aria-label="Quantity">${all.map(({ key, label }) => html`<label class="seg">
        <input type="radio" name="quantity" .checked=${of.quantity === key} @change=${() => chooseCompared(app, { quantity: key })}><span>${label}</span></label>`)}</div>
    </header>
    <div class="two" @crosshair=${together}>${of.sides.map((side, place) => sidePanel(app, of, side, place))}${differencePanel(app, of)}</div>
    <div class="two">${numbersPanel(of)}${casesPanel(of)}</div>
  </div>`;
}

/** The crosshair of one map moves that of the others. @param {CrosshairEvent} event */
function together(event) {
  const { currentTarget, target, detail } = event;
  for (const map of /** @type {HTMLElement} */ (currentTarget).querySelectorAll('field-map')) {
    if (map !== target && map instanceof FieldMap) map.follow(detail);
  }
}

/** @param {App} app @param {Comparison} of @param {Side} side @param {number} place */
function sidePanel(app, of, side, place) {
  const quantity = quantityOf(of.quantity);
  const shown = side.field && quantity ? {
    field: side.field, quantity, range: rangeOfAll(of, quantity), friction: frictionOf(side), border: true, arrows: true, tallest: 320,
    name: `${quantity.heading} of ${LETTERS[place]}`,
  } : null;
  const { patches } = side.result;
  const { points } = patches[side.patch];
  const pick = (/** @type {'patch' | 'point'} */ what) => (/** @type {Event} */ event) =>
    chooseSide(app, side, { [what]: Number(/** @type {HTMLSelectElement} */ (event.target).value) });
  const options = (/** @type {number} */ length, /** @type {number} */ chosen, /** @type {(at: number) => string} */ label) =>
    Array.from({ length }, (_, option) => html`<option value=${option} ?selected=${option === chosen}>${label(option)}</option>`);
  return html`<section class="panel" aria-label=${`Job ${LETTERS[place]}`}><header class="bar">
      <h2>${LETTERS[place]} · <a href=${formatRoute('result', [side.id], { patch: side.patch, point: side.point })}>${side.job.name || side.id}</a></h2>
      ${patches.length > 1 ? html`<label class="inline">Patch <select @change=${pick('patch')}>${options(patches.length, side.patch, String)}</select></label>` : nothing}
      ${points.length > 1 ? html`<label class="inline">Motion <select @change=${pick('point')}>${options(points.length, side.point, (option) => String(option + 1))}</select></label>` : nothing}
    </header>
    ${shown ? html`<field-map .shown=${shown}></field-map>` : html`<p class="pad quiet">No field that all of them have.</p>`}</section>`;
}

/** @param {App} app @param {Comparison} of */
function differencePanel(app, of) {
  const [one] = of.sides;
  const two = of.sides[of.other];
  const known = one.field && two?.field ? knownDifference(one.field, two.field, of.quantity) : null;
  if (!known) return nothing;
  const letter = LETTERS[of.other];
  const shown = { field: known.field, quantity: known.quantity, tallest: 320, name: `${letter} − A` };
  return html`<section class="panel" aria-label="Difference"><header class="bar"><h2>${letter} − A</h2>
      ${of.sides.length > 2 ? html`<div class="segs" role="group" aria-label="Compared with A">${of.sides.slice(1).map((_, place) => html`<label class="seg">
        <input type="radio" name="other" .checked=${of.other === place + 1} @change=${() => chooseCompared(app, { other: place + 1 })}><span>${LETTERS[place + 1]}</span></label>`)}</div>` : nothing}
      <span class="hint">${letter} at the cells of A</span></header>
    <field-map .shown=${shown}></field-map></section>`;
}

/** @param {Side} side @returns {Point} */
const pointOf = ({ result, patch, point }) => result.patches[patch].points[point];

/** @param {Point} point @param {string} name */
function errorOf({ error_estimate: errors }, name) {
  const value = /** @type {Record<string, unknown> | undefined | null} */ (errors)?.[name];
  return typeof value === 'number' ? value : 0;
}

/** How far apart two values are, in errors. @param {number} difference @param {number} error */
export function apart(difference, error) {
  if (!error) return '';
  const times = Math.abs(difference) / error;
  return times <= 1 ? 'within the errors' : `${number(times, 2)} × the error`;
}

/** @param {Comparison} of */
function numbersPanel({ sides, other }) {
  const points = sides.map(pointOf);
  const letter = LETTERS[other];
  return html`<section class="panel" aria-labelledby="h-numbers"><header class="bar"><h2 id="h-numbers">Numbers</h2></header><div class="scroll" tabindex="0" role="region" aria-labelledby="h-numbers">
    <table><thead><tr><th></th>${points.map((_, place) => html`<th scope="col">${LETTERS[place]}</th>`)}<th scope="col">${letter} − A</th><th></th></tr></thead>
    <tbody>${NUMBERS.map(([label, name, unit]) => {
      const values = points.map((point) => point[name]);
      const [one, two] = [values[0], values[other]];
      if (typeof one !== 'number' || typeof two !== 'number') return nothing;
      const error = Math.hypot(errorOf(points[0], name), errorOf(points[other], name));
      return html`<tr><th scope="row">${label} / ${unit}</th>${values.map((value) => html`<td>${number(value, 5)}</td>`)}
        <td>${number(two - one, 3)}</td><td class="quiet">${apart(two - one, error)}</td></tr>`;
    })}</tbody></table></div></section>`;
}

/** @param {Comparison} of */
function casesPanel({ sides }) {
  const pointers = [...new Set(sides.slice(1).flatMap((side) => differences(sides[0].document, side.document)))];
  const text = (/** @type {Side} */ side, /** @type {string} */ pointer) => {
    const value = JSON.stringify(at(side.document, pointer)) ?? '–';
    return value.length > 40 ? `${value.slice(0, 39)}…` : value;
  };
  return html`<section class="panel" aria-labelledby="h-cases"><header class="bar"><h2 id="h-cases">What differs in the cases</h2></header><div class="scroll" tabindex="0" role="region" aria-labelledby="h-cases">
    <table><thead><tr><th></th>${sides.map((_, place) => html`<th scope="col">${LETTERS[place]}</th>`)}</tr></thead>
    <tbody>${pointers.slice(0, DIFFERENCES_MAX).map((pointer) => html`<tr><th scope="row"><code>${pointer}</code></th>${sides.map((side) => html`<td>${text(side, pointer)}</td>`)}</tr>`)}
      ${pointers.length ? nothing : html`<tr><td colspan=${sides.length + 1} class="quiet">Nothing.</td></tr>`}</tbody></table></div>
    ${pointers.length > DIFFERENCES_MAX ? html`<p class="pad quiet">and ${pointers.length - DIFFERENCES_MAX} more</p>` : nothing}</section>`;
}
