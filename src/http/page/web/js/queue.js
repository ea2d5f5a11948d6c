// The loaded jobs and batches of the tenant, updated by events.

import { batches as batchesOf, jobs as jobsOf, me as askMe } from './api.js';
import { isThere } from './deleting.js';
import { follow } from './events.js';
import { isTyped } from './typed.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Job} Job */
/** @typedef {import('./api.js').Batch} Batch */

/**
 * @typedef {object} Queue
 * @property {Job[]} jobs Loaded jobs, newest first.
 * @property {string} cursor Cursor of the next page; empty at the end.
 * @property {boolean} loaded
 * @property {number} total Number of jobs that match the filter.
 * @property {boolean} more Whether there may be more than `total`.
 * @property {string[]} states Filter by state; empty for all.
 * @property {string} label Filter by label, `key:value`; empty for all.
 * @property {string} name Filter by a part of the name.
 * @property {string} batch Filter by batch; `none` for jobs without a batch, empty for all.
 * @property {Map<string, Batch>} batches
 * @property {import('./api.js').Schemas['Me'] | null} me The tenant and its usage.
 * @property {number} top Scroll position of the list in pixels.
 */

const PAGE = 200;
const MORE = 1000;
const BATCHES = 20;
/** Minimum interval of refreshing the jobs after events of batches, which do not include their jobs. */
const REFRESH_MS = 1000;
/** Interval of a regular refresh: events do not report deletions by other clients. */
const SELDOM_MS = 20_000;

/** @type {Queue} */
const queue = {
  jobs: [], cursor: '', loaded: false, total: 0, more: false, states: [], label: '', name: '', batch: 'none', batches: new Map(), me: null, top: 0,
};
let stopping = new AbortController();
let seldom = 0;
let soon = 0;
let turn = 0;
let loadingMore = false;

export const queueSeen = () => queue;

/** Returns the jobs of the list without deleted ones. */
export const jobsShown = () => queue.jobs.filter(isThere);

/** Loads the lists and follows all events of the tenant in one stream. @param {App} app */
export function startQueue(app) {
  stopQueue();
  stopping = new AbortController();
  const { signal } = stopping;
  // The scroll position is restored when the rows have been rendered.
  requestAnimationFrame(() => {
    const list = document.querySelector('.list');
    if (list) list.scrollTop = queue.top;
  });
  refresh(app);
  seldom = window.setInterval(() => document.hidden || refresh(app), SELDOM_MS);
  follow('/v1/events', ({ event, data }) => {
    if (event === 'start') refresh(app);
    else if (event === 'job') takeJob(app, JSON.parse(data));
    else if (event === 'batch') takeBatch(app, JSON.parse(data));
  }, signal).catch(app.refused);
}

export function stopQueue() {
  clearInterval(seldom);
  clearTimeout(soon);
  soon = 0;
  stopping.abort();
}

const filter = () => ({
  state: queue.states,
  label: queue.label,
  name: queue.name,
  batch: queue.batch,
  fields: 'batch_id,id,state,name,labels,created_at,started_at,ended_at,cached,progress',
});

/** Reloads the batches and the newest page of jobs; older loaded jobs are kept. @param {App} app */
async function refresh(app) {
  const { signal } = stopping;
  const mine = turn;
  try {
    const [page, listed, me] = await Promise.all([jobsOf({ ...filter(), limit: PAGE }), batchesOf({ limit: BATCHES }), askMe()]);
    if (signal.aborted || mine !== turn) return;
    const fresh = new Set(page.jobs.map((job) => job.id));
    const oldest = page.jobs[page.jobs.length - 1]?.id ?? '';
    // Ids sort by time, so that jobs older than the page are kept as loaded.
    const older = page.next_cursor ? queue.jobs.filter((job) => job.id < oldest && !fresh.has(job.id)) : [];
    queue.jobs = [...page.jobs.filter((job) => !isTyped(job)), ...older];
    if (!older.length) queue.cursor = page.next_cursor ?? '';
    queue.total = page.total ?? page.total_at_least ?? queue.jobs.length;
    queue.more = page.total === undefined;
    queue.batches = new Map(listed.batches.map((batch) => [batch.id, batch]));
    queue.me = me;
    queue.loaded = true;
    app.redraw();
    fill(app);
  } catch (error) {
    if (!signal.aborted) app.refused(error);
  }
}

/** Loads more if the list is scrolled near its end. The height of the list is known after the next frame. @param {App} app */
const fill = (app) => requestAnimationFrame(() => isNearEnd(document.querySelector('.list')) && loadMore(app));

/** Distance in pixels from the end of the list at which the next page is loaded. */
const AHEAD = 40 * 44;

/** @param {Element | null} list */
export const isNearEnd = (list) => list !== null && list.scrollTop > 0 && list.scrollTop + list.clientHeight > list.scrollHeight - AHEAD;

/** Schedules a refresh after a change. @param {App} app */
export function refreshSoon(app, pause = 0) {
  soon ||= window.setTimeout(() => {
    soon = 0;
    refresh(app);
  }, pause);
}

/** Handles an event of a job without a batch. @param {App} app @param {Job} job */
function takeJob(app, job) {
  if (isTyped(job)) return;
  const known = queue.jobs.some(({ id }) => id === job.id);
  const filtered = queue.states.length || queue.label || queue.name || (queue.batch && queue.batch !== 'none');
  if (known && !filtered) {
    queue.jobs = queue.jobs.map((other) => (other.id === job.id ? job : other));
    app.redraw();
  } else refreshSoon(app, REFRESH_MS / 4);
}

/** @param {App} app @param {Batch} batch */
function takeBatch(app, batch) {
  queue.batches.set(batch.id, batch);
  app.redraw();
  refreshSoon(app, REFRESH_MS);
}

/** @param {App} app @param {Partial<Pick<Queue, 'states' | 'label' | 'name' | 'batch'>>} wanted */
export function filterQueue(app, wanted) {
  turn += 1;
  Object.assign(queue, wanted, { jobs: [], cursor: '', loaded: false, top: 0 });
  app.redraw();
  refresh(app);
}

/** Loads the next page if there is one. @param {App} app */
export async function loadMore(app) {
  if (loadingMore || !queue.cursor) return;
  loadingMore = true;
  const mine = turn;
  try {
    const page = await jobsOf({ ...filter(), limit: MORE, cursor: queue.cursor });
    if (mine === turn) {
      const known = new Set(queue.jobs.map((job) => job.id));
      queue.jobs = [...queue.jobs, ...page.jobs.filter((job) => !known.has(job.id))];
      queue.cursor = page.next_cursor ?? '';
      app.redraw();
    }
  } catch (error) {
    app.refused(error);
    return;
  } finally {
    loadingMore = false;
  }
  fill(app);
}
