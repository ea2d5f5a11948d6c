// Parsing and formatting of numbers in the fields of the form, in the unit of the field.

/** @typedef {import('./document.js').JsonValue} JsonValue */

/**
 * Returns the text of a value in a field.
 * @param {JsonValue | undefined} value
 * @param {number} [factor] Factor from the shown unit to the unit of the API.
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
 * Parses a number. Other text is returned as it is, so that the service reports the fault.
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
 * Parses a list of numbers separated by spaces or semicolons, or by commas if there are neither. A single number is returned as a number. Text
 * that starts with a brace is parsed as JSON.
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

/** Formats an inclination as a ratio if possible: 1:40 for 0.025 rad. @param {JsonValue | undefined} value */
export function inclinationText(value) {
  if (typeof value !== 'number' || value === 0) return textOf(value);
  const ratio = Number((1 / value).toPrecision(6));
  return Number.isInteger(ratio) ? `${ratio < 0 ? '-' : ''}1:${Math.abs(ratio)}` : `${value}`;
}

/** Parses an inclination such as 1:40, 1/40, or a number in rad. @param {string} written */
export function parseInclination(written) {
  const ratio = /^\s*([-\u2212]?)\s*1\s*[:/]\s*(\d+(?:[.,]\d+)?)\s*$/.exec(written);
  const steps = ratio ? Number(ratio[2].replace(',', '.')) : 0;
  return ratio && steps > 0 ? (ratio[1] ? -1 : 1) * Number((1 / steps).toPrecision(12)) : parse(written);
}

/** Formats a yaw rate as a curve radius in m, positive to the left; empty on straight track. @param {JsonValue | undefined} rate In rad/s. @param {number} speed In mm/s. */
export const radiusText = (rate, speed) => (typeof rate !== 'number' ? textOf(rate) : rate === 0 ? '' : textOf(Number((speed / rate / 1000).toPrecision(6))));

/** Parses a curve radius in m into a yaw rate in rad/s; undefined on straight track. @param {string} written @param {number} speed In mm/s. */
export function parseRadius(written, speed) {
  const radius = parse(written, 1000);
  return typeof radius !== 'number' ? radius : radius === 0 || !(speed > 0) ? undefined : speed / radius;
}
