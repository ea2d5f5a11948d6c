// Form fields of the kinds of contact, and import of dropped files.

import { html, nothing } from '../vendor/lit-html.js';
import { checkCase, Refused } from './api.js';
import { at, isObject, numberAt, pretty, put } from './document.js';
import { change, editDocument, editText, isUntouched } from './editing.js';
import { hasSections, isBent, lacksSection, PROFILES, standardSection, withContact, withEverything, withoutNameOf } from './starts.js';
import { choice, faultAt, field, fieldId } from './field.js';
import { count, fixed, number } from './format.js';
import { bodiesOf, profileKind, textOfFile } from './files.js';
import { parseGapCurve, parseGrid } from './tables.js';
import { inclinationText, parse, parseInclination } from './written.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */

/** @typedef {import('./files.js').Body} Body */

const BODIES = /** @type {const} */ (['rail', 'wheel']);

/** @param {App} app @param {string} type */
export function contactFields(app, type) {
  switch (type) {
    case 'radii':
      return html`<div class="pair">${field(app, '/contact/rolling_mm', 'Relative radius along', 'mm')}${field(app, '/contact/lateral_mm', 'across', 'mm')}</div>`;
    case 'ellipse':
      return html`<div class="pair">${field(app, '/contact/a_mm', 'Semi-axis along', 'mm')}${field(app, '/contact/b_mm', 'across', 'mm')}</div>`;
    case 'profiles':
      return profileFields(app);
    case 'gap_profile':
      return html`<div class="pair">${field(app, '/contact/rolling_mm', 'Relative radius along', 'mm')}
        ${dropZone('Gap', pointsOf(app, '/contact/gap_mm'), '/contact/gap_mm', app, (file) => void takeGap(app, file).catch(app.refused))}</div>`;
    case 'gap_grid':
    case 'pressure_grid': {
      const member = type === 'gap_grid' ? 'gap_mm' : 'pressure_mpa';
      return dropZone(type === 'gap_grid' ? 'Gap on a grid' : 'Pressure on a grid', pointsOf(app, `/contact/${member}`), `/contact/${member}`, app, (file) => void takeGrid(app, file, member).catch(app.refused));
    }
    case 'wheelset':
      return wheelsetFields(app);
    default:
      return html`<p class="hint">Choose a kind of contact, or drop a rail and a wheel profile.</p>`;
  }
}

/** @param {App} app */
function profileFields(app) {
  const document = app.store.get().compose.document ?? {};
  const shift = numberAt(document, '/contact/lateral_shift_mm') || 0;
  const slide = (/** @type {Event} */ event) =>
    change(app, '/contact/lateral_shift_mm', Number(/** @type {HTMLInputElement} */ (event.target).value));
  const side = at(document, '/contact/side') ?? 'right';
  return html`
    ${sectionZones(app)}
    <div class="segs" role="group" aria-label="Side of the track">${['left', 'right'].map((name) => html`<label class="seg">
      <input type="radio" name="side" .checked=${side === name} @change=${() => change(app, '/contact/side', name)}><span>${name} rail</span></label>`)}</div>
    <div class="triple">${field(app, '/contact/lateral_shift_mm', 'Shift to the left', 'mm', { empty: '0' })}
      ${field(app, '/contact/yaw_rad', 'Angle of attack', 'mrad', { factor: 0.001, empty: '0' })}
      ${field(app, '/contact/roll_rad', 'Roll', 'mrad', { factor: 0.001, empty: '0' })}</div>
    <label class="slide"><span class="visually-hidden">Move the wheelset to the left</span>
      <input type="range" min="-8" max="8" step="0.05" .value=${String(shift)} @input=${slide}></label>
    ${trackFields(app)}
    ${surfaceFields(app)}`;
}

const SURFACES = /** @type {const} */ ([[undefined, 'curve of the rail'], ['plane', 'planes']]);
const INFLUENCES = /** @type {const} */ ([[undefined, 'corrected for the bend'], ['half_space', 'as on a half-space']]);

/** Fields of the surface on which the contact is solved. @param {App} app */
function surfaceFields(app) {
  const { document } = app.store.get().compose;
  const bent = isBent(document);
  return html`<details class="reading"><summary>Contact surface <span class="hint">${bent ? 'curve of the rail' : 'planes'}</span></summary>
    <div class="pair">${choice(app, '/contact/reference_surface', 'Contact surface', SURFACES, {
    take: (value) => editDocument(app, put(put(document ?? {}, '/contact/reference_surface', value), '/contact/influence', undefined)),
  })}
      ${bent ? choice(app, '/contact/influence', 'Influence of cells', INFLUENCES) : nothing}</div>
    <p class="hint">${bent
      ? 'The contact bends around the rail. What the curve does not solve, such as bodies that differ, is solved on planes.'
      : 'A plane of contact for each patch, for comparison. At a gauge corner the contact bends, and planes are off.'}</p></details>`;
}

