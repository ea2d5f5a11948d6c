// Custom element <line-strips>: one strip for each quantity along the track, with a common cursor. Dragging zooms all strips; a double click opens the contact.

import uPlot from '../vendor/uPlot.esm.js';
import { number, tickLabel } from './format.js';
import { adoptShown } from './adopt.js';

/**
 * @typedef {object} Strip
 * @property {string} key
 * @property {string} label
 * @property {string} unit
 * @property {string} colour
 * @property {readonly { label: string, values: (number | null)[] }[]} lines The first line is filled.
 */

/**
 * @typedef {object} Shown
 * @property {number[]} x Increasing.
 * @property {string} xLabel
 * @property {readonly Strip[]} strips
 * @property {Partial<Record<string, number>>} limits
 * @property {{ from: number, to: number } | null} zoom
 * @property {(at: number) => void} open
 * @property {(zoom: { from: number, to: number } | null) => void} zoomed
 */

const HEIGHT = 112;
const LAST_HEIGHT = 156;

export class LineStrips extends HTMLElement {
  /** @type {Shown | null} */ #shown = null;
  /** @type {uPlot[]} */ #plots = [];
  #zooming = false;
  #resized = new ResizeObserver(() => requestAnimationFrame(() => this.#resize()));
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
    if (before?.x === shown.x && before.strips === shown.strips) this.#plots.forEach((plot) => plot.redraw());
    else this.#build();
  }

  get plots() {
    return this.#plots;
  }

  #clear() {
    this.#plots.forEach((plot) => plot.destroy());
    this.#plots = [];
    this.replaceChildren();
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
    this.#plots = shown.strips.map((strip, at) => {
      const title = document.createElement('p');
      const value = document.createElement('span');
      title.className = 'strip-title';
      title.append(`${strip.label}${strip.unit ? ` / ${strip.unit}` : ''}`, value);
      this.append(title);
      const last = at === shown.strips.length - 1;
      const plot = new uPlot(this.#options(strip, last, sync.key, value), [shown.x, ...strip.lines.map(({ values }) => values)], this);
      plot.over.addEventListener('dblclick', () => this.#open(plot.cursor.idx));
      sync.sub(plot);
      return plot;
    });
    if (shown.zoom) this.#zoomAll(shown.zoom.from, shown.zoom.to);
  }

  /** @param {number | null | undefined} at */
  #open(at) {
    if (typeof at === 'number') this.#shown?.open(at);
  }

  /** Handles keys: arrow keys move the cursor of all strips, Enter opens the contact, and Escape shows the whole track. @param {KeyboardEvent} event */
  #key(event) {
    const [first] = this.#plots;
    const length = this.#shown?.x.length ?? 0;
    if (!first || !length) return;
    const at = first.cursor.idx ?? 0;
    const by = event.shiftKey ? 10 : 1;
    if (event.key === 'Enter') this.#open(at);
    else if (event.key === 'Escape') this.#zoomAll(first.data[0][0], first.data[0][length - 1]);
    else if (event.key === 'ArrowLeft' || event.key === 'ArrowRight') {
      const next = Math.max(0, Math.min(length - 1, at + (event.key === 'ArrowRight' ? by : -by)));
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
   * @param {Strip} strip
   * @param {boolean} last
   * @param {string} key
   * @param {HTMLElement} value Element that shows the value at the cursor.
   * @returns {uPlot.Options}
   */
  #options({ key: strip, unit, colour, lines }, last, key, value) {
    const style = getComputedStyle(this);
    const token = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const labels = (/** @type {uPlot} */ _, /** @type {number[]} */ marks) => marks.map((mark) => tickLabel(mark, marks));
    const font = `12px ${style.fontFamily}`;
    const axis = { stroke: token('--ink-2'), grid: { stroke: token('--line'), width: 1 }, ticks: { show: false }, font, labelFont: font, labelSize: 20, labelGap: 0 };
    const xLabel = this.#shown?.xLabel || 'case';
    return {
      width: this.clientWidth,
      height: last ? LAST_HEIGHT : HEIGHT,
      scales: { x: { time: false } },
      cursor: { sync: { key, setSeries: false }, drag: { x: true, y: false } },
      legend: { show: false },
      axes: [{ ...axis, size: last ? 30 : 4, values: last ? labels : () => [], ...(last ? { label: xLabel } : {}) }, { ...axis, size: 58, values: labels }],
      series: [{}, ...lines.map((line, at) => (at
        ? { label: line.label, stroke: token('--ink'), width: 1, points: { show: false } }
        : { label: line.label, stroke: token(colour), width: 1.25, fill: `${token(colour)}22`, points: { show: false } }))],
      hooks: {
        draw: [(plot) => this.#drawLimit(plot, strip, token('--bad'))],
        setCursor: [(plot) => {
          const { idx } = plot.cursor;
          value.textContent = typeof idx !== 'number' ? ''
            : `${xLabel} ${number(plot.data[0][idx], 6)}: ${lines.map((line, at) => `${lines.length > 1 ? `${line.label} ` : ''}${number(plot.data[at + 1][idx])}`).join(', ')} ${unit}`;
        }],
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

  /** @param {uPlot} plot @param {string} strip @param {string} colour */
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
