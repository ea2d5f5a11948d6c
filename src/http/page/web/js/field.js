// Input fields of the form: a value of the case at a JSON pointer, in a common engineering unit, with its fault.

import { html, nothing } from '../vendor/lit-html.js';
import { at } from './document.js';
import { change } from './editing.js';
import { number } from './format.js';
import { parse, parseList, textOf } from './written.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Fault} Fault */
/** @typedef {import('./document.js').JsonValue} JsonValue */

/**
 * @typedef {object} FieldLook
 * @property {number} [factor] Factor from the shown unit to the unit of the API.
 * @property {string} [hint]
 * @property {string} [empty] Placeholder of an empty field, whose value is optional. Without it an emptied field is null, so that its fault names it.
 * @property {boolean} [text] Accepts any text, not only numbers.
 * @property {boolean} [list] Accepts one number or several.
 * @property {(value: JsonValue | undefined) => string} [format] Formats a value without a unit.
 * @property {(written: string) => JsonValue | undefined} [read] Parses the text of the field.
 * @property {(value: JsonValue | undefined) => void} [take] Applies the value to the case, if more than this value changes.
 */

/** Returns the element id of the field of a pointer. @param {string} pointer */
export const fieldId = (pointer) => `field${pointer.replaceAll('/', '-')}`;

/**
 * @param {App} app
 * @param {string} pointer
 * @returns {Fault | undefined} The fault of this value or of one of its members.
 */
export const faultAt = (app, pointer) =>
  app.store.get().compose.faults.find((fault) => fault.pointer === pointer || fault.pointer?.startsWith(`${pointer}/`));

/**
 * An input field for one value of the case.
 * @param {App} app
 * @param {string} pointer
 * @param {string} label
 * @param {string} unit
 * @param {FieldLook} [look]
 */
export function field(app, pointer, label, unit, look = {}) {
  const { document, typing } = app.store.get().compose;
  const fault = faultAt(app, pointer);
  const id = fieldId(pointer);
  const value = at(document ?? undefined, pointer);
  const shown = typing?.pointer === pointer ? typing.text : look.format ? look.format(value) : textOf(value, look.factor);
  const write = (/** @type {InputEvent} */ event) => {
    const { value } = /** @type {HTMLInputElement} */ (event.target);
    app.compose({ typing: { pointer, text: value } });
    const read = look.read ?? (look.text ? (text) => text || undefined : look.list ? (text) => parseList(text, look.factor) : (text) => parse(text, look.factor));
    const needed = look.empty === undefined && !look.text ? null : undefined;
    (look.take ?? ((taken) => change(app, pointer, taken)))(read(value) ?? needed);
  };
  return html`<div class=${fault ? 'field bad' : 'field'}>
    <label for=${id}>${label}</label>
    <span class="input">
      <input id=${id} inputmode=${look.text || look.list || look.read ? 'text' : 'decimal'} autocomplete="off" .value=${shown} placeholder=${look.empty ?? ''}
        aria-invalid=${fault ? 'true' : 'false'} aria-describedby=${fault ? `${id}-fault` : nothing}
        @input=${write} @blur=${() => app.compose({ typing: null })}>
      ${unit ? html`<span class="unit">${unit}</span>` : nothing}
    </span>
    ${fault ? html`<p class="fault" id=${`${id}-fault`}>${faultText(fault, look.read ? undefined : (look.factor ?? 1), unit)}</p>`
      : look.hint ? html`<p class="hint">${look.hint}</p>` : nothing}
  </div>`;
}

/**
 * A drop-down list for one value of the case.
 * @param {App} app
 * @param {string} pointer
 * @param {string} label
 * @param {readonly (readonly [JsonValue | undefined, string])[]} options Values and their texts. The value undefined stands for the default of the service.
 * @param {{ hint?: string, take?: (value: JsonValue | undefined) => void }} [look] The same options as of `field`.
 */
export function choice(app, pointer, label, options, { hint, take = (value) => change(app, pointer, value) } = {}) {
  const value = at(app.store.get().compose.document ?? undefined, pointer);
  const known = options.some(([option]) => option === value);
  const fault = faultAt(app, pointer);
  const pick = (/** @type {Event} */ event) => take(options[/** @type {HTMLSelectElement} */ (event.target).selectedIndex]?.[0]);
  return html`<div class=${fault ? 'field bad' : 'field'}><label for=${fieldId(pointer)}>${label}</label>
    <select id=${fieldId(pointer)} @change=${pick}>${options.map(([option, text]) => html`<option ?selected=${option === value}>${text}</option>`)}
      ${known ? nothing : html`<option selected>${JSON.stringify(value)}</option>`}</select>
    ${fault ? html`<p class="fault">${fault.detail}</p>` : hint ? html`<p class="hint">${hint}</p>` : nothing}</div>`;
}

/** Returns the sentence of a fault. An emptied field is null in the case. @param {Fault} fault */
export const sentenceOf = ({ detail }) => detail.replace(/^null given/, 'empty');

/**
 * Describes a fault, in the unit of the field if its limits are known.
 * @param {Fault} fault
 * @param {number | undefined} factor Undefined if the field shows another quantity than the member of the case.
 * @param {string} unit
 */
export function faultText(fault, factor, unit) {
  const { minimum, maximum, minimum_excluded: excluded } = fault;
  if (!factor || (typeof minimum !== 'number' && typeof maximum !== 'number')) return sentenceOf(fault);
  const low = typeof minimum === 'number' ? `${excluded ? 'more than' : 'at least'} ${number(minimum / factor)}` : '';
  const high = typeof maximum === 'number' ? `at most ${number(maximum / factor)}` : '';
  return `A number of ${[low, high].filter(Boolean).join(' and ')} ${unit} is needed.`;
}