/** Fields of the dimensions of track and wheelset. @param {App} app */
function trackFields(app) {
  const { document, checked } = app.store.get().compose;
  const found = checked?.remarks.find(({ code }) => code === 'flange-back-found');
  const position = found && 'position_mm' in found ? Number(found.position_mm) : -70;
  const stated = Number.isFinite(numberAt(document ?? undefined, '/contact/flange_back_position_mm'));
  const byOrigin = at(document ?? undefined, '/contact/rail_origin_mm') !== undefined;
  return html`<div class="pair">${field(app, '/contact/rolling_radius_mm', 'Wheel radius', 'mm')}
      ${field(app, '/contact/cant_rad', 'Rail inclination', '', { format: inclinationText, read: parseInclination, empty: '0', hint: 'such as 1:40, or in rad' })}</div>
    <div class="pair">${byOrigin ? field(app, '/contact/rail_origin_mm', 'Rail origin from track centre', 'mm', { hint: 'in place of the gauge' })
      : html`${field(app, '/contact/gauge_mm', 'Track gauge', 'mm', { empty: '1435' })}${field(app, '/contact/gauge_height_mm', 'measured below the top', 'mm', { empty: '14' })}`}</div>
    <button class="link" @click=${() => placeRail(app, !byOrigin)}>${byOrigin ? 'Place the rail by the gauge' : 'Place the rail by its origin instead of the gauge'}</button>
    <div class="pair">${field(app, '/contact/flange_back_distance_mm', 'Flange back distance', 'mm', { empty: '1360' })}
      ${field(app, '/contact/flange_back_position_mm', 'Flange back at y', 'mm', {
        empty: fixed(position, 2), hint: stated ? '' : found ? `${fixed(position, 2)} mm was found in the wheel file` : 'usual: −70 mm',
      })}</div>`;
}

/** Places the rail by the origin of its cross-section, which a rail without a gauge face needs, or by the gauge. @param {App} app @param {boolean} byOrigin */
function placeRail(app, byOrigin) {
  const { document } = app.store.get().compose;
  const contact = /** @type {JsonObject} */ (at(document ?? undefined, '/contact') ?? {});
  const { rail_origin_mm, gauge_mm, gauge_height_mm, ...kept } = contact;
  editDocument(app, put(document ?? {}, '/contact', byOrigin ? { ...kept, rail_origin_mm: 750 } : kept));
}

/** @param {App} app */
function wheelsetFields(app) {
  const document = app.store.get().compose.document ?? {};
  const place = (/** @type {'lateral_shift_mm' | 'yaw_rad'} */ member, /** @type {string} */ label, /** @type {string} */ unit, factor = 1) => {
    const range = at(document, `/contact/${member}`);
    if (!isObject(range)) return html`<div class="pair">${field(app, `/contact/${member}`, label, unit, { factor, empty: '0' })}</div>`;
    if (Array.isArray(range.values)) return html`<p class="hint">${label}: ${range.values.map((value) => number(Number(value) / factor)).join(', ')} ${unit}</p>`;
    return html`<div class="triple">${field(app, `/contact/${member}/from`, `${label} from`, unit, { factor })}
      ${field(app, `/contact/${member}/to`, 'to', unit, { factor })}${field(app, `/contact/${member}/points`, 'Positions', '')}</div>`;
  };
  const asked = isObject(at(document, '/contact/kinematics'));
  const ask = (/** @type {Event} */ event) =>
    change(app, '/contact/kinematics', /** @type {HTMLInputElement} */ (event.target).checked ? {} : undefined);
  return html`
    ${sectionZones(app)}
    ${place('lateral_shift_mm', 'Shift to the left', 'mm')}${place('yaw_rad', 'Yaw', 'mrad', 0.001)}
    ${trackFields(app)}
    ${surfaceFields(app)}
    <div class="checks"><label><input type="checkbox" .checked=${asked} @change=${ask}> Δr and equivalent conicity</label></div>
    ${at(document, '/contact/right') === undefined ? nothing : html`<p class="hint">The right side has values of its own; change them in the JSON.</p>`}`;
}

