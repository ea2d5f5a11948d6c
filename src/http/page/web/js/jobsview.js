// The view Jobs: batches with their progress, and a virtual list of jobs that renders only the visible rows.

import { html, nothing, svg } from '../vendor/lit-html.js';
import { cancel, download } from './api.js';
import { isThere, removeLater } from './deleting.js';
import { ago, count, seconds } from './format.js';
import { COMPARED_MAX, mark, marked, toggleMark } from './marks.js';
import { filterQueue, isNearEnd, jobsShown, loadMore, queueSeen, refreshSoon } from './queue.js';
import { formatRoute } from './routes.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Job} Job */
/** @typedef {import('./api.js').Batch} Batch */
/** @typedef {import('./api.js').State} State */

const ROW = 44;
const SPARE_ROWS = 8;
/** Number of ended batches that are shown. */
const ENDED_SHOWN = 3;
const STATES = /** @type {const} */ (['queued', 'running', 'succeeded', 'failed', 'cancelled']);
/** @type {Record<State, string>} */
const GLYPHS = { queued: '○', running: '◔', succeeded: '●', failed: '✕', cancelled: '⊘' };

/** @param {App} app */
export function jobsView(app) {
  const queue = queueSeen();
  const jobs = jobsShown();
  const newest = [...queue.batches.values()].filter(isThere).sort((one, two) => (one.id < two.id ? 1 : -1));
  // Unfinished batches are always shown, ended ones only if they are among the newest.
  const shown = newest.filter((batch, at) => !batch.ended || at < ENDED_SHOWN);
  const number = queue.loaded ? html` <span class="quiet n">${count(Math.max(queue.total, jobs.length))}${queue.more ? ' or more' : ''}</span>` : nothing;
  return html`<h1 class="visually-hidden">Jobs</h1>
    ${shown.map((batch) => batchPanel(app, batch))}
    <section class="panel jobs" aria-labelledby="h-jobs">
      <header class="bar"><h2 id="h-jobs">Jobs${number}</h2>${filters(app)}</header>
      ${chosenBar(app, jobs)}
      ${usage(queue.me)}
      <div class="rows head"><span>${allMark(app, jobs)}</span><span>State</span><span>Name</span><span>Labels</span><span>Submitted</span><span>Took</span><span></span></div>
      ${list(app, jobs)}
    </section>`;
}

/** Shows the use of the queue by the tenant; nothing for an anonymous tenant without queued jobs. @param {import('./api.js').Schemas['Me'] | null} me */
function usage(me) {
  if (!me || (me.tenant === 'anonymous' && !me.used.queued)) return nothing;
  const share = me.used.queued / Math.max(1, me.quota.queued);
  return html`<p class=${share > 0.9 ? 'pad warn' : 'pad quiet'}>${me.tenant === 'anonymous' ? '' : html`<strong>${me.tenant}</strong>, `}${count(me.used.queued)} of
    ${count(me.quota.queued)} places of the queue in use</p>`;
}

/** Delay after a key press before the list is requested. */
const TYPING_MS = 250;
let typing = 0;

/** @param {App} app */
function filters(app) {
  const queue = queueSeen();
  const text = (/** @type {'label' | 'name'} */ what) => (/** @type {Event} */ event) => {
    const { value } = /** @type {HTMLInputElement} */ (event.target);
    clearTimeout(typing);
    // A label without a value is incomplete.
    if (what === 'label' && value && !/^[^:]+:.+/.test(value)) return;
    typing = window.setTimeout(() => value !== queue[what] && filterQueue(app, { [what]: value }), TYPING_MS);
  };
  const toggle = (/** @type {string} */ state) => () =>
    filterQueue(app, { states: queue.states.includes(state) ? queue.states.filter((other) => other !== state) : [...queue.states, state] });
  const show = (/** @type {Event} */ event) => filterQueue(app, { batch: /** @type {HTMLSelectElement} */ (event.target).value });
  const batch = queue.batches.get(queue.batch);
  const one = queue.batch !== '' && queue.batch !== 'none';
  return html`<label class="inline">Show <select class="slim" @change=${show}>
      ${one ? html`<option value=${queue.batch} selected>jobs of ${batch?.name || 'one batch'}</option>` : nothing}
      <option value="none" ?selected=${queue.batch === 'none'}>single jobs</option>
      <option value="" ?selected=${!queue.batch}>all, with those of batches</option></select></label>
    <div class="segs" role="group" aria-label="States">${STATES.map((state) => html`<label class="seg">
      <input type="checkbox" .checked=${queue.states.includes(state)} @change=${toggle(state)}><span>${state}</span></label>`)}</div>
    <label class="inline">Name <input class="search" placeholder="part of it" .value=${queue.name} @input=${text('name')}></label>
    <label class="inline">Label <input class="search" placeholder="line:A12" .value=${queue.label} @input=${text('label')}></label>`;
}

