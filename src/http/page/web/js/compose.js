// Compose: form, JSON and curl line of one and the same case, its drawing, and what the service says of it.

import { html, nothing } from '../vendor/lit-html.js';
import { apiKey } from './api.js';
import { at, placeInText } from './document.js';
import { drawEllipse } from './drawing/patch.js';
import { drawGapCurve, drawGrid } from './drawing/gaps.js';
import { drawGap, drawProfiles } from './drawing/profiles.js';
import { editText, openExample, queue, solve, solveLive } from './editing.js';
import { offered, rangeOf } from './field/quantities.js';
import { fieldId } from './field.js';
import { caseForm } from './form.js';
import { count, number, seconds, withError } from './format.js';
import { placed } from './placing.js';
import { lacksSection } from './starts.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./state.js').Compose} Compose */
/** @typedef {import('./api.js').CheckedCase} CheckedCase */
/** @typedef {import('./document.js').JsonObject} JsonObject */

/** @param {App} app */
export function compose(app) {
  const state = app.store.get().compose;
  const busy = state.solving || state.unreadable !== '' || !state.document;
  return html`<h1 class="visually-hidden">Compose a case</h1>
    <div class="compose">
      <section class="panel form" aria-labelledby="h-form">
        <header class="bar"><h2 id="h-form">Case</h2>${examplePicker(app)}</header>
        <div class="scroll">${caseForm(app)}</div>
      </section>
      <section class="panel stage" aria-labelledby="h-drawing">
        <header class="bar"><h2 id="h-drawing">${String(state.document?.name ?? 'Drawing')}</h2></header>
        <div class="figure">${state.document ? drawing(state, state.document) : nothing}</div>
        <div class="verdict" role="status">${verdict(state)}</div>
        ${previewOf(state)}
        <div class="actions">
          <button class="primary" ?disabled=${busy} @click=${() => solve(app)}>${state.solving ? 'Solving …' : 'Solve'}<kbd>Ctrl ↵</kbd></button>
          <button ?disabled=${busy} @click=${() => queue(app)}>Queue</button>
          <label class="live"><input type="checkbox" .checked=${state.live}
            @change=${(/** @type {Event} */ event) => solveLive(app, /** @type {HTMLInputElement} */ (event.target).checked)}> result while typing</label>
        </div>
      </section>
      ${codePanel(app, state)}
    </div>`;
}

/** @param {App} app */
function examplePicker(app) {
  const { example, examples } = app.store.get().compose;
  const open = (/** @type {Event} */ event) => openExample(app, /** @type {HTMLSelectElement} */ (event.target).value);
  return html`<label class="inline">Example <select @change=${open}>
    ${example ? nothing : html`<option value="" selected>–</option>`}
    ${examples.map(({ name, summary }) => html`<option value=${name} ?selected=${example === name}>${summary}</option>`)}</select></label>`;
}

/** @type {{ of: unknown, drawn: ReturnType<typeof placed> } | null} */
let placedBefore = null;

/** What the case is about: what the service understood of it, or the numbers that it brings. @param {Compose} state @param {JsonObject} document */
function drawing({ understood }, document) {
  const type = at(document, '/contact/type');
  const known = understood && understood.type === type ? understood.of : null;
  switch (type) {
    case 'radii':
    case 'ellipse':
      return drawEllipse(document, known?.patches[0]);
    case 'profiles': {
      const before = placedBefore?.of === known ? placedBefore : { of: known, drawn: placed(known?.placement) };
      placedBefore = before;
      return html`<div class="stack">${drawProfiles(before.drawn)}${drawGap(before.drawn)}</div>`;
    }
    case 'gap_profile':
      return drawGapCurve(document);
    case 'gap_grid':
    case 'pressure_grid':
      return drawGrid(document);
    case 'wheelset':
      return html`<p class="pad hint">Both wheels on both rails: the patches of every position are drawn with the result.</p>`;
    default:
      return nothing;
  }
}

const BODIES = /** @type {const} */ (['rail', 'wheel']);

/** @param {Compose} state */
function verdict(state) {
  const { unreadable, faults, refusal, checked, document } = state;
  if (unreadable) return html`<p class="fault big">${unreadable}</p>`;
  if (refusal) return html`<p class="fault big">${refusal}</p>`;
  const lacking = BODIES.filter((body) => document && lacksSection(document, body));
  const wrong = faults.filter(({ pointer }) => !lacking.some((body) => pointer?.startsWith(`/contact/${body}/`)));
  const wanted = lacking.length ? html`<p class="big">Next: ${lacking.map((body) => `the file of the ${body}`).join(' and ')}.</p>` : nothing;
  if (lacking.length && !wrong.length) return wanted;
  if (faults.length) {
    return html`${wanted}<p class="fault big">${wrong.length === 1 ? 'One fault' : `${wrong.length} faults`}</p>
      <ul class="faults">${wrong.map((fault) => html`<li>
        <button class="link" @click=${() => lead(fault.pointer ?? '')}>${fault.pointer || 'case'}</button> ${fault.detail}</li>`)}</ul>`;
  }
  if (!checked) return html`<p class="quiet">Checking …</p>`;
  const motions = checked.motions > 1 ? `${count(checked.motions)} motions, about` : 'About';
  const warnings = checked.remarks.filter(({ severity }) => severity === 'warning').length;
  const told = warnings === 0 ? 'Ready to solve' : warnings === 1 ? '1 warning' : `${warnings} warnings`;
  return html`<p class=${warnings ? 'checked warn' : 'checked good'}>${told}. ${motions} ${seconds(checked.estimate.seconds)}.</p>
    ${profileQuality(checked)}
    ${checked.remarks.map((remark) => html`<p class=${remark.severity === 'warning' ? 'warn' : 'quiet'}>${remark.detail}</p>`)}`;
}

