// The form: fields for the common parts of a case, in engineering units. Members without a field remain unchanged in the JSON.

import { html, nothing } from '../vendor/lit-html.js';
import { CANT, curving, GRAVITY_MM_PER_S2, labelsWithCant, normalLoad, staticLoad } from './curving.js';
import { at, isObject, numberAt, put } from './document.js';
import { change, editDocument } from './editing.js';
import { fixed, number } from './format.js';
import { contactFields } from './contactform.js';
import { freeRolling, hasSections, ONE_MOTION, outputsOf, withContact, withEverything, withOutput, withoutExtras, withoutNameOf } from './starts.js';
import { faultAt, field } from './field.js';
import { parse, parseRadius, radiusText, textOf } from './written.js';
import { FIRST_HISTORY, historyFields } from './historyform.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */

const CONTACTS = [
  ['profiles', 'Profiles'], ['wheelset', 'Wheelset'], ['radii', 'Radii'], ['ellipse', 'Ellipse'], ['gap_profile', 'Gap curve'],
  ['gap_grid', 'Gap grid'], ['pressure_grid', 'Pressure grid'],
];
const KM_PER_H = 1e6 / 3600;
const COMPONENTS = /** @type {const} */ ([
  { key: 'creepage_x', label: 'Creepage x', unit: '%', factor: 0.01 },
  { key: 'creepage_y', label: 'Creepage y', unit: '%', factor: 0.01 },
  { key: 'spin_per_mm', label: 'Spin', unit: '1/m', factor: 0.001 },
]);

/** Changes the kind of contact. @param {App} app @param {string} kind */
function chooseContact(app, kind) {
  const { document, example, examples } = app.store.get().compose;
  const known = /** @type {JsonObject | undefined} */ (/** @type {unknown} */ (examples.find(({ name }) => name === example)?.case));
  app.compose({ example: '' });
  const next = withContact(withoutCant(withoutNameOf(document ?? {}, known)), kind);
  editDocument(app, hasSections(kind) ? withEverything(next) : next);
}

/** Returns a case without cant, for motions that are not those of a wheelset. @param {JsonObject} document */
const withoutCant = (document) => put(document, '/labels', labelsWithCant(document, undefined));

/** @param {App} app */
export function caseForm(app) {
  const document = app.store.get().compose.document ?? {};
  const type = String(at(document, '/contact/type') ?? '');
  const fault = faultAt(app, '/contact/type');
  return html`
    <fieldset><legend>Kind of contact</legend>
      <div class="segs" role="group" aria-label="Kind of contact">${CONTACTS.map(([kind, label]) => html`<label class="seg">
        <input type="radio" name="contact" .checked=${kind === type} @change=${() => chooseContact(app, kind)}>
        <span>${label}</span></label>`)}</div>
      ${contactFields(app, type)}
      ${fault ? html`<p class="fault">${fault.detail}</p>` : nothing}
    </fieldset>
    <fieldset><legend>Load and friction</legend><div class="pair">${loadField(app, type)}${field(app, '/friction/coefficient', 'Friction coefficient', 'μ')}</div></fieldset>
    <fieldset><legend>Motion</legend>${motionFields(app, type)}</fieldset>
    <fieldset><legend>Material</legend><div class="pair">
      ${at(document, '/material/young_modulus_mpa') === undefined
        ? field(app, '/material/shear_modulus_mpa', 'Shear modulus', 'GPa', { factor: 1000 })
        : field(app, '/material/young_modulus_mpa', "Young's modulus", 'GPa', { factor: 1000 })}
      ${field(app, '/material/poisson_ratio', "Poisson's ratio", 'ν')}</div></fieldset>
    <fieldset><legend>Results</legend>${answerFields(app, document)}</fieldset>`;
}

/** @param {App} app @param {string} type */
function loadField(app, type) {
  const document = app.store.get().compose.document ?? {};
  if (type === 'pressure_grid') return html`<p class="hint">The load is that of the given pressure.</p>`;
  if (at(document, '/load/approach_mm') !== undefined) return field(app, '/load/approach_mm', 'Penetration', 'μm', { factor: 0.001 });
  const vertical = at(document, '/load/vertical_force_n') !== undefined || (hasSections(type) && at(document, '/load/normal_force_n') === undefined);
  const name = type === 'wheelset' ? 'Axle load' : 'Wheel load Q';
  const curve = curving(document);
  if (vertical && curve.cant) {
    return field(app, '/load/vertical_force_n', `${name}, static`, 'kN', {
      factor: 1000, format: (value) => (typeof value === 'number' ? textOf(staticLoad(document), 1000) : textOf(value)),
      read: (text) => {
        const load = parse(text, 1000);
        return typeof load === 'number' ? normalLoad(load, curve) : load;
      },
      hint: `${fixed(numberAt(document, '/load/vertical_force_n') / 1000, 2)} kN normal to the track`,
    });
  }
  return vertical
    ? field(app, '/load/vertical_force_n', name, 'kN', { factor: 1000 })
    : field(app, '/load/normal_force_n', 'Normal force N', 'kN', { factor: 1000 });
}

