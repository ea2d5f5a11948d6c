// Tests the view Result: the crosshair by mouse, touch and keys compared with the API, links, creep curves, several patches, downloads.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { test } from 'node:test';
import { hex } from '../../../src/http/page/web/js/field/palette.js';
import { drawn, example, parsed, readout, setUp, withFields } from './harness.mjs';

const { service, onPage } = setUp();

/** The cell of a field at a place. @param {Record<string, number[]>} cells @param {number} x @param {number} y */
const cellAt = (cells, x, y) => cells.x_mm.findIndex((_, cell) =>
  Math.abs(cells.x_mm[cell] - x) <= cells.dx_mm[cell] / 2 && Math.abs(cells.y_mm[cell] - y) <= cells.dy_mm[cell] / 2);

/** The readout says of its place what the API says. @param {import('playwright-core').Page} page @param {string} id */
async function agrees(page, id, query = 'patch=0&point=0') {
  const told = await readout(page);
  const { cells } = await service.ask(`/v1/jobs/${id}/tractions?${query}`);
  const cell = cellAt(cells, parsed(told.x), parsed(told.y));
  assert.ok(cell >= 0, JSON.stringify(told));
  const size = Math.hypot(cells.traction_x_mpa[cell], cells.traction_y_mpa[cell]);
  assert.ok(Math.abs(parsed(told['|t|']) - size) <= 2e-3 * size, `${told['|t|']} is ${size}`);
  return told;
}

test('the crosshair says what the API says, by mouse and by keys', () => onPage('', async (page) => {
  const { id } = await service.solved(withFields('hertz-steel'));
  await page.goto(`${service.base}/#/jobs/${id}`);
  await drawn(page);
  const over = page.locator('field-map.main .over');
  const box = await over.boundingBox();
  assert.ok(box);
  await page.mouse.move(box.x + 250, box.y + 220);
  await page.waitForTimeout(60);
  const one = await agrees(page, id);
  await page.mouse.click(box.x + 330, box.y + 260);
  await page.waitForTimeout(60);
  const held = await agrees(page, id);
  assert.notEqual(one.x, held.x);
  await page.mouse.move(box.x + 200, box.y + 200);
  await page.waitForTimeout(60);
  assert.deepEqual(await readout(page), held, 'a click holds the crosshair');
  await over.focus();
  await page.keyboard.press('ArrowRight');
  await page.waitForTimeout(60);
  const right = await agrees(page, id);
  await page.keyboard.press('ArrowUp');
  await page.waitForTimeout(60);
  const up = await agrees(page, id);
  assert.ok(parsed(right.x) > parsed(held.x) - 1 && parsed(up.y) > parsed(right.y));
  assert.match((await page.locator('field-map.main output').textContent()) ?? '', /^x .* mm, y .* mm, p .* MPa, \|t\| .* zone (stick|slip)/);
  await page.keyboard.press('End');
  await page.waitForTimeout(60);
  assert.ok(parsed((await agrees(page, id)).x) > parsed(up.x));
  await page.keyboard.press('Escape');
}));