/** @param {App} app */
function sectionZones(app) {
  const { document } = app.store.get().compose;
  const there = BODIES.filter((body) => document && isObject(at(document, `/contact/${body}`)) && !lacksSection(document, body));
  return html`<div class="pair">${sectionZone(app, 'rail')}${sectionZone(app, 'wheel')}</div>
    ${there.length === 2 ? html`<button class="link" @click=${() => exchange(app)}>Exchange rail and wheel</button>` : nothing}
    ${there.map((body) => readingFields(app, body))}
    ${at(document ?? undefined, '/contact/accept_rough_profiles') === true ? html`<div class="checks"><label><input type="checkbox" checked
      @change=${() => change(app, '/contact/accept_rough_profiles', undefined)}> solve although the profiles are rough</label></div>` : nothing}`;
}

const UNITS = /** @type {const} */ ([[undefined, 'as in the file, else mm'], ['mm', 'mm'], ['cm', 'cm'], ['m', 'm'], ['inch', 'inch']]);

/** Bodies whose import settings are unfolded. @type {Set<Body>} */
const unfolded = new Set();

/** Import settings of the file of a body: unit, smoothing, and directions of the axes, with the detected and suggested values. @param {App} app @param {Body} body */
function readingFields(app, body) {
  const { document, checked, faults } = app.store.get().compose;
  const pointer = `/contact/${body}`;
  const remarks = (checked?.remarks ?? []).filter((remark) => remark.pointer === pointer || remark.pointer?.startsWith(`${pointer}/`));
  const mirrored = (/** @type {'y' | 'z'} */ axis) => remarks.find(({ code }) => code === `profile-${axis}-mirrored`);
  const found = (/** @type {'y' | 'z'} */ axis) => !checked ? 'found from the shape' : mirrored(axis) ? 'found: mirrored' : 'found: as usual';
  const quality = checked?.quality?.[body];
  const smoothing = at(document ?? undefined, `${pointer}/smoothing_mm`);
  const advised = quality?.smoothing_suggested_mm ?? 0;
  const told = [
    quality ? `${count(quality.points)} points every ${number(quality.spacing_mm, 2)} mm` : '',
    typeof quality?.noise_um === 'number' && quality.noise_um >= 0.1 ? `noise ${number(quality.noise_um, 2)} μm` : '',
    advised && smoothing !== advised && smoothing !== 'auto' ? `smoothing of ${number(advised, 2)} mm advised` : '',
  ].filter(Boolean).join(', ');
  const needed = ['unit', 'mirror_y', 'mirror_z', 'smoothing_mm'].some((member) => at(document ?? undefined, `${pointer}/${member}`) !== undefined)
    || faults.some((fault) => fault.pointer?.startsWith(pointer) && /mirror|unit/.test(fault.detail));
  const toggled = (/** @type {Event} */ event) => (/** @type {HTMLDetailsElement} */ (event.target).open ? unfolded.add(body) : unfolded.delete(body));
  return html`<details class="reading" ?open=${needed || unfolded.has(body)} @toggle=${toggled}><summary>How the ${body} is read <span class="hint">${told}</span></summary>
    <div class="pair">${choice(app, `${pointer}/unit`, 'Unit', UNITS)}
      ${field(app, `${pointer}/smoothing_mm`, 'Smoothing', 'mm', { empty: '0 = none', hint: advised ? '' : 'none is needed', read: (text) => (/^\s*auto\s*$/i.test(text) ? 'auto' : parse(text)) })}</div>
    <div class="pair">${choice(app, `${pointer}/mirror_y`, 'y is positive', [[undefined, found('y')], [false, 'to the field side'], [true, 'to the track centre']])}
      ${choice(app, `${pointer}/mirror_z`, 'z is positive', [[undefined, found('z')], [false, 'down'], [true, 'up']])}</div></details>`;
}

/** @param {App} app @param {Body} body */
function sectionZone(app, body) {
  const { document, files } = app.store.get().compose;
  const section = at(document ?? {}, `/contact/${body}`);
  const title = body === 'rail' ? 'Rail' : 'Wheel';
  const take = (/** @type {File} */ file) => void takeProfiles(app, [file], body).catch(app.refused);
  if (!document || lacksSection(document, body)) {
    return html`<div>${dropZone(title, '', `/contact/${body}`, app, take, 'drop or choose a file: MiniProf, Simpack or columns of y and z')}
      <button class="link" @click=${() => useStandard(app, body)}>Use a new ${STANDARD_NAMES[body]}</button></div>`;
  }
  const file = files[body];
  const what = !isObject(section) ? ''
    : Array.isArray(section.points_mm) ? `${section.points_mm.length} points`
    : typeof section.text !== 'string' ? ''
    : `${section.text === file?.text ? `${file.name}: ` : ''}${section.format}, ${section.text.split('\n').filter((line) => line.trim()).length} lines`;
  return dropZone(title, what, `/contact/${body}`, app, take);
}

