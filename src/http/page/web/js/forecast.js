// State of the view Forecast, the wear of profiles under a traffic: its form, the computed evolutions, and the displayed step.

import { evolution as evolutionOf, evolutionRequest, evolutionResult, evolutions as evolutionsOf, submitEvolution } from './api.js';
import { takeProfiles } from './contactform.js';
import { at, isObject, numberAt } from './document.js';
import { editDocument } from './editing.js';
import { profileKind, TABLE_MIB, textOfFile } from './files.js';
import { LOSSES, wears } from './forecastdata.js';
import { formatRoute } from './routes.js';
import { inOrder, standardSection, withEverything } from './starts.js';
import { isTraffic, parseTraffic, rowsOf, tableOf, trafficOf } from './traffic.js';
import { parse } from './written.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./api.js').Job} Job */
/** @typedef {import('./api.js').Schemas} Schemas */
/** @typedef {Schemas['EvolutionAnswer']} Answer */
/** @typedef {Schemas['EvolutionRecord']} WornRecord */
/** @typedef {import('./document.js').JsonObject} JsonObject */
/** @typedef {import('./document.js').JsonValue} JsonValue */
/** @typedef {import('./files.js').Body} Body */
/** @typedef {import('./traffic.js').Row} Row */

export const EVENTS = /** @type {const} */ ([['grind', 'grind the rail'], ['friction', 'friction changes, as by a lubricator'], ['reprofile', 'turn the wheel']]);
/** Default target sections of grinding and turning. */
export const TARGETS = { grind: 'a new 60E1', reprofile: 'a new S1002' };

/**
 * @typedef {object} Maintenance
 * @property {'grind' | 'friction' | 'reprofile'} kind
 * @property {string} at
 * @property {string} value Depth below the target section in mm, or the coefficient of friction.
 * @property {{ name: string, section: JsonObject } | null} target Target section from a file; null for the default.
 */

/**
 * @typedef {object} Form
 * The form; values are stored as entered.
 * @property {string} name
 * @property {Row[]} rows
 * @property {import('./traffic.js').Table & { name: string } | null} table A table from a file, which replaces the rows.
 * @property {'rail' | 'wheel' | 'both'} wearing
 * @property {'usfd_wear' | 'archard_wear'} law
 * @property {string} states Largest number of representative states; empty for the default of the service.
 * @property {string} mgt
 * @property {string} km
 * @property {string} records
 * @property {Record<string, string>} limits
 * @property {Maintenance[]} events
 */

/** Initial form with a mixed traffic: straight track, curves, and a share with a large shift. @returns {Form} */
const firstForm = () => ({
  name: '',
  rows: [
    { passes: '60', load: '75', speed: '', radius: '', shift: '0', yaw: '0', friction: '0.35' },
    { passes: '25', load: '90', speed: '', radius: '', shift: '-2', yaw: '1', friction: '0.35' },
    { passes: '15', load: '85', speed: '', radius: '', shift: '-5', yaw: '3', friction: '0.35' },
  ],
  table: null, wearing: 'both', law: 'usfd_wear', states: '', mgt: '20', km: '50000', records: '10', limits: {}, events: [],
});

/**
 * @typedef {object} Side
 * A displayed evolution.
 * @property {Job} job
 * @property {Answer | null} answer
 */

/**
 * @typedef {object} Forecast
 * @property {Form} form
 * @property {boolean} sending
 * @property {string} refusal
 * @property {readonly import('./api.js').Fault[]} faults
 * @property {Job | null} against Evolution that the next submitted one is compared with.
 * @property {readonly Job[] | null} listed
 * @property {Set<string>} ticked
 * @property {string[]} ids Displayed evolutions; empty for the list.
 * @property {Side[]} sides
 * @property {number} step Displayed record of the first evolution.
 * @property {Body} body
 * @property {number} factor Magnification of the drawn wear.
 * @property {string} curve
 * @property {number} playing Timer of the animation; 0 while it is stopped.
 */

/** @type {Forecast} */
const forecast = {
  form: firstForm(), sending: false, refusal: '', faults: [], against: null, listed: null, ticked: new Set(), ids: [], sides: [], step: 0, body: 'rail', factor: 1, curve: 'losses', playing: 0,
};

