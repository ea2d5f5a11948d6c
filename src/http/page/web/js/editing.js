// What happens to the case that is being written: changes, checks while writing, the result while typing, solving.

import { cancel, checkCase, examples as examplesOf, Refused, remove, result as resultOf, submit } from './api.js';
import { at, pretty, put } from './document.js';
import { hasFields, loadField } from './fields.js';
import { formatRoute } from './routes.js';
import { adoptJob } from './result.js';
import { inOrder } from './starts.js';
import { removeTyped, TYPED } from './typed.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */

const KEPT = 'railhead.case';
const PAUSE_MS = 120;
const WAIT_S = 10;
/** The example that a new tab begins with. */
const FIRST = 'hertz-steel';
/** Estimated seconds up to which a case is solved while it is written. */
const LIVE_SECONDS_MAX = 0.05;

let timer = 0;
let began = -Infinity;
let asking = new AbortController();

/** The case as it was left in this tab, or the first example. @param {App} app */
export async function openKept(app) {
  const kept = sessionStorage.getItem(KEPT);
  if (kept) editText(app, kept);
  try {
    app.compose({ examples: await examplesOf() });
    removeTyped().catch(() => {});
    if (!kept) openExample(app, FIRST);
  } catch (error) {
    app.refused(error);
  }
}

/** @param {App} app @param {string} text */
export function editText(app, text) {
  /** @type {JsonObject | null} */
  let document = app.store.get().compose.document;
  let unreadable = '';
  try {
    document = JSON.parse(text);
  } catch (error) {
    unreadable = `Not JSON: ${error instanceof Error ? error.message : error}`;
  }
  take(app, document, text, unreadable);
}

/** @param {App} app @param {JsonObject} document */
export const editDocument = (app, document) => take(app, document, pretty(document), '');

/**
 * @param {App} app
 * @param {string} pointer
 * @param {JsonValue | undefined} value
 */
export function change(app, pointer, value) {
  editDocument(app, put(app.store.get().compose.document ?? {}, pointer, value));
}

/** @param {App} app @param {string} name */
export function openExample(app, name) {
  const example = app.store.get().compose.examples.find((known) => known.name === name);
  if (!example) return;
  app.compose({ example: name, files: {}, typing: null });
  editDocument(app, inOrder(/** @type {JsonObject} */ (/** @type {unknown} */ (example.case))));
}

/**
 * @param {App} app
 * @param {JsonObject | null} document
 * @param {string} text
 * @param {string} unreadable
 */
function take(app, document, text, unreadable) {
  app.compose({ document, text, unreadable, refusal: '', ...(unreadable ? { faults: [], checked: null } : {}) });
  sessionStorage.setItem(KEPT, text);
  asking.abort();
  // The first change is checked at once, those of a moving slider one after another.
  timer ||= window.setTimeout(() => check(app), Math.max(0, began + PAUSE_MS - performance.now()));
}

/** @param {App} app */
async function check(app) {
  timer = 0;
  const { text, unreadable } = app.store.get().compose;
  if (unreadable) return;
  began = performance.now();
  const mine = (asking = new AbortController());
  try {
    const checked = await checkCase(text, mine.signal);
    if (mine.signal.aborted) return;
    const type = at(app.store.get().compose.document ?? undefined, '/contact/type');
    const understood = checked.understood ? { type, of: checked.understood } : null;
    app.compose({ checked, understood, faults: [], refusal: '' });
    await preview(app, checked.digest, mine.signal);
  } catch (error) {
    if (!mine.signal.aborted) showRefusal(app, error);
  }
}

/** @param {App} app @param {unknown} error */
function showRefusal(app, error) {
  if (error instanceof Refused && error.faults.length) app.compose({ checked: null, faults: error.faults, preview: null });
  else {
    app.compose({ checked: null, faults: [], refusal: error instanceof Error ? error.message : String(error), preview: null });
    if (error instanceof Refused && error.status === 401) app.refused(error);
  }
}

/**
 * Solves a cheap case while it is written. The job is removed as soon as its answer is here.
 * @param {App} app
 * @param {string} digest
 * @param {AbortSignal} signal
 */
async function preview(app, digest, signal) {
  const { document, checked, live, preview: known } = app.store.get().compose;
  if (!live || !document || !checked || checked.estimate.seconds > LIVE_SECONDS_MAX) {
    app.compose({ preview: null });
    return;
  }
  if (known?.digest === digest) return;
  const text = JSON.stringify({ ...document, ...TYPED });
  // Not given up when the next character is written: its job would stay.
  const job = await submit(text, { wait: 2 });
  try {
    if (job.state !== 'succeeded') return;
    const result = job.result ?? (await resultOf(job.id));
    const field = hasFields(result) ? await loadField(job.id, result, 0, 0) : null;
    if (!signal.aborted) app.compose({ preview: { digest, result, field } });
  } finally {
    if (job.state === 'queued' || job.state === 'running') await cancel('jobs', job.id).catch(() => {});
    await remove('jobs', job.id).catch(() => {});
  }
}

/** @param {App} app @param {boolean} live */
export function solveLive(app, live) {
  app.compose({ live, preview: null });
  const { document, checked } = app.store.get().compose;
  if (live && document && checked) preview(app, checked.digest, asking.signal).catch(app.refused);
}

/** Solves the case and shows its result. @param {App} app */
export async function solve(app) {
  const { text, solving, unreadable } = app.store.get().compose;
  if (solving || unreadable) return;
  performance.mark('solve');
  app.compose({ solving: true });
  try {
    const job = await submit(text, { wait: WAIT_S });
    adoptJob(app, job, JSON.parse(text));
    app.go(formatRoute('result', [job.id]));
  } catch (error) {
    showFaults(app, error);
  } finally {
    app.compose({ solving: false });
  }
}

/** Queues the case and shows the list. @param {App} app */
export async function queue(app) {
  try {
    const job = await submit(app.store.get().compose.text);
    app.say(`Queued as ${job.id.slice(0, 8)}`);
    app.go(formatRoute('jobs'));
  } catch (error) {
    showFaults(app, error);
  }
}

/** @param {App} app @param {unknown} error */
function showFaults(app, error) {
  if (error instanceof Refused && error.faults.length) app.compose({ faults: error.faults, checked: null });
  else app.refused(error);
}
