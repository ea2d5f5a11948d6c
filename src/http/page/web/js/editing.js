// Editing of a case: changes, validation and live result while typing, and solving.

import { cancel, checkCase, examples as examplesOf, Refused, remove, result as resultOf, submit } from './api.js';
import { withLoadOfCurve } from './curving.js';
import { at, numberAt, pretty, put } from './document.js';
import { hasFields, loadField } from './fields.js';
import { formatRoute } from './routes.js';
import { adoptJob, tellingPoint } from './result.js';
import { freeRolling, hasSections, inOrder, lacksSection, standardSection, withEverything, withFields, withoutExtras } from './starts.js';
import { removeTyped, TYPED } from './typed.js';
import { oneWheel } from './wheelloads.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */
/** @typedef {import('./api.js').Fault} Fault */

const BODIES = /** @type {const} */ (['rail', 'wheel']);
const KEPT = 'railhead.case';
const PAUSE_MS = 120;
const WAIT_S = 10;
const TYPED_WAIT_S = 8;
/** Time to wait before a cancelled job is removed: it may still run for a moment and cannot be removed until it ends. */
const CANCELLED_MS = 1500;
/** Example that a new tab starts with: a new wheel on a new rail, rolling freely. */
const FIRST = 'wheel-rail';
/** Largest estimated time in seconds for solving while typing. The first case of a page may take longer. */
const LIVE_SECONDS_MAX = 1;
const FIRST_SECONDS_MAX = 10;

let timer = 0;
let began = -Infinity;
let asking = new AbortController();
const CHANGED = ', changed';
/** Text of the example when it was opened. */
let opened = '';
/** Whether a live result is being computed. */
let previewing = false;
/** Whether no live result has been requested since the page was opened. */
let first = true;

