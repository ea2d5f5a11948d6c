// Download buttons of a result: pictures, tables and arrays of the chosen patch and motion.

import { html, nothing } from '../vendor/lit-html.js';
import { download, save } from './api.js';
import { FieldMap } from './fieldmap.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./result.js').Looked} Looked */

/** Output that contains each quantity, and the name of the quantity in `plot.svg`. @type {Record<string, { part: string, plot: string }>} */
const PARTS = {
  pressure: { part: 'pressure', plot: 'pressure' },
  traction: { part: 'tractions', plot: 'traction' },
  traction_x: { part: 'tractions', plot: 'traction' },
  traction_y: { part: 'tractions', plot: 'traction' },
  slip: { part: 'slip', plot: 'slip' },
  temperature: { part: 'temperature', plot: 'temperature' },
  zones: { part: 'zones', plot: 'zones' },
};
const TABLES = ['csv', 'npz', 'vtk'];

/** Returns a name in a form suitable for files. @param {string} name */
export const fileName = (name) => name.toLowerCase().replace(/[^a-z0-9.]+/g, '-').replace(/^-|-$/g, '').slice(0, 48) || 'result';

/** @param {App} app @param {Looked} looked */
export function downloads(app, { job, patch, point, quantity }) {
  const names = PARTS[quantity];
  const base = `${fileName(job.name ?? job.id)}-${patch}-${point}`;
  const chosen = `patch=${patch}&point=${point}`;
  const get = (/** @type {string} */ path, /** @type {string} */ end) => () =>
    download(`/v1/jobs/${job.id}/${path}`, `${base}-${end}`).catch(app.refused);
  return html`
    ${names ? html`
      <button class="small" @click=${get(`plot.svg?field=${names.plot}&${chosen}`, `${names.plot}.svg`)}>SVG</button>
      <button class="small" @click=${() => savePicture(`${base}-${names.plot}.png`)}>PNG</button>
      ${TABLES.map((format) => html`<button class="small" @click=${get(`${names.part}?format=${format}&${chosen}`, `${names.part}.${format}`)}>${format.toUpperCase()}</button>`)}` : nothing}
    <button class="small" @click=${get('resultants?format=csv', 'resultants.csv')}>Numbers</button>`;
}

/** Saves the map as shown on the screen, at double density. @param {string} name */
async function savePicture(name) {
  const map = document.querySelector('field-map.main');
  const picture = map instanceof FieldMap ? await map.png() : null;
  if (picture) save(picture, name);
}
