// Colour maps of values, selected by scale, theme and preference.

import { COLOURS } from './colours.js';

/** @typedef {import('./colours.js').MapName} MapName */
/** @typedef {'amount' | 'signed' | 'zones'} Scale */

/** @type {Map<MapName, Uint32Array>} */
const tables = new Map();

const KEPT = 'railhead.colours';

/** @type {MapName} */
let amounts = kept();

/** @returns {MapName} */
function kept() {
  try {
    return localStorage.getItem(KEPT) === 'cividis' ? 'cividis' : 'viridis';
  } catch {
    return 'viridis';
  }
}

/** @param {'viridis' | 'cividis'} name Colour map of amounts. */
export function chooseAmounts(name) {
  amounts = name;
  try {
    localStorage.setItem(KEPT, name);
  } catch {
    // Storage is disabled; the choice applies until the page is left.
  }
}

export const chosenAmounts = () => amounts;

export function isDark() {
  return document.documentElement.dataset.theme === 'dark';
}

/**
 * Returns the colour map of a scale. The centre of the map of signed values is pale in the light theme and dark in the dark theme.
 * @param {Scale} scale
 * @returns {MapName}
 */
export const mapOf = (scale) => (scale === 'signed' ? (isDark() ? 'berlin' : 'vik') : amounts);

/**
 * Returns 256 colours as 32-bit words of an `ImageData` on a little-endian machine.
 * @param {MapName} name
 */
export function wordsOf(name) {
  const known = tables.get(name);
  if (known) return known;
  const words = new Uint32Array(256);
  for (let i = 0; i < 256; i += 1) {
    const rgb = parseInt(COLOURS[name].slice(6 * i, 6 * i + 6), 16);
    words[i] = (0xff000000 | ((rgb & 0xff) << 16) | (rgb & 0xff00) | (rgb >> 16)) >>> 0;
  }
  tables.set(name, words);
  return words;
}

/**
 * @param {MapName} name
 * @param {number} share 0 to 1
 */
export function hex(name, share) {
  const place = 6 * Math.max(0, Math.min(255, Math.round(share * 255)));
  return `#${COLOURS[name].slice(place, place + 6)}`;
}

/**
 * Writes the colours of values into pixels. NaN is transparent.
 * @param {Float32Array} values
 * @param {Uint32Array} pixels
 * @param {MapName} name
 * @param {readonly [number, number]} range
 */
export function colourise(values, pixels, name, [low, high]) {
  const words = wordsOf(name);
  const factor = 255.999 / (high - low || 1);
  for (let i = 0; i < values.length; i += 1) {
    const value = values[i];
    if (value !== value) {
      pixels[i] = 0;
      continue;
    }
    const place = ((value - low) * factor) | 0;
    pixels[i] = words[place < 0 ? 0 : place > 255 ? 255 : place];
  }
}