/** Magnifications of the drawn wear. The initial one is the largest with which the drawn depth does not exceed `DRAWN_MM`. */
export const FACTORS = [1, 5, 20, 100];
const DRAWN_MM = 3;
const POLL_MS = 1000;
const FRAME_MS = 250;

export const forecastSeen = () => forecast;

/** @param {App} app @param {Partial<Forecast>} change */
export function chooseForecast(app, change) {
  Object.assign(forecast, change);
  app.redraw();
}

/**
 * Changes the form. The fault of the written value no longer applies, and without its pointer none, because rows may have moved.
 * @param {App} app
 * @param {Partial<Form>} change
 * @param {string} [pointer] Pointer of the value in the request.
 */
export function writeForm(app, change, pointer = '') {
  const faults = forecast.faults.filter((fault) => pointer && !isWithin(fault.pointer, pointer));
  chooseForecast(app, { form: { ...forecast.form, ...change }, faults, refusal: faults.length ? forecast.refusal : '' });
}

/** Returns whether a pointer is another one or below it. @param {string | null | undefined} pointer @param {string} parent */
const isWithin = (pointer, parent) => pointer === parent || Boolean(pointer?.startsWith(`${parent}/`));

/** Returns the fault of a value of the submitted form. @param {string} pointer */
export const faultOf = (pointer) => forecast.faults.find((fault) => isWithin(fault.pointer, pointer));

/** Opens the list, one evolution, or a comparison of two. @param {App} app @param {string[]} ids */
export async function openForecast(app, ids) {
  stopFilm();
  const wanted = ids.slice(0, 2);
  const same = wanted.join() === forecast.ids.join() && forecast.sides.length === wanted.length;
  Object.assign(forecast, { ids: wanted, listed: null, ...(same ? {} : { sides: [], step: Infinity }) });
  try {
    if (!wanted.length) await watchList(app);
    else if (!same || forecast.sides.some(({ answer }) => !answer)) await watchSides(app, wanted);
  } catch (error) {
    app.absent(error);
  }
}

/** Leaves the view and stops its requests. */
export function leaveForecast() {
  stopFilm();
  forecast.ids = ['-'];
}

/** @param {{ state: string }} job */
const isOpen = ({ state }) => state === 'queued' || state === 'running';
const pause = () => new Promise((resolve) => setTimeout(resolve, POLL_MS));

/** @param {App} app */
async function watchList(app) {
  const { ids } = forecast;
  for (let open = true; open && forecast.ids === ids; open && await pause()) {
    const { evolutions } = await evolutionsOf({ limit: 50 });
    if (forecast.ids !== ids) return;
    open = evolutions.some(isOpen);
    chooseForecast(app, { listed: evolutions });
  }
}

/** @param {App} app @param {string[]} ids */
async function watchSides(app, ids) {
  while (forecast.ids === ids) {
    const jobs = await Promise.all(ids.map(evolutionOf));
    const sides = await Promise.all(jobs.map(async (job, at) => ({ job, answer: forecast.sides[at]?.answer ?? (job.state === 'succeeded' ? await evolutionResult(job.id) : null) })));
    if (forecast.ids !== ids) return;
    const records = sides[0].answer?.records.length ?? 0;
    const first = sides[0].answer;
    if (first && forecast.step >= records) {
      const body = wears(first, forecast.body) ? forecast.body : forecast.body === 'rail' ? 'wheel' : 'rail';
      const depth = Math.max(...first.records.flatMap((record) => record[body].depth_mm));
      Object.assign(forecast, { step: records - 1, body, factor: FACTORS.findLast((factor) => factor * depth <= DRAWN_MM) ?? 1 });
    }
    chooseForecast(app, { sides });
    if (!jobs.some(isOpen)) return;
    await pause();
  }
}

/** Returns the record of an evolution at the displayed step, by the share of the extent. @param {Side} side @returns {WornRecord | null} */
export function recordOf({ answer }) {
  const wanted = forecast.sides[0]?.answer?.records[forecast.step]?.progress.share;
  if (!answer || wanted === undefined) return null;
  return answer.records.reduce((best, record) => (Math.abs(record.progress.share - wanted) <= Math.abs(best.progress.share - wanted) ? record : best));
}