test('the colours of the map are those of the values', () => onPage('', async (page) => {
  const { id, result } = await service.solved(withFields('spin'));
  await page.goto(`${service.base}/#/jobs/${id}`);
  await drawn(page);
  for (const drawnOver of ['arrows', 'stick–slip line']) await page.getByLabel(drawnOver).uncheck();
  await page.waitForTimeout(60);
  const { cells } = await service.ask(`/v1/jobs/${id}/tractions?patch=0&point=0`);
  const bound = example('spin').friction.coefficient * result.patches[0].pressure_max_mpa;
  const shareOf = (/** @type {number} */ cell) => Math.hypot(cells.traction_x_mpa[cell], cells.traction_y_mpa[cell]) / bound;
  const base = page.locator('field-map.main canvas').first();
  const box = await page.locator('field-map.main .over').boundingBox();
  assert.ok(box);
  const far = [];
  for (let number = 0; number < 60; number += 1) {
    // The positions are spread over the whole picture in no regular pattern.
    const at = [0.05 + 0.6 * ((number * 0.618) % 1), 0.1 + 0.6 * ((number * 0.414) % 1)];
    const place = [Math.round(at[0] * box.width), Math.round(at[1] * box.height)];
    await page.mouse.move(box.x + place[0] + 0.5, box.y + place[1] + 0.5);
    await page.waitForTimeout(30);
    const told = await readout(page);
    const [x, y] = [parsed(told.x), parsed(told.y)];
    const cell = cellAt(cells, x, y);
    const around = cell < 0 ? [] : [-1, 0, 1].flatMap((i) => [-1, 0, 1].map((j) => cellAt(cells, cells.x_mm[cell] + i * cells.dx_mm[cell], cells.y_mm[cell] + j * cells.dy_mm[cell])));
    if (around.length === 0 || around.includes(-1)) continue;
    const pixel = await base.evaluate((canvas, [left, top]) => {
      const { context, density } = { context: /** @type {HTMLCanvasElement} */ (canvas).getContext('2d'), density: devicePixelRatio || 1 };
      return [...(context?.getImageData(Math.round(left * density), Math.round(top * density), 1, 1).data ?? [])];
    }, place);
    // The map interpolates between cells: the colour lies between those of the least and the largest value around.
    const shares = around.map(shareOf);
    const [low, high] = [Math.min(...shares), Math.max(...shares)];
    const distances = Array.from({ length: 65 }, (_, step) => hex('viridis', low + (high - low) * step / 64))
      .map((colour) => Math.max(...[0, 1, 2].map((part) => Math.abs(parseInt(colour.slice(1 + 2 * part, 3 + 2 * part), 16) - pixel[part]))));
    far.push(Math.min(...distances));
  }
  assert.ok(far.length >= 20, `${far.length} places inside`);
  assert.ok(far.every((distance) => distance <= 6), `${far}`);
}));

test('touch moves the crosshair', () => onPage('', async (page) => {
  const { id } = await service.solved(withFields('spin'));
  await page.goto(`${service.base}/#/jobs/${id}`);
  await drawn(page);
  const box = await page.locator('field-map.main .over').boundingBox();
  assert.ok(box);
  await page.locator('field-map.main').scrollIntoViewIfNeeded();
  const seen = await page.locator('field-map.main .over').boundingBox();
  assert.ok(seen);
  await page.touchscreen.tap(seen.x + 190, seen.y + 120);
  await page.waitForTimeout(60);
  await agrees(page, id);
}, { hasTouch: true, viewport: { width: 390, height: 844 }, isMobile: true }));

test('a link restores patch, motion, quantity and crosshair, and a motion keeps the crosshair', () => onPage('', async (page) => {
  const { id } = await service.solved(withFields('sweep'));
  await page.goto(`${service.base}/#/jobs/${id}?patch=0&point=7&field=pressure&x=1.2&y=-0.8`);
  await drawn(page);
  await page.waitForTimeout(60);
  const told = await readout(page);
  assert.deepEqual([parsed(told.x), parsed(told.y)], [1.2, -0.8]);
  assert.ok(await page.getByRole('radio', { name: 'Pressure' }).isChecked());
  await page.getByRole('radio', { name: 'Traction' }).check();
  await page.waitForTimeout(60);
  await agrees(page, id, 'patch=0&point=7');
  await page.locator('.panel > .slide input').fill('3');
  await page.waitForFunction(() => location.hash.includes('point=3'));
  await page.waitForTimeout(300);
  assert.deepEqual([parsed((await readout(page)).x), parsed((await readout(page)).y)], [1.2, -0.8]);
  await agrees(page, id, 'patch=0&point=3');
  const copied = page.url();
  await page.goto('about:blank');
  await page.goto(copied);
  await drawn(page);
  await page.waitForTimeout(60);
  await agrees(page, id, 'patch=0&point=3');
  assert.equal(parsed((await readout(page)).x), 1.2);
}));