/** How far the points of the profiles can be trusted. @param {CheckedCase} checked */
function profileQuality({ quality }) {
  if (!quality) return nothing;
  return html`<dl class="quality">${BODIES.map((body) => {
    const of = quality[body];
    if (!of) return nothing;
    const noise = typeof of.noise_um === 'number' ? `, noise ${number(of.noise_um, 2)} μm` : '';
    const smoothing = of.smoothing_suggested_mm ? `, smoothing of ${number(of.smoothing_suggested_mm, 2)} mm suggested` : '';
    return html`<div><dt>${body}</dt><dd>${count(of.points)} points every ${number(of.spacing_mm, 2)} mm${noise}${smoothing}</dd></div>`;
  })}</dl>`;
}

/** The result while typing: forces with their errors, and the field of the first patch. @param {Compose} state */
function previewOf({ preview, document, checked }) {
  if (!preview || preview.digest !== checked?.digest) return nothing;
  const { result, field } = preview;
  const point = result.patches[0]?.points[0];
  if (!point) return nothing;
  const errors = point.error_estimate;
  /** @type {[string, number, number | null | undefined, string][]} */
  const rows = [
    ['F along', point.force_x_n / 1000, errors && errors.force_x_n / 1000, 'kN'],
    ['F across', point.force_y_n / 1000, errors && errors.force_y_n / 1000, 'kN'],
    ['p max', result.patches[0].pressure_max_mpa, undefined, 'MPa'],
  ];
  const shown = field && thumbnail(field, Number(at(document ?? undefined, '/friction/coefficient')));
  return html`<section class="preview" aria-label="Result while typing">
    ${shown ? html`<field-map .shown=${shown}></field-map>` : nothing}
    <dl>${rows.map(([name, value, error, unit]) => {
      const text = withError(value, error);
      return html`<div><dt>${name}</dt><dd>${text.value}${text.error ? html`<span class="err"> ± ${text.error}</span>` : nothing} ${unit}</dd></div>`;
    })}</dl>
    ${result.patches.length > 1 ? html`<span class="quiet">patch 0 of ${result.patches.length}</span>` : nothing}
  </section>`;
}

/** @param {import('./fields.js').Field} field @param {number} friction */
function thumbnail(field, friction) {
  const all = offered(field.cells);
  const quantity = all.find(({ key }) => key === 'traction') ?? all[0];
  const xs = field.cells.x_mm;
  const ys = field.cells.y_mm;
  const size = Math.max(Math.max(...xs) - Math.min(...xs), 2 * (Math.max(...ys) - Math.min(...ys)));
  return quantity ? { field, quantity, friction, border: true, scale: 130 / size, range: rangeOf(quantity, [field.cells], NaN) } : null;
}

/** @param {App} app @param {Compose} state */
function codePanel(app, { text }) {
  const address = `${location.origin}/v1/jobs`;
  const key = apiKey() ? ' -H "Authorization: Bearer $KEY"' : '';
  const curl = `curl -s ${address} -H 'Prefer: wait=10'${key} --json @-`;
  const whole = `${curl} <<'CASE'\n${text}\nCASE\n`;
  const copy = async (/** @type {string} */ copied) => {
    await navigator.clipboard.writeText(copied).then(() => app.say('Copied'), () => app.say('The browser does not allow copying here.'));
  };
  return html`<section class="panel code" aria-labelledby="h-code">
    <header class="bar"><h2 id="h-code">JSON</h2><button class="small" aria-label="Copy the JSON" @click=${() => copy(text)}>Copy</button></header>
    <textarea spellcheck="false" aria-label="The case as JSON" .value=${text}
      @input=${(/** @type {Event} */ event) => editText(app, /** @type {HTMLTextAreaElement} */ (event.target).value)}></textarea>
    <header class="bar sub"><h2>curl</h2><button class="small" aria-label="Copy the curl command with the case" @click=${() => copy(whole)}>Copy</button></header>
    <pre tabindex="0" aria-label="curl command">${curl} &lt;&lt;'CASE' …</pre>
  </section>`;
}

/** To the field of a fault, or to its place in the JSON. @param {string} pointer */
function lead(pointer) {
  const input = document.getElementById(fieldId(pointer));
  if (input) {
    input.focus();
    return;
  }
  const area = /** @type {HTMLTextAreaElement | null} */ (document.querySelector('.code textarea'));
  if (!area) return;
  const span = placeInText(area.value, pointer);
  area.focus();
  if (!span) return;
  area.setSelectionRange(...span);
  area.scrollTop = (area.value.slice(0, span[0]).split('\n').length - 3) * parseFloat(getComputedStyle(area).lineHeight);
}
