// Custom element <field-map>: a field of one patch with a crosshair and its sections. It has two canvases: the picture, which is redrawn when its data
// change, and an overlay that follows the pointer.

import { indexOf } from './field/cells.js';
import { layoutCompact, layoutMap } from './field/layout.js';
import { drawBarMark, drawPicture, inkOf, tell } from './field/picture.js';
import { rangeOf, valuesOf } from './field/quantities.js';
import { drawSections } from './field/sections.js';

/** @typedef {import('./fields.js').Field} Field */
/** @typedef {import('./field/quantities.js').Quantity} Quantity */
/** @typedef {import('./field/layout.js').Layout} Layout */
/** @typedef {import('./field/picture.js').Scene} Scene */

/**
 * @typedef {object} Shown
 * @property {Field} field
 * @property {Quantity} quantity
 * @property {readonly [number, number]} [range] Range of colours that is shared with other maps.
 * @property {number} [friction]
 * @property {boolean} [border]
 * @property {boolean} [arrows]
 * @property {boolean} [mesh]
 * @property {boolean} [sections]
 * @property {number} [scale] Pixels per mm of a small picture without axes.
 * @property {{ x: number, y: number } | null} [held] Fixed position of the crosshair.
 * @property {number} [tallest] Largest height of the map in pixels.
 * @property {boolean} [bent] Whether the lateral coordinate is the arc length along the rail.
 * @property {string} [name] Accessible name.
 */

/** @typedef {CustomEvent<{ x: number, y: number, held: boolean }>} CrosshairEvent */

const HELP = 'Arrow keys move the crosshair from cell to cell, with Shift by five; Home and End go to the ends of the strip; '
  + 'Enter fixes the crosshair, Escape releases it.';

export class FieldMap extends HTMLElement {
  /** @type {Shown | null} */ #shown = null;
  /** @type {Scene | null} */ #scene = null;
  /** @type {Layout | null} */ #layout = null;
  /** @type {{ x: number, y: number } | null} */ #place = null;
  #held = false;
  #pending = 0;
  #announce = false;
  #base = document.createElement('canvas');
  #over = document.createElement('canvas');
  #readout = document.createElement('dl');
  #live = document.createElement('output');
  /** Duration of the last drawing of the picture and of the crosshair, in ms. */
  took = { picture: 0, crosshair: 0 };
  #resized = new ResizeObserver(() => requestAnimationFrame(() => this.draw()));
  #themed = new MutationObserver(() => this.draw());
  #scheme = matchMedia('(prefers-color-scheme: dark)');
  #redraw = () => this.draw();