/** Starts or stops the animation of the steps. @param {App} app */
export function playFilm(app) {
  if (forecast.playing) {
    stopFilm();
    return app.redraw();
  }
  const last = (forecast.sides[0]?.answer?.records.length ?? 1) - 1;
  if (forecast.step >= last) forecast.step = -1;
  forecast.playing = window.setInterval(() => {
    forecast.step += 1;
    if (forecast.step >= last) stopFilm();
    app.redraw();
  }, FRAME_MS);
  app.redraw();
}

function stopFilm() {
  clearInterval(forecast.playing);
  forecast.playing = 0;
}

/** Returns the case whose profiles are used, or the reason why it cannot be used. @param {App} app @returns {JsonObject | string} */
export function templateOf(app) {
  const { document } = app.store.get().compose;
  if (!document || at(document, '/contact/type') !== 'profiles') return 'Choose a wheel on a rail (Profiles) in the view Contact first: its files, inclination, speed and friction are taken from there.';
  const { outputs, subsurface, thermal, name, labels, damage, ...template } = document;
  return isObject(damage) && damage.parameters ? { ...template, damage: { parameters: damage.parameters } } : template;
}

/** Returns the speed of a case in mm/s. @param {JsonObject} template */
const speedOf = (template) => numberAt(template, '/motion/wheelset/speed_mm_per_s');

/** Returns the request of the form. @param {App} app @param {JsonObject} template @returns {JsonObject} */
function requestOf(app, template) {
  const { form } = forecast;
  const { examples } = app.store.get().compose;
  const number = (/** @type {string} */ text) => parse(text) ?? null;
  const limits = Object.fromEntries(LOSSES.flatMap(({ key, body }) => {
    const limit = parse(form.limits[key] ?? '');
    return limit === undefined || (form.wearing !== 'both' && form.wearing !== body) ? [] : [[key, limit]];
  }));
  /** @type {(event: Maintenance) => JsonObject} */
  const eventOf = ({ kind, at: when, value, target }) => {
    if (kind === 'friction') return { at: number(when), friction_coefficient: number(value) };
    const section = target?.section ?? standardSection(examples, kind === 'grind' ? 'rail' : 'wheel') ?? null;
    return { at: number(when), [kind]: section, ...(parse(value) === undefined ? {} : { depth_mm: number(value) }) };
  };
  const events = form.events.map(eventOf);
  return {
    template, traffic: trafficOf(form, template), wearing: form.wearing, wear_model: form.law, records: number(form.records),
    extent: { ...(form.wearing === 'wheel' ? {} : { mgt: number(form.mgt) }), ...(form.wearing === 'rail' ? {} : { wheel_distance_km: number(form.km) }) },
    ...(Object.keys(limits).length ? { limits } : {}), ...(events.length ? { events } : {}), ...(form.states ? { accuracy: { states_max: number(form.states) } } : {}),
  };
}

/** Returns the default name of a forecast, which describes its maintenance. @param {Form} form */
export function nameOf({ events, wearing }) {
  const unit = wearing === 'wheel' ? 'km' : 'MGT';
  const what = { grind: 'grind', reprofile: 'turn', friction: 'μ' };
  return events.map(({ kind, at: when, value }) => `${what[kind]}${kind === 'friction' ? ` ${value}` : ''} at ${when} ${unit}`).join(', ') || 'no maintenance';
}

/** Submits the form and opens the evolution, compared with another one if that is chosen. @param {App} app */
export async function startForecast(app) {
  const template = templateOf(app);
  if (typeof template === 'string') return app.say(template);
  chooseForecast(app, { sending: true, refusal: '', faults: [] });
  try {
    const { form, against } = forecast;
    const { id } = await submitEvolution(requestOf(app, template), form.name || nameOf(form));
    const { document, files } = app.store.get().compose;
    if (document) sent.set(id, { form, document, files });
    forecast.against = null;
    app.go(formatRoute('forecast', [...(against ? [against.id] : []), id]));
  } catch (error) {
    forecast.refusal = error instanceof Error ? error.message : String(error);
    forecast.faults = error instanceof Error && 'faults' in error ? /** @type {Forecast['faults']} */ (error.faults) : [];
  } finally {
    chooseForecast(app, { sending: false });
  }
}

