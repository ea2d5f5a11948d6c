// Tests the views Compare and Line: several jobs side by side, and the cases of a batch along a label.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { drawn, example, OUTPUT, parsed, readout, setUp, withFields } from './harness.mjs';

const { service, onPage } = setUp();

test('compared jobs share range and crosshair, and say how many errors they are apart', () => onPage('#/compose', async (page) => {
  const base = withFields('hertz-steel');
  const coarse = await service.solved({ ...base, name: 'one', solver: { mesh: { strips: 12, cells: 12 } } });
  const fine = await service.solved({ ...base, name: 'two', solver: { mesh: { strips: 14, cells: 14 } } });
  const other = await service.solved({ ...base, name: 'three', friction: { coefficient: 0.15 } });
  await page.goto(`${service.base}/#/jobs`);
  for (const name of ['one', 'two', 'three']) await page.getByLabel(`Choose ${name}`, { exact: true }).check();
  await page.getByRole('link', { name: 'Compare 3' }).first().click();
  await drawn(page, '[aria-label="Job C"] field-map');
  const ranges = await page.locator('[aria-label^="Job "] field-map').evaluateAll((maps) => maps.map((map) => /** @type {HTMLElement & { shown: { range: number[] } }} */ (map).shown.range));
  assert.equal(ranges.length, 3);
  for (const range of ranges) assert.deepEqual(range, ranges[0]);
  await page.locator('[aria-label="Job A"] field-map .over').hover({ position: { x: 150, y: 130 } });
  await page.waitForTimeout(120);
  const [a, c] = [await readout(page, '[aria-label="Job A"] field-map'), await readout(page, '[aria-label="Job C"] field-map')];
  assert.deepEqual([c.x, c.y], [a.x, a.y]);
  const force = page.locator('tr', { hasText: 'Fx / kN' });
  const numbers = async () => (await force.locator('td').allInnerTexts());
  assert.equal((await numbers())[4], 'within the errors');
  assert.ok(Math.abs(parsed((await numbers())[0]) - coarse.result.patches[0].points[0].force_x_n / 1000) < 0.01);
  assert.match((await numbers())[0], / ± /);
  await page.getByRole('radio', { name: 'C', exact: true }).check();
  const difference = (other.result.patches[0].points[0].force_x_n - coarse.result.patches[0].points[0].force_x_n) / 1000;
  await page.waitForFunction(() => /× the error/.test(document.querySelector('tbody')?.textContent ?? ''));
  assert.ok(Math.abs(parsed((await numbers())[3]) / difference - 1) < 0.01);
  // Differences are named with the words and units of the form. Members without a field are named by their pointer.
  const different = await page.locator('section[aria-labelledby="h-cases"] tbody tr').evaluateAll((rows) => rows.map((row) => [...row.querySelectorAll('th, td')].map((cell) => cell.textContent?.trim())));
  assert.deepEqual(different.find(([name]) => name === 'friction coefficient')?.slice(1), ['0.3', '0.3', '0.15']);
  assert.ok(different.every(([name]) => !name?.startsWith('/') || name.startsWith('/solver/')), JSON.stringify(different));
  assert.ok(different.some(([name]) => name === '/solver/mesh/strips'));
  void fine;
}));

test('the difference of a job with itself is nothing', () => onPage('#/compose', async (page) => {
  const { id } = await service.solved(withFields('spin'));
  await page.goto(`${service.base}/#/compare/${id}/${id}`);
  await drawn(page, '[aria-label="Difference"] field-map');
  const told = await readout(page, '[aria-label="Difference"] field-map');
  assert.equal(Object.values(told)[2], '0 MPa', JSON.stringify(told));
  assert.match(await page.locator('section[aria-labelledby="h-cases"]').innerText(), /Nothing/);
}));

