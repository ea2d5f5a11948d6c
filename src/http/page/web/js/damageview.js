// Damage of one pass: wear, fatigue, shakedown, stresses below the surface and temperature, with parameters and uncertainty.

import { html, nothing } from '../vendor/lit-html.js';
import { drawChart } from './drawing/axes.js';
import { indexOf } from './field/cells.js';
import { fixed, number } from './format.js';
import { patchesWith } from './loadsview.js';
import { choose, stressesBelow } from './result.js';
import { acrossSection } from './placing.js';
import { isSolvedBent } from './starts.js';
import { sideOf } from './wheelloads.js';

/** @typedef {import('./state.js').App} App */
/** @typedef {import('./result.js').Looked} Looked */
/** @typedef {import('./api.js').JobResult} JobResult */
/** @typedef {import('./api.js').Schemas} Schemas */
/** @typedef {import('./api.js').Point} Point */
/** @typedef {import('./drawing/axes.js').ChartLine} ChartLine */
/** @typedef {Schemas['Ranged']} Ranged */
/** @typedef {{ at: number, point: Point, patch: JobResult['patches'][number] }} Shown A patch with its chosen motion. */

/** Shakedown limit of a line contact as a load factor (Johnson 1985, chapter 9). */
const SUBSURFACE_LIMIT = 4;

/** @param {Point} point */
const hasDamage = ({ damage, subsurface, temperature }) => Boolean(damage || subsurface || temperature);

/**
 * @param {App} app
 * @param {Looked} looked
 * @param {JobResult} answer
 * @param {() => void} again Solves the case with damage.
 */
export function damagePanel(app, looked, answer, again) {
  const shown = patchesWith(answer, looked.patch).map((at) => {
    const patch = answer.patches[at];
    return { at, patch, point: patch.points[Math.min(looked.point, patch.points.length - 1)] };
  });
  const chosen = shown.find(({ at }) => at === looked.patch) ?? shown[0];
  if (!hasDamage(chosen.point)) {
    if (chosen.point.history) return nothing;
    return html`<section class="panel wait"><p>Wear, fatigue, stresses below the surface and temperature were not requested.</p>
      <button class="primary" @click=${again}>Solve again with damage</button></section>`;
  }
  const figures = answer.damage_parameters;
  return html`<section class="panel damage" aria-labelledby="h-damage">
    <header class="bar"><h2 id="h-damage">Damage of one pass</h2><span class="hint">${figures ? `parameters ${figures.set}` : ''}</span></header>
    <div class="cards">
      ${chosen.point.damage ? html`<div class="card tall"><h3>Wear and fatigue</h3>${table(shown, figures)}</div>` : nothing}
      ${wearCard(app, looked, answer, shown)}
      ${shakedownCard(shown, figures)}
      ${depthCard(app, looked, answer, chosen, figures)}
      ${temperatureCard(looked, chosen)}
    </div>
    ${figures ? sources(figures) : nothing}</section>`;
}

/** Shows a value with the interval due to the errors of its inputs. @param {Ranged | undefined} of @param {number} [factor] */
function ranged(of, factor = 1) {
  if (!of) return '–';
  const { value, low, high } = of;
  const known = typeof low === 'number' && typeof high === 'number' && high > low;
  return html`${number(value * factor, 3)}${known ? html` <small>${number(low * factor, 3)} … ${number(high * factor, 3)}</small>` : nothing}`;
}

/**
 * @param {readonly Shown[]} shown
 * @param {Schemas['DamageFiguresUsed'] | undefined | null} figures
 */
