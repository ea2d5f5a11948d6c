// Panel of a wheelset: slider of its shift, curves of the rigid wheelset, and the solved positions.

import { html, nothing } from '../vendor/lit-html.js';
import { drawChart } from './drawing/axes.js';
import { APART_MM, drawWheelset } from './drawing/wheelset.js';
import { WINDOWS } from './en15302.js';
import { fixed, number } from './format.js';
import { placeOn } from './placing.js';
import { choose } from './result.js';
import { begin, shifted, shiftingOf, shiftTo } from './shifting.js';
import { againstWindow, KINDS, nearest, wheelsetCurve } from './wheelsetdata.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./result.js').Looked} Looked */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {NonNullable<JobResult['wheelset']>} Wheelset */
/** @typedef {import('./wheelsetdata.js').Kinematics} Kinematics */
/** @typedef {import('./wheelloads.js').Side} Side */
/** @typedef {import('./curvedata.js').Curve} Curve */
/** @typedef {import('./shifting.js').Shifting} Shifting */
/** @typedef {import('./drawing/wheelset.js').Touch} Touch */

const SIDES = /** @type {const} */ (['left', 'right']);
/** Contact lines are drawn at multiples of this shift, in mm. */
const LINES_MM = 0.5;
/** Largest number of values of a printed curve with error bars; more would overlap. */
const SHIFTS_WITH_BARS = 40;
/** Amplitude used for vehicle acceptance, in mm. */
const ACCEPTANCE_MM = 3;

/** @type {{ wheelset: Wheelset, kind: string, window: string, curve: Curve | null } | null} */
let drawn = null;

/** Returns the index of the position of a patch; -1 for none. @param {Wheelset} wheelset @param {number} patch */
export const positionOf = ({ positions }, patch) =>
  positions.findIndex(({ left, right }) => left.patches.includes(patch) || right.patches.includes(patch));

/** @param {App} app @param {Looked} looked @param {Wheelset} wheelset */
export function wheelsetPanel(app, looked, wheelset) {
  const { kinematics, positions } = wheelset;
  const chosen = Math.max(0, positionOf(wheelset, looked.patch));
  if (!kinematics) return html`<section class="panel" aria-labelledby="h-wheelset"><header class="bar"><h2 id="h-wheelset">Wheelset</h2></header>${positionTable(app, positions, chosen)}</section>`;
  const moving = shiftingOf(kinematics, positions[chosen].lateral_shift_mm);
  if (looked.document) begin(app, looked.document, moving);
  return html`<section class="panel wheelset" aria-labelledby="h-wheelset"><header class="bar"><h2 id="h-wheelset">Wheelset and conicity</h2>
      <p class="hint">${headline(kinematics)}</p></header>
    <div class="two pad">${shiftPart(app, looked, moving)}${curvePart(app, looked, wheelset, kinematics, moving)}</div>
    ${paperPart(looked, wheelset, kinematics, moving)}
    ${positionTable(app, positions, chosen)}</section>`;
}

/** @type {{ wheelset: Wheelset, window: string, there: number, part: unknown } | null} */
let printed = null;

/** Contact lines and all curves for print. The screen shows one at a time. @param {Looked} looked @param {Wheelset} wheelset @param {Kinematics} kinematics @param {Shifting} moving */
function paperPart(looked, wheelset, kinematics, moving) {
  const { window, wheels } = looked;
  const there = SIDES.filter((side) => wheels[side]).length;
  if (printed?.wheelset !== wheelset || printed.window !== window || printed.there !== there) {
    const charts = KINDS.flatMap(([kind, name]) => {
      const curve = wheelsetCurve(kinematics, kind, window);
      if (!curve) return [];
      const lines = curve.lines.map(({ label, colour, y, error }, at) => ({
        label, look: colour === '--bad' ? 'limit' : ['one', 'two', 'three'][at], errors: curve.x.length > SHIFTS_WITH_BARS ? undefined : error, points: curve.x.map((x, place) => /** @type {[number, number]} */ ([x, y[place]])),
      }));
      return [drawChart({ name, x: curve.xLabel, y: curve.yLabel, lines: lines.filter(({ points }) => points.some(([, y]) => Number.isFinite(y))) })];
    });
    printed = { wheelset, window, there, part: html`<div class="paper pad" aria-hidden="true">${drawWheelset(sidesOf(looked, { ...moving, apart: true }), true, 0)}<div>${charts}</div></div>` };
  }
  return printed.part;
}

