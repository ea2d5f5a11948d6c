// Tests the first steps of a rail engineer: the first screen, files in unusual formats, and the settings of a wheel on a rail.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { test } from 'node:test';
import { dropFiles, OUTPUT, setUp, until } from './harness.mjs';

const { service, onPage } = setUp();

/** A file that no example of the service has. @param {string} name */
const file = (name) => readFileSync(new URL(`../data/${name}`, import.meta.url), 'utf8');
/** @param {import('playwright-core').Page} page */
const json = async (page) => JSON.parse(await page.locator('.code textarea').inputValue());
/** @param {import('playwright-core').Page} page */
const ready = (page) => page.locator('.verdict .checked').waitFor();
/** @param {import('playwright-core').Page} page @param {string} name */
const titled = (page, name) => page.waitForFunction((title) => document.querySelector('#h-drawing')?.textContent === title, name);

test('the first screen says what it is for, asks for two files, and shows a result of a service that has solved nothing', () => onPage('', async (page) => {
  await page.getByRole('heading', { level: 1, name: 'Wheel–rail contact' }).waitFor();
  await page.getByText('Find where a wheel and a rail touch').waitFor();
  await page.getByText('Drop a rail and a wheel profile').waitFor();
  await page.locator('.preview dd').first().waitFor();
  const shown = await page.locator('.preview').innerText();
  for (const name of ['Q', 'Y, outward', 'Y/Q, Nadal', 'pmax']) assert.ok(shown.replace(/\s+/g, ' ').includes(name), `${name} in ${shown}`);
  assert.match(shown, /\d ± \d+ MPa/, 'the largest pressure has an error');
  assert.equal(await page.locator('.code textarea').isVisible(), false, 'JSON is folded');
  assert.equal(await page.locator('.segs[aria-label="Kind of contact"] .seg').first().innerText(), 'Profiles');
  assert.doesNotMatch(await page.locator('body').innerText(), /\bSound\b|\bMB\b|approach/);
  await page.screenshot({ path: join(OUTPUT, 'first.png') });
  // The name of the example includes its load. With another load the name is marked as changed.
  await page.getByLabel('Wheel load Q').fill('90');
  await page.waitForFunction(() => document.querySelector('#h-drawing')?.textContent?.endsWith(', changed'));
}));

test('an inclination is written as 1:40, and free rolling is the motion of files', () => onPage('', async (page) => {
  await ready(page);
  await dropFiles(page, '.drop.big', { 'own.ban': file('words-behind.ban'), 'own.whl': file('worn-wheel.whl') });
  await titled(page, 'own on own');
  await ready(page);
  const inclination = page.getByLabel('Rail inclination');
  assert.equal(await inclination.inputValue(), '1:40');
  await inclination.fill('1:20');
  assert.equal((await json(page)).contact.cant_rad, 0.05);
  await inclination.fill('0,025');
  await inclination.blur();
  assert.equal(await inclination.inputValue(), '1:40');
  assert.deepEqual((await json(page)).motion, { wheelset: { speed_mm_per_s: 20000, force_x_n: 0 } });
  await page.getByText(/It touches at a radius of \d+\.\d+ mm; at the fixed radius of 460\.0 mm it would have a creepage of/).waitFor();
  await page.getByLabel('Rotation').selectOption('free_rolling_radius_mm');
  await page.getByText(/The wheel touches at a radius of \d+\.\d+ mm: the difference is a creepage/).waitFor();
  await page.getByLabel('Rotation').selectOption('force_x_n');
  await page.locator('#field-motion-wheelset-force_x_n').fill('0.5');
  assert.equal((await json(page)).motion.wheelset.force_x_n, 500);
  await page.getByRole('button', { name: 'Place the rail by its origin instead of the gauge' }).click();
  assert.equal((await json(page)).contact.rail_origin_mm, 750);
  await page.getByRole('button', { name: 'Place the rail by the gauge' }).click();
  assert.equal((await json(page)).contact.rail_origin_mm, undefined);
  await page.locator('#field-contact-yaw_rad').fill('5');
  await page.locator('#field-contact-roll_rad').fill('1');
  await page.getByLabel('Track gauge').fill('1437');
  await page.getByLabel('measured below the top').fill('16');
  await page.getByLabel('Flange back distance').fill('1359');
  const { contact } = await json(page);
  assert.deepEqual([contact.yaw_rad, contact.roll_rad, contact.gauge_mm, contact.gauge_height_mm, contact.flange_back_distance_mm], [0.005, 0.001, 1437, 16, 1359]);
  await ready(page);
}));

