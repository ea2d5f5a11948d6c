// Client of the public API: requests, errors, and one function for each call of the page.
// The types come from the contract, `/openapi.json`.

/** @typedef {import('contract').components['schemas']} Schemas */
/** @typedef {Schemas['Job']} Job */
/** @typedef {Schemas['JobResult']} JobResult */
/** @typedef {Schemas['Problem']} Problem */
/** @typedef {Schemas['Fault']} Fault */
/** @typedef {Schemas['RemarkEntry']} Remark */
/** @typedef {Schemas['CheckedCase']} CheckedCase */
/** @typedef {Schemas['Batch']} Batch */
/** @typedef {Schemas['State']} State */
/** @typedef {JobResult['patches'][number]} Patch */
/** @typedef {Patch['points'][number]} Point */
/** @typedef {import('./document.js').JsonObject} JsonObject */

/** @typedef {{ method?: string, body?: string, headers?: Record<string, string>, signal?: AbortSignal, keepalive?: boolean }} Asked */

const KEY = 'railhead.key';
let key = sessionStorage.getItem(KEY) ?? '';

export const apiKey = () => key;

/** @param {string} secret The API key, stored until the tab is closed. An empty string removes it. */
export function useKey(secret) {
  key = secret.trim();
  sessionStorage.setItem(KEY, key);
}

/** Thrown when the service rejects a request or does not respond. In the latter case `status` is 0. */
export class Refused extends Error {
  /** @param {Problem} problem */
  constructor(problem) {
    super(problem.detail || problem.title);
    this.problem = problem;
  }

  get status() {
    return this.problem.status;
  }

  /** @returns {readonly Fault[]} */
  get faults() {
    return this.problem.errors ?? [];
  }
}

/**
 * @param {string} title
 * @param {number} status
 * @param {string} detail
 * @returns {Problem}
 */
const problem = (title, status, detail) => ({ type: 'about:blank', title, status, detail, instance: '' });

/**
 * @param {string} path
 * @param {Asked} [asked]
 * @returns {Promise<Response>} A response with a status of success.
 * @throws {Refused}
 */
export async function request(path, asked = {}) {
  const headers = new Headers(asked.headers);
  if (key) headers.set('Authorization', `Bearer ${key}`);
  if (asked.body !== undefined && !headers.has('Content-Type')) headers.set('Content-Type', 'application/json');
  /** @type {Response} */
  let answer;
  try {
    answer = await fetch(path, { ...asked, headers });
  } catch (error) {
    if (asked.signal?.aborted) throw error;
    throw new Refused(problem('No answer', 0, 'The service does not respond.'));
  }
  if (answer.ok) return answer;
  const told = (answer.headers.get('Content-Type') ?? '').includes('problem+json');
  throw new Refused(told ? await answer.json() : problem(answer.statusText, answer.status, `status ${answer.status}`));
}

/**
 * @param {string} path
 * @param {Asked} [asked]
 */
const json = async (path, asked) => (await request(path, asked)).json();

/** @param {Record<string, string | number | undefined | readonly string[]>} members Undefined and empty members are omitted. */
function search(members) {
  const pairs = Object.entries(members).flatMap(([name, value]) =>
    (Array.isArray(value) ? value : [value ?? '']).filter((item) => item !== '').map((item) => [name, String(item)]));
  return new URLSearchParams(pairs).toString();
}

/** @returns {Promise<Schemas['Health']>} */
export const health = () => json('/readyz');

/**
 * @param {string} text The case.
 * @param {AbortSignal} [signal]
 * @returns {Promise<CheckedCase>}
 */
export const checkCase = (text, signal) => json('/v1/cases/check', { method: 'POST', body: text, signal });

/**
 * Submits a case. The returned job contains its result if it ends within `wait` seconds.
 * @param {string} text
 * @param {{ wait?: number, signal?: AbortSignal }} [how]
 * @returns {Promise<Job>}
 */
export function submit(text, { wait = 0, signal } = {}) {
  /** @type {Record<string, string>} */
  const headers = wait ? { Prefer: `wait=${wait}` } : {};
  return json('/v1/jobs', { method: 'POST', body: text, headers, signal });
}

