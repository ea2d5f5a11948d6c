// Measures frame times of the page with large data: a run of a million rows, a field of 400 × 400 cells, a shifted wheelset, ten thousand jobs. It
// prints times and tests nothing.
//   RAILHEAD_BINARY=target/release/railhead RAILHEAD_TEST_BROWSER=/usr/bin/chromium node tests/page/bench.mjs [rows]
import { drawn, example, launch, Service, withFields } from './browser/harness.mjs';

const ROWS = Number(process.argv[2] ?? 1_000_000);
const SIDE = 400;
const JOBS = 10_000;
const ROUNDS = 6;

const service = new Service();
await service.start(['--page-dir', new URL('../../src/http/page/web', import.meta.url).pathname]);
const browser = await launch();
const page = await browser.newPage({ viewport: { width: 1440, height: 900 } });
page.setDefaultTimeout(3_600_000);

/** Frames while something is done again and again. @param {string} name @param {(step: number) => Promise<unknown>} act @param {number} steps */
async function frames(name, act, steps) {
  await page.evaluate(() => {
    const kept = { frames: /** @type {number[]} */ ([]), long: /** @type {number[]} */ ([]), on: true };
    Object.assign(window, { kept });
    const tasks = new PerformanceObserver((list) => kept.on && kept.long.push(...list.getEntries().map(({ duration }) => duration)));
    tasks.observe({ entryTypes: ['longtask'] });
    let before = performance.now();
    const frame = (/** @type {number} */ now) => {
      kept.frames.push(now - before);
      before = now;
      if (kept.on) requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  });
  for (let step = 0; step < steps; step += 1) await act(step);
  const { frames: all, long } = await page.evaluate(() => {
    const { kept } = /** @type {{ kept: { frames: number[], long: number[], on: boolean } }} */ (/** @type {unknown} */ (window));
    kept.on = false;
    return kept;
  });
  all.sort((one, two) => one - two);
  const at = (/** @type {number} */ share) => Math.round(10 * all[Math.floor(share * (all.length - 1))]) / 10;
  console.log(JSON.stringify({ name, frames: all.length, median: at(0.5), '95 %': at(0.95), longest: at(1), longTasks: long.map(Math.round) }));
}

try {
  const list = (/** @type {(row: number) => number | string} */ of) => Array.from({ length: ROWS }, (_, row) => of(row));
  const body = {
    template: { ...example('hertz-steel'), contact: { type: 'radii', rolling_mm: 460, lateral_mm: 300 }, load: { normal_force_n: 80_000 }, motion: { creepage_x: 0, creepage_y: 0, spin_per_mm: 0 }, outputs: ['resultants'] },
    columns: { km: list((row) => row / 1000), section: list((row) => (row % 7000 < 4000 ? 'straight' : 'curve')), creepage_x: list((row) => Math.round(1000 * Math.sin(row / 777)) * 3e-6), normal_force_n: list((row) => 70_000 + (row % 113) * 300) },
  };
  const sent = performance.now();
  const run = await service.ask('/v1/runs?name=million', { json: body });
  let state = run;
  while (!state.ended_at) {
    await new Promise((resolve) => setTimeout(resolve, 1000));
    state = await service.ask(`/v1/runs/${run.id}`);
  }
  console.log(JSON.stringify({ rows: ROWS, solved: state.state, seconds: Math.round((performance.now() - sent) / 1000) }));
  await page.goto(`${service.base}/#/jobs`);
  await page.waitForTimeout(3000);
  await frames('run: opening', async () => {
    await page.evaluate((hash) => { location.hash = hash; }, `#/line/${run.id}?kind=run`);
    await page.locator('line-strips canvas').first().waitFor();
  }, 1);
  const box = await page.locator('line-strips .u-over').first().boundingBox();
  const { x, y, width } = /** @type {{ x: number, y: number, width: number }} */ (box);
  await frames('run: cursor over the strips', (step) => page.mouse.move(x + (width * step) / 200, y + 40), 200);
  await frames('run: zooming', async (step) => {
    await page.mouse.move(x + 40 + 20 * step, y + 30);
    await page.mouse.down();
    await page.mouse.move(x + 140 + 30 * step, y + 30, { steps: 6 });
    await page.mouse.up();
    await page.locator('line-strips').press('Escape');
  }, 12);
  // A run of few rows is searched at once, without this button.
  if (ROWS > 200_000) await page.getByRole('button', { name: /^Search all/ }).click();
  await frames('run: searching the worst rows', () => page.locator('[aria-labelledby="h-worst"] tbody tr').first().waitFor(), 1);

  const { id } = await service.solved(withFields('hertz-steel'));
  await page.goto(`${service.base}/#/jobs/${id}`);
  await drawn(page);
  await page.evaluate((side) => {
    const map = /** @type {HTMLElement & { shown: any }} */ (document.querySelector('field-map.main'));
    const places = Array.from({ length: side * side }, (_, cell) => [((cell % side) + 0.5) / side - 0.5, (Math.floor(cell / side) + 0.5) / side - 0.5]);
    const cells = {
      x_mm: places.map(([x]) => 20 * x), y_mm: places.map(([, y]) => 14 * y), dx_mm: places.map(() => 20 / side), dy_mm: places.map(() => 14 / side), strip: places.map((_, cell) => Math.floor(cell / side)),
      pressure_mpa: places.map(([x, y]) => 1000 * Math.max(0, 1 - 4 * (x * x + y * y))),
    };
    const { quantity } = map.shown;
    map.shown = { ...map.shown, field: { cells, border: null }, quantity: { ...quantity, key: 'pressure', vector: () => null, values: () => cells.pressure_mpa }, range: [0, 1000], held: null };
  }, SIDE);
  await frames(`field of ${SIDE} × ${SIDE}: drawn with other colours`, (step) => page.evaluate((to) => {
    const map = /** @type {HTMLElement & { shown: any }} */ (document.querySelector('field-map.main'));
    map.shown = { ...map.shown, range: [0, 1000 + to] };
    return new Promise(requestAnimationFrame);
  }, step), 120);
  const map = /** @type {{ x: number, y: number, width: number, height: number }} */ (await page.locator('field-map.main .over').boundingBox());
  await frames(`field of ${SIDE} × ${SIDE}: crosshair`, (step) => page.mouse.move(map.x + 80 + (map.width * step) / 500, map.y + 120 + (map.height * step) / 600), 240);

  const wheelset = await service.solved(withFields('wheelset'));
  await page.goto(`${service.base}/#/jobs/${wheelset.id}`);
  await page.locator('.shifting .comb').first().waitFor();
  await frames('wheelset: shifted by hand', async (step) => {
    await page.locator('.shifting input[type=range]').evaluate((input, to) => {
      /** @type {HTMLInputElement} */ (input).value = String(to);
      input.dispatchEvent(new Event('input', { bubbles: true }));
    }, 40 + step);
    await page.waitForTimeout(16);
  }, 80);
  const steps = await page.evaluate(() => performance.getEntriesByName('shift').map(({ duration }) => Math.round(duration)).sort((one, two) => one - two));
  console.log(JSON.stringify({ name: 'wheelset: wheels, forces and pressures of a shift', steps: steps.length, median: steps[steps.length >> 1], longest: steps.at(-1) }));

  // Each shift is timed several times. The minimum excludes other load of the machine.
  const alone = await page.evaluate(async (rounds) => {
    const slider = /** @type {HTMLInputElement} */ (document.querySelector('.shifting input[type=range]'));
    const shifts = () => performance.getEntriesByName('shift');
    const least = Array.from({ length: 80 }, () => Infinity);
    for (let round = 0; round < rounds; round += 1) {
      for (const at of least.keys()) {
        const before = shifts().length;
        slider.value = String(40 + at);
        slider.dispatchEvent(new Event('input', { bubbles: true }));
        while (shifts().length === before) await new Promise((resolve) => setTimeout(resolve, 3));
        least[at] = Math.min(least[at], Math.round(shifts()[before].duration));
      }
    }
    return least.sort((one, two) => one - two);
  }, ROUNDS);
  console.log(JSON.stringify({ name: `wheelset: the least of ${ROUNDS} times of each shift`, shifts: alone.length, median: alone[alone.length >> 1], longest: alone.at(-1) }));

  const line = JSON.stringify({ ...example('hertz-steel'), outputs: ['resultants'] });
  const batch = await service.ask('/v1/batches', { body: Array.from({ length: JOBS }, (_, job) => line.replace('UIC60 crown, 100 kN', `case ${job}`)).join('\n'), headers: { 'Content-Type': 'application/x-ndjson' } });
  await service.ask(`/v1/batches/${batch.id}/cancel`, { method: 'POST' });
  await page.goto(`${service.base}/#/jobs`);
  await page.locator(`.batch[data-batch="${batch.id}"]`).getByRole('button', { name: 'Its jobs' }).click();
  const scroll = (/** @type {number} */ by) => page.evaluate((step) => {
    const rows = document.querySelector('.list');
    if (rows) rows.scrollTop += step;
    return new Promise(requestAnimationFrame);
  }, by);
  await page.locator('.rows.job').nth(5).waitFor();
  await frames(`${JOBS} jobs: scrolled while they are loaded`, () => scroll(2000), 400);
  await page.evaluate(() => document.querySelector('.list')?.scrollTo(0, 0));
  await frames(`${JOBS} jobs: scrolled`, () => scroll(1200), 300);
} finally {
  await browser.close();
  await service.stop();
}
