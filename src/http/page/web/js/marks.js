// The selection of jobs for comparison or deletion.

/** @typedef {import('./state.js').App} App */

// Largest number of compared jobs, so that they fit side by side in a window; chosen by judgement.
export const COMPARED_MAX = 4;

/** @type {ReadonlySet<string>} */
let ids = new Set();

/** Returns the selected ids in the order of selection. */
export const marked = () => ids;

/** @param {App} app @param {Iterable<string>} wanted */
export function mark(app, wanted) {
  ids = new Set(wanted);
  app.redraw();
}

/** Selects or deselects a job. @param {App} app @param {string} id */
export const toggleMark = (app, id) => mark(app, ids.has(id) ? [...ids].filter((other) => other !== id) : [...ids, id]);
