// Remarks of the service: warnings first, notes folded, and equal remarks merged.

import { html, nothing } from '../vendor/lit-html.js';
import { wordsOf } from './words.js';

/** @typedef {import('./api.js').Remark} Remark */
/** @typedef {{ remark: Remark, patches: number[], points: number[] }} Group */
/** @typedef {{ patch?: number, point?: number }} Place */

/**
 * Groups remarks that differ only in their patch or motion.
 * @param {readonly Remark[]} remarks
 * @returns {Group[]}
 */
export function grouped(remarks) {
  /** @type {Map<string, Group>} */
  const groups = new Map();
  for (const remark of remarks) {
    const name = `${remark.code}\n${remark.pointer ?? ''}\n${remark.detail}`;
    const group = groups.get(name) ?? { remark, patches: [], points: [] };
    groups.set(name, group);
    if (typeof remark.patch === 'number' && !group.patches.includes(remark.patch)) group.patches.push(remark.patch);
    if (typeof remark.point === 'number' && !group.points.includes(remark.point)) group.points.push(remark.point);
  }
  return [...groups.values()];
}

/**
 * Shows warnings, and notes in a folded section.
 * @param {readonly Remark[]} remarks
 * @param {(place: Place) => void} [go] Opens the patch or motion of a remark.
 */
export function remarkList(remarks, go) {
  const groups = grouped(remarks);
  const warnings = groups.filter(({ remark }) => remark.severity === 'warning');
  const notes = groups.filter(({ remark }) => remark.severity !== 'warning');
  if (!groups.length) return nothing;
  return html`<div class="remarks">${warnings.map((group) => entry(group, go))}
    ${notes.length ? html`<details class="notes"><summary>${notes.length === 1 ? '1 note' : `${notes.length} notes`}</summary>${notes.map((group) => entry(group, go))}</details>` : nothing}</div>`;
}

/** Shows the name of a value of the case, or its pointer if it has no name. @param {string} pointer */
export function inWords(pointer) {
  const { label, known } = wordsOf(pointer);
  return known ? html`<span title=${pointer}>${label}</span>` : html`<code>${pointer}</code>`;
}

/** @param {Group} group @param {((place: Place) => void) | undefined} go */
function entry({ remark, patches, points }, go) {
  const places = [
    ...patches.map((patch) => ({ label: `patch ${patch}`, place: { patch } })),
    ...points.map((point) => ({ label: `motion ${point + 1}`, place: { point } })),
  ];
  return html`<p class=${`remark ${remark.severity}`} data-code=${remark.code}>
    ${go ? places.map(({ label, place }) => html`<button class="small" @click=${() => go(place)}>${label}</button> `) : nothing}
    ${remark.pointer && !remark.detail.startsWith(`${wordsOf(remark.pointer).label}:`) ? html`<b>${inWords(remark.pointer)}</b> ` : nothing}${remark.detail}</p>`;
}
