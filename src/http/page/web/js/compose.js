// The first view: introduction, form of a case, its drawing, the report of the service, and the case as JSON.

import { html, nothing } from '../vendor/lit-html.js';
import { apiKey } from './api.js';
import { takeProfiles } from './contactform.js';
import { at, numberAt, placeInText, put } from './document.js';
import { drawEllipse } from './drawing/patch.js';
import { drawGapCurve, drawGrid } from './drawing/gaps.js';
import { drawGap, drawProfiles, drawSection } from './drawing/profiles.js';
import { change, editDocument, editText, isUntouched, openExample, queue, solve, solveLive } from './editing.js';
import { offered, rangeOf } from './field/quantities.js';
import { fieldId, sentenceOf } from './field.js';
import { caseForm } from './form.js';
import { count, fixed, number, seconds, withError } from './format.js';
import { placed } from './placing.js';
import { inWords, remarkList } from './remarks.js';
import { hasSections, lacksSection } from './starts.js';
import { flangeAngle, nadal, wheelLoads } from './wheelloads.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./state.js').Compose} Compose */
/** @typedef {import('./api.js').CheckedCase} CheckedCase */
/** @typedef {import('./document.js').JsonObject} JsonObject */

/** @param {App} app */
export function compose(app) {
  const state = app.store.get().compose;
  const busy = state.solving || state.reading || state.unreadable !== '' || !state.document;
  return html`${intro(app, state)}
    <div class="compose">
      <section class="panel form" aria-labelledby="h-form">
        <header class="bar"><h2 id="h-form">Input</h2></header>
        <div class="scroll">${caseForm(app)}</div>
      </section>
      <div class="beside">
        <section class="panel stage" aria-labelledby="h-drawing">
          <header class="bar"><h2 id="h-drawing">${String(state.document?.name ?? 'Drawing')}</h2>
            <div class="actions">
              <label class="live"><input type="checkbox" .checked=${state.live}
                @change=${(/** @type {Event} */ event) => solveLive(app, /** @type {HTMLInputElement} */ (event.target).checked)}> result while typing</label>
              <button ?disabled=${busy} @click=${() => queue(app)}>Add to queue</button>
              <button class="primary" ?disabled=${busy} @click=${() => solve(app)}>${state.solving ? 'Solving …' : 'Solve'}<kbd>Ctrl ↵</kbd></button>
            </div></header>
          <div class=${state.faults.length ? 'figure stale' : 'figure'}>${state.document ? drawing(state, state.document) : nothing}</div>
          <div class="verdict" role="status">${verdict(app, state)}</div>
          ${previewOf(app, state)}
        </section>
        ${codePanel(app, state)}
      </div>
    </div>`;
}

/** Introduction with the two ways to start: files of profiles or an example. @param {App} app @param {Compose} state */
function intro(app, state) {
  const chosen = (/** @type {Event} */ event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    if (input.files?.length) takeProfiles(app, [...input.files]).catch(app.refused);
    input.value = '';
  };
  const over = (/** @type {boolean} */ on) => (/** @type {DragEvent} */ event) => /** @type {HTMLElement} */ (event.currentTarget).classList.toggle('over', on);
  return html`<header class=${isUntouched(state) ? 'intro' : 'intro compact'}>
    <div class="purpose"><h1>Wheel–rail contact</h1>
      <p>Find where a wheel and a rail touch, the pressure and friction between them, and the wear, fatigue and heat that follow.</p></div>
    <label class="drop big" @dragenter=${over(true)} @dragleave=${over(false)} @drop=${over(false)}><strong>Drop a rail and a wheel profile</strong>
      <span class="quiet">anywhere on the page, or choose the files: MiniProf, Simpack, CSV or text</span>
      <input type="file" multiple class="visually-hidden" id="files" aria-label="Files of a rail and a wheel profile" @change=${chosen}></label>
    ${examplePicker(app)}</header>`;
}