/** @param {App} app @param {string} type */
function motionFields(app, type) {
  const { motion } = app.store.get().compose.document ?? {};
  const kind = Array.isArray(motion) ? 'list' : isObject(motion) && 'sweep' in motion ? 'sweep' : isObject(motion) && 'wheelset' in motion ? 'wheelset' : isObject(motion) && 'history' in motion ? 'history' : 'one';
  // A motion without any creepage.
  const still = app.store.get().compose.faults.find(({ pointer }) => pointer === '/motion');
  const kinds = [...(hasSections(type) ? [['wheelset', 'Rolling wheel']] : []), ['one', 'Creepages'], ['sweep', 'Creep curve'], ...(type === 'wheelset' ? [] : [['history', 'Over a distance']])];
  return html`
    <div class="segs" role="group" aria-label="Kind of motion">${kinds.map(([key, label]) => html`<label class="seg">
      <input type="radio" name="motion" .checked=${key === kind} @change=${() => chooseMotion(app, key, type)}><span>${label}</span></label>`)}</div>
    ${kind === 'list' ? html`<p class="hint">${/** @type {JsonValue[]} */ (motion).length} motions on the same patch; change them in the JSON.</p>` : nothing}
    ${kind === 'history' ? historyFields(app, type) : nothing}
    ${kind === 'one' ? html`<div class="triple">${COMPONENTS.map(({ key, label, unit, factor }) => field(app, `/motion/${key}`, label, unit, { factor, empty: '0' }))}</div>
      <div class="pair">${field(app, '/motion/speed_mm_per_s', 'Speed', 'km/h', { factor: KM_PER_H, empty: 'none' })}</div>
      ${still ? html`<p class="fault">${still.detail}</p>` : nothing}` : nothing}
    ${kind === 'wheelset' ? wheelFields(app, type) : nothing}
    ${kind === 'sweep' && isObject(motion) && isObject(motion.sweep) ? sweepFields(app, motion.sweep) : nothing}`;
}

/**
 * Ways to prescribe the rotation of a wheel: member of the motion, label, and initial value.
 * @type {readonly { member: string, label: string, unit: string, factor: number, start: number, only?: string }[]}
 */
const TURNING = [
  { member: 'force_x_n', label: 'Longitudinal force', unit: 'kN', factor: 1000, start: -3000, only: 'profiles' },
  { member: 'drive_torque_n_mm', label: 'Torque of the drive', unit: 'N·m', factor: 1000, start: 1e6, only: 'wheelset' },
  { member: 'free_rolling_radius_mm', label: 'Free rolling radius', unit: 'mm', factor: 1, start: 460 },
  { member: 'angular_velocity_rad_per_s', label: 'Angular velocity', unit: 'rad/s', factor: 1, start: 43.5 },
];
const SIDEWAYS = [
  { member: 'lateral_velocity_mm_per_s', label: 'Lateral velocity', unit: 'mm/s', factor: 1, start: 0 },
  { member: 'force_y_n', label: 'Lateral force, to the left', unit: 'kN', factor: 1000, start: 4000 },
];

