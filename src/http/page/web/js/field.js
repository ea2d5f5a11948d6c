// One field of the form: a value of the case at a JSON pointer, in the unit that engineers use, with its fault.

import { html, nothing } from '../vendor/lit-html.js';
import { at } from './document.js';
import { change } from './editing.js';
import { number } from './format.js';
import { parse, parseList, textOf } from './written.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Fault} Fault */

/**
 * @typedef {object} FieldLook
 * @property {number} [factor] What one of the shown units is in the unit of the API.
 * @property {string} [hint]
 * @property {string} [empty] Shown where nothing is given.
 * @property {boolean} [text] Takes any text, not only numbers.
 * @property {boolean} [list] Takes one number or several.
 */

/** The id of the field of a pointer. @param {string} pointer */
export const fieldId = (pointer) => `field${pointer.replaceAll('/', '-')}`;

/**
 * @param {App} app
 * @param {string} pointer
 * @returns {Fault | undefined} The fault of this value or of what is inside it.
 */
export const faultAt = (app, pointer) =>
  app.store.get().compose.faults.find((fault) => fault.pointer === pointer || fault.pointer?.startsWith(`${pointer}/`));

/**
 * A field for one value of the case.
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
  const shown = typing?.pointer === pointer ? typing.text : textOf(at(document ?? undefined, pointer), look.factor);
  const write = (/** @type {InputEvent} */ event) => {
    const { value } = /** @type {HTMLInputElement} */ (event.target);
    app.compose({ typing: { pointer, text: value } });
    change(app, pointer, look.text ? value || undefined : look.list ? parseList(value, look.factor) : parse(value, look.factor));
  };
  return html`<div class=${fault ? 'field bad' : 'field'}>
    <label for=${id}>${label}</label>
    <span class="input">
      <input id=${id} inputmode=${look.text || look.list ? 'text' : 'decimal'} autocomplete="off" .value=${shown} placeholder=${look.empty ?? ''}
        aria-invalid=${fault ? 'true' : 'false'} aria-describedby=${fault ? `${id}-fault` : nothing}
        @input=${write} @blur=${() => app.compose({ typing: null })}>
      ${unit ? html`<span class="unit">${unit}</span>` : nothing}
    </span>
    ${fault ? html`<p class="fault" id=${`${id}-fault`}>${faultText(fault, look.factor, unit)}</p>`
      : look.hint ? html`<p class="hint">${look.hint}</p>` : nothing}
  </div>`;
}

/**
 * What is wrong, in the unit of the field where the limits are known.
 * @param {Fault} fault
 * @param {number | undefined} factor
 * @param {string} unit
 */
function faultText(fault, factor, unit) {
  const { minimum, maximum, minimum_excluded: excluded } = fault;
  if (!factor || (typeof minimum !== 'number' && typeof maximum !== 'number')) return fault.detail;
  const low = typeof minimum === 'number' ? `${excluded ? 'more than' : 'at least'} ${number(minimum / factor)}` : '';
  const high = typeof maximum === 'number' ? `at most ${number(maximum / factor)}` : '';
  return `A number of ${[low, high].filter(Boolean).join(' and ')} ${unit} is needed.`;
}
