// Saves a drawing of the page as an SVG file with the styles of the style sheet.

import { html } from '../vendor/lit-html.js';
import { save } from './api.js';
import { fileName } from './downloads.js';

const LOOKS = ['fill', 'fill-opacity', 'stroke', 'stroke-width', 'stroke-dasharray', 'font-family', 'font-size', 'font-weight', 'text-anchor', 'opacity'];

/** @param {SVGSVGElement} drawing @returns {string} */
function saveDrawing(drawing) {
  const copy = /** @type {SVGSVGElement} */ (drawing.cloneNode(true));
  const [from, to] = [drawing, copy].map((root) => [root, ...root.querySelectorAll('*')]);
  from.forEach((element, at) => {
    const style = getComputedStyle(element);
    for (const look of LOOKS) to[at].setAttribute(look, style.getPropertyValue(look));
  });
  // The file gets a background, because drawings in the dark theme have light lines.
  const ground = document.createElementNS('http://www.w3.org/2000/svg', 'rect');
  Object.entries({ width: '100%', height: '100%', fill: getComputedStyle(drawing).getPropertyValue('--surface') }).forEach(([name, value]) => ground.setAttribute(name, value));
  copy.prepend(ground);
  copy.setAttribute('xmlns', 'http://www.w3.org/2000/svg');
  copy.setAttribute('width', String(drawing.viewBox.baseVal.width));
  return new XMLSerializer().serializeToString(copy);
}

/** Adds a button to a drawing that saves it. @param {string} name @param {unknown} drawing */
export function savable(name, drawing) {
  const press = (/** @type {Event} */ event) => {
    const svg = /** @type {Element} */ (event.currentTarget).parentElement?.querySelector('svg');
    if (svg) save(new Blob([saveDrawing(svg)], { type: 'image/svg+xml' }), `${fileName(name)}.svg`);
  };
  return html`<div class="savable">${drawing}<button class="small ghost" aria-label=${`Save as SVG: ${name}`} @click=${press}>SVG</button></div>`;
}
