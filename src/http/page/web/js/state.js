// State of the page and functions of the shell for all views.

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
 * @property {string} digest Digest of its case.
 * @property {JobResult | null} result Null if the case was not solved in time or failed.
 * @property {string} failure Reason of a failure; empty if there is none.
 * @property {number} patch Patch with the largest load.
 * @property {number} point
 * @property {Field | null} field Field of this patch and motion, if the case requests one.
 */

/**
 * @typedef {object} Compose
 * @property {JsonObject | null} document The case; null until the text is valid JSON.
 * @property {string} text The document as text.
 * @property {string} unreadable Reason why the text is not JSON; empty if it is.
 * @property {{ pointer: string, text: string } | null} typing Focused field with its text as entered.
 * @property {CheckedCase | null} checked Report of the service on a valid case.
 * @property {{ type: unknown, of: NonNullable<CheckedCase['understood']> } | null} understood Interpretation of the last valid case, with its
 *   kind of contact. It keeps the drawing while faults are corrected.
 * @property {{ body: 'rail' | 'wheel', line: readonly (readonly number[])[] | null } | null} lone The cross-section of a case that lacks the other one.
 * @property {readonly Fault[]} faults
 * @property {string} refusal Reason why the case could not be checked, other than its faults.
 * @property {readonly import('./api.js').Schemas['ExampleCase'][]} examples Examples of the service.
 * @property {string} example Chosen example; empty for none.
 * @property {Partial<Record<'rail' | 'wheel', { name: string, text: string }>>} files Files of the cross-sections.
 * @property {boolean} solving
 * @property {boolean} reading Whether files are being read and assigned to bodies.
 * @property {boolean} live Whether fast cases are solved while typing.
 * @property {Preview | null} preview
 * @property {boolean} code Whether the JSON is unfolded.
 */

/** @typedef {{ label: string, act: () => void }} Action */

/**
 * @typedef {object} PageState
 * @property {Route} route
 * @property {{ ready: boolean, version: string } | null} health
 * @property {boolean} keyLine Whether the input of the API key is open.
 * @property {string} toast
 * @property {Action | null} action Action of the toast.
 * @property {string} absent Reason why the target of the address does not exist; empty if it does.
 * @property {Compose} compose
 * @property {number} turn Counter of changes of state outside the store.
 */

/**
 * @typedef {object} App
 * @property {import('./store.js').Store<PageState>} store
 * @property {(change: Partial<Compose>) => void} compose Changes the state of Compose.
 * @property {() => void} redraw
 * @property {(text: string, action?: Action, duration?: number) => void} say Shows a message for a duration in ms.
 * @property {(error: unknown) => void} refused Shows an error. Status 401 opens the input of the API key.
 * @property {(error: unknown) => void} absent Shows why the target of the address cannot be opened.
 * @property {(address: string) => void} go Navigates to an address of the page.
 * @property {(address: string) => void} remember Replaces the address after a delay, without an entry in the history.
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
    document: null, text: '', unreadable: '', typing: null, checked: null, understood: null, lone: null, faults: [], refusal: '', examples: [], example: '', files: {}, solving: false, reading: false,
    live: true, preview: null, code: false,
  },
});
