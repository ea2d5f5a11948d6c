// Quantities of a field that can be shown, with their values, units and scales.

/** @typedef {import('../fields.js').Cells} Cells */
/** @typedef {import('./palette.js').Scale} Scale */

/**
 * @typedef {object} Quantity
 * @property {string} key Name in addresses.
 * @property {string} label Text of its button.
 * @property {string} heading Title above the map.
 * @property {string} unit
 * @property {Scale} scale
 * @property {boolean} vanishes Whether it is 0 at the border of the patch.
 * @property {boolean} bounded Whether it is bounded by μp.
 * @property {(cells: Cells) => ArrayLike<number> | null} values Returns one value for each cell; null if the field has none.
 * @property {(cells: Cells) => [number[], number[]] | null} vector Returns the longitudinal and lateral components of arrows; null for no arrows.
 */

/** @param {number[] | undefined} along @param {number[] | undefined} across */
const lengths = (along, across) =>
  along && across ? Float64Array.from(along, (value, cell) => Math.hypot(value, across[cell])) : null;

/** @param {Cells} cells @returns {[number[], number[]] | null} */
const traction = (cells) =>
  cells.traction_x_mpa && cells.traction_y_mpa ? [cells.traction_x_mpa, cells.traction_y_mpa] : null;

const none = () => null;

/** @type {readonly Quantity[]} */
export const QUANTITIES = [
  {
    key: 'pressure', label: 'Pressure', heading: 'pressure p', unit: 'MPa', scale: 'amount', vanishes: true, bounded: false,
    values: (cells) => cells.pressure_mpa ?? null, vector: none,
  },
  {
    key: 'traction', label: 'Traction', heading: 'traction |t|', unit: 'MPa', scale: 'amount', vanishes: true, bounded: true,
    values: (cells) => lengths(cells.traction_x_mpa, cells.traction_y_mpa), vector: traction,
  },
  {
    key: 'traction_x', label: 'along', heading: 'traction along rolling', unit: 'MPa', scale: 'signed', vanishes: true,
    bounded: true, values: (cells) => cells.traction_x_mpa ?? null, vector: none,
  },
  {
    key: 'traction_y', label: 'across', heading: 'traction across', unit: 'MPa', scale: 'signed', vanishes: true,
    bounded: true, values: (cells) => cells.traction_y_mpa ?? null, vector: none,
  },
  {
    key: 'slip', label: 'Slip', heading: 'slip over rolling speed', unit: '', scale: 'amount', vanishes: false, bounded: false,
    values: (cells) => lengths(cells.slip_x, cells.slip_y),
    vector: (cells) => (cells.slip_x && cells.slip_y ? [cells.slip_x, cells.slip_y] : null),
  },
  {
    key: 'temperature', label: 'Temperature', heading: 'temperature', unit: '°C', scale: 'amount', vanishes: false, bounded: false,
    values: (cells) => cells.temperature_c ?? null, vector: none,
  },
  {
    key: 'zones', label: 'Zones', heading: 'stick and slip', unit: '', scale: 'zones', vanishes: false, bounded: false,
    values: (cells) => (cells.zone ? Float64Array.from(cells.zone, (zone) => (zone === 'slip' ? 1 : 0)) : null), vector: none,
  },
];

/** @type {WeakMap<Cells, Map<string, ArrayLike<number> | null>>} */
const known = new WeakMap();

/**
 * Returns the values of a quantity, cached by cells.
 * @param {Quantity} quantity
 * @param {Cells} cells
 */
export function valuesOf(quantity, cells) {
  const of = known.get(cells) ?? new Map();
  known.set(cells, of);
  if (!of.has(quantity.key)) of.set(quantity.key, quantity.values(cells));
  return of.get(quantity.key) ?? null;
}

/** Returns the quantities of a field. @param {Cells} cells */
export const offered = (cells) => QUANTITIES.filter((quantity) => valuesOf(quantity, cells));

/** @param {string | undefined} key */
export const quantityOf = (key) => QUANTITIES.find((quantity) => quantity.key === key);

/**
 * Returns the range of colours, from 0 or symmetric. With a given bound, tractions extend to it, so that motions, patches and cases
 * can be compared.
 * @param {Quantity} quantity
 * @param {readonly Cells[]} fields Fields that share the range.
 * @param {number} bound Largest μp in MPa; NaN for none.
 * @returns {[number, number]}
 */
export function rangeOf(quantity, fields, bound) {
  let largest = 0;
  for (const cells of fields) {
    const values = valuesOf(quantity, cells) ?? [];
    for (let cell = 0; cell < values.length; cell += 1) largest = Math.max(largest, Math.abs(values[cell]) || 0);
  }
  if (quantity.bounded && bound > 0) largest = Math.max(largest, bound);
  largest = quantity.scale === 'zones' ? 1 : largest || 1;
  return quantity.scale === 'signed' ? [-largest, largest] : [0, largest];
}