test('a click on the creep curve chooses the motion, and error bars reach as far as the errors', () => onPage('', async (page) => {
  const { id } = await service.solved({ ...withFields('sweep'), solver: { mesh: { strips: 4, cells: 4 } } });
  await page.goto(`${service.base}/#/jobs/${id}`);
  await page.locator('creep-curve canvas').waitFor();
  await drawn(page);
  const curve = page.locator('creep-curve');
  const place = await curve.evaluate((element) => {
    const { plot } = /** @type {HTMLElement & { plot: { data: number[][], valToPos: (value: number, scale: string) => number } }} */ (element);
    return { x: plot.valToPos(plot.data[0][8], 'x'), y: plot.valToPos(plot.data[1][8], 'y') };
  });
  const area = await curve.locator('.u-over').boundingBox();
  assert.ok(area);
  await page.mouse.click(area.x + place.x, area.y + place.y);
  await page.waitForFunction(() => location.hash.includes('point=8'));
  const { points } = (await service.ask(`/v1/jobs/${id}/result`)).patches[0];
  const error = points[8].error_estimate.force_x_n / 1000;
  assert.ok(error > 0.05, 'the coarse mesh has errors that can be seen');
  // The colour of the line appears halfway between the point and the end of its bar, and not a little beyond the end.
  const inked = await curve.evaluate((element, bar) => {
    const { plot } = /** @type {HTMLElement & { plot: { data: number[][], ctx: CanvasRenderingContext2D, valToPos: (value: number, scale: string, canvas: boolean) => number } }} */ (element);
    const colour = getComputedStyle(element).getPropertyValue('--c1').trim();
    const wanted = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
    const x = Math.round(plot.valToPos(plot.data[0][bar.at], 'x', true));
    const seen = (/** @type {number} */ share) => {
      const y = Math.round(plot.valToPos(plot.data[1][bar.at] + share * bar.error, 'y', true));
      const { data } = plot.ctx.getImageData(x - 1, y, 3, 1);
      return [0, 4, 8].some((at) => wanted.every((value, channel) => Math.abs(data[at + channel] - value) < 60));
    };
    const pixels = Math.abs(plot.valToPos(bar.error, 'y', true) - plot.valToPos(0, 'y', true));
    return { end: seen(1), beyond: seen(1 + 5 / pixels), pixels };
  }, { at: 5, error: points[5].error_estimate.force_x_n / 1000 });
  assert.ok(inked.pixels > 2, `${inked.pixels}`);
  assert.deepEqual([inked.end, inked.beyond], [true, false], JSON.stringify(inked));
}));

test('a wheelset shows Δr over its shift, its conicity and its positions, and a click goes to the nearest of them', () => onPage('', async (page) => {
  const { id, result } = await service.solved(example('wheelset'));
  const { kinematics, positions } = result.wheelset;
  await page.goto(`${service.base}/#/jobs/${id}`);
  await page.locator('creep-curve canvas').waitFor();
  const curve = page.locator('creep-curve');
  const data = () => curve.evaluate((element) => /** @type {HTMLElement & { plot: { data: number[][] } }} */ (element).plot.data);
  assert.deepEqual((await data()).slice(0, 2), [kinematics.lateral_shift_mm, kinematics.radius_difference_mm]);
  const table = page.getByRole('region', { name: 'Positions of the wheelset' });
  assert.equal(await table.locator('tbody tr').count(), positions.length);
  const last = positions.length - 1;
  const place = await curve.evaluate((element, shift) => {
    const { plot } = /** @type {HTMLElement & { plot: { valToPos: (value: number, scale: string) => number } }} */ (element);
    return { x: plot.valToPos(shift, 'x'), y: plot.valToPos(0, 'y') };
  }, positions[last].lateral_shift_mm);
  const area = await curve.locator('.u-over').boundingBox();
  assert.ok(area);
  await page.mouse.click(area.x + place.x, area.y + place.y);
  await page.waitForFunction((patch) => location.hash.includes(`patch=${patch}`), positions[last].left.patches[0]);
  await table.locator('tr[aria-current]').nth(0).waitFor();
  assert.equal(await table.locator('tr[aria-current] td').first().textContent(), '4.00');
  await page.getByRole('radio', { name: 'Conicity', exact: true }).check();
  await page.waitForFunction(() => /** @type {any} */ (document.querySelector('creep-curve'))?.plot?.data.length === 4);
  const known = kinematics.conicity.filter((/** @type {{ conicity?: number }} */ of) => of.conicity !== undefined);
  assert.deepEqual((await data())[1], known.map((/** @type {{ conicity: number }} */ of) => of.conicity));
  // In the form of the wheelset, another gauge makes another case.
  await page.getByRole('button', { name: 'Edit case' }).click();
  await page.getByRole('textbox', { name: 'Gauge' }).fill('1438');
  await page.waitForFunction(() => document.querySelector('textarea')?.value.includes('"gauge_mm": 1438'));
  assert.equal(await page.getByLabel('Δr and equivalent conicity').isChecked(), true);
}));