/** Opens the case that was last edited in this tab, or the first example. @param {App} app */
export async function openKept(app) {
  const kept = sessionStorage.getItem(KEPT);
  if (kept) editText(app, kept);
  try {
    app.compose({ examples: await examplesOf() });
    removeTyped().catch(() => {});
    if (!kept) openFirst(app);
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

/** Replaces the case after a change in the form. @param {App} app @param {JsonObject} document */
export function editDocument(app, document) {
  const loaded = withLoadOfCurve(app.store.get().compose.document, document);
  take(app, loaded, pretty(loaded), '');
}

/**
 * @param {App} app
 * @param {string} pointer
 * @param {JsonValue | undefined} value
 */
export function change(app, pointer, value) {
  const { document, example, examples } = app.store.get().compose;
  const changed = put(document ?? {}, pointer, value);
  const known = at(/** @type {JsonObject | undefined} */ (/** @type {unknown} */ (examples.find(({ name }) => name === example)?.case)), '/name');
  // The name of an example describes its unchanged values.
  editDocument(app, known && pointer !== '/name' && changed.name === known ? { ...changed, name: `${known}${CHANGED}` } : changed);
}

/** Opens an example with all fields requested. @param {App} app @param {string} name */
export function openExample(app, name) {
  const example = /** @type {JsonObject | undefined} */ (/** @type {unknown} */ (app.store.get().compose.examples.find((known) => known.name === name)?.case));
  if (example) openCase(app, name, { ...example, outputs: withFields(example.outputs) });
}

/** Opens the case that a new tab starts with, including damage, stresses and temperature. @param {App} app */
function openFirst(app) {
  const example = /** @type {JsonObject | undefined} */ (/** @type {unknown} */ (app.store.get().compose.examples.find((known) => known.name === FIRST)?.case));
  if (example) openCase(app, FIRST, withEverything({ ...example, motion: freeRolling('profiles') }));
}

/** @param {App} app @param {string} name @param {JsonObject} document */
function openCase(app, name, document) {
  const ordered = inOrder(document);
  opened = pretty(ordered);
  app.compose({ example: name, files: {}, typing: null });
  take(app, ordered, opened, '');
}

/** Returns whether the case is an unchanged example. @param {import('./state.js').Compose} state */
export const isUntouched = ({ example, text }) => example !== '' && text === opened;

/**
 * @param {App} app
 * @param {JsonObject | null} document
 * @param {string} text
 * @param {string} unreadable
 */
function take(app, document, text, unreadable) {
  app.compose({ document, text, unreadable, refusal: '', ...(unreadable ? { faults: [], checked: null } : {}) });
  try {
    sessionStorage.setItem(KEPT, text);
  } catch {
    // The browser stores about 5 MB. A larger case is lost when the page is left.
    sessionStorage.removeItem(KEPT);
  }
  asking.abort();
  // The first change is checked at once; rapid changes, such as of a slider, at intervals.
  timer ||= window.setTimeout(() => check(app), Math.max(0, began + PAUSE_MS - performance.now()));
}

/** @param {App} app */
async function check(app) {
  timer = 0;
  const { text, document, unreadable } = app.store.get().compose;
  if (unreadable || !document) return;
  began = performance.now();
  const mine = (asking = new AbortController());
  try {
    const lone = loneSection(document);
    if (lone) await checkLone(app, document, lone, mine.signal);
    else {
      const type = at(document, '/contact/type');
      const wheel = type === 'wheelset' ? checkCase(JSON.stringify(oneWheel(document, 'left', firstShift(document))), mine.signal).catch(() => null) : null;
      const [whole, one] = await Promise.all([checkCase(text, mine.signal), wheel]);
      if (mine.signal.aborted) return;
      // For a wheelset, the left wheel is drawn.
      const checked = one ? { ...whole, quality: one.quality, understood: one.understood } : whole;
      const understood = checked.understood ? { type, of: checked.understood } : null;
      app.compose({ checked, understood, lone: null, faults: [], refusal: '' });
      preview(app).catch(app.refused);
    }
  } catch (error) {
    if (!mine.signal.aborted) showRefusal(app, error);
  }
}

/** Returns the first lateral shift of a wheelset, in mm. @param {JsonObject} document */
function firstShift(document) {
  const [number, from, first] = ['', '/from', '/values/0'].map((end) => numberAt(document, `/contact/lateral_shift_mm${end}`));
  return [number, from, first].find(Number.isFinite) ?? 0;
}

/** Returns the body whose cross-section is given if the other one is missing; null otherwise. @param {JsonObject} document @returns {'rail' | 'wheel' | null} */
function loneSection(document) {
  const there = BODIES.filter((body) => hasSections(at(document, '/contact/type')) && !lacksSection(document, body));
  return there.length === 1 ? there[0] : null;
}

/**
 * Checks a single cross-section, with a standard one in place of its missing counterpart.
 * @param {App} app
 * @param {JsonObject} document
 * @param {'rail' | 'wheel'} body
 * @param {AbortSignal} signal
 */
async function checkLone(app, document, body, signal) {
  const other = body === 'rail' ? 'wheel' : 'rail';
  const standard = standardSection(app.store.get().compose.examples, other);
  const whole = oneWheel(put(document, `/contact/${other}`, standard), 'right', 0);
  /** @type {Fault[]} */
  let faults = [];
  let line = null;
  try {
    const { understood } = await checkCase(JSON.stringify(whole), signal);
    line = understood?.placement?.[`${body}_mm`] ?? null;
  } catch (error) {
    if (!(error instanceof Refused) || !error.faults.length) throw error;
    faults = error.faults.filter(({ pointer }) => pointer?.startsWith(`/contact/${body}`));
  }
  if (!signal.aborted) app.compose({ checked: null, understood: null, preview: null, refusal: '', faults, lone: { body, line } });
}

/** @param {App} app @param {unknown} error */
function showRefusal(app, error) {
  if (error instanceof Refused && error.faults.length) app.compose({ checked: null, lone: null, faults: error.faults, preview: null });
  else {
    app.compose({ checked: null, lone: null, faults: [], refusal: error instanceof Error ? error.message : String(error), preview: null });
    if (error instanceof Refused && error.status === 401) app.refused(error);
  }
}

/** Solves the case while typing if that is fast. One job runs at a time, always of the newest case. @param {App} app */
async function preview(app) {
  if (previewing) return;
  previewing = true;
  try {
    for (let next = wanted(app); next; next = wanted(app)) await solveTyped(app, next);
  } finally {
    previewing = false;
  }
}

/** Returns the digest of the case that is to be solved while typing; empty for none. @param {App} app */
function wanted(app) {
  const { document, checked, live, preview: known } = app.store.get().compose;
  if (!checked || known?.digest === checked.digest) return '';
  const cheap = live && document && checked.estimate.seconds < (first ? FIRST_SECONDS_MAX : LIVE_SECONDS_MAX);
  if (!cheap && known) app.compose({ preview: null });
  return cheap ? checked.digest : '';
}

/**
 * Solves the case without outputs that the preview does not show, and removes the job after its response.
 * @param {App} app
 * @param {string} digest
 */
async function solveTyped(app, digest) {
  const { document } = app.store.get().compose;
  const job = await submit(JSON.stringify({ ...withoutExtras(document ?? {}), ...TYPED }), { wait: first ? WAIT_S : TYPED_WAIT_S });
  first = false;
  /** @type {import('./state.js').Preview} */
  let answer = { digest, result: null, failure: job.state === 'failed' ? (job.error?.detail ?? 'The case cannot be solved.') : '', patch: 0, point: 0, field: null };
  try {
    const result = job.state === 'succeeded' ? (job.result ?? (await resultOf(job.id))) : null;
    if (result) {
      const loads = result.patches.map((patch) => patch.normal_force_n);
      const patch = loads.indexOf(Math.max(...loads));
      const point = tellingPoint(result.patches[patch].points);
      answer = { ...answer, result, patch, point, field: hasFields(result) ? await loadField(job.id, result, patch, point) : null };
    }
  } finally {
    // A result that arrives after the option was switched off is not shown.
    app.compose({ preview: app.store.get().compose.live ? answer : null });
    const open = job.state === 'queued' || job.state === 'running';
    if (open) await cancel('jobs', job.id).catch(() => {});
    setTimeout(() => remove('jobs', job.id).catch(() => {}), open ? CANCELLED_MS : 0);
  }
}

/** @param {App} app @param {boolean} live */
export function solveLive(app, live) {
  app.compose({ live, preview: null });
  preview(app).catch(app.refused);
}

/** Solves the case and shows its result. @param {App} app */
export async function solve(app) {
  const { text, solving, reading, unreadable } = app.store.get().compose;
  if (solving || reading || unreadable) return;
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
    await submit(app.store.get().compose.text);
    app.say('Added to the queue');
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
