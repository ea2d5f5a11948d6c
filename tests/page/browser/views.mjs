// Addresses of every view of the page with data in it.
import { readFileSync } from 'node:fs';
import { example, withFields } from './harness.mjs';

/**
 * Addresses of every view with something in it, and what is there when it is drawn.
 * @param {import('./harness.mjs').Service} service
 * @returns {Promise<[string, string, string][]>}
 */
export async function makeViews(service) {
  const [flange, curve, other] = [await service.solved(withFields('wheel-rail-flange')), await service.solved(withFields('sweep')), await service.solved(withFields('hertz-steel'))];
  const cases = Array.from({ length: 24 }, (_, i) => ({
    ...example('hertz-steel'), labels: { km: String(10 + i / 10) }, load: { normal_force_n: 60_000 + 3000 * ((i * 7) % 24) }, solver: { mesh: { strips: 8, cells: 8 } },
  }));
  const batch = await service.ask('/v1/batches', { json: cases });
  await fetch(`${service.base}/v1/batches/${batch.id}/results?wait=30`).then((answer) => answer.text());
  // A job with all outputs on damage, and a run along a column.
  const damage = await service.solved({ ...example('maintenance'), contact: example('wheel-rail-flange').contact, load: { vertical_force_n: 75_000 }, motion: { wheelset: { speed_mm_per_s: 20_000, force_x_n: 0 } } });
  const worn = await service.solved({ ...withFields('wheel-rail'), load: { vertical_force_n: 60_000 }, contact: { ...example('wheel-rail').contact, rail: { ...example('wheel-rail').contact.rail, smoothing_mm: 6 } } });
  const rows = { km: Array.from({ length: 60 }, (_, i) => 10 + i / 10), section: Array.from({ length: 60 }, (_, i) => (i < 30 ? 'straight' : 'curve')), creepage_x: Array.from({ length: 60 }, (_, i) => 0.0005 + i * 2e-5) };
  const template = { ...JSON.parse(readFileSync(new URL('../../../api/examples/run.json', import.meta.url), 'utf8')).template, load: { normal_force_n: 80_000 } };
  const run = await service.ask('/v1/runs?name=night', { json: { template, columns: rows } });
  const base = await service.solved(withFields('wheel-rail'));
  const bent = await service.solved({ ...withFields('wheel-rail'), contact: { ...example('wheel-rail').contact, reference_surface: 'curve', lateral_shift_mm: -6 } });
  const wheelset = await service.solved(withFields('wheelset'));
  const plan = {
    template: { ...example('wheel-rail'), outputs: undefined }, traffic: { columns: { '/load/vertical_force_n': [75_000, 90_000], '/contact/lateral_shift_mm': [0, -3] }, passes: [3, 1] },
    wearing: 'rail', extent: { mgt: 2 }, records: 4, limits: { height_mm: 0.01 },
  };
  const evolution = await service.ask('/v1/evolutions?name=leave+it', { json: plan });
  const lubricated = await service.ask('/v1/evolutions?name=lubricate&wait=60', { json: { ...plan, events: [{ at: 0.5, friction_coefficient: 0.1 }] } });
  return [
    ['compose', '#/compose', '.verdict .good'],
    ['result-flange', `#/jobs/${flange.id}`, 'svg .comb'],
    ['result-curve', `#/jobs/${curve.id}`, 'creep-curve canvas'],
    ['jobs', '#/jobs', '.rows.job'],
    ['compare', `#/compare/${curve.id}/${other.id}`, '[aria-label="Difference"] field-map canvas'],
    ['result-damage', `#/jobs/${damage.id}`, '.damage .chart .mark'],
    ['compare-worn', `#/compare/${base.id}/${worn.id}`, '[aria-labelledby="h-overlay"] .chart'],
    ['result-bent', `#/jobs/${bent.id}`, 'svg .comb'],
    ['wheelset', `#/jobs/${wheelset.id}`, '.shifting .comb'],
    ['forecasts', '#/forecast', '.forecasts a'],
    ['forecast', `#/forecast/${evolution.id}`, 'svg.worn .touch'],
    ['forecast-two', `#/forecast/${evolution.id}/${lubricated.id}`, '.decision'],
    ['line', `#/line/${batch.id}`, 'line-strips canvas'],
    ['run', `#/line/${run.id}?kind=run`, 'line-strips canvas'],
  ];
}