/** @param {App} app */
function examplePicker(app) {
  const { example, examples } = app.store.get().compose;
  const open = (/** @type {Event} */ event) => openExample(app, /** @type {HTMLSelectElement} */ (event.target).value);
  const others = (/** @type {typeof examples[number]} */ known) => Number(!hasSections(at(/** @type {JsonObject} */ (/** @type {unknown} */ (known.case)), '/contact/type')));
  const ordered = [...examples].sort((one, two) => others(one) - others(two));
  return html`<label class="inline start">or start from an example <select @change=${open}>
    ${example ? nothing : html`<option value="" selected>–</option>`}
    ${ordered.map(({ name, summary }) => html`<option value=${name} ?selected=${example === name}>${summary}</option>`)}</select></label>`;
}

/** @type {{ of: unknown, drawn: ReturnType<typeof placed> } | null} */
let placedBefore = null;

/** Draws the case: its interpretation by the service, or its own numbers. @param {Compose} state @param {JsonObject} document */
export function drawing({ understood, lone }, document) {
  const type = at(document, '/contact/type');
  if (lone && hasSections(type)) return drawSection(lone.body, lone.line);
  const known = understood && understood.type === type ? understood.of : null;
  switch (type) {
    case 'radii':
    case 'ellipse':
      return drawEllipse(document, known?.patches[0]);
    case 'profiles':
    case 'wheelset': {
      const before = placedBefore?.of === known ? placedBefore : { of: known, drawn: placed(known?.placement) };
      placedBefore = before;
      return html`<div class="stack">${drawProfiles(before.drawn)}${drawGap(before.drawn)}</div>`;
    }
    case 'gap_profile':
      return drawGapCurve(document);
    case 'gap_grid':
    case 'pressure_grid':
      return drawGrid(document);
    default:
      return nothing;
  }
}

const BODIES = /** @type {const} */ (['rail', 'wheel']);

/** Reports whether a case can be solved, with its faults and remarks. @param {App} app @param {Compose} state @param {boolean} [timed] Whether the estimated time is shown. */
export function verdict(app, state, timed = true) {
  const { reading, unreadable, faults, refusal, checked, document } = state;
  if (reading) return html`<p class="quiet">Reading the files …</p>`;
  if (unreadable) return html`<p class="fault big">${unreadable}</p>`;
  if (refusal) return html`<p class="fault big">${refusal}</p>`;
  const lacking = BODIES.filter((body) => document && lacksSection(document, body));
  const wrong = faults.filter(({ pointer }) => !lacking.some((body) => pointer?.startsWith(`/contact/${body}/`)));
  const wanted = lacking.length ? html`<p class="big">Next: ${lacking.map((body) => `the file of the ${body}`).join(' and ')}.</p>` : nothing;
  if (lacking.length && !wrong.length) return wanted;
  if (wrong.length) {
    return html`${wanted}<p class="fault big">${wrong.length === 1 ? 'One fault' : `${wrong.length} faults`}</p>
      <ul class="faults">${wrong.map((fault) => html`<li>
        <button class="link" @click=${() => lead(app, fault.pointer ?? '')}>${fault.pointer ? inWords(fault.pointer) : 'case'}</button> ${sentenceOf(fault)}${excerpt(state, fault)}</li>`)}</ul>`;
  }
  if (!checked) return html`<p class="quiet">Checking …</p>`;
  const motions = checked.motions > 1 ? `${count(checked.motions)} motions, about` : 'About';
  const warnings = checked.remarks.filter(({ severity }) => severity === 'warning').length;
  const told = warnings === 0 ? (timed ? 'Ready to solve' : 'Rail and wheel can be solved') : warnings === 1 ? '1 warning' : `${warnings} warnings`;
  return html`<p class=${warnings ? 'checked warn' : 'checked good'}>${told}.${timed ? ` ${motions} ${seconds(checked.estimate.seconds)}.` : ''}</p>
    ${adviceOf(app)}${remarkList(checked.remarks)}`;
}

