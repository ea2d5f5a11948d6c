// The view of the licences of third-party parts.

import { html } from '../vendor/lit-html.js';

/** @typedef {{ package: string, version: string, licence: string, why: string, files: { file: string }[] }} Vendored */

/** @type {Vendored[] | null} */
let vendored = null;
let asked = false;

/** @param {import('./state.js').App} app */
export function licencesView(app) {
  if (!asked) {
    asked = true;
    fetch(new URL('../vendor/vendor.json', import.meta.url)).then((answer) => answer.json()).then((list) => {
      vendored = list;
      app.redraw();
    }, app.refused);
  }
  return html`<section class="panel wait"><h1>Licences</h1>
    <p>The page itself is under the licences of railhead, MIT or Apache 2.0. It holds, unchanged:</p>
    <ul>${(vendored ?? []).map((part) => html`<li>${part.package} ${part.version}, ${part.licence}: ${part.why}
      (<a href=${new URL(`../vendor/${part.files.find(({ file }) => file.endsWith('LICENSE'))?.file}`, import.meta.url).pathname}>text</a>)</li>`)}</ul>
    <p>Colours: viridis and cividis of matplotlib (CC0), vik and berlin of Fabio Crameri (MIT).</p></section>`;
}
