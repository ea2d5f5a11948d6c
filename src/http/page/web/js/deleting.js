// Deletion with undo: jobs and batches disappear from the lists at once and are removed a few seconds later, unless the user undoes it.

import { Refused, remove } from './api.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {'jobs' | 'batches' | 'evolutions'} Kind */

const UNDO_MS = 6000;
/** Number of concurrent requests. */
const AT_ONCE = 4;
/** Number of requests that outlive the page. Chromium allows 20. */
const KEPT_ALIVE_MAX = 16;

/** @type {{ kind: Kind, ids: readonly string[], timer: number } | null} */
let pending = null;
/** Ids that have been deleted, so that an older response does not restore them. @type {Set<string>} */
const gone = new Set();

/** Returns whether a job or a batch has not been deleted here. @param {{ id: string }} of */
export const isThere = ({ id }) => !gone.has(id);

/**
 * @param {App} app
 * @param {Kind} kind
 * @param {readonly string[]} ids
 * @param {string} what Name of the deleted items in the message.
 */
export function removeLater(app, kind, ids, what) {
  flush(app);
  for (const id of ids) gone.add(id);
  pending = { kind, ids, timer: window.setTimeout(() => flush(app), UNDO_MS) };
  app.say(`${what} deleted`, {
    label: 'Undo',
    act: () => {
      if (!pending) return;
      clearTimeout(pending.timer);
      for (const id of pending.ids) gone.delete(id);
      pending = null;
      app.redraw();
    },
  }, UNDO_MS);
  app.redraw();
}

/** Removes the pending items, a few at a time. @param {App} app */
function flush(app) {
  if (!pending) return;
  const { kind, ids, timer } = pending;
  clearTimeout(timer);
  pending = null;
  const waiting = [...ids];
  const next = async () => {
    for (let id = waiting.shift(); id !== undefined; id = waiting.shift()) {
      try {
        await remove(kind, id);
      } catch (error) {
        if (error instanceof Refused && error.status === 404) continue;
        gone.delete(id);
        app.refused(error);
      }
    }
  };
  for (let lane = 0; lane < AT_ONCE; lane += 1) next();
}

// When the page is left, pending deletions are carried out.
addEventListener('pagehide', () => {
  for (const id of pending?.ids.slice(0, KEPT_ALIVE_MAX) ?? []) remove(pending?.kind ?? 'jobs', id, true).catch(() => {});
});
