// The jobs that are ticked, for comparing or deleting them.

/** @typedef {import('./state.js').App} App */

// As many as stand side by side in a window; chosen by judgement.
export const COMPARED_MAX = 4;

/** @type {ReadonlySet<string>} */
let ids = new Set();

/** In the order in which they were ticked. */
export const marked = () => ids;

/** @param {App} app @param {Iterable<string>} wanted */
export function mark(app, wanted) {
  ids = new Set(wanted);
  app.redraw();
}

/** Ticks a job, or takes the tick away. @param {App} app @param {string} id */
export const toggleMark = (app, id) => mark(app, ids.has(id) ? [...ids].filter((other) => other !== id) : [...ids, id]);
