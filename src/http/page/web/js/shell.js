// The frame around the views: top bar, input of the API key, and messages.

import { html, nothing, render } from '../vendor/lit-html.js';
import { apiKey, useKey } from './api.js';
import { compareView } from './compareview.js';
import { compose } from './compose.js';
import { isDark } from './field/palette.js';
import { forecastView } from './forecastview.js';
import { jobsView } from './jobsview.js';
import { licencesView } from './licences.js';
import { lineView } from './lineview.js';
import { COMPARED_MAX, marked } from './marks.js';
import { lookedAt } from './result.js';
import { result } from './resultview.js';
import { formatRoute } from './routes.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./routes.js').Route['view']} View */

const KEY_ICON = html`<svg viewBox="0 0 20 20" width="17" height="17" fill="none" stroke="currentColor" stroke-width="1.7" aria-hidden="true"><circle cx="6" cy="10" r="3.4"/><path d="M9.4 10H18v3.4M14.4 10v2.6"/></svg>`;

/** @type {Record<View, (app: App) => unknown>} */
const VIEWS = { compose, jobs: jobsView, result, compare: compareView, line: lineView, forecast: forecastView, licences: licencesView };
/** @type {Record<View, string>} */
const TITLES = { compose: 'Contact', jobs: 'Jobs', result: 'Result', compare: 'Compare', line: 'Track', forecast: 'Forecast', licences: 'Licences' };

/** @param {App} app @param {HTMLElement} root */
export function renderShell(app, root) {
  const { route, toast, action, keyLine, absent } = app.store.get();
  const act = () => {
    app.say('');
    action?.act();
  };
  document.title = `${TITLES[route.view]} – railhead`;
  render(html`${topBar(app)}${keyLine ? keyForm(app) : nothing}
    <main id="main" tabindex="-1">${absent ? absentPanel(absent) : VIEWS[route.view](app)}</main>
    <footer class="foot quiet"><a href="/docs/">API</a> · <a href="/openapi.json">contract</a> · <a href="#/licences">licences</a></footer>
    <div class=${toast ? 'toast on' : 'toast'} role="status" aria-live="polite">${toast}${action ? html` <button class="small" @click=${act}>${action.label}</button>` : nothing}</div>`, root);
}

/** @param {string} absent */
const absentPanel = (absent) => html`<section class="panel wait" role="alert"><h1>Nothing is here</h1><p>${absent} It may have been deleted, or have expired.</p>
  <a class="button primary" href="#/jobs">To the jobs</a></section>`;

/** @param {App} app */
function topBar(app) {
  const { route, health } = app.store.get();
  const looked = lookedAt();
  const ids = [...marked()].slice(0, COMPARED_MAX);
  /** @type {[View, string][]} */
  const tabs = [
    ['compose', formatRoute('compose')], ['jobs', formatRoute('jobs')],
    ...(looked ? [/** @type {[View, string]} */ (['result', formatRoute('result', [looked.job.id])])] : []),
    ['compare', formatRoute('compare', ids)], ['line', formatRoute('line')], ['forecast', formatRoute('forecast')],
  ];
  const state = health ? (health.ready ? 'ready' : 'away') : '…';
  return html`<header class="top">
    <a class="brand" href="#/compose"><img src=${new URL('../icon.svg', import.meta.url).pathname} alt="" width="26" height="26">railhead</a>
    <nav aria-label="Views">${tabs.map(([view, href]) => html`<a href=${href} aria-current=${route.view === view ? 'page' : nothing}>${TITLES[view]}${view === 'compare' && ids.length
      ? html` <span class="count">${ids.length}</span>` : nothing}</a>`)}</nav>
    <div class="right">
      <span class=${`health ${state === 'ready' ? 'up' : state === 'away' ? 'down' : ''}`} role="status"><i aria-hidden="true"></i>${state}<span class="wide"> ${health?.version ?? ''}</span></span>
      <button class="icon" aria-label="Light or dark" @click=${switchTheme}>◐</button>
      <button class="icon" aria-label="API key" aria-expanded=${app.store.get().keyLine ? 'true' : 'false'} @click=${() => app.store.set({ keyLine: !app.store.get().keyLine })}>${KEY_ICON}</button>
    </div></header>`;
}

/** @param {App} app */
function keyForm(app) {
  const use = (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    useKey(/** @type {HTMLInputElement} */ (/** @type {HTMLFormElement} */ (event.target).elements.namedItem('key')).value);
    app.store.set({ keyLine: false });
    window.dispatchEvent(new HashChangeEvent('hashchange'));
  };
  return html`<form class="keyline" @submit=${use}><label>API key <input name="key" type="password" autocomplete="off" .value=${apiKey()}></label>
    <button class="primary small">Use</button><span class="hint">Stored for this tab only and sent only to this server.</span></form>`;
}

function switchTheme() {
  const theme = isDark() ? 'light' : 'dark';
  document.documentElement.dataset.theme = theme;
  try {
    localStorage.setItem('railhead.theme', theme);
  } catch {
    // Storage is disabled; the choice applies until the page is left.
  }
}
