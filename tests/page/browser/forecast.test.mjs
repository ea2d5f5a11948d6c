// Tests the view Forecast: own sections under a traffic, the selected step, two plans side by side, and exported files.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { dropFiles, OUTPUT, parsed, setUp, until } from './harness.mjs';

const { service, onPage } = setUp();

/** @param {string} name */
const file = (name) => readFileSync(new URL(`../data/${name}`, import.meta.url), 'utf8');
const WAIT = { timeout: 240_000 };

/** Fills the form with a small traffic. @param {import('playwright-core').Page} page @param {string} name */
async function fill(page, name) {
  await page.getByLabel('Name').fill(name);
  await page.getByLabel('What wears').selectOption('the rail');
  await page.getByLabel('Traffic over the rail').fill('4');
  await page.getByLabel('Steps shown').fill('4');
  await page.getByLabel('rail height, W1').fill('0,05');
}

test('a planner forecasts the wear of own sections, and compares it with grinding', () => onPage('#/forecast', async (page) => {
  await dropFiles(page, 'main', { 'own.ban': file('words-behind.ban'), 'own.whl': file('worn-wheel.whl') });
  await page.getByText('own.ban, own.whl').waitFor();
  await page.getByRole('button', { name: 'Remove row 3' }).click();
  await fill(page, 'leave it');
  await page.getByRole('button', { name: 'Compute' }).click();
  await page.locator('svg.worn').waitFor(WAIT);
  const { evolutions: [job] } = await service.ask('/v1/evolutions?limit=10');
  const answer = await service.ask(`/v1/evolutions/${job.id}/result`);
  const last = answer.records.at(-1);

  // The last step is shown first. The slider returns to the start, where there is no wear.
  const area = page.locator('[aria-labelledby="h-step"] tr').filter({ hasText: 'worn area of the rail' }).locator('td').first();
  const shown = async () => parsed((await area.innerText()).split('\n')[0]);
  assert.ok(Math.abs((await shown()) - last.rail.worn_area_mm2) <= 6e-3 * last.rail.worn_area_mm2, `${await shown()} is ${last.rail.worn_area_mm2}`);
  await page.locator('.film input').evaluate((input) => {
    /** @type {HTMLInputElement} */ (input).value = '0';
    input.dispatchEvent(new Event('input', { bubbles: true }));
  });
  await until(async () => (await shown()) === 0);
  await page.getByRole('button', { name: 'Play as a film' }).click();
  await until(async () => (await shown()) > 0.9 * last.rail.worn_area_mm2);
  const curve = page.locator('[aria-labelledby="h-over"] svg.chart');
  await page.getByRole('radio', { name: 'Pressure' }).check();
  await until(async () => (await curve.getAttribute('aria-label')) === 'Pressure over the traffic');
  await page.getByRole('radio', { name: 'Losses' }).check();
  assert.ok((await curve.locator('.band').count()) >= 1, 'losses have the band of the coefficients');
  assert.equal(await curve.locator('.line.limit').count(), 2, 'the limit and its legend');
  // A click at the left end of the curve selects the start. The drawing has a needle for each contact.
  const { width = 0, height = 0 } = (await curve.boundingBox()) ?? {};
  await curve.click({ position: { x: 0.14 * width, y: 0.4 * height } });
  await until(async () => (await shown()) === 0);
  assert.equal(await page.locator('svg.worn .touch path').count(), answer.records[0].states.flatMap((/** @type {{ patches: unknown[] }} */ { patches }) => patches).length);
  await page.locator('.film input').press('End');
  await until(async () => (await shown()) > 0.9 * last.rail.worn_area_mm2);
  await page.screenshot({ path: join(OUTPUT, 'forecast.png'), fullPage: true });

  // The exported files are a table, a picture, and a section that the page reads again.
  const saved = async (/** @type {string} */ name) => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name, exact: true }).click()]);
    return readFileSync(await download.path());
  };
  assert.match((await saved('CSV')).toString(), /^record,/);
  assert.equal((await saved('Parquet')).subarray(0, 4).toString(), 'PAR1');
  for (const name of ['Save as SVG: leave it rail 4.00 MGT', 'Save as SVG: leave it depth rail', 'Save as SVG: leave it Losses over the traffic']) assert.match((await saved(name)).toString(), /^<svg[^]*stroke="rgb/);
  const ground = (await saved('MiniProf')).toString();
  assert.match((await saved('Simpack')).toString(), /point\.begin/);

  // A second plan grinds to another section. Both plans are shown side by side as soon as it is computed.
  await page.getByRole('button', { name: 'Compare with another plan' }).click();
  await page.getByText('compared with leave it').waitFor();
  await page.getByText('own.ban, own.whl').waitFor();
  await page.getByRole('button', { name: 'Add grinding, lubrication or turning' }).click();
  await page.getByLabel('Section of maintenance 1').setInputFiles({ name: 'target.ban', mimeType: 'text/plain', buffer: Buffer.from(file('words-behind.ban')) });
  await page.getByText('target.ban').waitFor();
  await page.getByLabel('Depth beyond that, in mm').fill('0.02');
  await page.getByRole('button', { name: 'Compute and compare' }).click();
  await page.getByRole('heading', { name: 'Two forecasts' }).waitFor(WAIT);
  const { evolutions: [second] } = await service.ask('/v1/evolutions?limit=10');
  assert.equal(second.name, 'grind at 2 MGT');
  const { events: [event] } = await service.ask(`/v1/evolutions/${second.id}/request`);
  assert.deepEqual([event.at, event.depth_mm, event.grind.text, event.grind.format], [2, 0.02, file('words-behind.ban'), 'miniprof']);
  assert.match(await page.locator('.decision').innerText(), /(goes on longer|Neither reaches a limit|at the same time)[^]*grinds 0 \(A\) and [\d.]+ \(B\) mm² off the rail/);
  const off = page.locator('[aria-labelledby="h-step"] tr').filter({ hasText: 'ground or turned off the rail' }).locator('td');
  await until(async () => (await off.count()) === 2);
  assert.ok(parsed(await off.nth(0).innerText()) !== parsed(await off.nth(1).innerText()));
  await page.screenshot({ path: join(OUTPUT, 'forecasts.png'), fullPage: true });

  await page.goto(`${service.base}/#/compose`);
  await dropFiles(page, 'main', { 'ground.ban': ground, 'own.whl': file('worn-wheel.whl') });
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'own on ground');
  await page.locator('.verdict .checked').waitFor();
}));

