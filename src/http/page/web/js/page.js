// Entry point of the page: its state, routing, and the functions that all views use.

import { health, Refused } from './api.js';
import { openComparison } from './compare.js';
import { takeProfiles } from './contactform.js';
import { openKept, solve } from './editing.js';
import './fieldmap.js';
import { leaveForecast, openForecast, takeForecastFiles } from './forecast.js';
import { Unusable } from './files.js';
import { loadCurves } from './late.js';
import { openLine } from './line.js';
import { isGone, openJob } from './result.js';
import { startQueue, stopQueue } from './queue.js';
import { leaveRun, openRun } from './run.js';
import { formatRoute, parseRoute } from './routes.js';
import { renderShell } from './shell.js';
import { initialState } from './state.js';
import { createStore } from './store.js';

/** @typedef {import('./state.js').App} App */

const HEALTH_MS = 10_000;
const TOAST_MS = 4000;
const LONG_TOAST_MS = 12_000;
const CURVES_MS = 2000;
const ADDRESS_MS = 150;

const store = createStore(initialState());
let toastTimer = 0;
let addressTimer = 0;

/** @type {App} */
const app = {
  store,
  compose: (change) => store.set({ compose: { ...store.get().compose, ...change } }),
  redraw: () => store.set({ turn: store.get().turn + 1 }),
  say(text, action, duration = TOAST_MS) {
    clearTimeout(toastTimer);
    store.set({ toast: text, action: action ?? null });
    toastTimer = window.setTimeout(() => store.set({ toast: '', action: null }), duration);
  },
  refused(error) {
    if (error instanceof DOMException && error.name === 'AbortError') return;
    if (error instanceof Unusable) return app.say(error.message, undefined, LONG_TOAST_MS);
    if (!(error instanceof Refused)) throw error;
    if (error.status === 401) store.set({ keyLine: true });
    if (error.status === 0) store.set({ health: { ready: false, version: store.get().health?.version ?? '' } });
    app.say(error.message);
  },
  absent: (error) => (isGone(error) ? store.set({ absent: `${error.message[0].toUpperCase()}${error.message.slice(1)}.` }) : app.refused(error)),
  go(address) {
    if (location.hash === address) follow();
    else location.hash = address;
  },
  // Changes of the address are slow, and browsers limit their rate.
  remember(address) {
    clearTimeout(addressTimer);
    addressTimer = window.setTimeout(() => {
      history.replaceState(null, '', address);
      store.set({ route: parseRoute(address) });
    }, ADDRESS_MS);
  },
};

/** Opens the view of the address. */
function follow() {
  clearTimeout(addressTimer);
  const before = store.get().route;
  const route = parseRoute(location.hash);
  store.set({ route, absent: '' });
  if (route.view !== 'jobs') stopQueue();
  if (route.view === 'jobs') startQueue(app);
  if (route.view === 'result' || route.view === 'line') loadCurves();
  if (route.view === 'result') openJob(app, route.ids[0], route.query);
  if (route.view === 'compare') openComparison(app, route.ids, route.query);
  if (route.view === 'line' && route.query.kind === 'run' && route.ids[0]) openRun(app, route.ids[0], route.query).catch(app.absent);
  else leaveRun();
  if (route.view === 'line' && route.query.kind !== 'run') openLine(app, route.ids[0], route.query);
  if (route.view === 'forecast') openForecast(app, route.ids);
  else leaveForecast();
  if (before.view !== route.view) document.getElementById('main')?.focus({ preventScroll: true });
}

async function lookAtHealth() {
  if (document.hidden) return;
  try {
    const { status, version } = await health();
    store.set({ health: { ready: status === 'ready', version } });
  } catch {
    store.set({ health: { ready: false, version: store.get().health?.version ?? '' } });
  }
}

const root = /** @type {HTMLElement} */ (document.getElementById('page'));
root.replaceChildren();
store.on(() => renderShell(app, root));
addEventListener('hashchange', follow);
addEventListener('keydown', (event) => {
  if (event.key !== 'Enter' || !(event.ctrlKey || event.metaKey) || store.get().route.view !== 'compose') return;
  event.preventDefault();
  solve(app);
});
// Files can be dropped anywhere. Without these handlers the browser would open them instead of the page.
addEventListener('dragover', (event) => {
  if (event.dataTransfer?.types.includes('Files')) event.preventDefault();
});
addEventListener('drop', (event) => {
  if (!event.dataTransfer?.types.includes('Files')) return;
  event.preventDefault();
  const files = [...event.dataTransfer.files];
  if (!files.length) return;
  if (store.get().route.view === 'forecast') return void takeForecastFiles(app, files).catch(app.refused);
  app.go(formatRoute('compose'));
  takeProfiles(app, files).catch(app.refused);
});
// The first picture after "Solve" ends the measured waiting time.
root.addEventListener('drawn', () => {
  if (store.get().route.view !== 'result' || !performance.getEntriesByName('solve').length) return;
  performance.measure('solve to picture', 'solve');
  performance.clearMarks('solve');
});
setInterval(lookAtHealth, HEALTH_MS);
// The elements are loaded in advance, but after the page itself.
setTimeout(loadCurves, CURVES_MS);
lookAtHealth();
openKept(app);
if (!location.hash) history.replaceState(null, '', formatRoute('compose'));
follow();
