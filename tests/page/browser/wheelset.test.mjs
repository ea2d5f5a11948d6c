// Tests a wheelset that is shifted by hand, and its conicity compared with the windows of the standard.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { ALL, example, OUTPUT, setUp, until } from './harness.mjs';

const { service, onPage } = setUp();

const benchmark = JSON.parse(readFileSync(new URL('../../data/en15302/benchmark.json', import.meta.url), 'utf8'));

/** Points of a reference profile of EN 15302, about 0.2 mm apart. @param {{ from: number, to: number, arc?: { centre: number[], radius: number, sign: number }, line?: { z0: number, slope: number } }[]} segments */
function section(segments) {
  /** @type {[number, number][]} */
  const points = [];
  for (const { from, to, arc, line } of segments) {
    for (let k = 0; k <= 5000; k += 1) {
      const y = from + ((to - from) * k) / 5000;
      const z = arc ? arc.centre[1] + arc.sign * Math.sqrt(Math.max(0, arc.radius ** 2 - (y - arc.centre[0]) ** 2)) : (line?.z0 ?? 0) + (line?.slope ?? 0) * y;
      const last = points.at(-1);
      if (!last || Math.hypot(y - last[0], z - last[1]) >= 0.2 || k === 5000) points.push([y, z]);
    }
  }
  return { points_mm: points, mirror_y: false, mirror_z: false };
}

/** The range of the shift, moved to a place as by hand. @param {import('playwright-core').Page} page @param {number} place */
const slide = (page, place) => page.locator('.shifting input[type=range]').evaluate((input, to) => {
  /** @type {HTMLInputElement} */ (input).value = String(to);
  input.dispatchEvent(new Event('input', { bubbles: true }));
}, place);

test('the slider of the shift moves both wheels, their patches and pressures', () => onPage('', async (page) => {
  const wheelset = example('wheelset');
  const { id } = await service.solved({ ...wheelset, outputs: ALL });
  await page.goto(`${service.base}/#/jobs/${id}`);
  const pressure = page.locator('.carried tr').filter({ hasText: 'largest pressure' }).locator('td').first();
  const wheel = page.locator('.shifting .wheel').first();
  await until(async () => (await pressure.innerText()) !== '–' && (await page.locator('.shifting .comb').count()) >= 2);
  const before = [await pressure.innerText(), await wheel.getAttribute('d')];
  const { kinematics } = (await service.ask(`/v1/jobs/${id}/result`)).wheelset;
  const shifts = /** @type {number[]} */ (kinematics.lateral_shift_mm);
  const place = shifts.findIndex((shift) => Math.abs(shift - 4.5) < 1e-6);
  for (let at = place - 12; at <= place; at += 1) {
    await slide(page, at);
    await page.waitForTimeout(60);
  }
  await page.getByText(`4.5 mm, Δr ${kinematics.radius_difference_mm[place].toFixed(3)} mm`).waitFor();
  await until(async () => (await pressure.innerText()) !== before[0]);
  assert.notEqual(await wheel.getAttribute('d'), before[1]);
  // The same wheel as a separate case, at another target error, has the same pressure to the displayed digits.
  const { right, kinematics: asked, combine, yaw_rad, ...contact } = wheelset.contact;
  const radius = (kinematics.left.rolling_radius_mm[place] + kinematics.right.rolling_radius_mm[place]) / 2;
  const alone = await service.solved({
    ...wheelset, contact: { ...contact, type: 'profiles', side: 'left', lateral_shift_mm: shifts[place] }, load: { vertical_force_n: 75000 },
    motion: { wheelset: { speed_mm_per_s: 20000, free_rolling_radius_mm: radius } }, outputs: ['resultants'],
  });
  const largest = Math.max(...alone.result.patches.map((/** @type {{ pressure_max_mpa: number }} */ patch) => patch.pressure_max_mpa));
  await until(async () => Math.abs(Number(await pressure.innerText()) - largest) < 2e-3 * largest);
  // The drawn contact point is that of the kinematics.
  const dot = await page.locator('.shifting .dot').first().evaluate((mark) => {
    const rail = /** @type {SVGGeometryElement} */ (mark.parentElement?.querySelector('.rail'));
    const [x, y] = ['cx', 'cy'].map((name) => Number(mark.getAttribute(name)));
    const all = (rail.getAttribute('d') ?? '').split(/[MLVHZ]/).filter((pair) => pair.includes(' ')).map((pair) => pair.split(' ').map(Number));
    return Math.min(...all.map(([x1, y1]) => Math.hypot(x - x1, y - y1)));
  });
  assert.ok(dot < 4, `${dot}`);
  const steps = await page.evaluate(() => performance.getEntriesByName('shift').map(({ duration }) => duration).sort((one, two) => one - two));
  console.log(JSON.stringify({ shiftSteps: steps }));
  assert.ok(steps.length > 0);
  await page.getByRole('radio', { name: 'Contact lines' }).check();
  assert.ok(await page.locator('.touching line').count() > 20);
  await page.screenshot({ path: join(OUTPUT, 'contact-lines.png') });
  await until(async () => (await service.ask('/v1/jobs?label=railhead-page:typing&fields=id')).jobs.length === 0);
}));

test('a reference pair of EN 15302 stands against its window', () => onPage('', async (page) => {
  const { WheelA, RailA } = benchmark.profiles;
  const { id } = await service.solved({
    ...example('wheelset'), name: 'EN 15302, A on A', motion: { wheelset: { speed_mm_per_s: 20000, free_rolling_radius_mm: 460 } },
    contact: {
      type: 'wheelset', rail: section(RailA), wheel: section(WheelA), rolling_radius_mm: 460, rail_origin_mm: 750, flange_back_distance_mm: 1360, flange_back_position_mm: -70, kinematics: {},
    },
  });
  await page.goto(`${service.base}/#/jobs/${id}`);
  await page.getByText(/equivalent conicity 0\.1\d\d at 3 mm/).waitFor();
  await page.getByRole('radio', { name: 'Conicity' }).check();
  await page.getByLabel('Window of EN 15302').selectOption('A on A');
  await page.getByText('Inside the window at all 7 amplitudes.').waitFor();
  await page.screenshot({ path: join(OUTPUT, 'conicity.png') });
  await page.getByLabel('Window of EN 15302').selectOption('B on A, right wheel 1 mm smaller');
  await page.getByText(/Outside the window at 1/).waitFor();
}));
