// Jobs that are solved while a case is written: how they are known, and that none of them stays.

import { jobs as jobsOf, remove } from './api.js';

/** @typedef {import('./api.js').Job} Job */

const KEY = 'railhead-page';
const VALUE = 'typing';
/** Nobody waits for the answer any longer. */
const FORGOTTEN_MS = 60_000;

/** Members that the page writes into such a case. They do not change its result. */
export const TYPED = { name: 'result while typing', labels: { [KEY]: VALUE } };

/** @param {Pick<Job, 'labels'>} job */
export const isTyped = ({ labels }) => labels?.[KEY] === VALUE;

/** Removes those that a closed page has left. */
export async function removeTyped() {
  const { jobs } = await jobsOf({ label: `${KEY}:${VALUE}`, fields: 'id,created_at', limit: 100 });
  const old = jobs.filter((job) => Date.now() - Date.parse(job.created_at) > FORGOTTEN_MS);
  await Promise.all(old.map((job) => remove('jobs', job.id).catch(() => {})));
}