/** Shows the conicity at the acceptance amplitude and the equilibrium shift. @param {Kinematics} kinematics */
function headline({ conicity, equilibrium_shift_mm: balance, contact_distance_mm: distance, reason }) {
  const accepted = conicity.find(({ amplitude_mm }) => amplitude_mm === ACCEPTANCE_MM);
  const error = Math.hypot(accepted?.error_estimate ?? 0, accepted?.profile_uncertainty ?? 0);
  return html`${typeof accepted?.conicity === 'number' ? html`equivalent conicity <b>${fixed(accepted.conicity, 3)}</b>${error >= 0.0005 ? ` ± ${fixed(error, 3)}` : ''} at ${ACCEPTANCE_MM} mm; ` : nothing}${typeof balance === 'number'
    ? `rolls in balance at ${fixed(balance, 2)} mm, contacts ${fixed(distance, 1)} mm apart`
    : `no shift is in balance: ${reason ?? 'Δr does not rise through 0 in this range of shifts'}`}`;
}

/** Slider, drawing of both wheels, and table of their loads. @param {App} app @param {Looked} looked @param {Shifting} moving */
function shiftPart(app, looked, moving) {
  const { kinematics, at, apart } = moving;
  const shifts = kinematics.lateral_shift_mm;
  const move = (/** @type {Event} */ event) => looked.document && shiftTo(app, looked.document, Number(/** @type {HTMLInputElement} */ (event.target).value)).catch(app.refused);
  const show = (/** @type {boolean} */ on) => () => {
    moving.apart = on;
    app.redraw();
  };
  const parts = /** @type {const} */ ([[false, 'On the rails'], [true, 'Contact lines']]);
  return html`<div class="shifting">
    <div class="segs" role="group" aria-label="Picture of the wheelset">${parts.map(([on, label]) => html`<label class="seg">
      <input type="radio" name="apart" .checked=${apart === on} @change=${show(on)}><span>${label}</span></label>`)}</div>
    ${drawWheelset(sidesOf(looked, moving), apart, shifts[at])}
    <label class="slide"><span>Shift to the left <output>${fixed(shifts[at], 1)} mm, Δr ${fixed(kinematics.radius_difference_mm[at], 3)} mm</output></span>
      <input type="range" aria-label="Shift to the left" aria-valuetext=${`${fixed(shifts[at], 1)} mm`} min="0" max=${shifts.length - 1} .value=${String(at)} @input=${move}></label>
    ${carriedTable(moving)}</div>`;
}

/** Returns the drawn sides whose cross-sections are loaded. @param {Looked} looked @param {Shifting} moving */
const sidesOf = (looked, moving) => Object.fromEntries(SIDES.flatMap((side) => (looked.wheels[side] ? [[side, drawnSide(looked, moving, side)]] : [])));

/** @param {Looked} looked @param {Shifting} moving @param {Side} side */
function drawnSide(looked, { kinematics, at, apart, pressed }, side) {
  const standing = /** @type {import('./result.js').Standing} */ (looked.wheels[side]);
  const { lateral_shift_mm: shifts, [side]: line } = kinematics;
  const { rail, wheel } = shifted(standing, shifts[at]);
  const drawnWheel = apart ? wheel.map(([y, z]) => /** @type {import('./placing.js').Place} */ ([y, z + APART_MM])) : wheel;
  const { touch, shift, cant } = standing;
  const onRail = placeOn(rail, [touch.track_mm[1], touch.track_mm[2]], touch.rail_mm[0], side, cant);
  const onWheel = placeOn(drawnWheel, [touch.track_mm[1] + shifts[at] - shift, 0], touch.wheel_mm[0], side, 0);
  /** @type {(place: number) => Touch} */
  const touching = (place) => ({ shift: shifts[place], rail: onRail(line.rail_y_mm[place]), wheel: onWheel(line.wheel_y_mm[place]) });
  const others = apart ? [...shifts.keys()].filter((place) => Math.abs(shifts[place] / LINES_MM - Math.round(shifts[place] / LINES_MM)) < 1e-6) : [];
  return { rail, wheel: drawnWheel, touch: touching(at), lines: others.map(touching), pressed: apart ? [] : (pressed[side] ?? []) };
}

/** @param {Shifting} moving */
function carriedTable({ kinematics, at, carried, failure }) {
  if (failure) return html`<p class="fault">${failure}</p>`;
  /** @type {[string, (side: Side) => string][]} */
  const rows = [
    ['rolling radius / mm', (side) => fixed(kinematics[side].rolling_radius_mm[at], 2)],
    ['contact angle / °', (side) => fixed((Math.abs(kinematics[side].contact_angle_rad[at]) * 180) / Math.PI, 2)],
    ['largest pressure / MPa', (side) => number(carried[side]?.pressure_mpa ?? NaN, 4)],
    ['contact area / mm²', (side) => number(carried[side]?.area_mm2 ?? NaN, 3)],
    ['normal force / kN', (side) => number((carried[side]?.normal_n ?? NaN) / 1000, 3)],
    ['Y, outward / kN', (side) => fixed((carried[side]?.y_n ?? NaN) / 1000, 2)],
    ['longitudinal force / kN', (side) => fixed((carried[side]?.x_n ?? NaN) / 1000, 2)],
    ['Tγ / (J/m)', (side) => number(carried[side]?.power_n ?? NaN, 3)],
  ];
  return html`<table class="carried"><thead><tr><th></th>${SIDES.map((side) => html`<th scope="col">${side}</th>`)}</tr></thead>
    <tbody>${rows.map(([name, of]) => html`<tr><th scope="row">${name}</th>${SIDES.map((side) => html`<td>${of(side)}</td>`)}</tr>`)}</tbody></table>
    <p class="hint">Axle level; each wheel with half the load, without yaw, forces to 1 % of μN.</p>`;
}