test('a batch stands along its label, with limits, the worst places and the way to the contact', () => onPage('#/compose', async (page) => {
  const cases = Array.from({ length: 40 }, (_, i) => ({
    ...example('hertz-steel'), name: `at ${i}`, labels: { km: String(10 + i / 10), line: 'A12' }, load: { normal_force_n: 60_000 + 2000 * ((i * 7) % 40) },
    solver: { mesh: { strips: 8, cells: 8 } }, outputs: ['resultants', 'zones'],
  }));
  const { id } = await service.ask('/v1/batches', { json: cases });
  await fetch(`${service.base}/v1/batches/${id}/results?wait=30`).then((answer) => answer.text());
  await page.goto(`${service.base}/#/line/${id}`);
  await page.locator('line-strips canvas').nth(3).waitFor();
  assert.equal(await page.getByRole('combobox', { name: 'Along' }).inputValue(), 'km');
  const results = (await fetch(`${service.base}/v1/batches/${id}/results`).then((answer) => answer.text())).trim().split('\n').map((line) => JSON.parse(line));
  const worst = results.sort((one, two) => two.result.patches[0].points[0].friction_power_n - one.result.patches[0].points[0].friction_power_n)[0];
  const table = page.locator('section[aria-labelledby="h-worst"] tbody tr');
  assert.equal(await table.count(), 8);
  assert.ok((await table.first().innerText()).startsWith(worst.labels.km));
  await page.getByLabel(/Limit of largest pressure/).fill('1200');
  await page.getByLabel(/Limit of largest pressure/).blur();
  await page.locator('section[aria-labelledby="h-worst"] select').selectOption('pressure');
  const over = results.filter((entry) => entry.result.patches[0].pressure_max_mpa > 1200).length;
  await page.getByText(`${over} of 40 over the limit`).waitFor();
  // Dragging zooms all strips, and the address stores the range.
  const area = await page.locator('line-strips .u-over').first().boundingBox();
  assert.ok(area);
  await page.mouse.move(area.x + 100, area.y + 40);
  await page.mouse.down();
  await page.mouse.move(area.x + 260, area.y + 40, { steps: 6 });
  await page.mouse.up();
  await page.waitForFunction(() => location.hash.includes('from='));
  const scales = await page.locator('line-strips').evaluate((strips) => /** @type {HTMLElement & { plots: { scales: { x: { min: number } } }[] }} */ (strips).plots.map((plot) => plot.scales.x.min));
  assert.equal(new Set(scales).size, 1);
  await page.reload();
  await page.locator('line-strips canvas').nth(3).waitFor();
  await page.waitForFunction(() => location.hash.includes('pressure=1200'));
  const kept = await page.locator('line-strips').evaluate((strips) => /** @type {HTMLElement & { plots: { scales: { x: { min: number } } }[] }} */ (strips).plots[0].scales.x.min);
  assert.ok(Math.abs(kept - scales[0]) < 1e-6);
  await page.locator('section[aria-labelledby="h-worst"] a').first().click();
  await page.locator('.figures').waitFor();
  await drawn(page);
}));

test('a worn rail lies over a new one: difference, worn area, numbers of all patches, the same place on the rail', () => onPage('#/compose', async (page) => {
  const base = example('wheel-rail');
  const points = /** @type {[number, number][]} */ (base.contact.rail.points_mm);
  // A groove of half a cosine wave, 20 mm long and 0.5 mm deep, at y = −8 mm. The missing area is 5 mm².
  const groove = (/** @type {number} */ y) => (Math.abs(y + 8) < 10 ? 0.25 * (1 + Math.cos((Math.PI * (y + 8)) / 10)) : 0);
  const finer = points.flatMap(([y, z], at) => {
    const next = points[at + 1];
    const parts = next && Math.abs(next[0] - y) > 0.4 ? 4 : 1;
    return Array.from({ length: parts }, (_, part) => [y + (part / parts) * ((next ?? [y])[0] - y), z + (part / parts) * ((next ?? [y, z])[1] - z)]);
  });
  const worn = finer.map(([y, z]) => [Number(y.toFixed(4)), Number((z + groove(y)).toFixed(5))]);
  const solve = (/** @type {string} */ name, /** @type {object} */ rail) =>
    service.solved({ ...base, name, contact: { ...base.contact, rail, lateral_shift_mm: 0, accept_rough_profiles: true }, outputs: ['resultants', 'zones', 'tractions', 'pressure', 'damage'] });
  const [one, two] = [await solve('new rail', base.contact.rail), await solve('worn rail', { points_mm: worn })];
  assert.deepEqual([one.state, two.state], ['succeeded', 'succeeded'], JSON.stringify(two.error));
  await page.goto(`${service.base}/#/compare/${one.id}/${two.id}`);
  await page.getByRole('img', { name: 'Cross-section of the rail of B over that of A' }).waitFor();
  await page.getByRole('img', { name: 'Material missing on the rail of B, compared with A' }).waitFor();
  const told = await page.locator('section[aria-labelledby="h-overlay"]').innerText();
  const area = Number(/Worn area ([\d.]+) mm²/.exec(told)?.[1]);
  const depth = Number(/at most ([\d.]+) mm/.exec(told)?.[1]);
  assert.ok(Math.abs(area - 5) < 0.6, told);
  assert.ok(Math.abs(depth - 0.5) < 0.06, told);
  await page.screenshot({ path: join(OUTPUT, 'compare-worn.png'), fullPage: true });
  const row = (/** @type {string} */ name) => page.locator('section[aria-labelledby="h-numbers"] tr').filter({ has: page.locator('th[scope="row"]', { hasText: new RegExp(`^${name}`) }) }).first().locator('td').allInnerTexts();
  const result = await service.ask(`/v1/jobs/${two.id}/result`);
  assert.equal(parsed((await row('patches'))[1]), result.patches.length);
  assert.ok(Math.abs(parsed((await row('Q / kN'))[1]) + result.total[0].force_z_n / 1000) < 0.01);
  for (const name of ['Y, outward', 'Y/Q', 'largest pressure', 'area', 'Tγ', 'wear depth', 'N / kN']) assert.ok((await row(name)).length >= 3, name);
  await page.getByLabel('aligned').selectOption('place');
  await page.locator('section[aria-labelledby="h-overlay"]').getByText('Worn area').waitFor();
  await page.getByRole('radio', { name: 'wheel' }).check();
  await page.getByText('Both cases have the same wheel.').waitFor();
  await page.getByLabel('at the same place').selectOption('patch');
  await drawn(page, '[aria-label="Difference"] field-map');
}));