const STANDARD_NAMES = { rail: '60E1 rail', wheel: 'S1002 wheel' };

/** Fills in a missing cross-section with the standard one of the examples. @param {App} app @param {Body} body */
function useStandard(app, body) {
  const { document, examples } = app.store.get().compose;
  const section = standardSection(examples, body);
  if (section) editDocument(app, put(document ?? {}, `/contact/${body}`, section));
}

/** @param {App} app @param {string} pointer */
function pointsOf(app, pointer) {
  const list = at(app.store.get().compose.document ?? {}, pointer);
  if (!Array.isArray(list) || !list.length) return '';
  return Array.isArray(list[0]) ? `${list[0].length} × ${list.length} values` : `${list.length} points`;
}

/**
 * An area on which a file can be dropped, or chosen by a click.
 * @param {string} title
 * @param {string} what Description of the present value.
 * @param {string} pointer
 * @param {App} app
 * @param {(file: File) => void} take
 * @param {string} [wanted] Description of a value that is still missing. It suppresses the fault of the value.
 */
function dropZone(title, what, pointer, app, take, wanted) {
  const fault = wanted ? undefined : faultAt(app, pointer);
  const over = (/** @type {DragEvent} */ event, /** @type {boolean} */ on) => {
    event.preventDefault();
    /** @type {HTMLElement} */ (event.currentTarget).classList.toggle('over', on);
  };
  const drop = (/** @type {DragEvent} */ event) => {
    over(event, false);
    const files = event.dataTransfer?.files;
    // Several files belong to several values; the listener of the page assigns them.
    if (!files || files.length !== 1) return;
    event.stopPropagation();
    take(files[0]);
  };
  const chosen = (/** @type {Event} */ event) => {
    const input = /** @type {HTMLInputElement} */ (event.target);
    if (input.files?.[0]) take(input.files[0]);
    input.value = '';
  };
  return html`<div class=${fault ? 'field bad' : 'field'}>
    <label class="drop" @dragover=${(/** @type {DragEvent} */ event) => over(event, true)}
      @dragleave=${(/** @type {DragEvent} */ event) => over(event, false)} @drop=${drop}>
      <span>${title}</span><span class="quiet">${what || (wanted ?? 'drop or choose a file')}</span>
      <input type="file" class="visually-hidden" id=${fieldId(pointer)} @change=${chosen}></label>
    ${fault ? html`<p class="fault">${fault.detail}</p>` : nothing}</div>`;
}

/** @param {App} app @param {File} file */
async function takeGap(app, file) {
  const curve = parseGapCurve(await textOfFile(file));
  if (!curve) return app.say(`${file.name} does not have two columns of numbers, y and gap in mm.`);
  const document = app.store.get().compose.document ?? {};
  editDocument(app, put(put(document, '/contact/y_mm', curve.y_mm), '/contact/gap_mm', curve.gap_mm));
}

/** @param {App} app @param {File} file @param {string} member */
async function takeGrid(app, file, member) {
  const grid = parseGrid(await textOfFile(file));
  if (!grid) return app.say(`${file.name} is not a grid with x in its first row and y in its first column.`);
  const document = app.store.get().compose.document ?? {};
  const { type } = /** @type {JsonObject} */ (document.contact);
  editDocument(app, put(document, '/contact', { type, x_mm: grid.x_mm, y_mm: grid.y_mm, [member]: grid.values }));
}

/** Returns the name of a case from the names of its files. @param {import('./state.js').Compose['files']} files */
function nameOf({ wheel, rail }) {
  const names = [wheel, rail].map((file) => file?.name.replace(/\.[^.]*$/, ''));
  return names.filter(Boolean).join(' on ');
}

/**
 * Returns the body that the shape of a file shows: the only one that the service reads it as, with a standard section as its counterpart.
 * @param {App} app
 * @param {import('./files.js').DroppedFile} file
 * @param {import('./files.js').ProfileFormat} format
 * @returns {Promise<Body | null>} Null if it may be both, or neither.
 */