/** @param {App} app @param {Looked} looked @param {Wheelset} wheelset @param {Kinematics} kinematics @param {Shifting} moving */
function curvePart(app, looked, wheelset, kinematics, moving) {
  const kind = looked.wheelset;
  if (drawn?.wheelset !== wheelset || drawn.kind !== kind || drawn.window !== looked.window) {
    drawn = { wheelset, kind, window: looked.window, curve: wheelsetCurve(kinematics, kind, looked.window) };
  }
  const { curve } = drawn;
  const overShift = kind !== 'conicity';
  const pick = (/** @type {number} */ at) => {
    if (!overShift) return;
    const { positions } = wheelset;
    choosePosition(app, positions[nearest(positions.map((position) => position.lateral_shift_mm), curve?.x[at] ?? 0)]);
    if (looked.document) shiftTo(app, looked.document, at).catch(app.refused);
  };
  return html`<div><div class="segs" role="group" aria-label="Curve of the wheelset">${KINDS.map(([name, label]) => html`<label class="seg">
      <input type="radio" name="wheelset" .checked=${kind === name} @change=${() => choose(app, { wheelset: name })}><span>${label}</span></label>`)}</div>
    ${curve ? html`<creep-curve .shown=${{ curve, chosen: overShift ? moving.at : -1, pick }}></creep-curve>`
      : html`<p class="pad quiet">No amplitude has a conicity: ${kinematics.conicity[0]?.reason ?? kinematics.reason ?? 'fewer than two amplitudes were requested'}.</p>`}
    ${overShift ? nothing : windowPart(app, looked, kinematics)}</div>`;
}

/** Choice of a window of EN 15302, and whether the conicity lies inside. @param {App} app @param {Looked} looked @param {Kinematics} kinematics */
function windowPart(app, looked, kinematics) {
  const pick = (/** @type {Event} */ event) => choose(app, { window: /** @type {HTMLSelectElement} */ (event.target).value });
  const { inside, outside } = againstWindow(kinematics, looked.window);
  return html`<label class="inline">Window of EN 15302 for reference profiles <select @change=${pick}>
      <option value="">none</option>${Object.entries(WINDOWS).map(([pair, { label }]) => html`<option value=${pair} ?selected=${pair === looked.window}>${label}</option>`)}</select></label>
    ${looked.window ? html`<p class=${outside.length ? 'warn' : 'good'}>${outside.length
      ? `Outside the window at ${outside.map((amplitude) => number(amplitude, 2)).join(', ')} mm.` : `Inside the window at all ${inside} amplitudes.`}</p>` : nothing}`;
}

/** Selects the first patch of a position. @param {App} app @param {Wheelset['positions'][number]} position */
const choosePosition = (app, { left, right }) => choose(app, { patch: [...left.patches, ...right.patches][0] });

/** @param {App} app @param {Wheelset['positions']} positions @param {number} chosen */
function positionTable(app, positions, chosen) {
  const kilonewtons = (/** @type {number} */ force) => fixed(force / 1000, 2);
  const degrees = (/** @type {number | null | undefined} */ angle) => fixed((Math.abs(angle ?? NaN) * 180) / Math.PI, 2);
  return html`<div class="scroll" tabindex="0" role="region" aria-label="Positions of the wheelset"><table class="positions">
    <thead><tr>${['shift / mm', 'yaw / mrad', 'roll / mrad', 'Δr / mm', html`left F<sub>x</sub>, F<sub>y</sub> / kN`, html`right F<sub>x</sub>, F<sub>y</sub> / kN`, 'angles / °'].map((name) => html`<th scope="col">${name}</th>`)}</tr></thead>
    <tbody>${positions.map((position, at) => html`<tr aria-current=${at === chosen ? 'true' : nothing}>
      <td><button class="link" @click=${() => choosePosition(app, position)}>${fixed(position.lateral_shift_mm, 2)}</button></td>
      <td>${fixed(1000 * position.yaw_rad, 2)}</td><td>${fixed(1000 * position.roll_rad, 3)}</td><td>${fixed(position.radius_difference_mm, 3)}</td>
      ${[position.left, position.right].map(({ force_x_n: x, force_y_n: y }) => html`<td>${kilonewtons(x)}, ${kilonewtons(y)}</td>`)}
      <td>${degrees(position.left.contact_angle_rad)}, ${degrees(position.right.contact_angle_rad)}</td></tr>`)}</tbody></table></div>`;
}
