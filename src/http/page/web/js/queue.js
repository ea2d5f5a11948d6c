// The jobs and batches of the tenant: what is loaded of them, and how they are kept up to date.

import { batch as batchOf, jobs as jobsOf, Refused } from './api.js';
import { follow } from './events.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Job} Job */
/** @typedef {import('./api.js').Batch} Batch */

/**
 * @typedef {object} Queue
 * @property {Job[]} jobs The newest first, as far as they are loaded.
 * @property {string} cursor Where the next page begins; empty at the end.
 * @property {boolean} loaded
 * @property {string} state Only jobs in this state; empty for all.
 * @property {string} label Only jobs with this label, `key:value`; empty for all.
 * @property {Map<string, Batch>} batches
 * @property {number} top Pixels that the list is scrolled by.
 */

const PAGE = 200;
const REFRESH_MS = 2000;
const HIDDEN_REFRESH_MS = 15_000;
/** A browser keeps six connections to one server. */
const FOLLOWED_MAX = 3;

/** @type {Queue} */
const queue = { jobs: [], cursor: '', loaded: false, state: '', label: '', batches: new Map(), top: 0 };
let stopping = new AbortController();
let timer = 0;
let turn = 0;
let loadingMore = false;
/** @type {Set<string>} */
const followed = new Set();

export const queueSeen = () => queue;

/** @param {App} app */
export function startQueue(app) {
  stopQueue();
  // The list is where it was left, as soon as its rows are there.
  requestAnimationFrame(() => {
    const list = document.querySelector('.list');
    if (list) list.scrollTop = queue.top;
  });
  stopping = new AbortController();
  refresh(app);
}

export function stopQueue() {
  clearTimeout(timer);
  stopping.abort();
  followed.clear();
}

const filter = () => ({ state: queue.state || undefined, label: queue.label || undefined });

/** Loads the newest page again and puts it before what is loaded. @param {App} app */
async function refresh(app) {
  const { signal } = stopping;
  const mine = turn;
  try {
    const page = await jobsOf({ ...filter(), limit: PAGE });
    if (signal.aborted || mine !== turn) return;
    const fresh = new Set(page.jobs.map((job) => job.id));
    const oldest = page.jobs[page.jobs.length - 1]?.id ?? '';
    // Ids sort by time: what is older than the page stays as it was loaded.
    const older = page.next_cursor ? queue.jobs.filter((job) => job.id < oldest && !fresh.has(job.id)) : [];
    queue.jobs = [...page.jobs, ...older];
    if (!older.length) queue.cursor = page.next_cursor ?? '';
    queue.loaded = true;
    app.redraw();
    followBatches(app, page.jobs);
  } catch (error) {
    app.refused(error);
  }
  if (!signal.aborted) timer = window.setTimeout(() => refresh(app), document.hidden ? HIDDEN_REFRESH_MS : REFRESH_MS);
}

/** Looks at once, after something was changed. @param {App} app */
export function refreshSoon(app) {
  clearTimeout(timer);
  refresh(app);
}

/** @param {App} app @param {{ state?: string, label?: string }} wanted */
export function filterQueue(app, wanted) {
  turn += 1;
  Object.assign(queue, wanted, { jobs: [], cursor: '', loaded: false, top: 0 });
  clearTimeout(timer);
  refresh(app);
}

/** Loads the next page, when the list is scrolled near its end. @param {App} app */
export async function loadMore(app) {
  if (loadingMore || !queue.cursor) return;
  loadingMore = true;
  const mine = turn;
  try {
    const page = await jobsOf({ ...filter(), limit: 1000, cursor: queue.cursor });
    if (mine !== turn) return;
    const known = new Set(queue.jobs.map((job) => job.id));
    queue.jobs = [...queue.jobs, ...page.jobs.filter((job) => !known.has(job.id))];
    queue.cursor = page.next_cursor ?? '';
    app.redraw();
  } catch (error) {
    app.refused(error);
  } finally {
    loadingMore = false;
  }
}

/** Batches of these jobs: those that go on are followed by events. @param {App} app @param {readonly Job[]} jobs */
async function followBatches(app, jobs) {
  const { signal } = stopping;
  const ids = [...new Set(jobs.flatMap((job) => job.batch_id ?? []))].slice(0, 8);
  for (const id of ids) {
    if (followed.has(id) || queue.batches.get(id)?.ended) continue;
    try {
      if (!queue.batches.has(id)) queue.batches.set(id, await batchOf(id));
    } catch (error) {
      if (error instanceof Refused && error.status === 404) continue;
      throw error;
    }
    app.redraw();
    if (queue.batches.get(id)?.ended || followed.size >= FOLLOWED_MAX || signal.aborted) continue;
    followed.add(id);
    follow(`/v1/batches/${id}/events`, ({ data }) => {
      /** @type {Batch} */
      const batch = JSON.parse(data);
      queue.batches.set(id, batch);
      app.redraw();
      return batch.ended;
    }, signal).catch(app.refused).finally(() => followed.delete(id));
  }
}

/** @param {string} id */
export function forgetBatch(id) {
  queue.batches.delete(id);
}