/** Forms and cases submitted by this tab, by evolution. @type {Map<string, { form: Form, document: JsonObject, files: import('./state.js').Compose['files'] }>} */
const sent = new Map();

/** Fills the form with the request of an evolution, so that a changed one can be compared with it. @param {App} app @param {Job} job */
export async function repeatForecast(app, job) {
  const asked = await evolutionRequest(job.id);
  const template = isObject(asked.template) ? asked.template : {};
  const text = (/** @type {unknown} */ value) => (typeof value === 'number' ? String(value) : '');
  const table = tableOf(/** @type {Record<string, number[]>} */ (at(asked, '/traffic/columns') ?? {}), /** @type {number[] | undefined} */ (at(asked, '/traffic/passes')), speedOf(template));
  const rows = rowsOf(table);
  const { examples } = app.store.get().compose;
  /** @type {(event: JsonObject) => Maintenance} */
  const eventOf = (event) => {
    const kind = 'grind' in event ? 'grind' : 'reprofile' in event ? 'reprofile' : 'friction';
    const section = kind === 'friction' ? undefined : event[kind];
    const own = isObject(section) && JSON.stringify(section) !== JSON.stringify(standardSection(examples, kind === 'grind' ? 'rail' : 'wheel'));
    return { kind, at: text(event.at), value: text(kind === 'friction' ? event.friction_coefficient : event.depth_mm), target: own ? { name: 'the section of before', section } : null };
  };
  const first = firstForm();
  /** @type {Form} */
  const form = {
    ...first, ...(rows ? { rows } : { table: { name: 'the traffic of before', ...table } }),
    wearing: /** @type {Form['wearing']} */ (asked.wearing ?? 'both'), law: /** @type {Form['law']} */ (asked.wear_model ?? 'usfd_wear'),
    states: text(at(asked, '/accuracy/states_max')), mgt: text(at(asked, '/extent/mgt')) || first.mgt, km: text(at(asked, '/extent/wheel_distance_km')) || first.km, records: text(asked.records) || first.records,
    limits: Object.fromEntries(LOSSES.map(({ key }) => [key, text(at(asked, `/limits/${key}`))])), events: /** @type {JsonObject[]} */ (asked.events ?? []).map(eventOf),
  };
  // The forms submitted by this tab still have the names of their files.
  const known = sent.get(job.id);
  chooseForecast(app, { form: known ? { ...known.form, name: '' } : form, against: job.state === 'succeeded' ? job : null, refusal: '', faults: [] });
  app.compose({ example: '', files: known?.files ?? {} });
  editDocument(app, known?.document ?? inOrder(withEverything(template)));
  app.go(formatRoute('forecast'));
}

/** Imports dropped or chosen files: a table of the traffic or cross-sections. @param {App} app @param {readonly File[]} files */
export async function takeForecastFiles(app, files) {
  const read = await Promise.all(files.map(async (file) => ({ file, text: await textOfFile(file, TABLE_MIB) })));
  const tables = read.filter(({ file, text }) => profileKind({ name: file.name, text }).format === 'columns' && isTraffic(text));
  if (forecast.ids.length) app.go(formatRoute('forecast'));
  if (tables.length) takeTable(app, tables[0].file.name, tables[0].text);
  const sections = read.filter((each) => !tables.includes(each)).map(({ file }) => file);
  if (sections.length) await takeProfiles(app, sections);
}

/** Imports a file that was chosen as the table of the traffic. @param {App} app @param {File} file */
export async function takeTraffic(app, file) {
  takeTable(app, file.name, await textOfFile(file, TABLE_MIB));
}

/** Imports a table of the traffic. @param {App} app @param {string} name @param {string} text */
function takeTable(app, name, text) {
  const parsed = parseTraffic(text);
  if (typeof parsed === 'string') app.say(`${name}: ${parsed}.`);
  else writeForm(app, { table: { name, ...parsed } });
}

/** Imports the target section of grinding or turning. @param {App} app @param {number} place Index of the event. @param {File} file */
export async function takeTarget(app, place, file) {
  const text = await textOfFile(file);
  const { format } = profileKind({ name: file.name, text });
  const { events } = forecast.form;
  writeForm(app, { events: events.map((event, other) => (other === place ? { ...event, target: { name: file.name, section: { format, text, smoothing_mm: 'auto' } } } : event)) });
}
