// Custom element <creep-curve>: a chart of lines with estimated errors, such as forces over creepage or Δr of a wheelset over its shift. A click selects a
// point.

import uPlot from '../vendor/uPlot.esm.js';
import { number, tickLabel } from './format.js';
import { adoptShown } from './adopt.js';

/** @typedef {import('./curvedata.js').Curve} Curve */
/** @typedef {import('./curvedata.js').Line} Line */
/** @typedef {{ curve: Curve, chosen: number, pick: (motion: number) => void }} Shown */

/** Half the width of the cap of an error bar, in pixels. */
const CAP = 4;
/** Largest number of values that are drawn with marks and error bars; those of longer lines would overlap. Chosen by judgement. */
const MARKED_MAX = 60;

export class CreepCurve extends HTMLElement {
  /** @type {uPlot | null} */ #plot = null;
  /** @type {Shown | null} */ #shown = null;
  #resized = new ResizeObserver(() => requestAnimationFrame(() => this.#resize()));
  #themed = new MutationObserver(() => this.#build());

  connectedCallback() {
    adoptShown(this);
    this.#resized.observe(this);
    this.#themed.observe(document.documentElement, { attributes: true, attributeFilter: ['data-theme'] });
    this.#build();
  }

  disconnectedCallback() {
    this.#resized.disconnect();
    this.#themed.disconnect();
    this.#plot?.destroy();
    this.#plot = null;
  }

  /** @param {Shown} shown */
  set shown(shown) {
    const same = this.#shown?.curve === shown.curve;
    this.#shown = shown;
    if (same) this.#plot?.redraw();
    else this.#build();
  }

  get plot() {
    return this.#plot;
  }

  #resize() {
    if (!this.#plot) this.#build();
    else if (Math.abs(this.clientWidth - this.#plot.width) > 1) this.#plot.setSize(this.#size());
  }

  #size() {
    return { width: this.clientWidth, height: Math.max(220, Math.min(330, this.clientWidth * 0.5)) };
  }

  #build() {
    const shown = this.#shown;
    this.#plot?.destroy();
    this.#plot = null;
    if (!shown || !this.isConnected || !this.clientWidth) return;
    const { curve } = shown;
    const style = getComputedStyle(this);
    const token = (/** @type {string} */ name) => style.getPropertyValue(name).trim();
    const font = `12px ${style.fontFamily}`;
    const labels = (/** @type {uPlot} */ _, /** @type {number[]} */ marks) => marks.map((mark) => tickLabel(mark, marks));
    const axis = { stroke: token('--ink-2'), grid: { stroke: token('--line'), width: 1 }, ticks: { show: false }, font, labelFont: font, labelSize: 22, labelGap: 0, values: labels };
    /** @type {uPlot.Options} */
    const options = {
      ...this.#size(),
      scales: { x: { time: false }, y: { range: withZero } },
      axes: [{ ...axis, size: 30, gap: 4, label: curve.xLabel }, { ...axis, size: 58, label: curve.yLabel }],
      series: [
        { label: curve.xLabel, value: (_, value) => (value === null ? '' : number(value)) },
        ...curve.lines.map((line) => seriesOf(line, token, curve.x.length <= MARKED_MAX)),
      ],
      legend: { live: true },
      cursor: { points: { size: 9 }, drag: { x: false, y: false } },
      hooks: { draw: [(plot) => this.#annotate(plot, token, font)] },
    };
    // Missing values become gaps of the line; NaN would break the scale.
    this.#plot = new uPlot(options, [curve.x, ...curve.lines.map((line) => line.y.map((value) => (Number.isFinite(value) ? value : null)))], this);
    this.#plot.over.addEventListener('click', () => {
      const at = this.#plot?.cursor.idx;
      if (typeof at === 'number') this.#shown?.pick(curve.order[at]);
    });
  }

  /**
   * Draws the error bars, the bound of friction, and the chosen motion.
   * @param {uPlot} plot
   * @param {(name: string) => string} token
   * @param {string} font
   */
  #annotate(plot, token, font) {
    const shown = this.#shown;
    if (!shown) return;
    const { curve, chosen } = shown;
    const pen = plot.ctx;
    const density = devicePixelRatio || 1;
    const { left, top, width, height } = plot.bbox;
    pen.save();
    for (const bound of [curve.bound, -curve.bound]) {
      const y = plot.valToPos(bound, 'y', true);
      if (!(y >= top && y <= top + height)) continue;
      pen.strokeStyle = pen.fillStyle = token('--ink-2');
      pen.lineWidth = density;
      pen.setLineDash([5 * density, 4 * density]);
      pen.beginPath();
      pen.moveTo(left, y);
      pen.lineTo(left + width, y);
      pen.stroke();
      pen.font = font.replace('12px', `${12 * density}px`);
      pen.textAlign = 'right';
      pen.fillText(bound > 0 ? 'μN' : '−μN', left + width - 6 * density, y - 5 * density);
    }
    pen.setLineDash([]);
    if (curve.x.length <= MARKED_MAX) for (const line of curve.lines) drawErrors(plot, curve, line, token(line.colour), density);
    const x = plot.valToPos(curve.x[curve.order.indexOf(chosen)], 'x', true);
    pen.strokeStyle = token('--accent');
    pen.globalAlpha = 0.3;
    pen.lineWidth = 8 * density;
    pen.beginPath();
    pen.moveTo(x, top);
    pen.lineTo(x, top + height);
    pen.stroke();
    pen.restore();
  }
}

/**
 * @param {Line} line
 * @param {(name: string) => string} token
 * @param {boolean} marked
 * @returns {uPlot.Series}
 */
const seriesOf = (line, token, marked) => ({
  label: line.label,
  stroke: token(line.colour),
  width: 2,
  dash: line.dash,
  points: { show: marked, size: 6, fill: token('--surface'), width: 1.5 },
  value: (_plot, value, _series, at) => {
    if (value === null) return '';
    const error = at === null ? null : line.error[at];
    return `${number(value)}${error ? ` ± ${number(error, 2)}` : ''} ${line.unit}`;
  },
});

/** @type {uPlot.Range.Function} */
function withZero(_plot, low, high) {
  const [least, most] = [Math.min(0, low), Math.max(0, high)];
  const margin = (most - least || 1) * 0.06;
  return [least < 0 ? least - margin : least, most > 0 ? most + margin : most];
}

/**
 * @param {uPlot} plot
 * @param {Curve} curve
 * @param {Line} line
 * @param {string} colour
 * @param {number} density
 */
function drawErrors(plot, curve, line, colour, density) {
  const pen = plot.ctx;
  const cap = CAP * density;
  pen.strokeStyle = colour;
  pen.lineWidth = 1.25 * density;
  pen.beginPath();
  curve.x.forEach((value, at) => {
    const error = line.error[at];
    if (!error) return;
    const x = plot.valToPos(value, 'x', true);
    const ends = [plot.valToPos(line.y[at] - error, 'y', true), plot.valToPos(line.y[at] + error, 'y', true)];
    pen.moveTo(x, ends[0]);
    pen.lineTo(x, ends[1]);
    for (const y of ends) {
      pen.moveTo(x - cap, y);
      pen.lineTo(x + cap, y);
    }
  });
  pen.stroke();
}

customElements.define('creep-curve', CreepCurve);