/** Button that applies the smoothing which the service suggests for noisy files. @param {App} app */
function adviceOf(app) {
  const { document, checked } = app.store.get().compose;
  const advised = BODIES.flatMap((body) => {
    const length = checked?.quality?.[body]?.smoothing_suggested_mm ?? 0;
    return length && at(document ?? undefined, `/contact/${body}/smoothing_mm`) === undefined ? [{ body, length }] : [];
  });
  if (!advised.length || !document) return nothing;
  const smooth = () => editDocument(app, advised.reduce((of, { body, length }) => put(of, `/contact/${body}/smoothing_mm`, length), document));
  return html`<button class="small" @click=${smooth}>The points are noisy: smooth ${advised.map(({ body, length }) => `the ${body} by ${number(length, 2)} mm`).join(' and ')}, as advised</button>`;
}

/** Number of lines shown before and after the faulty line. */
const AROUND = 2;

/** Shows the line of a file that a fault names, with its neighbours. @param {Compose} state @param {import('./api.js').Fault} fault */
function excerpt({ document, files }, { pointer, detail }) {
  const body = BODIES.find((known) => pointer === `/contact/${known}/text`);
  const number = Number(/\bline (\d+)/.exec(detail)?.[1]);
  const text = body && at(document ?? undefined, `/contact/${body}/text`);
  if (!body || !number || typeof text !== 'string') return nothing;
  const lines = text.split(/\r\n?|\n/);
  const from = Math.max(0, number - 1 - AROUND);
  return html`<figure class="excerpt"><figcaption>${files[body]?.text === text ? files[body].name : `the file of the ${body}`}</figcaption>
    <ol start=${from + 1}>${lines.slice(from, number + AROUND).map((line, place) => html`<li class=${from + place === number - 1 ? 'at-fault' : ''}><code>${line || ' '}</code></li>`)}</ol></figure>`;
}

