// Panel with the loads of each wheel on its rail, the margin to Nadal's limit, and the forces of every patch in local and track axes.

import { html, nothing } from '../vendor/lit-html.js';
import { degrees, fixed, number, plusMinus } from './format.js';
import { choose, frictionOf } from './result.js';
import { inTrackAxes, nadal, outward, sideOf, wheelLoads } from './wheelloads.js';
import { positionOf } from './wheelsetview.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./result.js').Looked} Looked */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./wheelloads.js').WheelLoad} WheelLoad */

/** Returns the patches that are shown together: those of one position of a wheelset, else all. @param {JobResult} answer @param {number} patch The chosen patch. */
export function patchesWith({ wheelset, patches }, patch) {
  const position = wheelset?.positions[positionOf(wheelset, patch)];
  return position ? [...position.left.patches, ...position.right.patches] : [...patches.keys()];
}

/** @param {App} app @param {Looked} looked @param {JobResult} answer */
export function loadsPanel(app, looked, answer) {
  const at = answer.wheelset ? positionOf(answer.wheelset, looked.patch) : looked.point;
  const loads = wheelLoads(answer, looked.document, at);
  if (!loads.length) return nothing;
  return html`<section class="panel" aria-labelledby="h-loads"><header class="bar"><h2 id="h-loads">Wheel loads on the rail</h2>
      <span class="hint">Y positive to the field side</span></header>
    ${loads.map((load) => wheelTable(looked, load, loads.length > 1))}
    ${loads.length > 1 ? axle(loads) : nothing}
    ${patchTable(app, looked, answer)}</section>`;
}

/** @param {Looked} looked @param {WheelLoad} load @param {boolean} named */
function wheelTable(looked, { side, x_n, y_n, q_n, x_error_n, y_error_n }, named) {
  const angle = looked.flange[side];
  const friction = frictionOf(looked);
  const limit = angle === undefined ? NaN : nadal(angle, friction);
  const ratio = y_n / q_n;
  const error = y_error_n && y_error_n / q_n;
  const row = (/** @type {unknown} */ label, /** @type {unknown} */ value) => html`<div><dt>${label}</dt><dd>${value}</dd></div>`;
  return html`<dl class="table" data-wheel=${side}>${named ? row(html`<b>${side} wheel</b>`, '') : nothing}
    ${row('Q, vertical', `${number(q_n / 1000)} kN`)}
    ${row('Y, lateral', `${y_error_n ? plusMinus(y_n / 1000, y_error_n / 1000) : fixed(y_n / 1000, 2)} kN`)}
    ${row(html`F<sub>x</sub>, longitudinal`, `${x_error_n ? plusMinus(x_n / 1000, x_error_n / 1000) : fixed(x_n / 1000, 2)} kN`)}
    ${row('Y/Q', error ? plusMinus(ratio, error) : fixed(ratio, 3))}
    ${Number.isFinite(limit) ? html`${row(`Nadal's limit, flange ${degrees(angle ?? 0)}, μ ${number(friction, 2)}`, fixed(limit, 2))}
      ${row('margin to the limit', html`<span class=${ratio > limit ? 'warn' : ''}>${fixed(limit - ratio, 2)} (${fixed(Math.max(0, (100 * ratio) / limit), 0)} % used)</span>`)}` : nothing}</dl>`;
}

/** @param {readonly WheelLoad[]} loads */
function axle(loads) {
  const across = loads.reduce((sum, { side, y_n }) => sum + outward(side, y_n), 0);
  return html`<dl class="table"><div><dt><b>axle</b></dt><dd></dd></div>
    <div><dt>ΣQ</dt><dd>${number(loads.reduce((sum, { q_n }) => sum + q_n, 0) / 1000)} kN</dd></div>
    <div><dt>ΣY, to the left</dt><dd>${fixed(across / 1000, 2)} kN</dd></div></dl>`;
}

/** @param {App} app @param {Looked} looked @param {JobResult} answer */
function patchTable(app, looked, answer) {
  const kilonewtons = (/** @type {number} */ force) => fixed(force / 1000, 2);
  const sideOfPatch = (/** @type {number} */ patch) =>
    answer.wheelset ? (answer.wheelset.positions.some(({ left }) => left.patches.includes(patch)) ? 'left' : 'right') : sideOf(looked.document);
  return html`<div class="scroll" tabindex="0" role="region" aria-label="Forces of the patches in kN"><table class="patches"><thead>
      <tr><th></th><th colspan="4" scope="colgroup">in the patch / kN</th><th colspan="3" scope="colgroup">in track axes / kN</th></tr>
      <tr><th scope="col">patch</th><th scope="col">angle</th><th scope="col">N</th><th scope="col">F<sub>x</sub></th><th scope="col">F<sub>y</sub></th>
        <th scope="col">F<sub>x</sub></th><th scope="col">Y</th><th scope="col">Q</th></tr></thead>
    <tbody>${patchesWith(answer, looked.patch).map((at) => {
      const patch = answer.patches[at];
      const point = Math.min(looked.point, patch.points.length - 1);
      const { force_x_n, force_y_n } = patch.points[point];
      const track = inTrackAxes(patch, point);
      return html`<tr aria-current=${at === looked.patch ? 'true' : nothing}><td><button class="link" @click=${() => choose(app, { patch: at })}>${at}</button></td>
        <td>${degrees(patch.position?.contact_angle_rad ?? 0)}</td><td>${kilonewtons(patch.normal_force_n)}</td><td>${kilonewtons(force_x_n)}</td><td>${kilonewtons(force_y_n)}</td>
        <td>${kilonewtons(track.x_n)}</td><td>${kilonewtons(outward(sideOfPatch(at), track.left_n))}</td><td>${kilonewtons(track.down_n)}</td></tr>`;
    })}</tbody></table></div>`;
}
