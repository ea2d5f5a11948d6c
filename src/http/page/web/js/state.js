// State of the page, and functions of the shell for all views.

/** @typedef {import('./api.js').Job} Job */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./api.js').Fault} Fault */
/** @typedef {import('./api.js').CheckedCase} CheckedCase */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./fields.js').Field} Field */
/** @typedef {import('./routes.js').Route} Route */

/**
 * @typedef {object} Preview
 * A result while typing.
 * @property {string} digest Of the case that it belongs to.
 * @property {JobResult | null} result Null if it could not be solved in a short time.
 * @property {string} failure Why it has no result; empty if that is for lack of time.
 * @property {number} patch The one that carries most.
 * @property {number} point
 * @property {Field | null} field Of this patch and motion, where the case asks for one.
 */

/**
 * @typedef {object} Compose
 * @property {JsonObject | null} document The case; null as long as the text is no JSON.
 * @property {string} text The document as text.
 * @property {string} unreadable Why the text is no JSON.
 * @property {{ pointer: string, text: string } | null} typing The field that is being written in, as it is written.
 * @property {CheckedCase | null} checked Report of the service on a valid case.
 * @property {{ type: unknown, of: NonNullable<CheckedCase['understood']> } | null} understood Interpretation of the last valid case, by its
 *   kind of contact: the drawing stays while faults are being corrected.
 * @property {{ body: 'rail' | 'wheel', line: readonly (readonly number[])[] | null } | null} lone The only cross-section of a case that lacks the other.
 * @property {readonly Fault[]} faults
 * @property {string} refusal Why it could not be checked, where that is no fault of the case.
 * @property {readonly import('./api.js').Schemas['ExampleCase'][]} examples Examples of the service.
 * @property {string} example The one that is chosen; empty for none.
 * @property {Partial<Record<'rail' | 'wheel', { name: string, text: string }>>} files The files that cross-sections were taken from.
 * @property {boolean} solving
 * @property {boolean} live Solve while typing, where it costs milliseconds.
 * @property {Preview | null} preview
 * @property {boolean} code Is the JSON unfolded?
 */

/** @typedef {{ label: string, act: () => void }} Action */

/**
 * @typedef {object} PageState
 * @property {Route} route
 * @property {{ ready: boolean, version: string } | null} health
 * @property {boolean} keyLine Is the line for the API key open?
 * @property {string} toast
 * @property {Action | null} action Action of the toast.
 * @property {string} absent Why what the address names is not there; empty where it is.
 * @property {Compose} compose
 * @property {number} turn Counts changes of what the views keep themselves.
 */

/**
 * @typedef {object} App
 * @property {import('./store.js').Store<PageState>} store
 * @property {(change: Partial<Compose>) => void} compose Changes the state of Compose.
 * @property {() => void} redraw
 * @property {(text: string, action?: Action, duration?: number) => void} say Shows a short message, for some milliseconds.
 * @property {(error: unknown) => void} refused Shows why something failed; a missing key opens its line.
 * @property {(error: unknown) => void} absent Shows why what the address names cannot be opened.
 * @property {(address: string) => void} go To an address of the page.
 * @property {(address: string) => void} remember Writes what is shown into the address, without a step in the history and some time later.
 */

/** @returns {PageState} */
export const initialState = () => ({
  route: { view: 'compose', ids: [], query: {} },
  health: null,
  keyLine: false,
  toast: '',
  absent: '',
  action: null,
  turn: 0,
  compose: {
    document: null, text: '', unreadable: '', typing: null, checked: null, understood: null, lone: null, faults: [], refusal: '', examples: [], example: '', files: {}, solving: false,
    live: true, preview: null, code: false,
  },
});
