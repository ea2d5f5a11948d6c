// <line-strips>: one strip for each quantity along the line, with one cursor; dragging zooms all, a double click opens the contact.

import uPlot from '../vendor/uPlot.esm.js';
import { number, tickLabel } from './format.js';
import { adoptShown } from './adopt.js';
import { placeOf, STRIPS } from './line.js';

/** @typedef {import('./line.js').Row} Row */
/** @typedef {import('./line.js').StripKey} StripKey */

/**
 * @typedef {object} Shown
 * @property {readonly Row[]} rows Sorted along the line.
 * @property {string} by
 * @property {Partial<Record<StripKey, number>>} limits
 * @property {{ from: number, to: number } | null} zoom
 * @property {(row: Row) => void} open
 * @property {(zoom: { from: number, to: number } | null) => void} zoomed
 */

const HEIGHT = 132;
const LAST_HEIGHT = 168;

export class LineStrips extends HTMLElement {
  /** @type {Shown | null} */ #shown = null;
  /** @type {uPlot[]} */ #plots = [];
  #zooming = false;
  #resized = new ResizeObserver(() => this.#resize());
  #themed = new MutationObserver(() => this.#build());

  connectedCallback() {
    adoptShown(this);
    this.#resized.observe(this);
    this.#themed.observe(document.documentElement, { attributes: true, attributeFilter: ['data-theme'] });
    this.addEventListener('keydown', (event) => this.#key(event));
    this.#build();
  }

  disconnectedCallback() {
    this.#resized.disconnect();
    this.#themed.disconnect();
    this.#clear();
  }

  /** @param {Shown} shown */
  set shown(shown) {
    const before = this.#shown;
    this.#shown = shown;
    if (before?.rows === shown.rows && before.by === shown.by) this.#plots.forEach((plot) => plot.redraw());
    else this.#build();
  }

  get plots() {
    return this.#plots;
  }

  #clear() {
    this.#plots.forEach((plot) => plot.destroy());
    this.#plots = [];
  }

  #resize() {
    if (!this.#plots.length) this.#build();
    this.#plots.forEach((plot) => {
      if (Math.abs(plot.width - this.clientWidth) > 1) plot.setSize({ width: this.clientWidth, height: plot.height });
    });
  }

  #build() {
    this.#clear();
    const shown = this.#shown;
    if (!shown || !this.isConnected || !this.clientWidth) return;
    const sync = uPlot.sync('line');
    const xs = shown.rows.map((row) => placeOf(row, shown.by));
    this.#plots = STRIPS.map((strip, at) => {
      const plot = new uPlot(this.#options(strip, at === STRIPS.length - 1, sync.key), [xs, shown.rows.map((row) => row[strip.key])], this);
      plot.over.addEventListener('dblclick', () => this.#open(plot.cursor.idx));
      sync.sub(plot);
      return plot;
    });
    if (shown.zoom) this.#zoomAll(shown.zoom.from, shown.zoom.to);
  }

  /** @param {number | null | undefined} at */
  #open(at) {
    const row = typeof at === 'number' ? this.#shown?.rows[at] : undefined;
    if (row) this.#shown?.open(row);
  }

  /** Arrow keys move the cursor of all strips, Enter opens the contact, Escape shows the whole line. @param {KeyboardEvent} event */
  #key(event) {
    const [first] = this.#plots;
    const rows = this.#shown?.rows ?? [];
    if (!first || !rows.length) return;
    const at = first.cursor.idx ?? 0;
    const by = event.shiftKey ? 10 : 1;
    if (event.key === 'Enter') this.#open(at);
    else if (event.key === 'Escape') this.#zoomAll(first.data[0][0], first.data[0][rows.length - 1]);
    else if (event.key === 'ArrowLeft' || event.key === 'ArrowRight') {
      const next = Math.max(0, Math.min(rows.length - 1, at + (event.key === 'ArrowRight' ? by : -by)));
      first.setCursor({ left: first.valToPos(first.data[0][next], 'x'), top: 10 });
    } else return;
    event.preventDefault();
  }

  /** @param {number} from @param {number} to */
  #zoomAll(from, to) {
    this.#zooming = true;
    this.#plots.forEach((plot) => plot.setScale('x', { min: from, max: to }));
    this.#zooming = false;
  }

  /**
   * @param {typeof STRIPS[number]} strip
   * @param {boolean} last
   * @param {string} key
   * @returns {uPlot.Options}
   */
  #options({ key: strip, label, unit, colour }, last, key) {
    const style = getComputedStyle(this);
    const token = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const labels = (/** @type {uPlot} */ _, /** @type {number[]} */ marks) => marks.map((mark) => tickLabel(mark, marks));
    const axis = { stroke: token('--ink-2'), grid: { stroke: token('--line'), width: 1 }, ticks: { show: false }, font: `12px ${style.fontFamily}` };
    return {
      width: this.clientWidth,
      height: last ? LAST_HEIGHT : HEIGHT,
      scales: { x: { time: false } },
      cursor: { sync: { key, setSeries: false }, drag: { x: true, y: false } },
      legend: { live: true },
      axes: [{ ...axis, size: last ? 34 : 4, values: last ? labels : () => [] }, { ...axis, size: 58, values: labels }],
      series: [
        { label: this.#shown?.by || 'case', value: (_, value) => number(value, 6) },
        { label: `${label} / ${unit}`, stroke: token(colour), width: 1.25, fill: `${token(colour)}22`, points: { show: false }, value: (_, value) => number(value) },
      ],
      hooks: {
        draw: [(plot) => this.#drawLimit(plot, strip, token('--bad'))],
        setScale: [(plot, scale) => {
          const { min, max } = plot.scales.x;
          if (scale !== 'x' || this.#zooming || typeof min !== 'number' || typeof max !== 'number' || !this.#plots.includes(plot)) return;
          const xs = plot.data[0];
          const whole = min <= xs[0] && max >= xs[xs.length - 1];
          this.#shown?.zoomed(whole ? null : { from: min, to: max });
        }],
      },
    };
  }

  /** @param {uPlot} plot @param {StripKey} strip @param {string} colour */
  #drawLimit(plot, strip, colour) {
    const limit = this.#shown?.limits[strip];
    if (limit === undefined) return;
    const y = plot.valToPos(limit, 'y', true);
    const { left, top, width, height } = plot.bbox;
    if (y < top || y > top + height) return;
    const pen = plot.ctx;
    pen.save();
    pen.strokeStyle = colour;
    pen.lineWidth = 1.5 * (devicePixelRatio || 1);
    pen.setLineDash([6, 4]);
    pen.beginPath();
    pen.moveTo(left, y);
    pen.lineTo(left + width, y);
    pen.stroke();
    pen.restore();
  }
}

customElements.define('line-strips', LineStrips);