function table(shown, figures) {
  const unconfirmed = new Set(figures?.unconfirmed ?? []);
  const mark = (/** @type {Schemas['DamageModel']} */ model) => (unconfirmed.has(model) ? html`<abbr title="Parameters that are not confirmed against their source">†</abbr>` : nothing);
  /** @type {(label: unknown, value: (damage: Schemas['DamageAnswer']) => unknown, is?: (damage: Schemas['DamageAnswer']) => unknown) => unknown} */
  const row = (label, value, is = () => true) => (shown.some(({ point }) => point.damage && is(point.damage))
    ? html`<tr><th scope="row">${label}</th>${shown.map(({ point }) => html`<td>${point.damage ? value(point.damage) : '–'}</td>`)}</tr>` : nothing);
  return html`<div class="scroll" tabindex="0" role="region" aria-label="Wear and fatigue of the patches"><table>
    <thead><tr><th></th>${shown.map(({ at, patch }) => html`<th scope="col">patch ${at}${patch.position ? html`<br><small>y ${fixed(patch.position.rail_mm[0], 1)} mm on the rail</small>` : nothing}</th>`)}</tr></thead>
    <tbody>
      ${row('Tγ with spin / J/m', ({ t_gamma }) => ranged(t_gamma?.with_spin_n), ({ t_gamma }) => t_gamma)}
      ${row('Tγ without spin / J/m', ({ t_gamma }) => ranged(t_gamma?.without_spin_n), ({ t_gamma }) => t_gamma)}
      ${row('Tγ over area / N/mm²', ({ t_gamma }) => ranged(t_gamma?.over_area_n_per_mm2), ({ t_gamma }) => t_gamma)}
      ${row(html`wear, Tγ/A law: regime`, ({ usfd_wear }) => usfd_wear?.regime ?? '–', ({ usfd_wear }) => usfd_wear)}
      ${row(html`wear, Tγ/A law: mean depth / nm`, ({ usfd_wear }) => ranged(usfd_wear?.depth_nm), ({ usfd_wear }) => usfd_wear)}
      ${row(html`wear, Archard: regime ${mark('archard_wear')}`, ({ archard_wear }) => archard_wear?.regime ?? '–', ({ archard_wear }) => archard_wear)}
      ${row(html`wear, Archard: mean depth / nm ${mark('archard_wear')}`, ({ archard_wear }) => ranged(archard_wear?.depth_nm), ({ archard_wear }) => archard_wear)}
      ${row(html`RCF damage, WLRM / 10⁻⁶ ${mark('wlrm')}`, ({ wlrm }) => ranged(wlrm?.damage_per_pass, 1e6), ({ wlrm }) => wlrm)}
      ${row(html`surface fatigue index ${mark('surface_fatigue_index')}`, ({ surface_fatigue_index: index }) => ranged(index?.index), ({ surface_fatigue_index: index }) => index)}
      ${row(html`load over shakedown limit ${mark('shakedown')}`, ({ shakedown }) => html`<span class=${shakedown?.ratchets ? 'warn' : ''}>${ranged(shakedown?.over_limit)}</span>`, ({ shakedown }) => shakedown)}
    </tbody></table></div>
    <p class="hint">Small: interval that the estimated errors leave. RCF below 0: wear removes cracks.${unconfirmed.size ? ' † Parameters not confirmed against their source.' : ''}</p>`;
}

/** Chart of the wear depth across the profiles. @param {App} app @param {Looked} looked @param {JobResult} answer @param {readonly Shown[]} shown */
function wearCard(app, looked, answer, shown) {
  if (!shown.some(({ point }) => point.damage?.across)) return nothing;
  const body = looked.wornBody;
  const placed = shown.every(({ patch }) => patch.position);
  /** @type {(name: 'usfd_depth_nm' | 'archard_depth_nm', label: string, look: string) => ChartLine[]} */
  const lines = (name, label, look) => shown.flatMap(({ at, patch, point }, order) => {
    const across = point.damage?.across;
    const depths = across?.[name];
    if (!across || !depths) return [];
    const hand = answer.wheelset ? sideIn(answer, at) : sideOf(looked.document);
    const place = acrossSection(patch, body, hand, looked.wheels[hand], isSolvedBent(looked.document, answer, at));
    const last = across.y_mm.length - 1;
    const points = /** @type {[number, number][]} */ ([
      [place(across.y_mm[0] - across.dy_mm[0] / 2), 0],
      ...across.y_mm.map((y, strip) => [place(y), depths[strip]]),
      [place(across.y_mm[last] + across.dy_mm[last] / 2), 0],
    ]);
    return [{ label: order ? '' : label, look, points, smooth: true }];
  });
  const all = [...lines('usfd_depth_nm', 'Tγ/A law', 'one'), ...lines('archard_depth_nm', 'Archard', 'two')];
  if (!all.length) return nothing;
  const ys = all.flatMap(({ points }) => points.map(([y]) => y));
  const margin = 0.08 * (Math.max(...ys) - Math.min(...ys));
  return html`<div class="card"><h3>Wear depth across the ${placed ? body : 'patch'}
      ${placed ? html`<span class="segs" role="group" aria-label="Wear shown on">${/** @type {const} */ (['rail', 'wheel']).map((name) => html`<label class="seg minor">
        <input type="radio" name="worn" .checked=${body === name} @change=${() => choose(app, { wornBody: name })}><span>${name}</span></label>`)}</span>` : nothing}</h3>
    ${drawChart({
      name: `Wear depth of one pass across the ${placed ? body : 'patch'}`, lines: all, y: 'depth of one pass / nm',
      x: placed ? `y on the ${body}, to the field side / mm` : 'y in the patch, to the left / mm', xRange: [Math.min(...ys) - margin, Math.max(...ys) + margin],
    })}
    <p class="hint">${placed && body === 'wheel' ? 'At the places of the wheel where the rail wears; both laws are those of a rail passed once, and of a wheel once per turn.' : `Each cell has a regime of its own; the table has that of the mean over the patch. Archard: middle of the range of its coefficient.${answer.wheelset ? ' Lines of both wheels.' : ''}`}</p></div>`;
}