test('a run stands along its kilometres: totals by section, exceedances, the worst rows, and a row as a job', () => onPage('#/compose', async (page) => {
  const rows = 3000;
  const template = JSON.parse(readFileSync(new URL('../../../api/examples/run.json', import.meta.url), 'utf8')).template;
  const columns = {
    km: Array.from({ length: rows }, (_, i) => Number((10 + i / 100).toFixed(2))),
    section: Array.from({ length: rows }, (_, i) => (i < 1000 ? 'straight' : i < 2000 ? 'curve' : 'switch')),
    '/load/normal_force_n': Array.from({ length: rows }, (_, i) => 60_000 + 30_000 * Math.abs(Math.sin(i / 90))),
    '/motion/creepage_x': Array.from({ length: rows }, (_, i) => 0.0004 + (i >= 1000 && i < 2000 ? 0.0015 : 0)),
  };
  const { id } = await service.ask('/v1/runs?name=night', { json: { template, columns } });
  await page.goto(`${service.base}/#/line`);
  await page.getByRole('link', { name: /^night: 3000 rows/ }).click();
  await page.locator('line-strips canvas').nth(3).waitFor({ timeout: 60_000 });
  // Strips have titles with units.
  assert.deepEqual(await page.locator('.strip-title').evaluateAll((titles) => titles.map((title) => title.firstChild?.textContent)), ['wear number Tγ / J/m', 'largest pressure / MPa', 'longitudinal force Fx / kN', 'lateral force Fy / kN']);
  const totals = await service.ask(`/v1/runs/${id}/totals?by=section&columns=friction_power_n&percentiles=50,99,100&above=20`);
  const section = (/** @type {string} */ name) => page.locator('table.sections tbody tr').filter({ has: page.locator('th', { hasText: new RegExp(`^${name}$`) }) }).locator('td').allInnerTexts();
  for (const of of totals.sections) {
    await page.locator('table.sections tbody tr').filter({ hasText: of.value }).waitFor();
    const cells = await section(of.value);
    assert.equal(parsed(cells[0]), of.rows);
    assert.ok(Math.abs(parsed(cells[4]) - of.columns.friction_power_n.percentiles['100']) < 0.01 * of.columns.friction_power_n.percentiles['100'], cells.join());
  }
  // A limit is drawn, and the service counts the rows that reach it.
  await page.getByLabel('Limit of wear number').fill('20');
  await page.getByLabel('Limit of wear number').blur();
  const over = totals.all.columns.friction_power_n.above['20'];
  await page.getByText(new RegExp(`^${String(over)} of 3000 rows reach the limit of 20`)).waitFor();
  await page.waitForFunction(() => location.hash.includes('friction_power_n=20'));
  const curve = totals.sections.find((/** @type {{ value: string }} */ of) => of.value === 'curve');
  await page.waitForFunction((count) => [...document.querySelectorAll('table.sections tbody tr')].some((row) => row.querySelector('th')?.textContent === 'curve' && Number(row.lastElementChild?.textContent) === count), curve.columns.friction_power_n.above['20']);
  // The worst row has the largest value, and opens as a job with its fields.
  const worst = page.locator('section[aria-labelledby="h-worst"] tbody tr').first();
  const value = parsed(await worst.locator('td').first().innerText());
  assert.ok(Math.abs(value - totals.all.columns.friction_power_n.max) < 0.01 * value, `${value}`);
  await page.screenshot({ path: join(OUTPUT, 'run.png'), fullPage: true });
  await worst.getByRole('button').click();
  await drawn(page);
  assert.match(await page.locator('h1').innerText(), /^row \d+ of night$/);
}));