test('what was found in a file is shown and can be set otherwise: flange back, senses, smoothing, unit', () => onPage('', async (page) => {
  await ready(page);
  await dropFiles(page, 'main', { 'rail.prr': file('percent.prr'), 'wheel.txt': file('flange-at-0.txt') });
  await titled(page, 'wheel on rail');
  await page.getByText('0.00 mm was found in the wheel file').waitFor();
  await page.locator('#field-contact-flange_back_position_mm').fill('-70');
  await page.locator('.verdict .warn, .verdict .fault').first().waitFor();
  await page.locator('#field-contact-flange_back_position_mm').fill('');
  await ready(page);
  await page.getByText('How the wheel is read').click();
  const wheel = page.locator('details.reading').filter({ hasText: 'How the wheel' });
  await wheel.getByLabel('y is positive').selectOption('to the track centre');
  assert.equal((await json(page)).contact.wheel.mirror_y, true);
  await page.locator('.verdict .warn, .verdict .fault').first().waitFor();
  await wheel.getByLabel('y is positive').selectOption({ index: 0 });
  await ready(page);
  await wheel.getByLabel('Smoothing').fill('auto');
  await wheel.getByLabel('Unit').selectOption('mm');
  assert.deepEqual([(await json(page)).contact.wheel.smoothing_mm, (await json(page)).contact.wheel.unit], ['auto', 'mm']);
  await ready(page);
}));

test('a file alone is drawn, and a new counterpart is one click away', () => onPage('', async (page) => {
  await ready(page);
  await dropFiles(page, 'main', { 'old-header.whl': file('old-header.whl') });
  await page.locator('svg[aria-label="The wheel alone, seen along rolling"] .wheel').waitFor();
  await page.getByText('Next: the file of the rail.').waitFor();
  await page.screenshot({ path: join(OUTPUT, 'lone.png') });
  await page.getByRole('button', { name: 'Use a new 60E1 rail' }).click();
  await page.locator('svg[aria-label^="Wheel on rail"]').waitFor();
  await ready(page);
}));

test('a file that is not understood is shown with the line at fault, with and without its counterpart', () => onPage('', async (page) => {
  await ready(page);
  const lines = file('flange-at-0.txt').split('\n');
  lines[40] = lines[40].replace(/(\d)(\s)/, '$1x$2');
  for (const files of [{ 'wheel.txt': lines.join('\n') }, { 'wheel.txt': lines.join('\n'), 'rail.prr': file('percent.prr') }]) {
    await dropFiles(page, 'main', files);
    const line = page.locator('.excerpt .at-fault');
    await line.waitFor();
    assert.equal((await line.innerText()).trim(), lines[40].trim());
    assert.match(await page.locator('.excerpt figcaption').innerText(), /wheel\.txt/);
    assert.equal(await page.locator('.excerpt ol').getAttribute('start'), '39');
  }
  await page.screenshot({ path: join(OUTPUT, 'fault-line.png') });
  await dropFiles(page, 'main', { 'elsewhere.prr': file('elsewhere.prr'), 'wheel.txt': file('flange-at-0.txt') });
  await page.locator('.faults').getByText('the points are in another file, rail.dat').waitFor();
  assert.equal((await service.ask('/v1/jobs?limit=100')).jobs.filter((/** @type {{ labels: Record<string, string> }} */ job) => !job.labels['railhead-page']).length, 0);
}));

test('a wheelset of own files is drawn by its left wheel, and its files stay', () => onPage('', async (page) => {
  await ready(page);
  await dropFiles(page, 'main', { 'own.ban': file('words-behind.ban'), 'own.whl': file('worn-wheel.whl') });
  await titled(page, 'own on own');
  await page.getByRole('radio', { name: 'Wheelset' }).check();
  await ready(page);
  await page.locator('svg[aria-label^="Wheel on rail"] .wheel').waitFor();
  assert.equal((await json(page)).contact.wheel.text, file('worn-wheel.whl'));
}));

