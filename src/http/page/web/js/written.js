// Numbers as they are written in the fields of the form, in the unit of the field.

/** @typedef {import('./document.js').JsonValue} JsonValue */

/**
 * What a field shows of a value.
 * @param {JsonValue | undefined} value
 * @param {number} [factor] What one of the shown units is in the unit of the API.
 * @returns {string}
 */
export function textOf(value, factor) {
  if (value === undefined || value === null) return '';
  if (Array.isArray(value)) return value.map((item) => textOf(item, factor)).join('  ');
  if (typeof value === 'object') return JSON.stringify(value);
  if (typeof value !== 'number') return String(value);
  return String(factor ? Number((value / factor).toPrecision(12)) : value);
}

/**
 * What was written as a number, or as text where it is none: then the service says what is wrong with it.
 * @param {string} written
 * @param {number} [factor]
 * @returns {JsonValue | undefined}
 */
export function parse(written, factor = 1) {
  const text = written.trim().replace(',', '.').replaceAll('\u2212', '-');
  if (!text) return undefined;
  const value = Number(text);
  return Number.isFinite(value) ? Number((value * factor).toPrecision(12)) : written;
}

/**
 * What was written as numbers with spaces or semicolons between them, or with commas where there is neither; one number stands for all
 * places. What begins with a brace is JSON.
 * @param {string} written
 * @param {number} [factor]
 * @returns {JsonValue | undefined}
 */
export function parseList(written, factor) {
  const text = written.trim();
  if (text.startsWith('{')) {
    try {
      return JSON.parse(text);
    } catch {
      return written;
    }
  }
  const spaced = text.split(/[;\s]+/).map((item) => item.replace(/,$/, '')).filter(Boolean);
  const items = spaced.length === 1 && spaced[0].split(',').length > 2 ? spaced[0].split(',') : spaced;
  if (items.length < 2) return parse(text, factor);
  return items.map((item) => parse(item, factor) ?? null);
}

/** An inclination as people write it: 1:40 for 0.025 rad. @param {JsonValue | undefined} value */
export function inclinationText(value) {
  if (typeof value !== 'number' || value === 0) return textOf(value);
  const ratio = Number((1 / value).toPrecision(6));
  return Number.isInteger(ratio) ? `${ratio < 0 ? '-' : ''}1:${Math.abs(ratio)}` : `${value}`;
}

/** The inclination in rad that was written as 1:40, 1/40, or in rad. @param {string} written */
export function parseInclination(written) {
  const ratio = /^\s*([-\u2212]?)\s*1\s*[:/]\s*(\d+(?:[.,]\d+)?)\s*$/.exec(written);
  const steps = ratio ? Number(ratio[2].replace(',', '.')) : 0;
  return ratio && steps > 0 ? (ratio[1] ? -1 : 1) * Number((1 / steps).toPrecision(12)) : parse(written);
}

/** A curve radius in m, positive to the left, of a yaw rate; empty on straight track. @param {JsonValue | undefined} rate In rad/s. @param {number} speed In mm/s. */
export const radiusText = (rate, speed) => (typeof rate !== 'number' ? textOf(rate) : rate === 0 ? '' : textOf(Number((speed / rate / 1000).toPrecision(6))));

/** The yaw rate in rad/s on a curve whose radius was written in m; undefined on straight track. @param {string} written @param {number} speed In mm/s. */
export function parseRadius(written, speed) {
  const radius = parse(written, 1000);
  return typeof radius !== 'number' ? radius : radius === 0 || !(speed > 0) ? undefined : speed / radius;
}
