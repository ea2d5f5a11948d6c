// Temporary jobs for results while typing: their marks and their removal.

import { jobs as jobsOf, remove } from './api.js';

/** @typedef {import('./api.js').Job} Job */

const KEY = 'railhead-page';
const VALUE = 'typing';
/** Age above which such a job is left over from a closed page. */
const FORGOTTEN_MS = 60_000;

/** Members that mark the case of such a job. They do not change its result. */
export const TYPED = { name: 'result while typing', labels: { [KEY]: VALUE } };

/** @param {Pick<Job, 'labels'>} job */
export const isTyped = ({ labels }) => labels?.[KEY] === VALUE;

/** Removes temporary jobs that closed pages have left behind. */
export async function removeTyped() {
  const { jobs } = await jobsOf({ label: `${KEY}:${VALUE}`, fields: 'id,created_at', limit: 100 });
  const old = jobs.filter((job) => Date.now() - Date.parse(job.created_at) > FORGOTTEN_MS);
  await Promise.all(old.map((job) => remove('jobs', job.id).catch(() => {})));
}
