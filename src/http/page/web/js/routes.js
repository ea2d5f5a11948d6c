// Conversion between the address of the page and its view with the selection.

/**
 * @typedef {object} Route
 * @property {'compose' | 'jobs' | 'result' | 'compare' | 'line' | 'forecast' | 'licences'} view
 * @property {string[]} ids Ids of the shown jobs, batch, run or forecasts.
 * @property {Record<string, string>} query Selection within the view.
 */

const VIEWS = /** @type {const} */ (['compose', 'jobs', 'compare', 'line', 'forecast', 'licences']);

/**
 * @param {string} hash
 * @returns {Route}
 */
export function parseRoute(hash) {
  const [path, search = ''] = hash.replace(/^#\/?/, '').split('?');
  const [name, ...ids] = path.split('/').filter(Boolean).map(decodeURIComponent);
  const query = Object.fromEntries(new URLSearchParams(search));
  const view = VIEWS.find((known) => known === name) ?? 'compose';
  if (view === 'jobs' && ids.length) return { view: 'result', ids: ids.slice(0, 1), query };
  return { view, ids, query };
}

/**
 * @param {Route['view']} view
 * @param {readonly string[]} [ids]
 * @param {Record<string, string | number | undefined>} [query] Undefined and empty members are omitted.
 */
export function formatRoute(view, ids = [], query = {}) {
  const path = ['#', view === 'result' ? 'jobs' : view, ...ids.map(encodeURIComponent)].join('/');
  const pairs = Object.entries(query).filter(([, value]) => value !== undefined && value !== '');
  const search = new URLSearchParams(pairs.map(([key, value]) => [key, String(value)])).toString();
  return search ? `${path}?${search}` : path;
}