/** Checkbox that selects all loaded jobs, or none. @param {App} app @param {readonly Job[]} jobs */
function allMark(app, jobs) {
  const ids = jobs.map(({ id }) => id);
  const all = ids.length > 0 && marked().size >= ids.length && ids.every((id) => marked().has(id));
  return html`<input type="checkbox" aria-label="Choose all jobs of the list" .checked=${all} @change=${() => mark(app, all ? [] : ids)}>`;
}

/** Bar with the actions on the selected jobs. @param {App} app @param {readonly Job[]} shown */
function chosenBar(app, shown) {
  const jobs = marked().size ? shown.filter(({ id }) => marked().has(id)) : [];
  if (!jobs.length) return nothing;
  const ended = jobs.filter(({ state }) => !isOpen(state)).map(({ id }) => id);
  const solved = jobs.filter(({ state }) => state === 'succeeded').map(({ id }) => id);
  const drop = () => {
    mark(app, []);
    removeLater(app, 'jobs', ended, ended.length === 1 ? 'One job' : `${count(ended.length)} jobs`);
  };
  const compare = solved.length >= 2 && solved.length <= COMPARED_MAX;
  return html`<div class="bar chosen"><span>${count(jobs.length)} chosen</span>
    ${compare ? html`<a class="button primary small" href=${formatRoute('compare', solved)}>Compare ${solved.length}</a>` : html`<span class="hint">two to four can be compared</span>`}
    ${ended.length ? html`<button class="small" @click=${drop}>Delete ${count(ended.length)}</button>` : nothing}
    <button class="small ghost" @click=${() => mark(app, [])}>None</button></div>`;
}

/** @param {State} state */
const isOpen = (state) => state === 'queued' || state === 'running';

/** @param {App} app @param {readonly Job[]} jobs */
function list(app, jobs) {
  const queue = queueSeen();
  const height = Math.max(320, innerHeight - 190);
  const first = Math.max(0, Math.min(jobs.length, Math.floor(queue.top / ROW)) - SPARE_ROWS);
  const rows = jobs.slice(first, first + Math.ceil(height / ROW) + 2 * SPARE_ROWS);
  const scrolled = (/** @type {Event} */ event) => {
    const list = /** @type {HTMLElement} */ (event.target);
    const { scrollTop } = list;
    if (isNearEnd(list)) loadMore(app);
    if (Math.abs(scrollTop - queue.top) < 3 * ROW && scrollTop > 0) return;
    queue.top = scrollTop;
    app.redraw();
  };
  const after = jobs.length - first - rows.length;
  return html`<div class="list" tabindex="0" role="group" aria-label="Jobs, newest first" @scroll=${scrolled}>
    ${spacer(first)}${rows.map((job) => row(app, job))}${spacer(after)}
    ${queue.loaded && !jobs.length && !queue.cursor ? html`<p class="quiet pad">No jobs${queue.states.length ? ` that are ${queue.states.join(' or ')}` : ''}${queue.name ? ` with “${queue.name}” in their names` : ''}${queue.label ? ` with the label ${queue.label}` : ''}.
      <a href="#/compose">Start one.</a></p>` : nothing}
    ${queue.loaded ? nothing : html`<p class="quiet pad">Loading …</p>`}
  </div>`;
}

