// The jobs that are ticked for comparing.

/** @typedef {import('./state.js').App} App */

// As many as stand side by side in a window; chosen by judgement.
export const MARKED_MAX = 4;

/** @type {string[]} */
let ids = [];

export const marked = () => ids;

/** Ticks a job, or takes the tick away; a fifth tick takes away the first. @param {App} app @param {string} id */
export function toggleMark(app, id) {
  ids = ids.includes(id) ? ids.filter((other) => other !== id) : [...ids, id].slice(-MARKED_MAX);
  app.redraw();
}