/** @param {JobResult} answer @param {number} patch */
const sideIn = ({ wheelset }, patch) => (wheelset?.positions.some(({ left }) => left.patches.includes(patch)) ? 'left' : 'right');

/** Shakedown map with a point for each patch. @param {readonly Shown[]} shown @param {Schemas['DamageFiguresUsed'] | undefined | null} figures */
function shakedownCard(shown, figures) {
  const places = shown.flatMap(({ at, point }) => (point.damage?.shakedown ? [{ at, place: point.damage.shakedown }] : []));
  if (!places.length) return nothing;
  const most = Math.max(0.6, ...places.map(({ place }) => 1.15 * place.utilisation.value));
  const border = Array.from({ length: 61 }, (_, step) => {
    const used = (step / 60) * most;
    return /** @type {[number, number]} */ ([used, Math.min(SUBSURFACE_LIMIT, 1 / Math.max(used, 1e-9))]);
  });
  const top = Math.max(6, ...places.map(({ place }) => 1.15 * place.load_factor));
  return html`<div class="card"><h3>Shakedown map</h3>
    ${drawChart({
      name: places.map(({ at, place }) => `Patch ${at}: load factor ${number(place.load_factor, 3)} at ${number(place.utilisation.value, 2)}, limit ${number(place.limit, 3)}`).join('; '),
      lines: [{ label: 'limit: above it plastic strain goes on', look: 'limit', points: border }], x: 'tangential over normal force', y: 'largest pressure over yield in shear',
      xRange: [0, most], yRange: [0, top], marks: places.map(({ at, place }) => ({ at: /** @type {[number, number]} */ ([place.utilisation.value, place.load_factor]), label: `patch ${at}` })),
    })}
    <p class="hint">Yield in shear ${number(figures?.shear_yield_mpa ?? NaN, 3)} MPa; change it for your steel in the form.</p></div>`;
}