/** Spacer with the height of rows that are not rendered. @param {number} rows */
const spacer = (rows) => svg`<svg class="spacer" width="1" height=${rows * ROW} aria-hidden="true"></svg>`;

/** @param {App} app @param {Job} job */
function row(app, job) {
  const name = job.name || job.id;
  const open = isOpen(job.state);
  const act = () => {
    if (open) cancel('jobs', job.id).then(() => refreshSoon(app), app.refused);
    else removeLater(app, 'jobs', [job.id], name);
  };
  return html`<div class="rows job">
    <span><input type="checkbox" aria-label=${`Choose ${name}`} .checked=${marked().has(job.id)}
      @change=${() => toggleMark(app, job.id)}></span>
    <span class=${`state ${job.state}`}><i aria-hidden="true">${GLYPHS[job.state]}</i> ${job.state}${job.state === 'running'
      ? html` <progress max="1" .value=${job.progress} aria-label="Progress"></progress>` : nothing}</span>
    <a class="name" href=${formatRoute('result', [job.id])}>${name}</a>
    <span class="labels">${Object.entries(job.labels).slice(0, 3).map(([key, value]) => html`<span class="chip">${key}: ${value}</span>`)}</span>
    <time datetime=${job.created_at} title=${job.created_at}>${ago(job.created_at)}</time>
    <span class="n">${took(job)}</span>
    <span class="do"><button class=${open ? 'small' : 'small ghost'} aria-label=${`${open ? 'Cancel' : 'Delete'} ${name}`} @click=${act}>${open ? 'Cancel' : 'Delete'}</button></span>
  </div>`;
}

/** @param {Job} job */
function took(job) {
  if (job.cached) return 'solved before';
  // Jobs of a batch are solved in groups, so that a single job has no time of its own.
  if (job.batch_id) return '';
  if (!job.started_at || !job.ended_at) return '';
  const time = (Date.parse(job.ended_at) - Date.parse(job.started_at)) / 1000;
  return time > 0 ? seconds(time) : '< 1 ms';
}

/** @param {App} app @param {Batch} batch */
function batchPanel(app, batch) {
  const states = STATES.filter((state) => batch.states[state]).map((state) => `${count(batch.states[state])} ${state}`);
  const table = () => download(`/v1/batches/${batch.id}/results?format=csv`, `batch-${batch.id.slice(0, 8)}.csv`).catch(app.refused);
  const drop = () => removeLater(app, 'batches', [batch.id], batch.name || `The batch of ${count(batch.count)}`);
  return html`<section class="panel batch" aria-label=${`Batch of ${batch.count}`} data-batch=${batch.id}>
    <strong>${batch.name || `Batch of ${count(batch.count)}`}</strong>${batch.name ? html`<span class="quiet">${count(batch.count)} cases</span>` : nothing}
    ${Object.entries(batch.labels).map(([key, value]) => html`<span class="chip">${key}: ${value}</span>`)}
    <svg class="shares" viewBox="0 0 1000 10" preserveAspectRatio="none" role="img" aria-label=${`${Math.round(100 * batch.progress)} percent ended`}>${shares(batch)}</svg>
    <span class="n">${Math.floor(100 * batch.progress)} %</span><span class="quiet">${states.join(' · ')}</span>
    <span class="do">${batch.ended ? html`
      <button class="small" @click=${() => filterQueue(app, { batch: batch.id })}>Its jobs</button>
      <a class="button small" href=${formatRoute('line', [batch.id])}>Along the track</a><button class="small" @click=${table}>CSV</button>
      <button class="small ghost" aria-label=${`Delete the batch of ${batch.count}`} @click=${drop}>Delete</button>`
      : html`<button class="small" @click=${() => cancel('batches', batch.id).catch(app.refused)}>Cancel all</button>`}</span>
  </section>`;
}

/** @param {Batch} batch */
function shares({ states, count: all }) {
  let at = 0;
  return /** @type {const} */ (['succeeded', 'failed', 'cancelled', 'running']).map((state) => {
    const from = at;
    at += (1000 * states[state]) / Math.max(1, all);
    return svg`<rect class=${state} x=${from} width=${at - from} height="10"/>`;
  });
}