test('two patches have one scale of colours, and stand on the profiles', () => onPage('', async (page) => {
  const flange = withFields('wheel-rail-flange');
  const { id, result } = await service.solved({ ...flange, contact: { ...flange.contact, reference_surface: 'plane' } });
  await page.goto(`${service.base}/#/jobs/${id}`);
  await drawn(page);
  await drawn(page, '.thumbs label:last-child field-map');
  await page.getByLabel('scale').selectOption('common');
  await page.waitForTimeout(100);
  const ranges = await page.locator('field-map').evaluateAll((maps) => maps.map((map) => /** @type {HTMLElement & { shown: { range: number[] } }} */ (map).shown.range));
  assert.equal(ranges.length, 3);
  for (const range of ranges) assert.deepEqual(range, ranges[0]);
  const bound = example('wheel-rail-flange').friction.coefficient * Math.max(...result.patches.map((/** @type {{ pressure_max_mpa: number }} */ patch) => patch.pressure_max_mpa));
  // Pressures with tractions may be slightly larger than those of the patch.
  assert.ok(ranges[0][1] > 0.9999 * bound && ranges[0][1] < 1.1 * bound, `${ranges[0][1]}: ${bound}`);
  await page.locator('svg .patch .comb').nth(1).waitFor();
  await page.getByText(/^\d+ notes$/).click();
  const remarks = await page.locator('.remark').allInnerTexts();
  assert.equal(remarks.length, result.remarks.length);
  assert.ok(remarks.some((text) => text.startsWith('patch 0')));
  await page.locator('svg .patch[data-patch="1"] text.tag').click();
  await page.waitForFunction(() => location.hash.includes('patch=1'));
  await page.waitForTimeout(60);
  await agrees(page, id, 'patch=1&point=0');
  // The contact points lie on the drawn rail.
  const far = await page.evaluate(() => {
    const rail = /** @type {SVGPathElement} */ (document.querySelector('svg .rail'));
    const svg = /** @type {SVGSVGElement} */ (rail.ownerSVGElement);
    const length = rail.getTotalLength();
    const dots = [...svg.querySelectorAll('.patch .dot')].map((dot) => [Number(dot.getAttribute('cx')), Number(dot.getAttribute('cy'))]);
    return dots.map(([x, y]) => {
      let least = Infinity;
      for (let at = 0; at < length; at += 0.25) {
        const point = rail.getPointAtLength(at);
        least = Math.min(least, Math.hypot(point.x - x, point.y - y));
      }
      return least;
    });
  });
  assert.ok(far.every((distance) => distance < 1), `${far}`);
}));

test('colours can be those of cividis, and stay so', () => onPage('#/compose', async (page) => {
  const { id } = await service.solved(withFields('spin'));
  await page.goto(`${service.base}/#/jobs/${id}`);
  await drawn(page);
  const picture = () => page.locator('field-map.main canvas').first().evaluate((canvas) => /** @type {HTMLCanvasElement} */ (canvas).toDataURL());
  const viridis = await picture();
  await page.getByLabel('colours').selectOption('cividis');
  const cividis = await picture();
  assert.notEqual(cividis, viridis);
  await page.reload();
  await drawn(page);
  assert.equal(await picture(), cividis);
}));

test('a field of many cells comes as arrays, and is the same', () => onPage('#/compose', async (page) => {
  const { id } = await service.solved({ ...withFields('spin'), solver: { mesh: { strips: 64, cells: 64 } }, outputs: ['zones', 'tractions'] });
  const [asked] = await Promise.all([page.waitForRequest(/fields.*format=npz/), page.goto(`${service.base}/#/jobs/${id}`)]);
  assert.ok(asked);
  await drawn(page);
  await page.waitForTimeout(60);
  const told = await agrees(page, id);
  const { cells } = await service.ask(`/v1/jobs/${id}/zones`);
  assert.equal(told.zone, cells.zone[cellAt(cells, parsed(told.x), parsed(told.y))]);
}));

test('a job without fields shows its numbers and offers to solve again with fields', () => onPage('', async (page) => {
  const { id } = await service.solved({ ...example('spin'), outputs: ['resultants'] });
  await page.goto(`${service.base}/#/jobs/${id}`);
  await page.getByRole('button', { name: 'Solve again with fields' }).click();
  await drawn(page);
  assert.ok(!page.url().includes(id));
}));

/** @param {import('playwright-core').Page} page @param {string} name */
async function downloaded(page, name) {
  const [file] = await Promise.all([page.waitForEvent('download'), page.getByRole('group', { name: 'Download' }).getByRole('button', { name, exact: true }).click()]);
  const path = await file.path();
  return { path, name: file.suggestedFilename(), body: readFileSync(path) };
}

