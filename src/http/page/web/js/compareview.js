// The view Compare: maps with a common scale and crosshair, the difference of two jobs, their numbers with errors, and the differences of their cases.

import { html, nothing } from '../vendor/lit-html.js';
import { chooseCompared, chooseSide, common, compared, equal, frictionOf, knownDifference, rangeOfAll, shapeOf, wearOf } from './compare.js';
import { drawChart, drawShapes } from './drawing/axes.js';
import { differences } from './document.js';
import { quantityOf } from './field/quantities.js';
import { FieldMap } from './fieldmap.js';
import { fixed, number, plusMinus } from './format.js';
import { formatRoute } from './routes.js';
import { isSolvedBent } from './starts.js';
import { wheelLoads } from './wheelloads.js';
import { valueInWords, wordsOf } from './words.js';
import { inWords } from './remarks.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./compare.js').Side} Side */
/** @typedef {import('./compare.js').Comparison} Comparison */
/** @typedef {import('./api.js').Point} Point */
/** @typedef {import('./fieldmap.js').CrosshairEvent} CrosshairEvent */

const LETTERS = 'ABCD';
const DIFFERENCES_MAX = 30;
/** @type {readonly [unknown, keyof Point, string, number][]} Results of the chosen patch and motion: label, member, unit, and divisor to that unit. */
const NUMBERS = [
  [html`F<sub>x</sub>`, 'force_x_n', 'kN', 1000], [html`F<sub>y</sub>`, 'force_y_n', 'kN', 1000], [html`M<sub>z</sub>`, 'moment_z_n_mm', 'N·m', 1000],
  ['stick area', 'stick_area_mm2', 'mm²', 1], ['largest traction', 'traction_max_mpa', 'MPa', 1], ['friction power', 'friction_power_n', 'J/m', 1],
];

/** Results of the wheel over all its patches: label, unit, value, and error. @type {readonly [string, string, (side: Side) => number | undefined, ((side: Side) => number | undefined)?][]} */
const OF_WHEEL = [
  ['patches', '', ({ result }) => result.patches.length],
  ['Q', 'kN', (side) => loadOf(side, ({ q_n }) => q_n / 1000)],
  ['Y, outward', 'kN', (side) => loadOf(side, ({ y_n }) => y_n / 1000), (side) => loadOf(side, ({ y_error_n = 0 }) => y_error_n / 1000)],
  ['Y/Q', '', (side) => loadOf(side, ({ y_n, q_n }) => y_n / q_n), (side) => loadOf(side, ({ y_error_n = 0, q_n }) => y_error_n / q_n)],
  ['largest pressure', 'MPa', (side) => strongest(side).pressure_max_mpa, (side) => openPressure(strongest(side), side.point)],
  ['area', 'mm²', ({ result }) => total(result.patches.map((patch) => patch.area_mm2))],
  ['Tγ', 'J/m', ({ result, point }) => total(result.patches.map(({ points }) => points[Math.min(point, points.length - 1)].friction_power_n))],
  ['wear depth, Tγ/A law, largest mean', 'nm', (side) => damageOf(side, ({ usfd_wear }) => usfd_wear?.depth_nm.value)],
  ['RCF damage, WLRM', '10⁻⁶', (side) => damageOf(side, ({ wlrm }) => wlrm && wlrm.damage_per_pass.value * 1e6)],
  ['load over shakedown limit', '', (side) => damageOf(side, ({ shakedown }) => shakedown?.over_limit.value)],
];

/** @param {Side} side */
const strongest = ({ result }) => result.patches.reduce((most, patch) => (patch.pressure_max_mpa > most.pressure_max_mpa ? patch : most));

/** Returns the uncertainty of the largest pressure due to the profiles. @param {import('./api.js').Patch} patch @param {number} point */
const openPressure = ({ points }, point) => points[Math.min(point, points.length - 1)].profile_uncertainty?.pressure_max_mpa;

/** @param {readonly number[]} values */
const total = (values) => values.reduce((sum, value) => sum + value, 0);

/** Returns a component of the load if the case has a single wheel. @param {Side} side @param {(of: import('./wheelloads.js').WheelLoad) => number} pick */
function loadOf({ result, document, point }, pick) {
  const [load] = result.wheelset ? [] : wheelLoads(result, document, point);
  return load && pick(load);
}

