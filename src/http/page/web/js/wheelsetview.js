// A wheelset: what it does as a rigid body when it is shifted, and where its positions are on these curves.

import { html, nothing } from '../vendor/lit-html.js';
import { number } from './format.js';
import { choose } from './result.js';
import { KINDS, nearest, wheelsetCurve } from './wheelsetdata.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./result.js').Looked} Looked */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {NonNullable<JobResult['wheelset']>} Wheelset */
/** @typedef {import('./curvedata.js').Curve} Curve */

/** @type {{ wheelset: Wheelset, kind: string, curve: Curve | null } | null} */
let drawn = null;

/** The position that a patch belongs to; -1 for none. @param {Wheelset} wheelset @param {number} patch */
export const positionOf = ({ positions }, patch) =>
  positions.findIndex(({ left, right }) => left.patches.includes(patch) || right.patches.includes(patch));

/** @param {App} app @param {Looked} looked @param {Wheelset} wheelset */
export function wheelsetPanel(app, looked, wheelset) {
  const { kinematics, positions } = wheelset;
  const chosen = Math.max(0, positionOf(wheelset, looked.patch));
  return html`<section class="panel" aria-labelledby="h-wheelset"><header class="bar"><h2 id="h-wheelset">Wheelset</h2>
    ${kinematics ? html`<div class="segs" role="group" aria-label="Curve of the wheelset">${KINDS.map(([kind, label]) => html`<label class="seg">
      <input type="radio" name="wheelset" .checked=${looked.wheelset === kind} @change=${() => choose(app, { wheelset: kind })}><span>${label}</span></label>`)}</div>` : nothing}</header>
    ${kinematics ? curvePart(app, looked, wheelset, kinematics, chosen) : nothing}
    ${positionTable(app, positions, chosen)}</section>`;
}

/** @param {App} app @param {Looked} looked @param {Wheelset} wheelset @param {NonNullable<Wheelset['kinematics']>} kinematics @param {number} chosen */
function curvePart(app, looked, wheelset, kinematics, chosen) {
  if (drawn?.wheelset !== wheelset || drawn.kind !== looked.wheelset) {
    drawn = { wheelset, kind: looked.wheelset, curve: wheelsetCurve(kinematics, looked.wheelset) };
  }
  const { curve } = drawn;
  if (!curve) return html`<p class="pad quiet">No amplitude has a conicity: ${kinematics.conicity[0]?.reason ?? kinematics.reason ?? 'fewer than two were asked for'}.</p>`;
  const overShift = looked.wheelset !== 'conicity';
  const shifts = wheelset.positions.map((position) => position.lateral_shift_mm);
  const pick = (/** @type {number} */ at) => overShift && choosePosition(app, wheelset.positions[nearest(shifts, curve.x[at])]);
  const balance = kinematics.equilibrium_shift_mm;
  return html`<creep-curve .shown=${{ curve, chosen: overShift ? nearest(curve.x, shifts[chosen]) : -1, pick }}></creep-curve>
    <p class="pad hint">${typeof balance === 'number'
      ? `Rolls in balance at ${number(balance, 3)} mm; the contacts are ${number(kinematics.contact_distance_mm ?? NaN, 5)} mm apart.`
      : `No shift is in balance: ${kinematics.reason ?? 'Δr rises through 0 nowhere within reach'}.`}</p>`;
}

/** Goes to the left patch of a position. @param {App} app @param {Wheelset['positions'][number]} position */
const choosePosition = (app, { left, right }) => choose(app, { patch: [...left.patches, ...right.patches][0] });

/** @param {App} app @param {Wheelset['positions']} positions @param {number} chosen */
function positionTable(app, positions, chosen) {
  const kilonewtons = (/** @type {number} */ force) => number(force / 1000, 3);
  const degrees = (/** @type {number | null | undefined} */ angle) => number((Math.abs(angle ?? NaN) * 180) / Math.PI, 3);
  return html`<div class="scroll" tabindex="0" role="region" aria-label="Positions of the wheelset"><table class="positions">
    <thead><tr>${['shift / mm', 'yaw / mrad', 'roll / mrad', 'Δr / mm', 'left F x, F y / kN', 'right F x, F y / kN', 'angles / °'].map((name) => html`<th scope="col">${name}</th>`)}</tr></thead>
    <tbody>${positions.map((position, at) => html`<tr aria-current=${at === chosen ? 'true' : nothing}>
      <td><button class="link" @click=${() => choosePosition(app, position)}>${number(position.lateral_shift_mm, 3)}</button></td>
      <td>${number(1000 * position.yaw_rad, 3)}</td><td>${number(1000 * position.roll_rad, 3)}</td><td>${number(position.radius_difference_mm, 3)}</td>
      ${[position.left, position.right].map(({ force_x_n: x, force_y_n: y }) => html`<td>${kilonewtons(x)}, ${kilonewtons(y)}</td>`)}
      <td>${degrees(position.left.contact_angle_rad)}, ${degrees(position.right.contact_angle_rad)}</td></tr>`)}</tbody></table></div>`;
}
