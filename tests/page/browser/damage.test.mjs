// Tests the effects of a wheel on a rail: wheel loads and Nadal's limit, wear, fatigue, stresses, temperature, remarks.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { drawn, dropFiles, example, OUTPUT, parsed, setUp } from './harness.mjs';

const { service, onPage } = setUp();

/** @param {string} name */
const file = (name) => readFileSync(new URL(`../data/${name}`, import.meta.url), 'utf8');

/** The values of a table of definitions by their terms. @param {import('playwright-core').Locator} list */
const entries = (list) => list.locator('div').evaluateAll((rows) => Object.fromEntries(rows.map((row) => [row.querySelector('dt')?.textContent ?? '', row.querySelector('dd')?.textContent ?? ''])));

test('from own files to their damage without reading: drop, solve, see', () => onPage('', async (page) => {
  await page.locator('.verdict .checked').waitFor();
  await dropFiles(page, 'main', { 'own.ban': file('words-behind.ban'), 'own.whl': file('worn-wheel.whl') });
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'own on own');
  await page.locator('.verdict .checked').waitFor();
  await page.getByRole('button', { name: /^Solve/ }).click();
  await drawn(page);
  const id = page.url().split('/jobs/')[1].split('?')[0];
  const result = await service.ask(`/v1/jobs/${id}/result`);
  const [patch] = result.patches;
  const [point] = patch.points;

  await page.getByText("Nadal's limit").waitFor();
  const loads = await entries(page.locator('[data-wheel]'));
  const { force_y_n, force_z_n } = result.total[0];
  assert.ok(Math.abs(parsed(loads['Q, vertical']) + force_z_n / 1000) < 0.01, loads['Q, vertical']);
  // The wheel stands on the right rail, so that outward is to the right.
  assert.ok(Math.abs(parsed(loads['Y, lateral']) + force_y_n / 1000) < 0.05, loads['Y, lateral']);
  assert.ok(Math.abs(parsed(loads['Y/Q']) - force_y_n / force_z_n) < 1e-3, loads['Y/Q']);
  const limit = Object.keys(loads).find((name) => name.startsWith("Nadal's limit, flange 70.0°"));
  assert.ok(limit, Object.keys(loads).join());
  const flange = Math.tan((70 * Math.PI) / 180);
  assert.ok(Math.abs(parsed(loads[limit]) - (flange - 0.3) / (1 + 0.3 * flange)) < 0.02);

  const row = (/** @type {string} */ name) => page.locator('.damage tr').filter({ hasText: name }).locator('td').first().innerText();
  assert.ok(Math.abs(parsed((await row('Tγ with spin')).split('\n')[0]) - point.damage.t_gamma.with_spin_n.value) < 0.01 * point.damage.t_gamma.with_spin_n.value + 1e-3);
  assert.match(await row('wear, Tγ/A law: regime'), new RegExp(point.damage.usfd_wear.regime));
  const chart = (/** @type {RegExp} */ name) => page.getByRole('img', { name });
  await chart(/^Wear depth of one pass across the rail/).waitFor();
  await page.locator('.damage .seg').filter({ hasText: 'wheel' }).click();
  await chart(/^Wear depth of one pass across the wheel/).waitFor();
  const place = point.damage.shakedown;
  const told = await chart(/^Patch 0: load factor/).getAttribute('aria-label');
  assert.ok(Math.abs(Number(/load factor ([\d.]+)/.exec(told ?? '')?.[1]) - place.load_factor) < 0.01, told ?? '');
  const { worst } = point.subsurface;
  await chart(/^Stress over depth; von Mises/).waitFor();
  assert.ok(Math.abs(parsed(/von Mises (\S+) MPa/.exec(await chart(/^Stress over depth/).getAttribute('aria-label') ?? '')?.[1]) - worst.von_mises_mpa) < 0.01 * worst.von_mises_mpa);
  await chart(/^Temperature along rolling/).waitFor();
  // Uncertain results are marked: the set of parameters, and models whose values are not confirmed.
  assert.match(await page.locator('.damage header').innerText(), /900a-r8t-1/);
  assert.ok((await page.locator('.damage abbr').count()) >= 3);
  await page.getByText('Parameters and their sources').click();
  await page.getByText('not confirmed against the source').first().waitFor();
  await page.screenshot({ path: join(OUTPUT, 'damage.png'), fullPage: true });
}));