test('a faulty traffic is refused with its place, and a table from a file is taken', () => onPage('#/forecast', async (page) => {
  await page.getByRole('button', { name: 'Compute', exact: true }).waitFor();
  // Every fault is shown at its field and in the list, whose entries lead to the fields.
  await page.getByLabel('Traffic over the rail').fill('');
  await page.getByLabel('rail height, W1').fill('-2');
  await page.getByLabel('speed, row 2').fill('fast');
  await page.getByRole('button', { name: 'Add grinding' }).click();
  await page.getByLabel('Time of maintenance 1').fill('-1');
  await page.getByRole('button', { name: 'Compute' }).click();
  for (const label of ['Traffic over the rail', 'rail height, W1', 'speed, row 2', 'Time of maintenance 1']) {
    const input = page.getByLabel(label);
    await until(async () => (await input.getAttribute('aria-invalid')) === 'true', label);
    assert.match(await page.locator(`[id="${await input.getAttribute('aria-describedby')}"]`).innerText(), /needed/, label);
  }
  await page.locator('.faults').getByRole('button', { name: 'speed, row 2' }).click();
  assert.equal(await page.evaluate(() => document.activeElement?.getAttribute('aria-label')), 'speed, row 2');
  // A changed value has no fault until the form is sent again; an empty cell has the value of the case.
  await page.getByLabel('speed, row 2').fill('');
  assert.equal(await page.getByLabel('speed, row 2').getAttribute('aria-invalid'), 'false');
  await page.getByLabel('Traffic over the rail').fill('4');
  await page.getByLabel('rail height, W1').fill('');
  await page.getByRole('button', { name: 'Remove event 1' }).click();
  await page.getByLabel('speed, row 1').fill('60');
  await page.getByLabel('friction μ, row 1').fill('-1');
  await page.getByRole('button', { name: 'Compute' }).click();
  await page.locator('.faults').getByRole('button', { name: 'friction μ, row 1' }).waitFor();
  assert.equal(await page.locator('.faults li').count(), 1);
  assert.equal(await page.getByLabel('friction μ, row 1').getAttribute('aria-invalid'), 'true');
  await page.locator('#traffic').setInputFiles({ name: 'year.csv', mimeType: 'text/csv', buffer: Buffer.from('axle load [t];shift [mm];passes\n20;0;3\n22,5;-1;1\n') });
  await page.getByText('year.csv: 2 rows').waitFor();
  // Each dropped file goes to its place, and the columns that were read from the table are shown.
  await dropFiles(page, 'main', { 'own.whl': file('worn-wheel.whl'), 'line.csv': 'train;axle load [t];speed [km/h];radius [m];passes\nore;30;60;-400;3\ncoach;12;140;;9\n', 'own.ban': file('words-behind.ban') });
  await page.getByText('own.ban, own.whl').waitFor();
  await page.getByText('line.csv: 2 rows').waitFor();
  const read = await page.getByRole('region', { name: 'Columns of the table' }).innerText();
  assert.match(read, /wheel load Q\s+58\.8 … 147 kN/);
  assert.match(read, /curve radius\s+−400 … 0 m/);
  await page.getByText('Not used: train.').waitFor();
  assert.equal(await page.getByText('Titles without a unit').count(), 0);
  await page.locator('#traffic').setInputFiles({ name: 'plain.csv', mimeType: 'text/csv', buffer: Buffer.from('axle load;passes\n22;1\n') });
  await page.getByText('“axle load” is read in kN (allowed: kN, N, t)').waitFor();
  // A file chosen as a table is not taken for a section.
  await page.locator('#traffic').setInputFiles({ name: 'bad.csv', mimeType: 'text/csv', buffer: Buffer.from('passes;axle load [t]\n1;x\n') });
  await page.getByText('own.ban, own.whl').waitFor();
}));