  connectedCallback() {
    if (!this.#base.isConnected) this.#build();
    this.#resized.observe(this);
    this.#themed.observe(document.documentElement, { attributes: true, attributeFilter: ['data-theme'] });
    this.#scheme.addEventListener('change', this.#redraw);
    this.draw();
  }

  disconnectedCallback() {
    this.#resized.disconnect();
    this.#themed.disconnect();
    this.#scheme.removeEventListener('change', this.#redraw);
  }

  /** Sets the shown data. The map is redrawn only if they change. @param {Shown | null} shown */
  set shown(shown) {
    const before = this.#shown;
    const keys = /** @type {(keyof Shown)[]} */ ([...new Set([...Object.keys(before ?? {}), ...Object.keys(shown ?? {})])]);
    if (before && shown && keys.every((key) => same(before[key], shown[key]))) return;
    this.#shown = shown;
    if (!shown) return;
    const held = shown.held ?? null;
    if (!same(held, before?.held ?? null) || !before) {
      this.#held = held !== null;
      if (held) this.#place = held;
    }
    this.draw();
  }

  get shown() {
    return this.#shown;
  }

  /** Moves the crosshair without dispatching an event, to follow the crosshair of another map. @param {{ x: number, y: number }} place */
  follow(place) {
    this.#place = place;
    this.#paint();
  }

  #build() {
    this.#base.setAttribute('aria-hidden', 'true');
    this.#over.className = 'over';
    this.#readout.className = 'readout';
    this.#live.className = 'visually-hidden';
    this.#live.setAttribute('aria-live', 'polite');
    this.append(this.#base);
    this.#over.addEventListener('pointermove', (event) => this.#held || this.#point(event));
    this.#over.addEventListener('pointerdown', (event) => {
      this.#held = true;
      this.#point(event);
    });
    this.#over.addEventListener('pointerleave', () => this.#held || this.#goHome());
    this.#over.addEventListener('keydown', (event) => this.#key(event));
  }

  /** Draws the picture and the crosshair. */
  draw() {
    const shown = this.#shown;
    if (!shown || !this.isConnected) return;
    const began = performance.now();
    const values = valuesOf(shown.quantity, shown.field.cells);
    if (!values) return;
    const index = indexOf(shown.field);
    const compact = shown.scale !== undefined;
    const range = shown.range ?? rangeOf(shown.quantity, [shown.field.cells], NaN);
    this.#scene = {
      index, quantity: shown.quantity, values, range, friction: shown.friction ?? NaN, compact,
      border: shown.border ?? false, arrows: shown.arrows ?? false, mesh: shown.mesh ?? false, bent: shown.bent ?? false,
    };
    const width = this.clientWidth;
    if (!compact && !width) return;
    const tallest = shown.tallest ?? Math.max(260, Math.min(560, innerHeight - 500));
    const sections = (shown.sections ?? true) && shown.quantity.scale !== 'zones';
    this.#layout = compact ? layoutCompact(index, shown.scale ?? 1) : layoutMap(index, width, { sections, tallest });
    this.#interactive(!compact, shown.name ?? 'Field over the contact patch');
    const density = Math.min(3, devicePixelRatio || 1);
    for (const canvas of [this.#base, this.#over]) {
      canvas.width = Math.round(this.#layout.width * density);
      canvas.height = Math.round(this.#layout.height * density);
      canvas.style.width = `${this.#layout.width}px`;
      canvas.style.height = `${this.#layout.height}px`;
    }
    drawPicture(pen(this.#base), this.#scene, this.#layout, density, inkOf(this));
    if (!this.#held || !this.#place) this.#place = this.#largest();
    this.took.picture = performance.now() - began;
    if (!compact) this.#paint();
    this.dispatchEvent(new CustomEvent('drawn', { bubbles: true }));
  }

  /** @param {boolean} yes @param {string} name */
  #interactive(yes, name) {
    if (!yes || this.#over.isConnected) {
      this.#over.setAttribute('aria-label', `${name}. ${HELP}`);
      return;
    }
    this.#over.tabIndex = 0;
    this.#over.setAttribute('role', 'application');
    this.#over.setAttribute('aria-roledescription', 'field map');
    this.#over.setAttribute('aria-label', `${name}. ${HELP}`);
    this.append(this.#over, this.#readout, this.#live);
  }

  /** Returns the position of the largest value, where the crosshair rests. */
  #largest() {
    const scene = this.#scene;
    if (!scene) return null;
    let best = 0;
    for (let cell = 1; cell < scene.values.length; cell += 1) {
      if (Math.abs(scene.values[cell]) > Math.abs(scene.values[best])) best = cell;
    }
    return { x: scene.index.cells.x_mm[best], y: scene.index.cells.y_mm[best] };
  }

  #goHome() {
    this.#place = this.#largest();
    this.#paint();
    this.#tellOthers();
  }

  /** @param {PointerEvent} event */
  #point(event) {
    const layout = this.#layout;
    if (!layout) return;
    const { left, top } = this.#over.getBoundingClientRect();
    const x = layout.x0 + (event.clientX - left - layout.map.left) / layout.scale;
    const y = layout.y1 - (event.clientY - top - layout.map.top) / layout.scale;
    const right = layout.x0 + layout.map.width / layout.scale;
    const bottom = layout.y1 - layout.map.height / layout.scale;
    this.#place = { x: Math.max(layout.x0, Math.min(right, x)), y: Math.max(bottom, Math.min(layout.y1, y)) };
    this.#paint();
    this.#tellOthers();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const scene = this.#scene;
    if (!scene || !this.#place) return;
    if (event.key === 'Escape') {
      this.#held = false;
      this.#goHome();
    } else if (event.key === 'Enter') {
      this.#held = !this.#held;
      this.#announce = true;
      this.#paint();
      this.#tellOthers();
    } else {
      const place = step(scene.index, this.#place, event.key, event.shiftKey ? 5 : 1);
      if (!place) return;
      event.preventDefault();
      this.#place = place;
      this.#held = true;
      this.#announce = true;
      this.#paint();
      this.#tellOthers();
    }
  }

  #tellOthers() {
    const detail = { ...(this.#place ?? { x: 0, y: 0 }), held: this.#held };
    this.dispatchEvent(new CustomEvent('crosshair', { detail, bubbles: true }));
  }

  #paint() {
    this.#pending ||= requestAnimationFrame(() => {
      this.#pending = 0;
      this.#crosshair();
    });
  }

  #crosshair() {
    const scene = this.#scene;
    const layout = this.#layout;
    const place = this.#place;
    if (!scene || !layout || !place || scene.compact) return;
    const began = performance.now();
    const ink = inkOf(this);
    const over = pen(this.#over);
    const density = this.#over.width / layout.width;
    over.setTransform(density, 0, 0, density, 0, 0);
    over.clearRect(0, 0, layout.width, layout.height);
    drawHair(over, layout, place, this.#held);
    const cell = scene.index.cellAt(place.x, place.y);
    if (cell >= 0) {
      const { x_mm, y_mm, dx_mm, dy_mm } = scene.index.cells;
      over.strokeStyle = '#ffffff';
      over.lineWidth = 2;
      const left = layout.X(x_mm[cell] - dx_mm[cell] / 2);
      over.strokeRect(left, layout.Y(y_mm[cell] + dy_mm[cell] / 2), dx_mm[cell] * layout.scale, dy_mm[cell] * layout.scale);
      drawBarMark(over, scene, layout, scene.values[cell], ink);
    }
    drawSections(over, scene, layout, place, ink);
    this.#say(tell(scene, place, cell));
    this.took.crosshair = performance.now() - began;
  }

  /** @param {[string, string][]} told */
  #say(told) {
    const entries = told.map(([name, value]) => {
      const entry = document.createElement('div');
      const term = document.createElement('dt');
      const text = document.createElement('dd');
      term.textContent = name;
      text.textContent = value;
      entry.append(term, text);
      return entry;
    });
    this.#readout.replaceChildren(...entries);
    if (!this.#announce) return;
    this.#announce = false;
    this.#live.textContent = told.map(([name, value]) => `${name} ${value}`).join(', ') + (this.#held ? ', held' : '');
  }

  /**
   * Renders the picture as shown on the screen as PNG, on the background of the theme.
   * @param {number} density
   * @returns {Promise<Blob | null>}
   */
  png(density = 2) {
    if (!this.#scene || !this.#layout) return Promise.resolve(null);
    const sheet = document.createElement('canvas');
    sheet.width = Math.round(this.#layout.width * density);
    sheet.height = Math.round(this.#layout.height * density);
    const ink = inkOf(this);
    const sheetPen = pen(sheet);
    drawPicture(sheetPen, this.#scene, this.#layout, density, ink);
    if (this.#place) drawSections(sheetPen, this.#scene, this.#layout, this.#place, ink);
    sheetPen.setTransform(1, 0, 0, 1, 0, 0);
    sheetPen.globalCompositeOperation = 'destination-over';
    sheetPen.fillStyle = ink.surface;
    sheetPen.fillRect(0, 0, sheet.width, sheet.height);
    return new Promise((resolve) => sheet.toBlob(resolve, 'image/png'));
  }
}

/** @param {HTMLCanvasElement} canvas */
const pen = (canvas) => /** @type {CanvasRenderingContext2D} */ (canvas.getContext('2d'));

/** @param {unknown} one @param {unknown} other */
function same(one, other) {
  if (one === other) return true;
  if (Array.isArray(one) && Array.isArray(other)) return one.length === other.length && one.every((item, i) => item === other[i]);
  if (!isPlace(one) || !isPlace(other)) return false;
  return one.x === other.x && one.y === other.y;
}

/** @param {unknown} value @returns {value is { x: number, y: number }} */
const isPlace = (value) => typeof value === 'object' && value !== null && 'x' in value && 'y' in value;

/**
 * @param {CanvasRenderingContext2D} over
 * @param {Layout} layout
 * @param {{ x: number, y: number }} place
 * @param {boolean} held
 */
function drawHair(over, { map, X, Y }, place, held) {
  const x = X(place.x);
  const y = Y(place.y);
  /** @type {[string, number, number[]][]} */
  const strokes = [['#00000080', 2.5, []], ['#ffffff', 1, held ? [] : [5, 4]]];
  for (const [colour, width, dash] of strokes) {
    over.strokeStyle = colour;
    over.lineWidth = width;
    over.setLineDash(dash);
    over.beginPath();
    over.moveTo(map.left, y);
    over.lineTo(map.left + map.width, y);
    over.moveTo(x, map.top);
    over.lineTo(x, map.top + map.height);
    over.stroke();
  }
  over.setLineDash([]);
}

/**
 * Returns the cell centre to which a key moves the crosshair; null for other keys.
 * @param {import('./field/cells.js').CellIndex} index
 * @param {{ x: number, y: number }} place
 * @param {string} key
 * @param {number} by
 */
function step(index, place, key, by) {
  const { x_mm } = index.cells;
  const inside = index.stripAt(place.y);
  const at = inside < 0 ? index.strips.length >> 1 : inside;
  const strip = index.strips[at];
  const found = index.nearest(place.x, strip.y);
  const cell = found < strip.first || found >= strip.end ? strip.first : found;
  const limit = (/** @type {number} */ value, /** @type {number} */ low, /** @type {number} */ high) => Math.max(low, Math.min(high, value));
  const toCell = (/** @type {number} */ wanted) => ({ x: x_mm[limit(wanted, strip.first, strip.end - 1)], y: strip.y });
  const toStrip = (/** @type {number} */ wanted) => ({ x: place.x, y: index.strips[limit(wanted, 0, index.strips.length - 1)].y });
  switch (key) {
    case 'ArrowRight': return toCell(cell + by);
    case 'ArrowLeft': return toCell(cell - by);
    case 'ArrowUp': return toStrip(at + by);
    case 'ArrowDown': return toStrip(at - by);
    case 'Home': return toCell(strip.first);
    case 'End': return toCell(strip.end - 1);
    default: return null;
  }
}

customElements.define('field-map', FieldMap);