/** Returns the largest value of a damage quantity over the patches. @param {Side} side @param {(of: import('./api.js').Schemas['DamageAnswer']) => number | undefined} pick */
function damageOf({ result, point }, pick) {
  const values = result.patches.flatMap(({ points }) => {
    const { damage } = points[Math.min(point, points.length - 1)];
    const value = damage ? pick(damage) : undefined;
    return value === undefined ? [] : [value];
  });
  return values.length ? Math.max(...values) : undefined;
}

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
    ${profilesPanel(app, of)}
    <div class="two" @crosshair=${together}>${of.sides.map((side, place) => sidePanel(app, of, side, place))}${differencePanel(app, of)}</div>
    <div class="two">${numbersPanel(of)}${casesPanel(of)}</div>
  </div>`;
}

/** Moves the crosshairs of all other maps with that of one map. @param {CrosshairEvent} event */
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
    field: side.field, quantity, range: rangeOfAll(of, quantity), friction: frictionOf(side), border: true, arrows: true, tallest: 320, bent: isBentSide(side),
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

/** @param {Side} side */
const isBentSide = ({ document, result, patch }) => isSolvedBent(document, result, patch);

/** @param {App} app @param {Comparison} of */
function differencePanel(app, of) {
  const [one] = of.sides;
  const two = of.sides[of.other];
  const known = two && knownDifference(one, two, of.quantity, of.sameRail);
  if (!known) return nothing;
  const placed = [one, two].every(({ result, patch }) => result.patches[patch].position);
  const same = (/** @type {Event} */ event) => chooseCompared(app, { sameRail: /** @type {HTMLSelectElement} */ (event.target).value === 'rail' });
  const letter = LETTERS[of.other];
  const shown = { field: known.field, quantity: known.quantity, tallest: 320, bent: isBentSide(one), name: `${letter} − A` };
  return html`<section class="panel" aria-label="Difference"><header class="bar"><h2>${letter} − A</h2>
      ${of.sides.length > 2 ? html`<div class="segs" role="group" aria-label="Compared with A">${of.sides.slice(1).map((_, place) => html`<label class="seg">
        <input type="radio" name="other" .checked=${of.other === place + 1} @change=${() => chooseCompared(app, { other: place + 1 })}><span>${LETTERS[place + 1]}</span></label>`)}</div>` : nothing}
      ${placed ? html`<label class="inline">at the same place <select class="slim" @change=${same}>
        <option value="rail" ?selected=${of.sameRail}>on the rail</option><option value="patch" ?selected=${!of.sameRail}>in the patch</option></select></label>` : nothing}</header>
    <field-map .shown=${shown}></field-map></section>`;
}

/** @param {Side} side @returns {Point} */
const pointOf = ({ result, patch, point }) => result.patches[patch].points[point];

/** @param {Point} point @param {string} name */
function errorOf({ error_estimate: errors }, name) {
  const value = /** @type {Record<string, unknown> | undefined | null} */ (errors)?.[name];
  return typeof value === 'number' ? value : 0;
}

/** Describes the difference of two values relative to its error. @param {number} difference @param {number} error */
export function apart(difference, error) {
  if (!error) return '';
  const times = Math.abs(difference) / error;
  return times <= 1 ? 'within the errors' : `${number(times, 2)} × the error`;
}

/** @param {Comparison} of */
function numbersPanel({ sides, other }) {
  const points = sides.map(pointOf);
  const letter = LETTERS[other];
  const line = (/** @type {unknown} */ label, /** @type {string} */ unit, /** @type {readonly (number | undefined)[]} */ values, /** @type {readonly (number | undefined)[]} */ errors = []) => {
    const [one, two] = [values[0], values[other]];
    if (one === undefined || two === undefined || !Number.isFinite(one) || !Number.isFinite(two)) return nothing;
    const error = Math.hypot(errors[0] ?? 0, errors[other] ?? 0);
    return html`<tr><th scope="row">${label}${unit ? ` / ${unit}` : ''}</th>${values.map((value, at) => html`<td>${Number.isInteger(value) ? value : plusMinus(value ?? NaN, errors[at])}</td>`)}
      <td>${number(two - one, 3)}</td><td class="quiet">${apart(two - one, error)}</td></tr>`;
  };
  return html`<section class="panel" aria-labelledby="h-numbers"><header class="bar"><h2 id="h-numbers">Numbers</h2></header><div class="scroll" tabindex="0" role="region" aria-labelledby="h-numbers">
    <table><thead><tr><th></th>${points.map((_, place) => html`<th scope="col">${LETTERS[place]}</th>`)}<th scope="col">${letter} − A</th><th></th></tr></thead>
    <tbody><tr><th scope="rowgroup" colspan=${sides.length + 3}>All patches</th></tr>
      ${OF_WHEEL.map(([label, unit, value, error]) => line(label, unit, sides.map(value), error && sides.map(error)))}
      <tr><th scope="rowgroup" colspan=${sides.length + 3}>The patch and motion above</th></tr>
      ${line('N', 'kN', sides.map(({ result, patch }) => result.patches[patch].normal_force_n / 1000))}
      ${line('largest pressure', 'MPa', sides.map(({ result, patch }) => result.patches[patch].pressure_max_mpa),
        sides.map(({ result, patch, point }) => openPressure(result.patches[patch], point)))}
      ${NUMBERS.map(([label, name, unit, factor]) => line(label, unit, points.map((point) => (typeof point[name] === 'number' ? point[name] / factor : undefined)),
        points.map((point) => errorOf(point, name) / factor)))}</tbody></table></div></section>`;
}

/** Draws the cross-sections over each other and the material that one lacks compared with the other. @param {App} app @param {Comparison} of */
function profilesPanel(app, of) {
  const wear = wearOf(of);
  const [one, two] = [of.sides[0], of.sides[of.other]];
  if (!wear || !one.sections) return nothing;
  const letter = LETTERS[of.other];
  const align = (/** @type {Event} */ event) => chooseCompared(app, { fitted: /** @type {HTMLSelectElement} */ (event.target).value === 'fit' });
  const shapes = [
    { label: `A: ${one.job.name || one.id}`, look: 'one', points: shapeOf(one, one.sections, of.body) },
    { label: `${letter}: ${two.job.name || two.id}`, look: 'two', points: wear.moved },
  ];
  const most = wear.most && wear.most.depth > 1e-3 ? wear.most : null;
  const lengths = wear.curve.map(([length]) => length);
  return html`<section class="panel" aria-labelledby="h-overlay"><header class="bar"><h2 id="h-overlay">Profiles</h2>
      <div class="segs" role="group" aria-label="Cross-section">${/** @type {const} */ (['rail', 'wheel']).map((body) => html`<label class="seg">
        <input type="radio" name="body" .checked=${of.body === body} @change=${() => chooseCompared(app, { body })}><span>${body}</span></label>`)}</div>
      <label class="inline">aligned <select class="slim" @change=${align}><option value="place" ?selected=${!of.fitted}>${of.body === 'rail' ? 'at gauge and top' : 'at flange back and running circle'}</option>
        <option value="fit" ?selected=${of.fitted}>${of.body === 'rail' ? 'by the field side' : 'by the flange back'}</option></select></label></header>
    <div class="cards"><div class="card">${drawShapes({
      name: `Cross-section of the ${of.body} of ${letter} over that of A`, shapes, mark: most && { at: most.at, label: `${fixed(most.depth, 2)} mm` },
    })}</div>
    <div class="card">${equal(one, two, of.body) ? html`<p class="quiet">Both cases have the same ${of.body}.</p>` : html`${drawChart({
      name: `Material missing on the ${of.body} of ${letter}, compared with A`, lines: [{ label: `A − ${letter}`, look: 'one', points: wear.curve }],
      x: `along the ${of.body} of A / mm`, y: 'wear, along the normal / mm', xRange: [Math.min(...lengths), Math.max(...lengths)],
    })}<p>Worn area <b>${fixed(wear.area, 1)} mm²</b>${most ? html`, at most <b>${fixed(most.depth, 2)} mm</b> deep` : nothing}${wear.added > 0.05 ? `; ${letter} has ${fixed(wear.added, 1)} mm² more elsewhere` : ''}.</p>`}</div></div></section>`;
}

/** @param {Comparison} of */
function casesPanel({ sides }) {
  const places = sides.slice(1).flatMap((side) => differences(sides[0].document, side.document)).map((pointer) => wordsOf(pointer).pointer);
  const pointers = [...new Set(places)];
  return html`<section class="panel" aria-labelledby="h-cases"><header class="bar"><h2 id="h-cases">What differs in the cases</h2></header><div class="scroll" tabindex="0" role="region" aria-labelledby="h-cases">
    <table><thead><tr><th></th>${sides.map((_, place) => html`<th scope="col">${LETTERS[place]}</th>`)}</tr></thead>
    <tbody>${pointers.slice(0, DIFFERENCES_MAX).map((pointer) => html`<tr><th scope="row">${inWords(pointer)}</th>${sides.map((side) => html`<td>${valueInWords(side.document, pointer)}</td>`)}</tr>`)}
      ${pointers.length ? nothing : html`<tr><td colspan=${sides.length + 1} class="quiet">Nothing.</td></tr>`}</tbody></table></div>
    ${pointers.length > DIFFERENCES_MAX ? html`<p class="pad quiet">and ${pointers.length - DIFFERENCES_MAX} more</p>` : nothing}</section>`;
}