/** Chart of the stresses below the chosen patch. @param {App} app @param {Looked} looked @param {JobResult} answer @param {Shown} chosen @param {Schemas['DamageFiguresUsed'] | undefined | null} figures */
function depthCard(app, looked, answer, { at, patch, point }, figures) {
  const worst = point.subsurface?.worst;
  if (!point.subsurface) return nothing;
  const below = stressesBelow(app, looked, at);
  const depths = below?.points ?? [];
  // The worst point is added to the line if the line passes through it.
  const through = worst && depths.length && Math.hypot(depths[0].at_mm[0] - worst.at_mm[0], depths[0].at_mm[1] - worst.at_mm[1]) < 1e-6;
  const points = [...depths, ...(through ? [worst] : [])].sort((one, two) => one.at_mm[2] - two.at_mm[2]);
  const deepest = Math.max(1, ...points.map(({ at_mm }) => at_mm[2]));
  const yieldMpa = figures ? Math.sqrt(3) * figures.shear_yield_mpa : NaN;
  /** @type {ChartLine[]} */
  const lines = points.length ? [
    { label: 'von Mises', look: 'one', points: points.map((each) => [each.von_mises_mpa, each.at_mm[2]]) },
    { label: 'largest shear', look: 'two', points: points.map((each) => [each.shear_max_mpa, each.at_mm[2]]) },
    ...(Number.isFinite(yieldMpa) ? [/** @type {ChartLine} */ ({ label: 'yield, √3 k', look: 'limit', points: [[yieldMpa, 0], [yieldMpa, deepest]] })] : []),
  ] : [];
  const open = point.profile_uncertainty?.pressure_max_mpa;
  return html`<div class="card"><h3>Stress below the surface of the rail, patch ${at}</h3>
    ${lines.length ? drawChart({
      name: worst ? `Stress over depth; von Mises ${number(worst.von_mises_mpa, 3)} MPa at most, ${number(worst.at_mm[2], 2)} mm deep` : 'Stress over depth',
      lines, x: 'stress / MPa', y: 'depth / mm', yRange: [deepest, 0],
      marks: worst ? [{ at: [worst.von_mises_mpa, worst.at_mm[2]], label: `${number(worst.von_mises_mpa, 3)} MPa` }] : [],
    }) : nothing}
    ${worst ? html`<p>Worst point: von Mises <b>${number(worst.von_mises_mpa, 3)} MPa</b>, shear ${number(worst.shear_max_mpa, 3)} MPa, <b>${number(worst.at_mm[2], 2)} mm</b> deep,
      at x ${fixed(worst.at_mm[0], 1)}, ${isSolvedBent(looked.document, answer, at) ? 's' : 'y'} ${fixed(worst.at_mm[1], 1)} mm of the patch.</p>` : nothing}
    <p class="hint">Numerical error up to 0.3 % of the largest pressure (${number(0.003 * patch.pressure_max_mpa, 2)} MPa)${typeof open === 'number' ? `; the profiles leave the pressure open by ± ${number(open, 2)} MPa` : ''}.</p></div>`;
}

/** Chart of the temperature along the strip with the hottest point. @param {Looked} looked @param {Shown} chosen */
function temperatureCard(looked, { at, point }) {
  const heat = point.temperature;
  if (!heat) return nothing;
  const field = looked.fields[at];
  const { temperature_c: temperatures, x_mm } = field?.cells ?? {};
  const index = field && indexOf(field);
  const cells = index ? index.row(index.stripAt(heat.at_mm[1])) : [];
  const coldest = temperatures ? Math.min(...cells.map((cell) => temperatures[cell])) : 0;
  /** @type {ChartLine[]} */
  const lines = temperatures && x_mm && cells.length
    ? [{ label: 'both surfaces', look: 'one', points: cells.map((cell) => [x_mm[cell], temperatures[cell]]) }] : [];
  return html`<div class="card"><h3>Flash temperature, patch ${at}</h3>
    ${lines.length ? drawChart({
      name: `Temperature along rolling: ${number(heat.max_c, 3)} °C at most`, lines, x: 'x along rolling / mm', y: 'temperature / °C',
      xRange: [x_mm?.[cells[0]] ?? 0, x_mm?.[cells[cells.length - 1]] ?? 1], yRange: [coldest, coldest + 1.15 * Math.max(1, heat.max_c - coldest)], marks: [{ at: [heat.at_mm[0], heat.max_c], label: `${number(heat.max_c, 3)} °C` }],
    }) : nothing}
    <p>Largest <b>${number(heat.max_c, 3)} °C</b>, a rise of ${number(heat.rise_max_k, 3)} K by friction.</p>
    <p class="hint">Within 2 % where heat flows into the depth only (Péclet number ${number(heat.peclet, 2)}, to be well above 10); ${number(100 * heat.heat_share_lower, 2)} % of the heat flows into the rail.</p></div>`;
}

/** Descriptions of the sources, by the names of the API. @type {Record<string, string>} */
const SOURCES = { usfd: 'wear, Tγ/A law', archard: 'wear, Archard', wlrm: 'RCF damage', shear_yield_mpa: 'yield in shear', hardness_mpa: 'hardness' };

/** @param {Schemas['DamageFiguresUsed']} figures */
function sources(figures) {
  return html`<details class="as-table"><summary>Parameters and their sources</summary>
    <p>Set ${figures.set}: density ${number(figures.density_kg_per_m3)} kg/m³, yield in shear ${number(figures.shear_yield_mpa)} MPa, hardness ${number(figures.hardness_mpa)} MPa.</p>
    <ul>${figures.sources.map((source) => html`<li>${source.replace(/^\w+(?=:)/, (name) => SOURCES[name] ?? name)}</li>`)}</ul></details>`;
}