/** Result while typing: loads of the wheel and the field of the patch with the largest load. @param {App} app @param {Compose} state */
function previewOf(app, { preview, document, checked, understood }) {
  // A case with faults has no result; the last one belongs to an earlier case.
  if (!checked) return nothing;
  if (preview?.failure) return html`<section class="preview" aria-label="Result while typing"><p class="fault">Solving it fails: ${preview.failure}</p>
    ${preview.failure.includes('accept_rough_profiles') ? html`<button class="small" @click=${() => change(app, '/contact/accept_rough_profiles', true)}>Solve it anyway</button>` : nothing}</section>`;
  if (!preview) return nothing;
  if (!preview.result) return html`<section class="preview" aria-label="Result while typing"><p class="quiet">This case takes too long to solve while typing: click Solve.</p></section>`;
  const { result, patch, point, field } = preview;
  const { patches } = result;
  const of = patches[patch].points[point];
  const [load] = patches.length && !result.wheelset ? wheelLoads(result, document, point) : [];
  const placement = understood?.of.placement;
  const angle = load && placement ? flangeAngle(/** @type {import('./placing.js').Place[]} */ (placement.wheel_mm), load.side) : NaN;
  const friction = numberAt(document ?? undefined, '/friction/coefficient');
  const strongest = patches.reduce((most, each) => (each.pressure_max_mpa > most.pressure_max_mpa ? each : most));
  /** @type {[unknown, number, number | null | undefined, string][]} */
  const rows = load ? [
    ['Q', load.q_n / 1000, undefined, 'kN'],
    ['Y, outward', load.y_n / 1000, load.y_error_n && load.y_error_n / 1000, 'kN'],
    [Number.isFinite(angle) ? `Y/Q, Nadal ${fixed(nadal(angle, friction), 2)}` : 'Y/Q', load.y_n / load.q_n, load.y_error_n && load.y_error_n / load.q_n, ''],
    [html`F<sub>x</sub>`, load.x_n / 1000, load.x_error_n && load.x_error_n / 1000, 'kN'],
  ] : [
    ['N', patches[patch].normal_force_n / 1000, undefined, 'kN'],
    [html`F<sub>x</sub>`, of.force_x_n / 1000, of.error_estimate && of.error_estimate.force_x_n / 1000, 'kN'],
    [html`F<sub>y</sub>`, of.force_y_n / 1000, of.error_estimate && of.error_estimate.force_y_n / 1000, 'kN'],
  ];
  rows.push([html`p<sub>max</sub>`, strongest.pressure_max_mpa, strongest.points[Math.min(point, strongest.points.length - 1)].profile_uncertainty?.pressure_max_mpa, 'MPa'],
    ['contact area', patches.reduce((sum, each) => sum + each.area_mm2, 0), undefined, 'mm²']);
  const shown = field && thumbnail(field, friction);
  const notes = [
    patches.length > 1 ? `${patches.length} patches; the one drawn carries ${number(patches[patch].normal_force_n / 1000, 3)} kN` : '',
    patches[patch].points.length > 1 ? `motion ${point + 1} of ${patches[patch].points.length}` : '',
  ].filter(Boolean).join('; ');
  return html`<section class=${preview.digest === checked.digest ? 'preview' : 'preview stale'} aria-label="Result while typing">
    ${shown ? html`<field-map .shown=${shown}></field-map>` : nothing}
    <dl>${rows.map(([name, value, error, unit]) => {
      const text = withError(value, error);
      return html`<div><dt>${name}</dt><dd>${text.value}${text.error ? html`<span class="err"> ± ${text.error}</span>` : nothing} ${unit}</dd></div>`;
    })}</dl>
    ${notes ? html`<span class="quiet">${notes}</span>` : nothing}
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
function codePanel(app, state) {
  const { text } = state;
  const address = `${location.origin}/v1/jobs`;
  const key = apiKey() ? ' -H "Authorization: Bearer $KEY"' : '';
  const curl = `curl -s ${address} -H 'Prefer: wait=10'${key} --json @-`;
  const whole = `${curl} <<'CASE'\n${text}\nCASE\n`;
  const copy = async (/** @type {string} */ copied) => {
    await navigator.clipboard.writeText(copied).then(() => app.say('Copied'), () => app.say('The browser does not allow copying here.'));
  };
  const toggle = (/** @type {Event} */ event) => app.compose({ code: /** @type {HTMLDetailsElement} */ (event.target).open });
  return html`<details class="panel code" ?open=${state.code || state.unreadable !== ''} @toggle=${toggle}><summary class="bar"><h2 id="h-code">JSON and curl, for programs</h2></summary>
    <header class="bar sub"><h3>The case as JSON</h3><button class="small" aria-label="Copy the JSON" @click=${() => copy(text)}>Copy</button></header>
    <textarea spellcheck="false" aria-label="The case as JSON" .value=${text}
      @input=${(/** @type {Event} */ event) => editText(app, /** @type {HTMLTextAreaElement} */ (event.target).value)}></textarea>
    <header class="bar sub"><h3>curl</h3><button class="small" aria-label="Copy the curl command with the case" @click=${() => copy(whole)}>Copy</button></header>
    <pre tabindex="0" aria-label="curl command">${curl} &lt;&lt;'CASE' …</pre>
  </details>`;
}

/** Moves the focus to the field of a fault, or to its place in the JSON. @param {App} app @param {string} pointer */
function lead(app, pointer) {
  const input = document.getElementById(fieldId(pointer));
  if (input) {
    const folded = input.closest('details');
    if (folded) folded.open = true;
    input.focus();
    return;
  }
  const code = /** @type {HTMLDetailsElement | null} */ (document.querySelector('details.code'));
  if (code) code.open = true;
  app.compose({ code: true });
  const area = /** @type {HTMLTextAreaElement | null} */ (document.querySelector('.code textarea'));
  if (!area) return;
  const span = placeInText(area.value, pointer);
  area.focus();
  if (!span) return;
  area.setSelectionRange(...span);
  area.scrollTop = (area.value.slice(0, span[0]).split('\n').length - 3) * parseFloat(getComputedStyle(area).lineHeight);
}