test('every download opens', () => onPage('', async (page) => {
  const { id } = await service.solved(withFields('hertz-steel'));
  await page.goto(`${service.base}/#/jobs/${id}`);
  await drawn(page);
  const svg = await downloaded(page, 'SVG');
  assert.match(svg.name, /traction\.svg$/);
  execFileSync('python3', ['-c', 'import sys, xml.dom.minidom; assert xml.dom.minidom.parse(sys.argv[1]).documentElement.tagName == "svg"', svg.path]);
  const png = await downloaded(page, 'PNG');
  assert.equal(png.body.toString('latin1', 1, 4), 'PNG');
  const width = await page.locator('field-map.main canvas').first().evaluate((canvas) => canvas.clientWidth);
  assert.equal(png.body.readUInt32BE(16), 2 * Math.round(width));
  const csv = await downloaded(page, 'CSV');
  const [head, ...lines] = csv.body.toString().trim().split(/\r?\n/);
  assert.ok(head.includes('traction_x_mpa') && head.includes('traction_y_mpa'), head);
  const { cells } = await service.ask(`/v1/jobs/${id}/tractions`);
  assert.equal(lines.length, cells.x_mm.length);
  const vtk = await downloaded(page, 'VTK');
  assert.match(vtk.body.toString('latin1', 0, 400), /^(# vtk DataFile|<\?xml|<VTKFile)/);
  const npz = await downloaded(page, 'NPZ');
  const read = await page.evaluate(async ({ base, bytes }) => {
    const { readNpz } = await import(`${base}js/npz.js`);
    const arrays = await readNpz(new Uint8Array(bytes).buffer);
    return Array.from(arrays.traction_x_mpa.values);
  }, { base: new URL(await page.locator('.brand img').getAttribute('src') ?? '', service.base).href.replace('icon.svg', ''), bytes: [...npz.body] });
  assert.deepEqual(read, cells.traction_x_mpa);
  const numbers = await downloaded(page, 'Numbers');
  assert.match(numbers.body.toString(), /force_x_n/);
  numpyReads(npz.path, cells.traction_x_mpa.length);
}));

/** NumPy opens the archive, where it is installed. @param {string} path @param {number} length */
function numpyReads(path, length) {
  const python = process.env.RAILHEAD_TEST_PYTHON ?? 'python3';
  try {
    execFileSync(python, ['-c', 'import numpy'], { stdio: 'ignore' });
  } catch {
    assert.ok(!process.env.CI, 'not run: RAILHEAD_TEST_PYTHON names a Python with NumPy');
    return;
  }
  const sum = execFileSync(python, ['-c', 'import numpy, sys; print(len(numpy.load(sys.argv[1])["traction_x_mpa"]))', path]);
  assert.equal(Number(sum.toString()), length);
}

/** The points of a line that is drawn. @param {import('playwright-core').Page} page @param {string} selector @returns {Promise<number[][]>} */
const pixels = async (page, selector) => (await page.locator(selector).getAttribute('d') ?? '').split(/[MLZ]/).filter(Boolean).map((pair) => pair.split(' ').map(Number));

/** @param {readonly number[][]} line @param {readonly number[]} place */
const distanceTo = (line, [x, y]) => Math.min(...line.slice(1).map(([x1, y1], at) => {
  const [x0, y0] = line[at];
  const share = Math.min(1, Math.max(0, ((x - x0) * (x1 - x0) + (y - y0) * (y1 - y0)) / ((x1 - x0) ** 2 + (y1 - y0) ** 2 || 1)));
  return Math.hypot(x - x0 - share * (x1 - x0), y - y0 - share * (y1 - y0));
}));

test('on the curve of the rail the pressure stands along the rail', () => onPage('', async (page) => {
  const bent = withFields('wheel-rail');
  Object.assign(bent.contact, { reference_surface: 'curve', lateral_shift_mm: -6 });
  const { id } = await service.solved(bent);
  await page.goto(`${service.base}/#/jobs/${id}`);
  const comb = page.locator('.drawing .patch .comb');
  await comb.waitFor();
  assert.ok(await page.getByRole('radio', { name: 'Contact', exact: true }).isChecked());
  await page.getByText('pressure along the curve of the rail').waitFor();
  // The base of the pressure lies on the rail within a pixel. It ends where the line over it begins.
  const [rail, line] = [await pixels(page, '.drawing .rail'), await pixels(page, '.drawing .patch .comb')];
  const base = line.slice(0, line.findIndex(([x, y], at) => at > 0 && x === line[at - 1][0] && y === line[at - 1][1]));
  const away = Math.max(...base.map((place) => distanceTo(rail, place)));
  assert.ok(away < 1, `${away}`);
  await page.getByRole('radio', { name: 'Whole head' }).check();
  await page.getByRole('button', { name: 'Solve again with damage' }).waitFor();
  // The coordinate across the patch is the arc length along the rail, in a comparison too.
  await page.waitForFunction(() => document.querySelectorAll('field-map.main .readout dt')[1]?.textContent === 's');
  const flat = await service.solved({ ...bent, contact: { ...bent.contact, reference_surface: 'plane' } });
  await page.goto(`${service.base}/#/compare/${id}/${flat.id}`);
  await drawn(page, '[aria-label="Job B"] field-map');
  const across = (/** @type {string} */ side) => page.locator(`[aria-label="${side}"] field-map .readout dt`).nth(1).innerText();
  assert.deepEqual([await across('Job A'), await across('Job B'), await across('Difference')], ['s', 'y', 's']);
}));

test('what the curve does not solve stands on planes, and says so', () => onPage('', async (page) => {
  const job = await service.solved({ ...withFields('wheel-rail'), solver: { method: 'fastsim' } });
  await page.goto(`${service.base}/#/jobs/${job.id}`);
  await drawn(page);
  await page.locator('.remark.warning[data-code="on-planes"]').waitFor();
  await page.getByText('pressure on the rail').waitFor();
  await page.waitForFunction(() => document.querySelectorAll('field-map.main .readout dt')[1]?.textContent === 'y');
  assert.ok(await page.getByRole('radio', { name: 'Whole head' }).isChecked());
}));

/** A running rail with a guard rail beside it, 41 mm from its gauge face and 20 mm higher, as one section. @param {[number, number][]} rail */
function guarded(rail) {
  const face = -36.5 - 41;
  const corner = Array.from({ length: 21 }, (_, i) => (i * Math.PI) / 40).map((angle) => [face - 8 + 8 * Math.sin(angle), -12 - 8 * Math.cos(angle)]);
  const groove = Array.from({ length: 11 }, (_, i) => [face + 1 + 3.9 * i, 45]);
  return [[face - 40, -20], [face - 26, -20], [face - 14, -20], ...corner, ...Array.from({ length: 18 }, (_, i) => [face, -10 + 2 * i]), ...groove, [-36.7, 28], ...rail].map((point) => point.map((value) => Number(value.toFixed(4))));
}

test('a wheel on its running rail and on a guard rail stands where it touches, with its wear there', () => onPage('', async (page) => {
  const base = withFields('wheel-rail');
  const { damage } = example('maintenance');
  const solve = (/** @type {number} */ shift) => service.solved({
    ...base, damage, outputs: [...base.outputs, 'damage'], contact: { ...base.contact, rail: { points_mm: guarded(base.contact.rail.points_mm) }, rail_origin_mm: 753.5, lateral_shift_mm: shift },
  });
  const [running, guard] = [await solve(3), await solve(6)];
  for (const job of [running, guard]) assert.equal(job.state, 'succeeded', JSON.stringify(job.error));
  const place = (/** @type {typeof guard} */ job) => job.result.patches[0].position.rail_mm[0];
  assert.ok(Math.abs(place(running)) < 36 && place(guard) < -77, 'the second touches the guard rail with the back of its flange');
  for (const job of [running, guard]) {
    await page.goto(`${service.base}/#/jobs/${job.id}`);
    await drawn(page);
    await page.locator('.drawing .patch .comb').waitFor();
    // The patch is visible, on the line of the rail.
    const dot = await page.locator('.drawing .patch .dot').evaluate((mark) => ['cx', 'cy'].map((name) => Number(mark.getAttribute(name))));
    const away = distanceTo(await pixels(page, '.drawing .rail'), dot);
    assert.ok(away < 4, `${away}`);
    const shown = await page.locator('.damage .chart').first().locator('text').allTextContents();
    const ticks = shown.filter((text) => /\d/.test(text)).map(parsed).filter(Number.isFinite);
    assert.ok(ticks.some((tick) => Math.abs(tick - place(job)) < 12), `${place(job)} among ${ticks}`);
  }
  await page.goto(`${service.base}/#/compare/${running.id}/${guard.id}`);
  await page.getByText('Both cases have the same rail.').waitFor();
}));