/** Fields of the motion of a wheel or a wheelset. @param {App} app @param {string} type */
function wheelFields(app, type) {
  const { document, typing } = app.store.get().compose;
  const given = /** @type {JsonObject} */ (at(document ?? {}, '/motion/wheelset') ?? {});
  const ways = TURNING.filter(({ only }) => !only || only === type);
  const way = ways.find(({ member }) => member in given);
  // A force or torque of 0 means free rolling, except while it is being entered.
  const free = way && given[way.member] === 0 && (way.only !== undefined) && typing?.pointer !== `/motion/wheelset/${way.member}`;
  const across = SIDEWAYS.find(({ member }) => member in given) ?? SIDEWAYS[0];
  const turn = (/** @type {Event} */ event) => {
    const { value } = /** @type {HTMLSelectElement} */ (event.target);
    const kept = Object.fromEntries(Object.entries(given).filter(([member]) => !TURNING.some((known) => known.member === member)));
    const chosen = ways.find(({ member }) => member === value) ?? ways[0];
    change(app, '/motion/wheelset', { ...kept, [chosen.member]: value ? chosen.start : 0 });
  };
  const move = (/** @type {Event} */ event) => {
    const { value } = /** @type {HTMLSelectElement} */ (event.target);
    const kept = Object.fromEntries(Object.entries(given).filter(([member]) => !SIDEWAYS.some((known) => known.member === member)));
    change(app, '/motion/wheelset', { ...kept, [value]: SIDEWAYS.find(({ member }) => member === value)?.start ?? 0 });
  };
  const speed = numberAt(given, '/speed_mm_per_s');
  const rate = numberAt(given, '/yaw_rate_rad_per_s');
  // A change of speed keeps the curve radius.
  const drive = (/** @type {JsonValue | undefined} */ next) => change(app, '/motion/wheelset', {
    ...given, speed_mm_per_s: next ?? null, ...(rate && speed && Number(next) > 0 ? { yaw_rate_rad_per_s: (rate * Number(next)) / speed } : {}),
  });
  const curve = curving(document);
  return html`<div class="triple">${field(app, '/motion/wheelset/speed_mm_per_s', 'Speed', 'km/h', { factor: KM_PER_H, take: drive })}
      ${field(app, '/motion/wheelset/yaw_rate_rad_per_s', 'Curve radius', 'm', {
        empty: 'straight', format: (value) => radiusText(value, speed), read: (text) => parseRadius(text, speed), hint: '+ left, − right',
      })}
      ${field(app, `/labels/${CANT}`, 'Cant', 'mm', {
        empty: '0', hint: curve.wrong ? `a number below ${number(curve.base)} is needed` : curve.balancing ? `${fixed(curve.balancing, 0)} mm balances` : '+ right rail up',
        read: (text) => text.trim() || undefined, take: (cant) => change(app, '/labels', labelsWithCant(document, cant === undefined ? cant : String(cant))),
      })}</div>
    ${curveNotes(document, speed / rate, curve).map((note) => html`<p class="hint">${note}</p>`)}
    <div class="pair"><div class="field"><label for="turning">Rotation</label><select id="turning" @change=${turn}>
        <option value="" ?selected=${free}>free, without torque</option>
        ${ways.map(({ member, label }) => html`<option value=${member} ?selected=${!free && member === way?.member}>${label}</option>`)}</select></div>
      ${free || !way ? nothing : field(app, `/motion/wheelset/${way.member}`, way.label, way.unit, { factor: way.factor })}</div>
    <div class="pair">${type === 'wheelset' ? nothing : html`<div class="field"><label for="sideways">Sideways</label><select id="sideways" @change=${move}>
        ${SIDEWAYS.map(({ member, label }) => html`<option value=${member} ?selected=${member === across.member}>${label}</option>`)}</select></div>`}
      ${field(app, `/motion/wheelset/${across.member}`, across.label, across.unit, { factor: across.factor, empty: '0' })}</div>
    <p class="hint">${turningNote(app, way?.member, Boolean(free), numberAt(given, '/free_rolling_radius_mm'))}</p>`;
}

/**
 * Describes the effect of a curve and its cant on a wheelset and its load.
 * @param {JsonObject | null} document
 * @param {number} radius Curve radius in mm.
 * @param {import('./curving.js').Curving} curve
 * @returns {string[]}
 */
function curveNotes(document, radius, { base, cant, left, roll, balancing, lateral }) {
  const needed = Math.abs((base * numberAt(document ?? undefined, '/contact/rolling_radius_mm')) / radius);
  const rolling = Number.isFinite(needed) ? [`Curve to the ${left ? 'left' : 'right'}: a wheelset rolls without slip at Δr = ${number(needed, 2)} mm.`] : [];
  if (!cant && !balancing) return rolling;
  const short = balancing - cant;
  const axle = staticLoad(document) * (at(document ?? undefined, '/contact/type') === 'wheelset' ? 1 : 2);
  const force = Math.abs((axle * lateral) / GRAVITY_MM_PER_S2);
  const toward = lateral > 0 === left ? 'right' : 'left';
  const pushes = Number.isFinite(force) ? `; an axle pushes the rails to the ${toward} with ${fixed(force, 1)} kN` : '';
  return [...rolling,
    `${cant ? `The track rolls by ${fixed(1000 * roll, 1)} mrad. ` : ''}Cant ${short < 0 ? 'excess' : 'deficiency'} ${fixed(Math.abs(short), 0)} mm, unbalanced lateral acceleration ${fixed(Math.abs(lateral), 2)} m/s²${pushes}.`,
    ...(cant ? ['Track and wheelset roll together; load that shifts from one wheel to the other is not included.'] : [])];
}

