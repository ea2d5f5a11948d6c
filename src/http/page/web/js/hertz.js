// The contact ellipse of Hertz, for the drawing before anything is solved.

import { numberAt } from './document.js';

/** @typedef {import('./document.js').JsonObject} JsonObject */

/** @typedef {{ a: number, b: number, pressure: number }} Ellipse Semi-axes along and across rolling in mm, largest pressure in MPa. */

const SAMPLES = 256;

/**
 * @param {JsonObject} document A case of the types `ellipse` or `radii`.
 * @returns {Ellipse | null} Null as long as something is missing.
 */
export function ellipseOf(document) {
  const force = numberAt(document, '/load/normal_force_n');
  const a = numberAt(document, '/contact/a_mm');
  const b = numberAt(document, '/contact/b_mm');
  if (a > 0 && b > 0) return { a, b, pressure: (1.5 * force) / (Math.PI * a * b) };
  const along = numberAt(document, '/contact/rolling_mm');
  const across = numberAt(document, '/contact/lateral_mm');
  const modulus = contactModulus(document);
  if (!(along > 0 && across > 0 && force > 0 && modulus > 0)) return null;
  const { long, short } = hertz(Math.max(along, across), Math.min(along, across), force, modulus);
  const [x, y] = along >= across ? [long, short] : [short, long];
  return { a: x, b: y, pressure: (1.5 * force) / (Math.PI * x * y) };
}

/** Of two equal bodies, E / (2 (1 − ν²)), in MPa. @param {JsonObject} document */
function contactModulus(document) {
  const poisson = numberAt(document, '/material/poisson_ratio');
  const shear = numberAt(document, '/material/shear_modulus_mpa');
  const young = numberAt(document, '/material/young_modulus_mpa');
  return shear > 0 ? shear / (1 - poisson) : young / (2 * (1 - poisson ** 2));
}

/**
 * Semi-axes of the ellipse (Johnson, Contact Mechanics, 1985, equations 4.26 and 4.28), by bisection of the eccentricity.
 * @param {number} longRadius
 * @param {number} shortRadius
 * @param {number} force
 * @param {number} modulus
 */
export function hertz(longRadius, shortRadius, force, modulus) {
  const ratio = shortRadius / longRadius;
  let low = 1e-12;
  let high = 1 - 1e-12;
  for (let round = 0; round < 60; round += 1) {
    const square = (low + high) / 2;
    const [k, e] = ellipticIntegrals(square);
    if ((k - e) / (e / (1 - square) - k) > ratio) low = square;
    else high = square;
  }
  const [k, e] = ellipticIntegrals(low);
  const long = Math.cbrt((3 * force * longRadius * (k - e)) / (Math.PI * modulus * low));
  return { long, short: long * Math.sqrt(1 - low) };
}

/** Complete elliptic integrals K and E of a squared modulus, by the trapezoidal rule. @param {number} square */
function ellipticIntegrals(square) {
  let k = 0;
  let e = 0;
  for (let sample = 0; sample < SAMPLES; sample += 1) {
    const root = Math.sqrt(1 - square * Math.sin(((sample + 0.5) / SAMPLES) * (Math.PI / 2)) ** 2);
    k += 1 / root;
    e += root;
  }
  return [(k * Math.PI) / (2 * SAMPLES), (e * Math.PI) / (2 * SAMPLES)];
}
