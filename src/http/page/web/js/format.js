// Formatting of numbers: grouped thousands, a typographic minus, and as many digits as the error allows.

const THIN_SPACE = '\u2009';
const MINUS = '\u2212';
const NONE = '–';
/** Magnitude below which a number counts as 0. */
const ROUNDING = 1e-15;
const SUPERSCRIPT = '⁰¹²³⁴⁵⁶⁷⁸⁹';

/**
 * Formats a number with a fixed number of decimals.
 * @param {number} value
 * @param {number} decimals
 */
export function fixed(value, decimals) {
  if (!Number.isFinite(value)) return NONE;
  const digits = Math.abs(value).toFixed(Math.max(0, Math.min(12, decimals)));
  const [whole, part] = digits.split('.');
  const grouped = whole.length > 4 ? whole.replace(/\B(?=(\d{3})+$)/g, THIN_SPACE) : whole;
  const sign = value < 0 && Number(digits) !== 0 ? MINUS : '';
  return sign + grouped + (part ? `.${part}` : '');
}

/**
 * Formats a number to a number of significant digits, with a power of ten if it is very large or small.
 * @param {number | null | undefined} value
 */
export function number(value, digits = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return NONE;
  if (Math.abs(value) < ROUNDING) return '0';
  const exponent = Math.floor(Math.log10(Math.abs(value)));
  if (exponent >= -4 && exponent <= 8) return fixed(value, Math.max(0, digits - 1 - exponent));
  const mantissa = fixed(value / 10 ** exponent, Math.max(0, digits - 2)).replace(/\.0+$/, '');
  const factor = mantissa === '1' ? '' : mantissa === `${MINUS}1` ? MINUS : `${mantissa}·`;
  return `${factor}10${superscript(exponent)}`;
}

/** @param {number} exponent */
function superscript(exponent) {
  const digits = [...String(Math.abs(exponent))].map((digit) => SUPERSCRIPT[Number(digit)]);
  return (exponent < 0 ? '⁻' : '') + digits.join('');
}

/**
 * Formats a value and its error, both to the second significant digit of the error.
 * @param {number} value
 * @param {number | null | undefined} error
 * @returns {{ value: string, error: string }}
 */
export function withError(value, error) {
  if (!error || !Number.isFinite(error)) return { value: number(value), error: '' };
  const decimals = Math.max(0, 1 - Math.floor(Math.log10(error)));
  if (decimals > 6) return { value: number(value, 5), error: number(error, 2) };
  return { value: fixed(value, decimals), error: fixed(error, decimals) };
}

/** Formats a value with its error as one text. @param {number} value @param {number | null | undefined} error */
export function plusMinus(value, error) {
  const text = withError(value, error);
  return text.error ? `${text.value} ± ${text.error}` : text.value;
}

/** @param {number} value */
export function seconds(value) {
  if (value < 1e-3) return `${number(value * 1e6, 3)} µs`;
  if (value < 1) return `${number(value * 1e3, 3)} ms`;
  return value < 120 ? `${number(value, 3)} s` : `${number(value / 60, 3)} min`;
}

/** @param {number} value */
export const count = (value) => fixed(value, 0);

/** @param {number} radians */
export const degrees = (radians) => `${fixed((radians * 180) / Math.PI, 1)}°`;

/**
 * Returns ticks with steps of 1, 2 or 5 times a power of ten, about `wanted` of them.
 * @param {number} low
 * @param {number} high
 * @param {number} wanted
 */
export function ticks(low, high, wanted) {
  const raw = (high - low) / Math.max(1, wanted);
  if (!(raw > 0) || !Number.isFinite(raw)) return [low];
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = power * ([1, 2, 5].find((factor) => factor * power >= raw * 0.999) ?? 10);
  const marks = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + step * 1e-9; n += 1) marks.push(n * step);
  return marks;
}

/**
 * Returns the label of a tick with as many decimals as the step needs.
 * @param {number} value
 * @param {readonly number[]} all
 */
export function tickLabel(value, all) {
  const largest = Math.max(...all.map(Math.abs));
  if (largest > 0 && (largest < 1e-3 || largest >= 1e6)) return number(value, 2);
  const step = all.length > 1 ? Math.abs(all[1] - all[0]) : Math.abs(value) || 1;
  // A step such as 2.5 needs one more digit than its magnitude.
  const tens = Math.floor(Math.log10(step) + 1e-9);
  const whole = Math.abs(Math.round(step / 10 ** tens) - step / 10 ** tens) < 1e-6;
  return fixed(value, Math.max(0, (whole ? 0 : 1) - tens));
}

/**
 * Describes how long ago a time was.
 * @param {string} time
 */
export function ago(time, now = Date.now()) {
  const past = (now - Date.parse(time)) / 1000;
  if (past < 5) return 'just now';
  if (past < 90) return `${Math.round(past)} s ago`;
  if (past < 5400) return `${Math.round(past / 60)} min ago`;
  if (past < 129_600) return `${Math.round(past / 3600)} h ago`;
  return time.slice(0, 10);
}