/** Describes the effect of the rotation of the wheel on its longitudinal force. @param {App} app @param {string | undefined} member @param {boolean} free @param {number} radius */
function turningNote(app, member, free, radius) {
  const { document, checked, understood } = app.store.get().compose;
  const nominal = numberAt(document ?? undefined, '/contact/rolling_radius_mm');
  const touch = (checked?.understood?.placement ?? understood?.of.placement)?.first_touch;
  const own = touch ? nominal + touch.wheel_mm[1] : NaN;
  if (free) {
    const differs = Number.isFinite(own) ? ` It touches at a radius of ${fixed(own, 2)} mm; at the fixed radius of ${number(nominal)} mm it would have a creepage of ${number(100 * (1 - own / nominal), 2)} %.` : '';
    return `The wheel turns so that the rail takes no longitudinal force from it.${differs}`;
  }
  if (member === 'force_x_n') return 'Force on the rail along the track: negative under a driven wheel, positive under a braked one.';
  if (member !== 'free_rolling_radius_mm') return '';
  if (!touch) return 'A difference of 0.1 % between this radius and that of the contact is a creepage of 0.1 %.';
  return `The wheel touches at a radius of ${fixed(own, 2)} mm: the difference is a creepage of ${number(100 * (1 - own / radius), 2)} %, and pulls.`;
}

/** @param {App} app @param {JsonObject} sweep */
function sweepFields(app, sweep) {
  return Object.entries(sweep).map(([key, range]) => {
    if (key === 'speed_mm_per_s') return field(app, '/motion/sweep/speed_mm_per_s', 'Speed', 'km/h', { factor: KM_PER_H, empty: 'none' });
    const component = COMPONENTS.find((known) => known.key === key);
    if (!component || !isObject(range) || 'values' in range) return html`<p class="hint">${key} = ${JSON.stringify(range)}</p>`;
    const { label, unit, factor } = component;
    return html`<div class="triple">
      ${field(app, `/motion/sweep/${key}/from`, `${label} from`, unit, { factor })}
      ${field(app, `/motion/sweep/${key}/to`, 'to', unit, { factor })}
      ${field(app, `/motion/sweep/${key}/points`, 'Points', '')}</div>`;
  });
}

/** Changes the kind of motion. Transient rolling has no damage or temperature, which assume steady rolling. @param {App} app @param {string} kind @param {string} type */
function chooseMotion(app, kind, type) {
  const document = app.store.get().compose.document ?? {};
  const next = put(kind === 'wheelset' ? document : withoutCant(document), '/motion', startMotion(kind, type, document.motion));
  editDocument(app, kind === 'history' ? withoutExtras(next) : next);
}

/**
 * @param {string} kind
 * @param {string} type Type of the contact.
 * @param {JsonValue | undefined} before
 * @returns {JsonObject}
 */
function startMotion(kind, type, before) {
  if (kind === 'wheelset') return freeRolling(type);
  if (kind === 'history') return FIRST_HISTORY;
  if (kind === 'sweep') return { sweep: { creepage_x: { from: 0, to: 0.006, points: 13 }, speed_mm_per_s: 20000 } };
  const first = Array.isArray(before) ? before[0] : before;
  const alone = isObject(first) && !('sweep' in first) && !('wheelset' in first) && !('history' in first);
  return alone ? first : ONE_MOTION;
}

const RESULTS = /** @type {const} */ ([
  ['zones', 'stick and slip'], ['tractions', 'traction'], ['pressure', 'pressure'], ['slip', 'slip'],
  ['damage', 'wear and fatigue'], ['subsurface', 'stress below the surface'], ['temperature', 'flash temperature'],
]);

/** @param {App} app @param {JsonObject} document */
function answerFields(app, document) {
  const outputs = outputsOf(document);
  const mesh = isObject(at(document, '/solver/mesh'));
  const fault = faultAt(app, '/outputs');
  return html`
    <div class="checks" role="group" aria-label="Results to compute">${RESULTS.map(([output, label]) => html`<label>
      <input type="checkbox" .checked=${outputs.includes(output)}
        @change=${(/** @type {Event} */ event) => editDocument(app, withOutput(document, output, /** @type {HTMLInputElement} */ (event.target).checked))}> ${label}</label>`)}</div>
    ${fault ? html`<p class="fault">${fault.detail}</p>` : nothing}
    ${outputs.includes('damage') ? field(app, '/damage/parameters/shear_yield_mpa', 'Yield stress in shear, of the steel', 'MPa', { empty: '300' }) : nothing}
    <div class="pair">
      ${mesh ? field(app, '/solver/mesh/strips', 'Strips', '') : field(app, '/solver/target_error', 'Largest error', '% of μN', { factor: 0.01, empty: '0.5' })}
      ${mesh ? field(app, '/solver/mesh/cells', 'Cells of a strip', '') : field(app, '/name', 'Name', '', { text: true })}
    </div>
    ${at(document, '/solver/time_limit_s') !== undefined ? field(app, '/solver/time_limit_s', 'Time limit', 's') : nothing}`;
}