async function bodyByShape(app, { text }, format) {
  const { examples } = app.store.get().compose;
  const [rail, wheel] = BODIES.map((body) => standardSection(examples, body));
  if (!rail || !wheel) return null;
  const isRead = async (/** @type {Body} */ body) => {
    const whole = { ...withContact(null, 'profiles'), contact: { ...PROFILES, rail, wheel, [body]: { format, text } } };
    const pointer = `/contact/${body}`;
    try {
      const { remarks } = await checkCase(JSON.stringify(whole));
      return !remarks.some((remark) => remark.code === 'profile-of-other-body' && remark.pointer === pointer);
    } catch (error) {
      return error instanceof Refused && error.faults.length > 0 && !error.faults.some((fault) => fault.pointer?.startsWith(pointer));
    }
  };
  const [isRail, isWheel] = await Promise.all(BODIES.map(isRead));
  return isRail === isWheel ? null : isRail ? 'rail' : 'wheel';
}

/** Opens a dropped case. @param {App} app @param {import('./files.js').DroppedFile} file */
function takeCase(app, { name, text }) {
  /** @type {JsonValue} */
  let value;
  try {
    value = JSON.parse(text);
  } catch (error) {
    return app.say(`${name} is not valid JSON: ${error instanceof Error ? error.message : error}.`);
  }
  if (!isObject(value) || !isObject(value.contact)) return app.say(`${name} is JSON, but not a case: it has no contact.`);
  app.compose({ example: '', files: {}, typing: null });
  editText(app, pretty(value));
}

/**
 * Imports files of cross-sections into the case, or a file with a whole case as JSON.
 * @param {App} app
 * @param {readonly File[]} files
 * @param {Body} [onto] The body on whose area they were dropped.
 */
export async function takeProfiles(app, files, onto) {
  app.compose({ reading: true });
  try {
    await assign(app, files, onto);
  } finally {
    app.compose({ reading: false });
  }
}

/** @param {App} app @param {readonly File[]} files @param {Body} [onto] */
async function assign(app, files, onto) {
  const read = await Promise.all(files.map(async (file) => ({ name: file.name, text: await textOfFile(file) })));
  const whole = read.find(({ text }) => /^\s*\{/.test(text));
  if (whole && read.length > 1) return app.say(`${whole.name} is JSON. Drop a case alone.`);
  if (whole) return takeCase(app, whole);
  const kinds = await Promise.all(read.map(async (file) => {
    const kind = profileKind(file);
    return { ...kind, contents: kind.contents ?? await bodyByShape(app, file, kind.format) };
  }));
  const state = app.store.get().compose;
  const { document: before, files: taken, example, examples } = state;
  const fresh = !before || !hasSections(at(before, '/contact/type')) || isUntouched(state);
  const shipped = /** @type {JsonObject | undefined} */ (/** @type {unknown} */ (examples.find(({ name }) => name === example)?.case));
  let document = fresh ? withEverything(put(put(put(withContact(isUntouched(state) ? null : before, 'profiles'), '/labels', undefined), '/name', undefined), '/contact', PROFILES)) : withoutNameOf(before, shipped);
  const missing = BODIES.filter((body) => !Object.keys(at(document, `/contact/${body}`) ?? {}).length);
  const bodies = bodiesOf(read, kinds, missing, onto);
  if (typeof bodies === 'string') return app.say(bodies);
  const known = { ...taken };
  for (const body of BODIES) {
    const file = bodies[body];
    if (!file) continue;
    const { format, contents, named } = kinds[read.indexOf(file)];
    document = put(document, `/contact/${body}`, { format, text: file.text });
    // The right side of a wheelset uses the same file, unless it is changed in the JSON.
    if (at(document, `/contact/right/${body}`)) document = put(document, `/contact/right/${body}`, undefined);
    known[body] = file;
    const elsewhere = files.length === 1 && onto && body !== onto;
    if (elsewhere || (named && body !== named)) app.say(`${file.name} is a ${body}, by its ${contents ? 'contents' : 'name'}.`);
  }
  if (isObject(at(document, '/contact/right')) && !Object.keys(at(document, '/contact/right') ?? {}).length) document = put(document, '/contact/right', undefined);
  const name = at(document, '/name');
  if (name === undefined || name === nameOf(taken)) document = put(document, '/name', nameOf(known));
  app.compose({ example: '', files: known });
  editDocument(app, document);
}

/** Exchanges the cross-sections of rail and wheel. @param {App} app */
function exchange(app) {
  const { document, files } = app.store.get().compose;
  const [rail, wheel] = BODIES.map((body) => at(document ?? {}, `/contact/${body}`));
  app.compose({ files: { rail: files.wheel, wheel: files.rail } });
  editDocument(app, put(put(document ?? {}, '/contact/rail', wheel), '/contact/wheel', rail));
}