/** @type {(id: string) => Promise<Job>} */
export const job = (id) => json(`/v1/jobs/${id}`);

/** @type {(id: string) => Promise<JobResult>} */
export const result = (id) => json(`/v1/jobs/${id}/result`);

/** @type {(id: string) => Promise<JsonObject>} */
export const caseOf = (id) => json(`/v1/jobs/${id}/case`);

/** @type {(id: string, patch: number, point: number) => Promise<Schemas['Stresses']>} */
export const stresses = (id, patch, point) => json(`/v1/jobs/${id}/subsurface?patch=${patch}&point=${point}`);

/** @param {{ limit?: number }} filter @returns {Promise<{ evolutions: Job[] }>} */
export const evolutions = (filter) => json(`/v1/evolutions?${search(filter)}`);

/** @type {(id: string) => Promise<Job>} */
export const evolution = (id) => json(`/v1/evolutions/${id}`);

/** @type {(id: string) => Promise<JsonObject>} */
export const evolutionRequest = (id) => json(`/v1/evolutions/${id}/request`);

/** @type {(id: string) => Promise<Schemas['EvolutionAnswer']>} */
export const evolutionResult = (id) => json(`/v1/evolutions/${id}/result`);

/** @param {JsonObject} asked @param {string} name @returns {Promise<Job>} */
export const submitEvolution = (asked, name) => json(`/v1/evolutions?${search({ name })}`, { method: 'POST', body: JSON.stringify(asked) });

/** @typedef {{ state?: readonly string[], batch?: string, label?: string, name?: string, fields?: string, cursor?: string, limit?: number }} Filter */
/** @typedef {Omit<Schemas['JobPage'], 'jobs'> & { jobs: Job[] }} JobPage A page whose jobs have all requested members. */

/**
 * @param {Filter} filter
 * @returns {Promise<JobPage>}
 */
export const jobs = (filter) => json(`/v1/jobs?${search(filter)}`);

/**
 * @param {{ label?: string, name?: string, limit?: number }} filter
 * @returns {Promise<Schemas['BatchPage']>}
 */
export const batches = (filter) => json(`/v1/batches?${search(filter)}`);

/** @returns {Promise<Schemas['Me']>} */
export const me = () => json('/v1/me');

/** @returns {Promise<Schemas['ExampleCase'][]>} */
export const examples = () => json('/v1/examples');

/** @type {(id: string) => Promise<Batch>} */
export const batch = (id) => json(`/v1/batches/${id}`);

/** @param {{ limit?: number }} filter @returns {Promise<Schemas['RunPage']>} */
export const runs = (filter) => json(`/v1/runs?${search(filter)}`);

/** @type {(id: string) => Promise<Schemas['Run']>} */
export const run = (id) => json(`/v1/runs/${id}`);

/**
 * @param {string} id
 * @param {{ columns?: string, percentiles?: string, above?: string, by?: string, width?: number }} wanted
 * @returns {Promise<Schemas['RunTotals']>}
 */
export const runTotals = (id, wanted) => json(`/v1/runs/${id}/totals?${search(wanted)}`);

/** @type {(id: string, row: number) => Promise<Schemas['RunRowAlone']>} */
export const runRow = (id, row) => json(`/v1/runs/${id}/rows/${row}`);

/** @param {'jobs' | 'batches' | 'evolutions'} kind @param {string} id */
export const cancel = (kind, id) => request(`/v1/${kind}/${id}/cancel`, { method: 'POST' });

/**
 * @param {'jobs' | 'batches' | 'evolutions'} kind
 * @param {string} id
 * @param {boolean} [keepalive] The request continues after the page is left. Browsers limit the number of such requests.
 */
export const remove = (kind, id, keepalive = false) => request(`/v1/${kind}/${id}`, { method: 'DELETE', keepalive });

/**
 * Saves the response of a path as a file.
 * @param {string} path
 * @param {string} name
 */
export async function download(path, name) {
  save(await (await request(path)).blob(), name);
}

/**
 * @param {Blob} blob
 * @param {string} name
 */
export function save(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}