test('each wheel of a wheelset and its axle have their loads', async () => {
  const job = await service.solved(example('wheelset'));
  const { wheelset } = await service.ask(`/v1/jobs/${job.id}/result`);
  await onPage(`#/jobs/${job.id}`, async (page) => {
    const right = page.locator('[data-wheel="right"]');
    await right.waitFor();
    const position = wheelset.positions[0];
    assert.ok(Math.abs(parsed((await entries(right))['Y, lateral']) + position.right.force_y_n / 1000) < 0.02);
    assert.ok(Math.abs(parsed((await entries(page.locator('[data-wheel="left"]')))['Y, lateral']) - position.left.force_y_n / 1000) < 0.02);
    await right.getByText("Nadal's limit").waitFor();
    const axle = await entries(page.locator('dl.table').filter({ hasText: 'axle' }));
    assert.ok(Math.abs(parsed(axle['ΣY, to the left']) - (position.left.force_y_n + position.right.force_y_n) / 1000) < 0.02);
    // Damage was not requested, and can be solved with one click.
    await page.getByRole('button', { name: 'Solve again with damage' }).click();
    await page.getByRole('img', { name: /^Patch 0: load factor/ }).waitFor({ timeout: 60_000 });
  });
});

test('forces of the patches add up to those of the wheel in track axes', async () => {
  const flange = example('wheel-rail-flange');
  const job = await service.solved({ ...flange, contact: { ...flange.contact, reference_surface: 'plane' }, outputs: ['resultants', 'zones', 'tractions', 'pressure'] });
  await onPage(`#/jobs/${job.id}`, async (page) => {
    await page.locator('table.patches tbody tr').nth(1).waitFor();
    const rows = await page.locator('table.patches tbody tr').evaluateAll((lines) => lines.map((line) => [...line.querySelectorAll('td')].map((cell) => cell.textContent ?? '')));
    const sum = (/** @type {number} */ column) => rows.reduce((total, cells) => total + parsed(cells[column]), 0);
    const loads = await entries(page.locator('[data-wheel]'));
    assert.ok(Math.abs(sum(6) - parsed(loads['Y, lateral'])) < 0.03, 'Y');
    assert.ok(Math.abs(sum(7) - parsed(loads['Q, vertical'])) < 0.03, 'Q');
    // Notes are folded, and a remark about several patches appears once.
    assert.equal(await page.locator('.remark.info:visible').count(), 0);
    await page.getByText(/^\d+ notes$/).click();
    const texts = await page.locator('.remark:visible').allInnerTexts();
    assert.equal(new Set(texts).size, texts.length);
    // The scale is that of the patch, or a common one that ends at the largest μp.
    const range = () => page.locator('field-map.main').evaluate((map) => /** @type {HTMLElement & { shown: { range: number[] } }} */ (map).shown.range[1]);
    const own = await range();
    await page.getByLabel('scale').selectOption('common');
    const result = await service.ask(`/v1/jobs/${job.id}/result`);
    const bound = 0.3 * Math.max(...result.patches.map((/** @type {{ pressure_max_mpa: number }} */ patch) => patch.pressure_max_mpa));
    await page.waitForFunction((before) => /** @type {HTMLElement & { shown: { range: number[] } } | null} */ (document.querySelector('field-map.main'))?.shown.range[1] !== before, own);
    assert.ok((await range()) > 0.9999 * bound && (await range()) < 1.1 * bound);
  });
});

test('from a noisy worn pair to its damage, smoothed, and against new profiles', () => onPage('', async (page) => {
  await page.locator('.verdict .checked').waitFor();
  await dropFiles(page, 'main', { 'km37.ban': file('noisy-worn.ban'), 'unit3.whl': file('noisy-worn.whl') });
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent === 'unit3 on km37');
  await page.getByRole('button', { name: 'The points are noisy: smooth the rail by 2.0 mm and the wheel by 2.0 mm, as advised' }).waitFor();
  await page.getByRole('button', { name: /^Solve/ }).click();
  await drawn(page);
  await page.locator('.remark[data-code="profile-noise"]').first().waitFor();
  await page.getByRole('button', { name: 'Solve again with the rail smoothed by 2.0 mm and the wheel smoothed by 2.0 mm' }).click();
  await page.waitForFunction(() => document.querySelector('field-map.main') && !document.querySelector('.remark[data-code="profile-noise"]'));
  // The patch with the largest load is selected.
  assert.ok(parsed(await page.locator('.figures .figure-of').filter({ has: page.locator('dt', { hasText: /^N$/ }) }).locator('b').innerText()) > 37.5);
  await page.getByRole('button', { name: 'Compare with new profiles' }).click();
  await page.getByText('Worn area').waitFor();
  const area = parsed((await page.locator('[aria-labelledby="h-overlay"] b').first().innerText()));
  assert.ok(area > 10 && area < 60, `${area}`);
  await page.screenshot({ path: join(OUTPUT, 'worn-against-new.png'), fullPage: true });
}));