test('a rail whose points jump says so, and is solved all the same on request', () => onPage('', async (page) => {
  await ready(page);
  await dropFiles(page, 'main', { 'rail.txt': file('jumping-points.txt'), 'wheel.txt': file('flange-at-0.txt') });
  await titled(page, 'wheel on rail');
  await page.getByLabel('Shift to the left').fill('-1');
  await ready(page);
  await page.getByRole('button', { name: /^Solve Ctrl/ }).click();
  await page.waitForURL(/#\/jobs\//);
  const failed = page.locator('.result');
  await failed.getByText("the rail's points jump at y = ").waitFor({ timeout: 60_000 });
  await failed.getByRole('button', { name: 'Solve it anyway' }).click();
  await until(async () => {
    const { jobs } = await service.ask('/v1/jobs?name=wheel+on+rail&fields=id');
    const cases = await Promise.all(jobs.map((/** @type {{ id: string }} */ job) => service.ask(`/v1/jobs/${job.id}/case`)));
    return cases.some(({ contact }) => contact.accept_rough_profiles === true);
  });
  await page.goto(`${service.base}/#/compose`);
  await page.getByLabel('solve although the profiles are rough').click();
  assert.equal((await json(page)).contact.accept_rough_profiles, undefined);
}));

test('a rail in cm is refused with its unit, and stating it is one choice away', () => onPage('', async (page) => {
  await ready(page);
  const area = page.locator('.code textarea');
  await page.locator('.code summary').click();
  const document = await json(page);
  const rail = { points_mm: document.contact.rail.points_mm.map((/** @type {number[]} */ point) => point.map((part) => part / 10)) };
  await area.fill(JSON.stringify({ ...document, contact: { ...document.contact, rail } }));
  await page.locator('.verdict .faults').getByText('state unit: "cm"').waitFor();
  await page.locator('.reading').filter({ hasText: 'How the rail is read' }).getByLabel('Unit').selectOption('cm');
  await ready(page);
}));

test('a curve radius sets the yaw rate, and another speed keeps the radius', () => onPage('', async (page) => {
  await ready(page);
  const radius = page.getByLabel('Curve radius');
  await radius.fill('-300');
  await page.getByText('Curve to the right: a wheelset rolls without slip at Δr = 2.3 mm').waitFor();
  const rate = async () => (await json(page)).motion.wheelset.yaw_rate_rad_per_s;
  assert.ok(Math.abs(await rate() - 20 / -300) < 1e-12);
  await page.getByLabel('Speed').fill('36');
  assert.ok(Math.abs(await rate() - 10 / -300) < 1e-12);
  await radius.blur();
  assert.equal(await radius.inputValue(), '-300');
  await ready(page);
  await radius.fill('');
  assert.equal(await rate(), undefined);
}));

test('a cant changes the load normal to the track and not the roll of the wheelset, and the static load stays', () => onPage('', async (page) => {
  await ready(page);
  const load = async () => (await json(page)).load.vertical_force_n;
  await page.getByLabel('Wheel load Q').fill('80');
  await page.getByLabel('Curve radius').fill('500');
  const [gravities, base] = [400 / 500 / 9.80665, 1500];
  await page.getByText(`${Math.round(base * gravities)} mm balances`).waitFor();
  await page.getByText('Cant deficiency 122 mm, unbalanced lateral acceleration 0.80 m/s²; an axle pushes the rails to the right with 13.1 kN').waitFor();
  assert.equal(await load(), 80_000);
  await page.getByLabel('Cant', { exact: true }).fill('150');
  const canted = 80_000 * (Math.sqrt(0.99) + 0.1 * gravities);
  assert.ok(Math.abs(await load() - canted) < 1e-6);
  await page.getByText('The track rolls by −100.2 mrad. Cant excess 28 mm, unbalanced lateral acceleration 0.18 m/s²; an axle pushes the rails to the left with 3.0 kN').waitFor();
  const { contact, labels } = await json(page);
  assert.deepEqual([contact.roll_rad, labels.track_cant_mm], [undefined, '150']);
  await page.getByLabel('Wheel load Q, static').fill('90');
  assert.ok(Math.abs(await load() - (canted * 90) / 80) < 1e-6);
  await page.getByLabel('Speed').fill('36');
  await page.getByLabel('Curve radius').fill('-500');
  await page.getByText('The track rolls by 100.2 mrad').waitFor();
  assert.equal(await page.getByLabel('Wheel load Q, static').inputValue(), '90');
  // The solved wheel carries this load, in track axes.
  const [, shown] = /([\d.]+) kN normal to the track/.exec(await page.locator('.form').innerText()) ?? [];
  assert.ok(Math.abs(Number(shown) - (await load()) / 1000) < 0.006);
  await ready(page);
  await page.getByRole('button', { name: /^Solve/ }).click();
  await page.locator('field-map.main').waitFor();
  const { jobs: [job] } = await service.ask('/v1/jobs?limit=1&label=track_cant_mm:150');
  const { total: [{ force_z_n: force }] } = await service.ask(`/v1/jobs/${job.id}/result`);
  await page.goBack();
  assert.ok(Math.abs(-force - (await load())) < 300, "within the tolerance of the vertical force");
  // Another kind of motion has no curve, and the load is the static one again.
  await page.getByRole('radio', { name: 'Creepages' }).check();
  assert.deepEqual([await load(), (await json(page)).labels], [90_000, undefined]);
}));

test('the contact is solved on the curve of the rail or on planes, of a wheel and of a wheelset', () => onPage('', async (page) => {
  await ready(page);
  const unfold = () => page.locator('summary', { hasText: 'Contact surface' }).click();
  await unfold();
  await page.getByText('The contact bends around the rail').waitFor();
  await page.getByLabel('Influence of cells').selectOption('as on a half-space');
  const { contact } = await json(page);
  assert.deepEqual([contact.reference_surface, contact.influence], [undefined, 'half_space']);
  await ready(page);
  await page.getByLabel('Contact surface').selectOption('planes');
  assert.deepEqual([(await json(page)).contact.reference_surface, (await json(page)).contact.influence], ['plane', undefined]);
  await ready(page);
  await page.getByRole('radio', { name: 'Wheelset' }).check();
  await unfold();
  await page.getByLabel('Contact surface').selectOption('planes');
  await ready(page);
}));
